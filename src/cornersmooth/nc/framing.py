"""What stands around the motion: head and tail, program name, block numbers, the user's own texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from cornersmooth.errors import SettingsError
from cornersmooth.model import Program
from cornersmooth.nc.control import Form
from cornersmooth.text import format_number

#: share of the tolerance that a control may blend lines with, where it is told so
_BLEND_SHARE = 0.1

#: decimals of that
_BLEND_DECIMALS = 5


class Stream(Protocol):
    """What text is written to."""

    def write(self, data: bytes, /) -> object:
        """Write the bytes."""


@dataclass(frozen=True)
class Frame:
    """What a user wants around the motion.

    Parameters
    ----------
    program : str or None
        Name or number of the program; None for that of the control's table.
    block_numbers : bool
        Whether blocks are numbered where the control does not ask for it.
    header, footer : tuple of str
        Lines behind the head and before the tail, with ``{program}`` and ``{units}``.
    """

    program: str | None = None
    block_numbers: bool = False
    header: tuple[str, ...] = ()
    footer: tuple[str, ...] = ()

    def start(self, stream: Stream, form: Form, program: Program, tolerance: float) -> Framing:
        """Frame for one text.

        Raises
        ------
        SettingsError
            A line of header or footer has unknown braces or characters that NC text cannot hold.
        """
        layout = form.table.layout
        blend = format_number(_BLEND_SHARE * tolerance / program.mm_per_unit, _BLEND_DECIMALS)
        values = {"program": self.program or layout.program, "units": layout.units[program.units], "blend": blend}
        number = layout.block_number or ("N{number} " if self.block_numbers else "")
        return Framing(
            stream,
            before=[*_filled(layout.head, values), *_filled(self.header, values)],
            after=[*_filled(self.footer, values), *_filled(layout.tail, values)],
            number=number,
            next_number=layout.number_start,
            step=layout.number_step,
        )


@dataclass
class Framing:
    """Writes one text; numbers its blocks where asked for.

    Parameters
    ----------
    stream : binary stream
    before, after : list of str
    number : str
        With ``{number}``; empty for none.
    """

    stream: Stream
    before: list[str]
    after: list[str]
    number: str
    next_number: int
    step: int
    blocks: int = 0  #: in head and tail

    def head(self) -> None:
        """Write what stands before the motion."""
        self._write_lines(self.before)

    def tail(self, last: Sequence[str]) -> None:
        """Write what stands behind the motion, its own last blocks first."""
        self._write_lines([*last, *self.after])

    def write(self, text: bytes) -> None:
        """Write whole lines."""
        self.stream.write(self._numbered(text) if self.number else text)

    def _write_lines(self, lines: list[str]) -> None:
        self.blocks += len(lines)
        if lines:
            self.write("".join(line + "\n" for line in lines).encode("ascii"))

    def _numbered(self, text: bytes) -> bytes:
        before, _, behind = self.number.partition("{number}")
        head, tail = before.encode(), behind.encode()
        lines = text.splitlines(keepends=True)
        pieces = []
        number = self.next_number
        for line in lines:
            if line in (b"%\n", b"\n"):
                pieces.append(line)
            else:
                pieces.append(b"%b%d%b%b" % (head, number, tail, line))
                number += self.step
        self.next_number = number
        return b"".join(pieces)


def _filled(lines: Sequence[str], values: dict[str, str]) -> list[str]:
    filled = []
    for line in lines:
        try:
            text = line.format(**values) if "{" in line or "}" in line else line
        except (KeyError, IndexError, ValueError) as error:
            known = ", ".join(f"{{{name}}}" for name in values)
            raise SettingsError("CS216", f"{line!r} has unknown braces", f"use {known}") from error
        if not (text.isascii() and text.isprintable()):
            raise SettingsError("CS216", f"{line!r} has characters that NC text cannot hold", "use ASCII")
        filled.append(text)
    return filled
