"""What a person sees on the terminal: everything but the NC text goes to standard error."""

from __future__ import annotations

import re
import sys
import textwrap
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final, TextIO

from cornersmooth.errors import message, printable

if TYPE_CHECKING:
    from rich.console import Console

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

#: room for the labels of the summary
_LABEL = 14


def console() -> Console:
    """Console on standard error; rich itself honours NO_COLOR and a missing terminal."""
    from rich.console import Console

    return Console(stderr=True, highlight=False, markup=False, emoji=False, soft_wrap=True)


@contextmanager
def progress_bar(quiet: bool, *, rate: bool = False) -> Iterator[Progress | None]:
    """Progress callback drawing a bar, or None where nobody would see it; `rate` adds pieces a second and time left."""
    if quiet or not sys.stderr.isatty():
        yield None
        return
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        ProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    columns: list[ProgressColumn] = [TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn()]
    columns.append(TimeElapsedColumn())
    if rate:
        columns += [TextColumn("{task.fields[rate]}"), TimeRemainingColumn()]
    with Progress(*columns, console=console(), transient=True) as bar:
        tasks: dict[str, Any] = {}
        begin = time.monotonic()

        def advance(stage: str, done: int, total: int) -> None:
            if stage not in tasks:
                tasks[stage] = bar.add_task(stage, total=total, rate="")
            took = time.monotonic() - begin
            bar.update(tasks[stage], completed=done, total=total, rate=f"{done / took:.1f}/s" if took else "")

        yield advance


def show_findings(source: str, findings: list[dict[str, Any]], verbose: int) -> None:
    """Print the findings of one file, each on its line: first what is to be checked, all of it."""
    told = [finding for finding in findings if finding["code"] != NOT_VERIFIED]  # the first line says it
    ranked = sorted(told, key=_rank)
    if not verbose:
        ranked = [finding for finding in ranked if finding["severity"] != "note"]
    count = max(_FINDINGS_SHOWN, sum(finding["to_check"] for finding in ranked))
    shown = ranked if verbose else ranked[:count]
    for finding in shown:
        print_message(told_finding(source, finding))
    if len(ranked) > len(shown):
        print_line(f"{source}: {more(len(ranked) - len(shown), 'finding')}; -v shows them")


def told_finding(source: str, finding: Mapping[str, Any]) -> str:
    """Give the message of a finding in the table of a report."""
    place = f"{source}:{finding['line']}" if finding["line"] else source
    return message(finding["severity"], finding["text"], code=finding["code"], place=place, count=finding["count"])


def _rank(finding: dict[str, Any]) -> int:
    return 0 if finding["to_check"] else ("error", "warning", "note").index(finding["severity"]) + 1


def show_verdict(contents: dict[str, Any], saving: Saving | None = None) -> None:
    """Print the verdict, in one line."""
    from cornersmooth.report.verdict import first_line

    console().print(printable(first_line(contents, saving)), style="bold")


def show_summary(contents: dict[str, Any], seconds: Mapping[str, float], verbose: int) -> None:
    """Print the small table of one file, and its sharp corners."""
    from rich.text import Text

    from cornersmooth.report.verdict import method_text, sharp_text
    from cornersmooth.smoothing.construction import construction_of

    summary, settings = contents["summary"], contents["settings"]
    given = contents["input"]
    out = console()

    def say(label: str, text: str) -> None:
        out.print(Text.assemble((f"{label:<{_LABEL}}", "bold"), printable(text)))

    say("input", f"{given['name']}: {given['dialect']}, {given['poses']} poses, {given['units']}")
    sharp = ", ".join(f"{count} {reason}" for reason, count in summary["not_smoothed"].items())
    say("corners", f"{summary['smoothed']} of {summary['corners']} rounded" + (f" ({sharp})" if sharp else ""))
    say(
        "limited by",
        f"the tolerance ({summary['limited_by_tolerance']} of them), segment length ({summary['limited_by_segment']})",
    )
    own_axis = settings["axis_tolerance_deg"] is not None
    allowed = f"tolerance {settings['tolerance_mm']:g} mm"
    if own_axis:
        say("error", f"tip {summary['max_tip_error_mm']:.4f} mm, {allowed}, axis {settings['axis_tolerance_deg']:g}°")
    else:
        say(
            "error",
            f"tip {summary['max_tip_error_mm']:.4f} mm, axis point {summary['max_axis_error_mm']:.4f} mm "
            f"(H {settings['axis_length_mm']:g} mm), {allowed}",
        )
    say("tool axis", f"turned by up to {summary['max_orientation_error_deg']:.4f}° from the original")
    say("method", method_text(summary))
    if text := construction_of(settings["method"]).summary_text(summary):
        say(settings["method"], text)
    if "verification" in contents:
        found = contents["verification"]
        second = f"axis point {found['max_axis_point_deviation_mm'] or 0.0:.4f} mm"
        if own_axis:
            second = f"tool axis {found['max_orientation_deviation_deg']:.4f}°"
        say(
            "measured",
            f"tip {found['max_tip_deviation_mm']:.4f} mm, {second} in the written program",
        )
    say("blocks", f"{summary['blocks_in']} in, {summary['blocks_out']} out")
    if verbose:
        say("seconds", ", ".join(f"{stage} {value:.3f}" for stage, value in seconds.items()))
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


def say_json(contents: Mapping[str, Any]) -> None:
    """Print one JSON object to standard output."""
    from cornersmooth.report import report_json

    text = report_json(contents)
    print(text.encode("utf-8", "backslashreplace").decode(), end="")  # names need not be UTF-8  # noqa: T201


def say_line(text: str) -> None:
    """Print a line to standard output."""
    print(printable(text))  # noqa: T201


def print_message(text: str) -> None:
    """Print to standard error what `errors.message` has made; it has lines, and nothing in them is raw."""
    for line in text.split("\n"):
        _print(line, sys.stderr)


def warn(text: str, place: str = "", code: str = "") -> None:
    """Print a warning."""
    print_message(message("warning", text, place=place, code=code))


def _print(line: str, stream: TextIO) -> None:
    """Print a line as it is; on a terminal in colour, and wrapped between words."""
    if stream is None or not stream.isatty():
        print(line, file=stream)
        return
    from rich.text import Text

    out = console()
    wrapped = textwrap.wrap(line, out.width, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)
    shown = Text("\n".join(wrapped))
    if (found := _MESSAGE.match(line)) and found.end() <= len(wrapped[0]):
        shown.stylize(_STYLES[found["kind"]], *found.span("head"))
    out.print(shown)
