"""The hole cycle that a CL file has in force: CYCLE, said, switched off and on again."""

from __future__ import annotations

from dataclasses import dataclass

from cornersmooth.errors import InputError
from cornersmooth.model import Program, Statement
from cornersmooth.nc.findings import Findings
from cornersmooth.nc.holes import Cycle, has_fixed_order, in_force, read_cycle
from cornersmooth.nc.statement_args import words_of


@dataclass
class HoleCycles:
    """Remembers the cycle for the holes that follow.

    Parameters
    ----------
    program : Program
    findings : Findings
    skip : bool
        Whether cycles that cannot be written are left out with a warning; an error otherwise.
    """

    program: Program
    findings: Findings
    skip: bool = False
    now: Cycle | None = None  #: the cycle in force, None where it is not understood
    _said: Statement | None = None  #: the last CYCLE
    _args: tuple[float | str, ...] = ()
    _on: bool = False

    def end(self) -> None:
        """CYCLE/OFF."""
        self.now, self._on = None, False

    def say(self, statement: Statement, speed: float | None) -> None:
        """CYCLE with the words of a cycle, ON, or INIT, at a speed of the spindle in revolutions per minute."""
        self._said = statement
        self._on |= words_of(statement) != ["INIT"]
        self._args = in_force(self._args, statement.args, self.program)
        self.read(speed)
        if has_fixed_order(statement.args, self.program):
            text = "CYCLE without words is read as depth, feed, clearance; see that the positions are tops of holes"
            self.findings.add("CS385", "warning", statement.line, text)
        if self.now is not None and self.now.pecking and not self.now.steps:
            text = "CYCLE with pecks does not say how deep they are; see that the tool may drill in one feed"
            self.findings.add("CS321", "warning", statement.line, text)

    def read(self, speed: float | None) -> None:
        """Read the last cycle at another speed of the spindle: a dwell may count in revolutions."""
        self.now = read_cycle(self._args, self.program, speed) if self._on else None

    def leave_out(self, why: str, line: int, holes: int) -> None:
        """Count holes that are not drilled.

        Parameters
        ----------
        why : str
            Why there is no motion for them.
        line : int
            Of the first one.
        holes : int

        Raises
        ------
        InputError
            CS342: they may not be left out.
        """
        if not self.skip:
            raise InputError(
                "CS342",
                f"the hole cycle is not written: {why}",
                "give --skip-cycles to leave its holes out; the program says NOT DRILLED where they are",
                file=self.program.source.name,
                line=self.line or line,
            )
        text = f"hole not drilled, the tool only goes over it: {why}"
        self.findings.add("CS315", "warning", line, text, holes)

    @property
    def line(self) -> int:
        """Line of the last CYCLE statement, 0 for none."""
        return 0 if self._said is None else self._said.line
