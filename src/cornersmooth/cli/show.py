"""What a person sees on the terminal: everything but the NC text goes to standard error."""

from __future__ import annotations

import json
import os
import re
import sys
import textwrap
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TextIO

from cornersmooth.errors import CornersmoothError, message, printable

if TYPE_CHECKING:
    from rich.console import Console

    from cornersmooth.cli.options import Options
    from cornersmooth.pipeline import Progress
    from cornersmooth.report.verdict import Saving

#: code of the finding that a text is not verified
NOT_VERIFIED = "CS509"

#: where the kind of a message stands in its line, and how it is shown
_MESSAGE: Final = re.compile(r"(?:.*?: )?(?P<head>(?P<kind>error|warning|note|hint)(?:\[CS\d{3}\])?:)")
_STYLES: Final = {"error": "bold red", "warning": "bold yellow", "note": "bold", "hint": "cyan"}

#: findings and sharp corners shown without -v
_FINDINGS_SHOWN = 10
_SHARP_SHOWN = 10

#: what JSON has escapes for
_OUTSIDE_ASCII: Final = re.compile(r"[^\x00-\x7f]+")

#: room for the labels of the summary
_LABEL = 14

#: of the lines below a verdict
INDENT = " " * 8


def console(stream: TextIO | None = None) -> Console:
    """Console on standard error, or another stream; rich itself honours NO_COLOR and a missing terminal."""
    from rich.console import Console

    return Console(file=stream or sys.stderr, highlight=False, markup=False, emoji=False, soft_wrap=True)


@contextmanager
def progress_bar(quiet: bool, *, rate: bool = False) -> Iterator[Progress | None]:
    """Progress callback drawing a bar, or None where nobody would see it; `rate` adds pieces a second and time left.

    LinuxCNC's AXIS reads lines in place of a bar (its manual, "G-code filters").
    """
    if not quiet and "AXIS_PROGRESS_BAR" in os.environ:
        yield _progress_of_axis
        return
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich import progress as rich

    columns: list[rich.ProgressColumn] = [rich.TextColumn("{task.description}"), rich.BarColumn()]
    columns += [rich.MofNCompleteColumn(), rich.TimeElapsedColumn()]
    if rate:
        columns += [rich.TextColumn("{task.fields[rate]}"), rich.TimeRemainingColumn()]
    with rich.Progress(*columns, console=console(), transient=True) as bar:
        tasks: dict[str, Any] = {}
        begin = time.monotonic()

        def advance(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                for begun in tasks.values():  # a stage that nobody knows the length of ends where the next begins
                    bar.update(begun, total=bar.tasks[begun].total or 1, completed=bar.tasks[begun].total or 1)
                tasks[stage] = bar.add_task(stage, total=total or None, rate="")
            took = time.monotonic() - begin
            bar.update(tasks[stage], completed=done, total=total or None, rate=f"{done / took:.1f}/s" if took else "")

        yield advance


def _progress_of_axis(stage: str, done: int, total: int) -> None:
    """Print how much of a stage is done, as AXIS reads it."""
    if total:
        print_line(f"FILTER_PROGRESS={100 * done // total}")


def show_findings(source: str, findings: Sequence[dict[str, Any]], verbose: int) -> None:
    """Print the findings of one file, each on its line: first what is to be checked, all of it."""
    listed = [finding for finding in findings if finding["code"] != NOT_VERIFIED]  # the first line says it
    ranked = sorted(listed, key=lambda one: (not one["to_check"], ("error", "warning", "note").index(one["severity"])))
    if not verbose:
        ranked = [finding for finding in ranked if finding["severity"] != "note"]
    count = max(_FINDINGS_SHOWN, sum(finding["to_check"] for finding in ranked))
    shown = ranked if verbose else ranked[:count]
    for finding in shown:
        print_message(finding_text(source, finding))
    if len(ranked) > len(shown):
        print_line(f"{source}: {more(len(ranked) - len(shown), 'finding')}; -v shows them")


def finding_text(source: str, finding: Mapping[str, Any]) -> str:
    """Give the message of a finding in the table of a report."""
    place = f"{source}:{finding['line']}" if finding["line"] else source
    return message(finding["severity"], finding["text"], code=finding["code"], place=place, count=finding["count"])


def print_verdict(contents: Mapping[str, Any], counts: str, lines: Iterable[str]) -> None:
    """Print the verdict and the program, in bold on a terminal, then what the verdict says and other lines."""
    verdict, _, what = contents["verdict_text"].partition(": ")
    program = contents["program"]
    machine = f", {program['machine']}" if program["machine"] else ""
    name = f"{program['name'] or 'standard output'}  {program['control']} {program['form']}{machine}"
    head = f"{verdict}  {name}, {counts}"
    if sys.stderr is not None and sys.stderr.isatty():
        console().print(printable(head), style="bold", soft_wrap=False)
    else:
        print_line(head)
    for line in (*what.split("; "), *lines):
        print_line(INDENT + line)


def show_verdict(contents: Mapping[str, Any], saving: Saving | None = None) -> None:
    """Print what became of a program that was smoothed, and what somebody has to look at before it runs."""
    from cornersmooth.report.verdict import method_text, sharp_line, time_text

    summary = contents["summary"]
    corners = summary["corners"] - summary["not_smoothed"].get("duplicate", 0)
    lines = [
        _error_text(contents),
        f"{summary['smoothed']:,} of {corners:,} corners rounded, {sharp_line(contents)}",
        *(time_text(saving, contents["times"]["limits"]).split("; ") if saving is not None else ()),
        f"method {method_text(summary)}",
    ]
    print_verdict(contents, f"{summary['blocks_out']:,} blocks from {contents['input']['poses']:,} poses", lines)
    for finding in contents["findings"]:
        if finding["to_check"]:
            what, _, hint = finding["text"].partition("; ")
            line = f"CL line {finding['line']}: " if finding["line"] else ""
            times = f" ({finding['count']:,} times)" if finding["count"] > 1 else ""
            print_line(f"{'CHECK':<{len(INDENT)}}{line}{what}{times} [{finding['code']}]")
            if hint:
                print_line(f"{INDENT}hint: {hint}")


def _error_text(contents: Mapping[str, Any]) -> str:
    """Say how far the written path is off, or where it was not measured, the curves."""
    found, summary, settings = contents.get("verification"), contents["summary"], contents["settings"]
    kind, label, where = (
        ("deviation", "measured", "in the program") if found else ("error", "computed", "on the curves")
    )
    known = found or summary
    if settings["axis_tolerance_deg"] is not None:
        second = f"tool axis {known[f'max_orientation_{kind}_deg']:.4f}°"
    else:
        name = "max_axis_point_deviation_mm" if found else "max_axis_error_mm"
        second = f"axis point {known[name] or 0.0:.4f} mm (H {settings['axis_length_mm']:g} mm)"
    return f"{label}: tip {known[f'max_tip_{kind}_mm'] or 0.0:.4f} mm, {second} {where}"


def show_summary(contents: Mapping[str, Any], seconds: Mapping[str, float], verbose: int) -> None:
    """Print the sharp corners of one file; with `verbose` what limits the others, and the times of the stages."""
    from cornersmooth.report.verdict import sharp_text
    from cornersmooth.smoothing.construction import construction_of

    summary, given = contents["summary"], contents["input"]
    if verbose:
        sharp = ", ".join(f"{count} {reason}" for reason, count in summary["not_smoothed"].items())
        rows = {
            "input": f"{given['name']}: {given['dialect']}, {given['poses']} poses, {given['units']}",
            "limited by": f"the tolerance ({summary['limited_by_tolerance']} corners), "
            f"segment length ({summary['limited_by_segment']})",
            "not rounded": sharp,
            "tool axis": f"turned by up to {summary['max_orientation_error_deg']:.4f}° from the original",
            contents["settings"]["method"]: construction_of(contents["settings"]["method"]).summary_text(summary),
            "seconds": ", ".join(f"{stage} {value:.3f}" for stage, value in seconds.items()),
        }
        for label, text in rows.items():
            if text:
                print_line(f"{label:<{_LABEL}}{text}")
    shown = contents["sharp"] if verbose else contents["sharp"][:_SHARP_SHOWN]
    for corner in shown:
        print_line(f"{given['name']}{sharp_text(corner)}, stays sharp")
    if summary["sharp"] > len(shown):
        rest = more(summary["sharp"] - len(shown), "sharp corner")
        print_line(f"{given['name']}: {rest}; --report part.html lists them")


def more(count: int, thing: str) -> str:
    """Say that there are more: ``1 more finding``, ``2 more findings``."""
    return f"{count:,} more {thing}{'s' * (count != 1)}"


def print_line(text: str) -> None:
    """Print a line to standard error."""
    _print(printable(text), sys.stderr)


def say(given: Options, contents: Mapping[str, Any], lines: Iterable[str], indent: int = 2) -> None:
    """Print a result to standard output: as one JSON object, or in lines to read; nothing where it is to be quiet."""
    if given.as_json:
        say_json(contents)
    elif not given.quiet:
        for line in lines:
            say_line(line, indent)


def say_json(contents: Mapping[str, Any]) -> None:
    """Print one JSON object to standard output."""
    from cornersmooth.report import report_json

    text = report_json(contents).encode("utf-8", "backslashreplace").decode()  # names need not be UTF-8
    if (sys.stdout.encoding or "").lower().replace("-", "") != "utf8":  # the code page of a console
        text = _OUTSIDE_ASCII.sub(lambda one: json.dumps(one[0])[1:-1], text)
    print(text, end="")  # noqa: T201


def error_contents(failure: CornersmoothError) -> dict[str, Any]:
    """Give the object of an error (report/error.schema.json)."""
    fields = {name: getattr(failure, name) or None for name in ("code", "what", "hint", "file", "line")}
    return {"schema": "cornersmooth-error/1", "exit_code": failure.exit_code, **fields}


def say_line(text: str, indent: int = 2) -> None:
    """Print a line to standard output; what a terminal wraps is indented."""
    _print(printable(text), sys.stdout, indent)


def print_message(text: str) -> None:
    """Print to standard error what `errors.message` has made; it has lines, and nothing in them is raw."""
    for line in text.split("\n"):
        _print(line, sys.stderr)


def warn(text: str, place: str = "", code: str = "") -> None:
    """Print a warning."""
    print_message(message("warning", text, place=place, code=code))


def _print(line: str, stream: TextIO, indent: int = 2) -> None:
    """Print a line as it is; on a terminal in colour, and wrapped between words."""
    if stream is None or not stream.isatty():
        print(line, file=stream)
        return
    from rich.text import Text

    out = console(stream)
    indent = max(indent, len(INDENT)) if line.startswith(("CHECK", INDENT)) else indent
    wrapped = textwrap.wrap(
        line, out.width, subsequent_indent=" " * indent, break_long_words=False, break_on_hyphens=False
    )
    shown = Text("\n".join(wrapped))
    if line.startswith("CHECK"):
        shown.stylize("bold yellow", 0, len(INDENT))
    if (found := _MESSAGE.match(line)) and found.end() <= len(wrapped[0]):
        shown.stylize(_STYLES[found["kind"]], *found.span("head"))
    out.print(shown)
