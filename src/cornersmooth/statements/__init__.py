"""Statements beside the motion: what the CL file asks for, what a text says, and whether that is the same.

Verification's own, as `nc_reader` is: shares no code with what writes. `asked` and `cycles` interpret the CL file,
`tokens` the words of a program; both give tokens, and `comparison` compares them. Work offsets by number are here:
what ZERO/n of Autodesk's CAMplete post asks for, and how controls spell it.
"""

from __future__ import annotations

from cornersmooth.model import Program, Statement


def number_of(statement: Statement) -> int | None:
    """Number of the work offset of ZERO/n, 1 for the first; None for anything else."""
    number = statement.args[0] if len(statement.args) == 1 else None
    return int(number) if isinstance(number, float) and 1 <= number < 1000 and number == int(number) else None


def work_offset_of(program: Program) -> int | None:
    """Number of the work offset that a program asks for; None where it names none.

    ZERO/n is that in files of Autodesk alone (CAMplete APT post, 42558: `ZERO/` and `currentSection.workOffset`).
    """
    if program.source.dialect != "hsm":
        return None
    return next((number_of(one) for one in program.statements if one.word == "ZERO"), None)


def spellings(number: int) -> tuple[str, ...]:
    """Words of a work offset: those of FANUC, Haas, LinuxCNC, Siemens and Heidenhain.

    G54 to G59 are the first six, but G505 is the fifth of Siemens, and Heidenhain numbers its presets.
    """
    further = number - 6
    words = [f"G{53 + number}"] if number <= 6 else [f"G54.1 P{further}", f"G154 P{further}"]
    words += [f"G59.{further}"] if 1 <= further <= 3 else []
    words += [f"G5{number:02d}"] if 5 <= number <= 99 else []
    return (*words, str(number), f"CYCL DEF 247 DATUM SETTING Q339=+{number}")
