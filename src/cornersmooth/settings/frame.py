"""What a user wants around the motion of a program."""

from __future__ import annotations

from dataclasses import dataclass

from cornersmooth.settings.declared import option


@dataclass(frozen=True)
class FrameSettings:
    """Name, work offset, texts, retracts and holes of a program. Lengths in mm."""

    #: None for that of the CL file, or of the control's table
    program: str | None = option(
        None, "Name or number of the NC program. [default: from the name of the CL file]", flags="--program-name"
    )
    block_numbers: bool = option(False, "Number the blocks.")
    #: may have ``{program}``, ``{units}`` and ``{blend}``
    header: tuple[str, ...] = option((), "Lines to write after the head; {program} and {units} are filled in.")
    footer: tuple[str, ...] = option((), "Lines to write before the tail.")
    comments: bool = option(True, "Leave out what the CL file says in words.", flags="--no-comments")
    #: None for that of the control's table, empty for none
    work_offset: str | None = option(
        None,
        "Work offset, such as G55, or the number of a preset; 'none' leaves it out. [default: G54, or preset 1]",
    )
    #: what the program is made of, for comments before the header
    provenance: tuple[str, ...] = ()
    #: name of the CL file without its ending, for `program`; empty for none
    stem: str = ""
    skip_cycles: bool = option(
        False, "Leave out holes whose cycle cannot be written; the program says NOT DRILLED there. [default: an error]"
    )
    #: taps are the control's own cycles anyway
    cycles: str = option(
        "moves",
        "Holes as plain moves, or as the control's own cycles where it has such and the tool stays along Z (or in a "
        "tilted plane).",
    )
    #: 0 for neither. A form with a point on the axis comes down by 20 mm at least.
    approach: float = option(
        0.0,
        "How far the tool comes down along its axis to the first position after a retract. [default: straight down]",
        unit="mm",
    )
    retract: float = option(
        0.0, "How far the tool goes back along its axis before it goes up. [default: straight up]", unit="mm"
    )
    modal: bool = option(False, "Leave out words that repeat from block to block, where the control keeps them.")
    line_ends: str | None = option(
        None, "What each line of the program ends with: lf or crlf. [default: that of the control's table, lf]"
    )
