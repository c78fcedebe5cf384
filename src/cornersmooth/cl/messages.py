"""What the readers of CL files and of tables of points say: one place for all texts.

Texts take their values by `str.format`.
"""

from __future__ import annotations

from typing import Final

from cornersmooth.errors import Finding, InputError, Severity

#: code: (what is wrong, what to do)
ERRORS: Final[dict[str, tuple[str, str]]] = {
    # the file
    "CS100": ("cannot be read: {why}", "check the path and the permissions"),
    "CS101": ("holds no tool positions", "give a CL file with GOTO statements, or a table of points"),
    "CS102": ("is a binary file", "write the CL data in readable form: NX .cls, CATIA .aptsource, Creo .ncl, ..."),
    "CS103": ("is not a complete gzip file: {why}", "compress it again"),
    "CS206": ("not read: {what}", "{hint}"),
    "CS169": ("operation {name} begins {how}", "write it together with the operation before it"),
    "CS199": ("holds more than {limit}", "divide it; CORNERSMOOTH_NO_SIZE_LIMIT=1 reads it all the same"),
    # statements
    "CS104": ("{word} ends in a continuation sign but {next} follows", "complete the statement or remove the $"),
    "CS105": ("a line of numbers that continues no GOTO: {text!r}", "write the statement in front of its numbers"),
    "CS106": ("{word} cannot be read: {token!r} is not a number", "give decimal numbers separated by commas"),
    "CS107": ("{word} is followed by {text!r} instead of '/'", "write {word}/ and its numbers"),
    "CS108": ("{word} moves the tool and is not carried out", "export the path with GOTO and CIRCLE statements"),
    "CS109": ("unknown statement {word}: is it {near}?", "correct the word; a motion must not be lost"),
    # poses
    "CS110": ("{word} with {count} number{s}", "give {want}"),
    "CS111": ("tool axis of length zero", "give a vector from tip to spindle"),
    "CS112": ("tool axis is {length:.6g} long, not 1", "give unit vectors, or read with --lenient to normalise them"),
    "CS113": ("coordinate {value:g} is out of range", "give finite coordinates within {limit:g}"),
    "CS114": ("{word} is incremental and comes before the first position", "begin with FROM or GOTO"),
    # state
    "CS115": ("{word}/{text} is not understood", "{want}"),
    "CS116": ("{word} changes to {new} after positions in {old}", "say --units, or split the file"),
    "CS117": ("{word} changes the coordinates of what follows", "export the path in one coordinate system"),
    "CS118": ("{word} after FINI", "split the file at FINI, or remove what follows it"),
    "CS136": ("FEDRAT/{text} is not understood: {why}", "give one feed, with MMPM, MMPR, IPM or IPR"),
    "CS179": ("{text} is for a lathe, and turning is not written", "take the milling alone, with --operation"),
    "CS119": ("{word} needs a positive feed, not {value:g}", "correct the feed"),
    # arcs and curves
    "CS120": ("{word} with {count} number{s}", "give {want}"),
    "CS121": ("{word} without a GOTO after it", "give the end point of the arc right after it"),
    "CS122": ("{word} without a position to start from", "give a GOTO before the arc"),
    "CS123": (
        "{which} of the arc is {distance:.6g} from its centre, not {radius:.6g}",
        "correct centre, radius or position",
    ),
    "CS124": ("{word} has a normal of length {length:.6g}", "give the unit vector of the arc's axis"),
    "CS125": ("{word} has a radius of {radius:g}", "give a positive radius"),
    "CS126": ("{word} cannot be resolved: {why}", "export arcs as CIRCLE statements or as points"),
    "CS127": ("{word} with {value:g} turns", "give 1 to {limit:g}"),
    "CS128": ("NURBS cannot be read: {why}", "export the path with GOTO statements"),
    # what may move the tool
    "CS186": (
        "{word} repeats, calls or includes statements and is not carried out",
        "export all motion as GOTO and CIRCLE statements in one file",
    ),
    "CS187": (
        "unknown statement {word} with a row of numbers: it may move the tool",
        "export motion as GOTO; where it moves nothing, remove it or read with --lenient",
    ),
    "CS188": (
        "position without a tool axis after MULTAX/OFF: +Z (ISO 4343), or locked at {axis} (CATIA)",
        "say --dialect hsm for +Z, or --dialect catia for the locked axis",
    ),
    "CS188b": (
        "position without a tool axis after the axis {axis}: +Z, or that axis",
        "write all six numbers, or say --dialect plain for that axis",
    ),
    "CS197": (
        "tool axis {axis} after MULTAX/OFF, where ISO 4343 and CATIA read no axis",
        "put MULTAX/ON before it, or say --dialect catia to lock the axis as it was",
    ),
    "CS189": ("a number in columns 73 to 80, as of a punched card", "remove columns 73 to 80"),
    "CS190": ("a line number in front of {text!r}", "remove the line numbers"),
    "CS196": ("{word} has a number too large for any machine", "correct the number"),
    "CS198": (
        "{word} is a block of an NC program, no CL statement",
        "give the CL file that it was made of, or smooth the program itself with 'cornersmooth filter'",
    ),
    "CS193": ("RETRCT cannot be carried out: {why}", "{want}"),
    "CS181": ("{word} inside a CYCLE, which is drilled at every position", "put CYCLE/OFF before it"),
    # tables of points
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
    "CS162": ("column {column!r} is in {unit!r}", "give lengths in mm, m or inch, and feeds per minute"),
    "CS163": ("coordinate beyond {limit:g}", "check the columns and the units"),
    "CS164": ("an empty cell where a number is expected", "fill it or leave the line out"),
    "CS165": (
        "the columns {names} are a quaternion, not a tool axis",
        "give the tool axis as a unit vector: x,y,z,i,j,k",
    ),
    "CS166": ("{cell!r} in the column {column!r} is neither rapid nor feed", "{want}"),
    "CS191": (
        "the column {column!r} changes, and a table of positions has no orders",
        "write a table for each tool and speed, or take the column out",
    ),
}

#: code: (severity, sentence)
FINDINGS: Final[dict[str, tuple[Severity, str]]] = {
    "CS129": ("warning", "the last GOTO is cut short by the end of the file: read with the axis before it"),
    "CS130": ("warning", "unknown statement {word} is kept in place"),
    "CS131": ("warning", "line is no CL statement: kept in place as a comment"),
    "CS132": ("note", "the file states no units: {units} assumed ({why})"),
    "CS133": ("warning", "the file says {stated}, read as {units} as asked for"),
    "CS134": ("warning", "GOTO numbers separated by blanks instead of commas"),
    "CS135": ("warning", "FEDRAT between RAPID and its GOTO: the move stays rapid"),
    "CS137": ("warning", "axis vectors after MULTAX/OFF are ignored: the axis is locked"),
    "CS138": ("note", "poses under CUTCOM are passed exactly: the control offsets the path"),
    "CS139": ("warning", "tool axis is {length:.6g} long, not 1: normalised"),
    "CS140": ("warning", "RAPID/{text} is not understood: the move is {how}"),
    "CS141": ("note", "arcs shorter than the printed digits can tell are read as lines"),
    "CS142": ("warning", "arc turns the other way than its neighbours: read {how}, corners there are kept"),
    "CS143": (
        "warning",
        "{word} changes the coordinates of what follows: ignored; see that the path is in one coordinate system",
    ),
    "CS144": ("warning", "{what}: ignored"),
    "CS145": ("note", "NURBS curves become lines within {tolerance:g} mm"),
    "CS146": ("note", "{word} changes: positions and axes are read into {into}"),
    "CS147": ("warning", "the tool axis turns along an arc, and how it turns is not defined"),
    "CS148": ("warning", "FEDRAT without a unit is read in the unit of the file"),
    "CS149": ("note", "GOHOME without coordinates is kept as a statement"),
    "CS185": ("warning", "FROM is where the tool is not: it feeds on from where it is; put a RAPID after the FROM"),
    "CS192": ("note", "MOVNRB: its points are read, not its curves"),
    "CS195": ("note", "lines of numbers alone are further points of the GOTO before them"),
    "CS194": ("warning", "RETRCT beyond the clearance plane: ignored"),
    "CS275": ("warning", "the file ends in this position, without a line end; see that its last number is whole"),
    "CS385": ("warning", "CYCLE without words is read as depth, feed, clearance; see that positions are tops of holes"),
    "CS180": ("warning", "the feeds are in {feeds} per minute, the positions are read in {units} as asked for"),
    "CS178": ("warning", "not in this program: {words} of the operations before, which may hold on"),
    # tables of points
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
    "CS200": (
        "warning",
        "{what} before this line, and the tool feeds straight on; see that it may, or say --between-passes",
    ),
    "CS209": ("warning", "the whole path is {size:.3g} {units} long: are the numbers metres?; then --scale 1000"),
    "CS176": ("note", "the file states no units: mm assumed"),
}


#: values that are quoted from a file, and to how many characters they are cut
QUOTED: Final = frozenset({"next", "text", "token", "word"})
LONGEST_QUOTE: Final = 60


def error(code: str, file: str, line: int | None, **values: object) -> InputError:
    """Return the error of this code at FILE:LINE, ready to be raised."""
    what, hint = ERRORS[code]
    values = _cut(values)
    return InputError(code[:5], what.format(**values), hint.format(**values), file=file, line=line)


def finding(code: str, line: int, count: int = 1, **values: object) -> Finding:
    """Return the finding of this code."""
    severity, text = FINDINGS[code]
    return Finding(code, severity, line, text.format(**_cut(values)), count)


def _cut(values: dict[str, object]) -> dict[str, object]:
    """Shorten long quotations."""
    return {
        name: value[:LONGEST_QUOTE] + "..."
        if name in QUOTED and isinstance(value, str) and len(value) > LONGEST_QUOTE
        else value
        for name, value in values.items()
    }
