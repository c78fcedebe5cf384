"""The hole cycle that a CL file has in force: CYCLE, said, switched off and on again."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NoReturn

from cornersmooth.errors import InputError
from cornersmooth.model import Program, Statement
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.holes import Cycle, read_cycle
from cornersmooth.nc.statement_args import words_of


@dataclass
class HoleCycles:
    """Remembers the cycle for the holes that follow.

    Parameters
    ----------
    program : Program
    findings : Findings
    skip_taps : bool
        Whether taps are left out with a warning.
    """

    program: Program
    findings: Findings
    skip_taps: bool = True
    now: Cycle | None = None  #: the cycle in force, None where it is not understood
    line: int = 0  #: of the last CYCLE
    _last: Cycle | None = None
    _args: tuple[float | str, ...] = ()
    _on: bool = False

    def end(self) -> None:
        """CYCLE/OFF."""
        self.now, self._on = None, False

    def say(self, statement: Statement, speed: float | None) -> None:
        """CYCLE with the words of a cycle, ON, or INIT, at a speed of the spindle in revolutions per minute.

        Raises
        ------
        InputError
            CS342: a tap that is not understood and may not be left out.
        """
        words = words_of(statement)
        self._on |= words != ["INIT"]
        if words == ["ON"]:
            self.now = self._last
        elif words != ["INIT"]:  # SolidWorks announces a cycle by it
            self.line, self._args = statement.line, statement.args
            self.read(speed)
            if "TAP" in words and self.now is None and not self.skip_taps:
                self.refuse_tap("its words are not understood")
        if self.now is not None and self.now.pecking and not self.now.steps:
            text = "CYCLE with pecks does not say how deep they are; the holes are drilled in one feed"
            self.findings.add("CS321", "warning", statement.line, text)

    def read(self, speed: float | None) -> None:
        """Read the last cycle at another speed of the spindle: a dwell may count in revolutions."""
        if self._args:
            self._last = read_cycle(self._args, self.program, speed)
            self.now = self._last if self._on else None

    def refuse_tap(self, reason: str) -> NoReturn:
        """Give up at a tap, which moves cannot do, and a hole without its thread is nothing to be silent about."""
        raise InputError(
            "CS342",
            f"a tap, which is not written, as {reason}: plain moves cannot turn the spindle with the feed",
            "give --skip-taps, and put the control's own cycle where the text says NOT DRILLED",
            file=self.program.source.name,
            line=self.line,
        )
