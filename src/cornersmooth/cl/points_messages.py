"""What the reader of point files says: codes CS150-CS179, one line each.

The texts take their values by `str.format`; `error` and `finding` put them into the project's classes.
"""

from __future__ import annotations

from cornersmooth.errors import Finding, InputError, Severity

#: code: (what is wrong, what to do)
ERRORS: dict[str, tuple[str, str]] = {
    "CS150": ("no poses in the file", "give one pose a line: x y z, or x y z i j k"),
    "CS151": ("{got} columns where {want} are expected", "give every line the same columns"),
    "CS152": ("{cell!r} is not a number", "give decimal numbers; begin other lines with #"),
    "CS153": ("{cell!r} is not a finite number", "give finite coordinates"),
    "CS154": ("tool axis of length zero", "give a vector from tip to spindle, or a second point away from the tip"),
    "CS155": ("tool axis is {length:.6g} long, not 1", "give unit vectors, or read with --lenient to normalise them"),
    "CS156": ("cannot make out the columns of the header: {why}", "name them x,y,z,i,j,k or xa,ya,za,xb,yb,zb, and f"),
    "CS157": (
        "cannot tell whether columns 4 to 6 are axis vectors or second points",
        "put a header line before the rows: x,y,z,i,j,k or xa,ya,za,xb,yb,zb",
    ),
    "CS158": ("feed {feed:g} is not positive", "give the feed per minute, or leave the cell empty to keep the last"),
    "CS159": ("{got} columns and no header", "give 3, 6 or 7 columns, or name them: x,y,z,i,j,k,f"),
    "CS160": (
        "cannot tell decimal commas from separating commas",
        "put semicolons or tabs between the columns, or write decimal points",
    ),
    "CS161": ("the file holds bytes that are no characters", "give a plain file in UTF-8 or Windows-1252"),
    "CS162": ("column {column!r} is in {unit!r}", "give lengths in mm or inch and feeds per minute"),
    "CS163": ("coordinate beyond {limit:g}", "check the columns and the units"),
    "CS164": ("an empty cell where a number is expected", "fill it or leave the line out"),
    "CS165": (
        "the columns {names} are a quaternion, not a tool axis",
        "give the tool axis as a unit vector: x,y,z,i,j,k",
    ),
    "CS166": ("{cell!r} in the column {column!r} is neither rapid nor feed", "{want}"),
}

#: code: (severity, sentence)
FINDINGS: dict[str, tuple[Severity, str]] = {
    "CS170": ("note", "no columns for the tool axis: +Z is used"),
    "CS171": ("note", "second points are {mean:.6g} mm from the tips: only their direction is used"),
    "CS172": (
        "warning",
        "distance of the second points from the tips varies from {low:.6g} to {high:.6g} mm; check the columns",
    ),
    "CS173": ("warning", "columns not used: {names}"),
    "CS174": ("warning", "tool axis is {length:.6g} long, not 1: normalised"),
    "CS175": ("warning", "feed {feed:g} is not positive: the feed before it is kept"),
    "CS177": ("note", "no column says which moves are rapid: the first pose is reached in rapid, all others at feed"),
    "CS176": ("note", "the file states no units: mm assumed"),
}


def error(code: str, file: str, line: int | None, **values: object) -> InputError:
    """Return the error of this code at FILE:LINE, ready to be raised."""
    what, hint = ERRORS[code]
    return InputError(code, what.format(**values), hint.format(**values), file=file, line=line)


def finding(code: str, line: int, count: int = 1, **values: object) -> Finding:
    """Return the finding of this code."""
    severity, text = FINDINGS[code]
    return Finding(code, severity, line, text.format(**values), count)
