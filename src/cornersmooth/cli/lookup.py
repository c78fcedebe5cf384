"""What is looked up: a CL file, controls with their forms, machines, values that smooth would use, causes of codes."""

from __future__ import annotations

import os
import re
import textwrap
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any, Final

import click

from cornersmooth.cli import shop
from cornersmooth.cli.commands import COMMANDS
from cornersmooth.cli.options import Options
from cornersmooth.cli.show import finding_text, say, say_line
from cornersmooth.errors import InputError

#: what the modes of a form are called for people
_MODES = {
    "vector": "tool vectors",
    "point": "a second point on the tool axis",
    "fixed": "tool parallel to Z",
    "angles": "rotary words (--machine)",
    "machine": "machine positions (--machine, --no-tcp)",
}


def run_controls(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    from cornersmooth.nc import control_names, control_table, load_control

    if given.table:
        _check_table(given, "control")
        click.echo(control_table(str(given.name)), nl=False)
        return 0
    controls = [_control(load_control(one)) for one in ([given.name] if given.name else control_names())]
    lines = (line for control in controls for line in _control_lines(control))
    say(given, {"schema": "cornersmooth-controls/1", "controls": controls}, lines)
    return 0


def _check_table(given: Options, kind: str) -> None:
    """Refuse a table of nothing, and one beside other things."""
    if given.name is None:
        raise click.UsageError(f"--table needs the name of a {kind}")
    if given.as_json or given.pose:
        raise click.UsageError(f"--table and {'--pose' if given.pose else '--json'} exclude each other")


def _control(control: Any) -> dict[str, Any]:
    """What the list has of a control."""
    from cornersmooth.nc import control_aliases

    aliases = [alias for alias, own in control_aliases().items() if own == control.name and not control.own]
    forms = [{**_named(form), "with": [_MODES[mode] for mode in form.modes]} for form in control.forms.values()]
    return {**_named(control), "aliases": aliases, "forms": forms, "functions": [*map(_named, control.extras.values())]}


def _named(item: Any) -> dict[str, Any]:
    return {"name": item.name, "description": item.description}


def _control_lines(control: dict[str, Any]) -> Iterator[str]:
    yield _line("", control)
    if control["aliases"]:
        yield f"  also called {', '.join(control['aliases'])}"
    for form in control["forms"]:
        yield _line("  -f ", form)
        yield f"     with {', '.join(form['with'])}"
    for extra in control["functions"]:
        yield _line("  --with ", extra)


def _line(before: str, item: dict[str, Any]) -> str:
    return f"{before}{item['name']}: {item['description']}" if item["description"] else f"{before}{item['name']}"


def run_machines(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    from cornersmooth.kinematics import load_machine, machine_names, machine_table
    from cornersmooth.kinematics.posed import parse_pose, pose_facts, pose_lines

    name = given.name
    if given.table:
        _check_table(given, "machine")
        click.echo(machine_table(str(name)), nl=False)
    elif given.pose and name is None:
        raise click.UsageError("--pose needs the name of a machine")
    elif given.pose and name:
        machine = load_machine(name)
        facts = pose_facts(machine, parse_pose(machine, given.pose))
        say(given, facts, pose_lines(facts), indent=4)
    else:
        found = [load_machine(one) for one in ([name] if name else machine_names())]
        lines = found[0].describe().splitlines() if name else [f"{one.name}: {one.description}" for one in found]
        say(given, {"schema": "cornersmooth-machines/1", "machines": [*map(asdict, found)]}, lines, indent=4)
    return 0


#: where a help says what holds without the option
_DEFAULT: Final = re.compile(r"\[default: ([^]]+)\]")


def run_config(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    smooth = COMMANDS["smooth"]
    source = given.source
    if not os.path.exists(source):
        raise InputError("CS100", "cannot read it: no such file or directory", "check the path", file=source)
    values, lines = [], []
    with smooth.make_context("smooth", [source]) as context:
        for option in shop.settable(smooth):
            name = str(option.name)
            value = getattr(context.params[name], "name", context.params[name])  # a control or machine of one's own
            row = (shop.key(name), value, shop.origin(context, name))
            values.append(dict(zip(("key", "value", "from"), row, strict=True)))
            instead = _DEFAULT.search(option.help or "")
            lines.append((row[0], instead[1] if instead and value in (None, "", ()) else _shown(value), row[2]))
    widths = [max(len(line[column]) for line in lines) for column in (0, 1)]
    table = (f"{key:<{widths[0]}}  {value:<{widths[1]}}  {origin}" for key, value, origin in lines)
    say(given, {"schema": "cornersmooth-config/1", "values": values}, table)
    return 0


def _shown(value: object) -> str:
    if value is None or value == ():
        return "none"
    if isinstance(value, bool):
        return "yes" if value else "no"
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


#: what the hundreds of the codes are about
PARTS: Final = {
    "1": "CL input",
    "2": "Settings, controls and machines",
    "3": "NC output",
    "4": "Files",
    "5": "Verification",
}
#: what each kind of message means
KINDS: Final = {
    "error": "The command ends. No program is written, and an old one is as it was.",
    "problem": "Verification found a fault in the program: the verdict is FAILED.",
    "warning, to check": "The program is written. Somebody has to look at this before it runs.",
    "warning": "The program is written. The warning is not about the metal.",
    "note": "The program is written. -v prints notes.",
}
#: columns of a text on a terminal
_WIDTH: Final = 80


def run_explain(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    if given.stream:
        if given.name is not None:
            raise click.UsageError("--stream shows a program: leave the code out")
        from cornersmooth.cli.filter import explain_program

        return explain_program(str(given.stream), given)
    known, code = codes(), given.name
    if code is not None:
        number = re.fullmatch(r"(?:CS)?(\d{3})", code.strip("[]"), re.IGNORECASE)
        code = f"CS{number[1]}" if number else code
        if code not in known:
            raise click.UsageError(f"no code {code!r}; 'cornersmooth explain' lists them")
    found = {name: one for name, one in known.items() if code in (None, name)}
    lines = _every_code(known) if code is None else _code_lines(code, known[code])
    say(given, {"schema": "cornersmooth-codes/1", "codes": found}, lines)
    return 0


def codes() -> dict[str, dict[str, Any]]:
    """Give messages, cause and remedy of every code; cause and remedy are empty where the message is all there is."""
    messages, causes = (
        tomllib.loads(Path(__file__).with_name(f"{name}.toml").read_text(encoding="utf-8"))
        for name in ("codes", "causes")
    )
    keys = ("kind", "message", "hint")
    return {
        code: {
            "about": PARTS[code[2]],
            "messages": [dict(zip(keys, row, strict=True)) for row in rows],
            **{key: causes.get(code, {}).get(key, "") for key in ("cause", "remedy")},
        }
        for code, rows in messages.items()
    }


def _every_code(known: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    about = ""
    for code, one in known.items():
        if one["about"] != about:
            yield from ("",) * bool(about)
            about = one["about"]
            yield f"{code[:3]}xx  {about}"
        first = one["messages"][0]
        kind = first["kind"].partition(",")[0]
        message = textwrap.shorten(first["message"], _WIDTH - len(f"  {code}  {kind:<8}"), placeholder=" ...")
        yield f"  {code}  {kind:<8}{message}"


def _code_lines(code: str, found: Mapping[str, Any]) -> Iterator[str]:
    kinds = list(dict.fromkeys(one["kind"] for one in found["messages"]))
    yield f"{code}  {found['about']}: {' or '.join(kinds)}"
    for kind in kinds:
        yield from _paragraph("meaning", KINDS[kind])
    yield from _paragraph("cause", found["cause"])
    yield from _paragraph("what to do", found["remedy"])
    yield ""
    yield "as it is printed (... is filled in):"
    for one in found["messages"]:
        severity = {"problem": "error"}.get(one["kind"], one["kind"].partition(",")[0])
        yield from _wrapped(f"FILE:LINE: {severity}[{code}]: {one['message'].replace('…', '...')}", "  ")
        if one["hint"]:
            yield from _wrapped(f"hint: {one['hint'].replace('…', '...')}", "  ")


def _paragraph(label: str, text: str) -> list[str]:
    return _wrapped(text.replace("`", ""), f"  {label:<12}") if text else []


def _wrapped(text: str, indent: str) -> list[str]:
    further = " " * len(indent) if indent.strip() else indent + "  "
    return textwrap.wrap(
        text, _WIDTH, initial_indent=indent, subsequent_indent=further, break_long_words=False, break_on_hyphens=False
    )


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
    from cornersmooth.cl import read
    from cornersmooth.report.info import describe

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
        from cornersmooth.report import marks_text

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
