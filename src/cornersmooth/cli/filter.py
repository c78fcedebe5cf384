"""``cornersmooth filter``: finished NC programs in, the same with smooth runs out."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, replace
from itertools import chain
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli.command import new_command
from cornersmooth.cli.files import STANDARD, check_path, read_input, suffix_of, target_of, told_of, write_report
from cornersmooth.cli.headings import EXIT_CODES_OF_WRITERS
from cornersmooth.cli.inputs import Input, check_together, find_inputs
from cornersmooth.cli.options import LINES, Options
from cornersmooth.cli.programs import filter_form_of, how_read, show_wrong
from cornersmooth.cli.shop import command_line, loosened
from cornersmooth.cli.show import (
    INDENT,
    print_heading,
    print_line,
    print_message,
    program_text,
    say_json,
    say_line,
    warn,
)
from cornersmooth.cli.values import (
    machine_of,
    settings_of,
)
from cornersmooth.errors import CornersmoothError
from cornersmooth.output import FAILED, make_folder, open_output
from cornersmooth.verdict import Verdict

if TYPE_CHECKING:
    from cornersmooth.filter import Filtered
    from cornersmooth.filter.checking import Checked
    from cornersmooth.kinematics import Machine
    from cornersmooth.nc import Form
    from cornersmooth.nc_reader import Problem
    from cornersmooth.report import NcFile
    from cornersmooth.report.record import Kind
    from cornersmooth.report.verdict import Judgement
    from cornersmooth.settings import Settings

#: names of NC programs, for folders
PATTERNS = ("*.nc", "*.ngc", "*.mpf", "*.spf", "*.h", "*.tap", "*.cnc", "*.eia", "*.iso", "*.gcode")

#: reasons shown without -v
_SHOWN = 10


@new_command(
    "filter",
    "IN...",
    "tolerance output control machine no_tcp tip_control units form axis_length axis_tolerance directory glob reports "
    f"as_json method {LINES} limits no_verify strict force quiet verbose",
    epilog=f"{EXIT_CODES_OF_WRITERS} With several inputs: that of the worst.",
    reports="Write what was done: .json, or .html for a page to look at. May be repeated; {stem} is the input's name.",
    units="Units of a program that does not say them.",
)
def command(given: Options) -> int:
    """Smooth the cutting runs of the finished NC programs IN; every other byte stays.

    Runs of plain cuts are replaced where the state of the control is surely known. What the program does there today
    is what the new blocks stay within the tolerance of. Both programs are read again and compared. All other cuts stay
    as they are, and a table says why. - is standard input.

    \b
    Examples:
      cornersmooth filter part.ngc --control linuxcnc --machine xyzac-trt -o n.ngc
      cornersmooth filter part.mpf --control siemens -e 0.01 -o smooth.mpf
      cornersmooth filter part.nc -e 0.01 --lines long -o smooth.nc
      cornersmooth filter *.mpf --control siemens -d smooth/
      cat part.nc | cornersmooth filter - > smooth.nc
    """
    folder, output = given.directory, given.output
    check_together(given)
    form, settings = filter_form_of(given), settings_of(given)
    files = find_inputs(given, PATTERNS)
    targets = [_target(one, folder) if folder else output or STANDARD for one in files]
    if len(set(targets)) < len(targets):
        raise click.UsageError("two inputs would be written to one name; give each a -d of its own")
    reports = [[path.replace("{stem}", one.stem) for path in given.reports] for one in files]
    _check_reports(reports, given.reports)
    if given.as_json and (STANDARD in targets or len(files) != 1):
        raise click.UsageError("--json needs one input and -o FILE; --report '{stem}.json' tells of several")
    for path in (*targets, *chain.from_iterable(reports)):
        check_path(path, [one.path for one in files], force=given.force)
    if folder:
        make_folder(folder)
    worst = 0
    for one, target, own in zip(files, targets, reports, strict=True):
        try:
            worst = max(worst, _filter(one.path, target, own, form, settings, given))
        except CornersmoothError as error:
            if len(files) == 1:
                raise
            error.file = error.file or one.path
            print_message(str(error))
            worst = max(worst, error.exit_code)
    return worst


def _check_reports(reports: Sequence[Sequence[str]], given: Sequence[str]) -> None:
    """Refuse names of reports that say another form, or are the same for several inputs."""
    if wrong := [path for path in given if suffix_of(path) not in (".json", ".html")]:
        raise click.UsageError(f"--report {wrong[0]}: let the name end in .json or .html")
    paths = [*chain.from_iterable(reports)]
    if len(set(paths)) < len(paths):
        raise click.UsageError("two reports have the same name; with several inputs put {stem} into it")


def _pages(reports: Sequence[str]) -> bool:
    return any(suffix_of(path) == ".html" for path in reports)


def _write_reports(
    reports: Sequence[str],
    contents: Mapping[str, Any],
    page: Callable[[], str] | None,
) -> None:
    """Write the reports of a filtered program: JSON, and the page of its runs before and after, if any differs."""
    from cornersmooth.report import report_json

    for report in reports:
        if suffix_of(report) != ".html":
            write_report(report, [report_json(contents)])
        elif page is None:
            warn("no page is written: no run differs", report)
        else:
            write_report(report, [page()])


def _page(
    found: Filtered,
    judgement: Judgement,
    source: tuple[str, bytes],
    name: str,
    form: Form,
    settings: Settings,
    axes: Machine | None = None,
) -> Callable[[], str] | None:
    """What makes the page of the runs of a program before and after; None where no run differs."""
    from cornersmooth.filter.checking import measure
    from cornersmooth.page import verified_page

    if found.motions is None:
        return None
    motions = found.motions
    return lambda: verified_page(
        *measure(*motions, settings, os.path.basename(source[0])),
        name=name,
        control=form.table.name,
        form=form.name,
        source=source[1],
        machine=axes or form.machine,
        planner=form.table.lines.planner,
        judgement=judgement,
        origin="old program",
    )


def _target(one: Input, folder: str) -> str:
    path = os.path.join(folder, one.stem + os.path.splitext(one.path)[1])
    os.makedirs(os.path.dirname(path) or ".", exist_ok=True)
    return path


def _filter(source: str, target: str, reports: Sequence[str], form: Form, settings: Settings, given: Options) -> int:
    """Filter one program; return the exit code."""
    from cornersmooth.filter import filter_program
    from cornersmooth.report import NcFile
    from cornersmooth.report.record import planned_times
    from cornersmooth.report.verdict import Saving
    from cornersmooth.verify import useful_processes

    data, name = read_input(source)
    axes = machine_of(given.limits)
    with told_of(name):
        found = filter_program(
            data,
            form,
            settings,
            **how_read(given),
            verify=not given.no_verify,
            axes=axes,
            paths=_pages(reports),
            processes=useful_processes(),
        )
    bad = found.verdict is Verdict.FAILED or (given.strict and found.verdict is not Verdict.PASSED)
    with open_output(target_of(target), hold=bad, replace=given.force) as output:
        output.failed = bad
        output.stream.write(found.data)
    judgement = judgement_of(found, settings.tolerance)
    path = None if target == STANDARD else target + FAILED * bad
    written = NcFile.of(path, output.stream.digest, form)
    saving = None if found.seconds is None else Saving(*found.seconds, against="the program as it was")
    times = planned_times(saving, axes)
    contents = _report("filter", judgement, found.checked, (name, data), written, settings, times)
    contents["summary"] = {
        "cuts": found.cuts,
        "smoothed": found.smoothed,
        "runs": found.runs,
        "lines_in": found.lines,
        "lines_out": found.new_lines,
    }
    contents["left_as_it_is"] = [asdict(left) for left in found.left]
    page = _page(found, judgement, (name, data), os.path.basename(target), form, settings, axes)
    _write_reports(reports, contents, page)
    line = contents["verdict_text"]
    if given.as_json:
        say_json(contents)
    elif not given.quiet:
        _show(name, contents, found, given.verbose, given.units)
    elif loosened(settings.tolerance):
        print_line(f"{name}: {line}")
    return int(bad)


def verify_with_program(source: str, old: bytes, path: str, given: Options) -> int:
    """Compare an NC program with what was made of it; return the exit code of ``verify``."""
    from cornersmooth.filter import verify_programs
    from cornersmooth.report import NcFile
    from cornersmooth.report.record import sha256_of
    from cornersmooth.report.verdict import Judgement
    from cornersmooth.verify import useful_processes

    new, name = read_input(path)
    settings, form = settings_of(given), filter_form_of(given)
    found = verify_programs(
        old, new, form, settings, **how_read(given), paths=_pages(given.reports), processes=useful_processes()
    )
    checked = found.checked
    assert checked is not None
    judgement = Judgement(found.verdict, 0, 0, "", _problems(checked.wrong) or _measured(checked, settings.tolerance))
    written = replace(NcFile.of(None if path == STANDARD else path, sha256_of(new), form), form=None)
    contents = _report("verify", judgement, checked, (source, old), written, settings)
    _write_reports(given.reports, contents, _page(found, judgement, (source, old), name, form, settings))
    show_wrong(name, checked.wrong)
    if given.as_json:
        say_json(contents)
    elif loosened(settings.tolerance) or not given.quiet:
        say_line(contents["verdict_text"])
    return int(found.verdict is not Verdict.PASSED)


def _problems(wrong: Sequence[Problem]) -> str:
    return f"{len(wrong)} problem{'s' * (len(wrong) != 1)}" if wrong else ""


def _measured(found: Checked, tolerance: float) -> str:
    point = f", axis point {found.axis_point:.4g} mm" if found.axis_point == found.axis_point else ""
    return f"within {tolerance:g} mm: tip {found.tip:.4g} mm{point}"


def _show(name: str, contents: Mapping[str, Any], found: Filtered, verbose: int, given_units: str | None) -> None:
    """Print the verdict, what was measured, and what was left as it is."""
    verdict, _, what = contents["verdict_text"].partition(": ")
    print_heading(
        f"{verdict}  {program_text(contents['program'])}, {found.new_lines:,} lines from {found.lines:,} lines"
    )
    for part in (*what.split("; "), "all outside of runs is the same byte for byte"):
        print_line(INDENT + part)
    if found.checked is not None:
        show_wrong(name, found.checked.wrong)
    if found.seconds is not None:
        before, after = found.seconds
        share = 100.0 * (after / before - 1.0)
        print_line(f"{INDENT}time of the runs {after:.1f} s instead of {before:.1f} s ({share:+.1f} %)")
    if not found.units_said and given_units is None:
        warn("the program does not say its units: millimetres are taken; give --units", name)
    left = found.left if verbose else found.left[:_SHOWN]
    if left:
        print_line(f"{'left as it is':>13}  first line  reason")
    for cuts in left:
        print_line(f"{cuts.count:>13}  {cuts.line:>10}  {cuts.reason}")
    if len(left) < len(found.left):
        print_line(f"... {len(found.left) - len(left)} more reasons; -v shows them")
    if found.cuts and not found.smoothed and any("tool tip control is off" in one.reason for one in found.left):
        print_line("--tip-control says that tool tip control is on where the program begins")


def judgement_of(found: Filtered, tolerance: float) -> Judgement:
    """Give the verdict, and what it rests on."""
    from cornersmooth.report.verdict import Judgement

    what, unverified = f"{found.smoothed} of {found.cuts} cuts smoothed in {found.runs} runs", ""
    if found.checked is None:
        unverified = "it was not asked for"
        what = f"{what}; {unverified}"
    elif found.checked.wrong:
        what = f"{_problems(found.checked.wrong)}; {what}"
    elif not found.runs:
        what = f"{what}; the program is the same byte for byte"
    else:
        what = f"{what} {_measured(found.checked, tolerance)}"
    return Judgement(found.verdict, 0, 0, unverified, what)


def _report(
    kind: Kind,
    judgement: Judgement,
    checked: Checked | None,
    source: tuple[str, bytes],
    program: NcFile,
    settings: Settings,
    times: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """The report of a filtered program, or of one that was compared with the one it was made from."""
    from cornersmooth.report.record import record, sha256_of

    name, data = source
    contents = record(
        kind,
        judgement,
        source={"name": name, "sha256": sha256_of(data), "format": "nc"},
        program=program,
        settings=settings.as_dict(),
        command=command_line(),
        loosened=loosened(settings.tolerance),
        times=times,
    )
    contents["compared"] = checked and {
        "max_tip_deviation_mm": checked.tip,
        "max_axis_point_deviation_mm": checked.axis_point,
        "problem_count": len(checked.wrong),
        "problems": [{"code": one.code, "nc_line": one.nc_line, "text": one.text} for one in checked.wrong],
    }
    return contents
