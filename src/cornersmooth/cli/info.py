"""``cornersmooth info``: what a CL file holds and what would limit the rounding of its corners."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from cornersmooth.cl import read
from cornersmooth.cli.options import Options
from cornersmooth.cli.show import finding_text, say, say_line
from cornersmooth.report import marks_text
from cornersmooth.report.info import describe


def run_info(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    data, name, is_program = given.read()
    if is_program:
        from cornersmooth.cli.filter import describe_program

        contents = describe_program(data, name)
        looks = f", looks like {contents['looks_like']}" if contents["looks_like"] else ""
        lines = [
            f"file   {name}: an NC program{looks}, {contents['lines']} lines",
            f"cuts   {contents['cuts']}",
            "       'cornersmooth filter' smooths them; name the control and the machine there",
        ]
        say(given, contents, lines)
        return 0
    program = read(data, name=name, **given.reading())
    info = describe(program, given.tolerance, given.axis_length, given.load_machine())
    rows = [*_file(info), *_motion(info), *_axis(info), *_corners(info)]
    width = max(len(label) for label, _ in rows)
    say(given, info, (f"{label:<{width}}  {text}".rstrip() for label, text in rows), indent=width + 2)
    if not given.as_json:
        for finding in info["findings"]:
            for line in finding_text(name, finding).split("\n"):
                say_line(line)
    return 0


Rows = Iterator[tuple[str, str]]
Record = dict[str, Any]


def _file(info: Record) -> Rows:
    yield "file", f"{info['name']}: {info['dialect']}, {info['units']}"
    yield "poses", _counts(info["motion"]["moves"])
    if info["statements"]:
        yield "statements", _counts(info["statements"])
    for tool in info["tools"]:
        number = "no tool number" if tool["number"] is None else f"T{tool['number']}"
        used = ", ".join(map(str, tool["operations"]))
        yield "tool", f"{number}{tool['shape'] and ', ' + tool['shape']}: operations {used}"
    for one in info["operations"]:
        tool_named = "" if one["tool"] is None else f", T{one['tool']}"
        yield (
            f"operation {one['number']}",
            f"{one['name']}{tool_named}, lines {one['first_line']} to {one['last_line']}, {one['poses']} poses, "
            f"{one['feed_length_mm']:.6g} mm of lines at feed, tool axis {one['axis']}".lstrip(", "),
        )


def _motion(info: Record) -> Rows:
    motion = info["motion"]
    yield "chains", f"{motion['chains']}, the longest {motion['longest_chain_poses']} poses"
    yield "path", f"{motion['feed_length_mm']:.6g} mm of lines at feed, {motion['rapid_length_mm']:.6g} mm of rapids"
    low, high = (
        " ".join(f"{value:.6g}" for value in corner) for corner in (motion["box_min_mm"], motion["box_max_mm"])
    )
    yield "box", f"{low} to {high} mm"
    by_unit = {"mm/min": motion["feeds_mm_per_min"], "mm/rev": motion["feeds_mm_per_rev"]}
    feeds = [", ".join(f"{value:g}" for value in values) + f" {unit}" for unit, values in by_unit.items() if values]
    missing = f"{motion['feed_moves_without_feed']} moves without" if motion["feed_moves_without_feed"] else ""
    yield "feeds", "; ".join(part for part in (*feeds, missing) if part) or "none"
    yield "segments", _spread(motion["segment_length_mm"], "mm")
    if info["arcs"]["count"]:
        yield "arcs", f"{info['arcs']['count']}, {info['arcs']['helices']} of them helices"
        yield "arc radius", _spread(info["arcs"]["radius_mm"], "mm")
        yield "arc sweep", _spread(info["arcs"]["sweep_deg"], "deg")


def _axis(info: Record) -> Rows:
    axis = info["axis"]
    meaning = {"fixed": "one direction", "indexed": "turns between cuts only", "simultaneous": "turns while cutting"}
    yield "tool axis", meaning[axis["kind"]]
    yield "tilt from +Z", _spread(axis["tilt_deg"], "deg")
    yield "axis steps", _spread(axis["step_deg"], "deg")
    kinds = {
        "translations": axis["translations"],
        "pure rotations": axis["rotations"],
        "repetitions": axis["repetitions"],
    }
    for marks in axis["rotary_marks"]:
        yield "rotary axis", marks_text(marks)
    if axis["step_deg"]["count"]:
        yield "", _counts({name: count for name, count in kinds.items() if count}) or "every segment moves and turns"


def _corners(info: Record) -> Rows:
    corners = info["corners"]
    yield "corners", f"{corners['count']}, {corners['sharp']} sharper than 10 deg"
    yield "turns", _spread(corners["tip_turn_deg"], "deg")
    yield (
        f"at {corners['tolerance_mm']:g} mm",
        f"{corners['smoothed']} would be rounded: {corners['limited_by_segment']} limited by segment length, "
        f"{corners['limited_by_tolerance']} by the tolerance (axis point at {corners['axis_length_mm']:g} mm)",
    )
    if corners["not_smoothed"]:
        yield "stay sharp", _counts(corners["not_smoothed"])
    yield "deviation", _spread(corners["deviation_mm"], "mm")
    yield "", "values are least / 5 % / median / 95 % / most (how many)"


def _counts(counts: dict[str, int]) -> str:
    return ", ".join(f"{count} {name}" for name, count in counts.items())


def _spread(spread: Record, unit: str) -> str:
    if not spread["count"]:
        return "none"
    levels = " / ".join(f"{spread[level]:.4g}" for level in ("min", "p5", "p50", "p95", "max"))
    return f"{levels} {unit} ({spread['count']})"
