"""Finished NC programs: ``cornersmooth filter``, and what ``verify``, ``time`` and others do with them."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any, Self

import click

from cornersmooth.cli import files, show
from cornersmooth.cli.options import Options
from cornersmooth.cli.shop import command_line, loosened
from cornersmooth.cli.show import more
from cornersmooth.control.program import Text, listing
from cornersmooth.errors import CornersmoothError, SettingsError, Verdict, command_text
from cornersmooth.filter import Filtered, filter_program, verify_programs
from cornersmooth.filter.checking import measure
from cornersmooth.filter.program import THREE_AXES, read_program, refuse_cl_file, refuse_no_program
from cornersmooth.filter.runs import FILTERED, ProgramReader
from cornersmooth.filter.times import Times
from cornersmooth.frame import HEAD
from cornersmooth.kinematics import Machine, with_dynamics
from cornersmooth.nc import Form
from cornersmooth.nc_reader import Problem
from cornersmooth.nc_reader.recognition import is_cl_file, names_tip_control, needs_its_control, recognise_control
from cornersmooth.report import Kind, nc_file, planned_times, record, sha256_of
from cornersmooth.report.verdict import Judgement, Saving
from cornersmooth.settings import Settings
from cornersmooth.system.output import FAILED, make_folder, open_output
from cornersmooth.verify import useful_processes

#: names of NC programs, for folders
PATTERNS = ("*.nc", "*.ngc", "*.mpf", "*.spf", "*.h", "*.tap", "*.cnc", "*.eia", "*.iso", "*.gcode")

#: controls of three axes whose finished programs have LinuxCNC's words
ALIKE = ("grbl", "grblhal", "fluidnc", "mach", "mach3", "mach4")

#: reasons shown without -v, and problems shown
_SHOWN, _WRONG_SHOWN = 10, 20


@dataclass(frozen=True)
class OldProgram:
    """A finished program, and how it is read and written."""

    data: bytes
    name: str
    given: Options  #: with the control that it looks like
    settings: Settings
    form: Form

    @classmethod
    def of(cls, data: bytes, name: str, given: Options) -> Self:
        """One with options as typed (SettingsError CS240: a control whose programs are not read as a filter)."""
        given = options_for(data, name, given)
        control = given.load_control()
        if control.dialect not in FILTERED:
            hint = f"use one of {', '.join(sorted(FILTERED))}"
            raise SettingsError("CS240", f"programs for {control.name} are not read as a filter", hint)
        return cls(data, name, given, given.settings(), given.choose_form())

    @property
    def paths(self) -> bool:
        """Whether a page shows its runs."""
        return any(files.suffix_of(path) == ".html" for path in self.given.reports)


def run_filter(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    given.settings()  # refuses wrong ones before any file is touched
    files.check_endings("report", given.reports, ".json or .html")
    jobs = files.find_inputs(given, PATTERNS)
    if given.as_json and (len(jobs) != 1 or jobs[0].target == files.STANDARD):
        raise click.UsageError("--json needs one input and -o FILE; --report '{stem}.json' tells of several")
    if len(jobs) == 1:  # what is wrong with the input comes before what is wrong with the output
        files.check_inputs(jobs[0].source)
        with files.naming(jobs[0].source):
            refuse_cl_file(files.read_head(jobs[0].source))
    for job in jobs:
        if given.directory:
            make_folder(os.path.dirname(job.target) or ".")
        for path in (job.target, *job.reports):
            files.check_path(path, [job.source], force=given.force)
    worst, words = 0, Counter[str]()
    for job in jobs:
        try:
            verdict = _filter(job, given)
            worst, words = max(worst, int(_bad(verdict, given))), words + Counter((verdict,))
        except CornersmoothError as error:
            if len(jobs) == 1:
                raise
            error.file = error.file or job.source
            show.print_message(str(error))
            worst, words = max(worst, error.exit_code), words + Counter(("error",))
    if len(jobs) > 1 and not given.quiet:
        show.print_line(f"{len(jobs)} programs: " + ", ".join(f"{count} {word}" for word, count in words.items()))
    return worst


def _bad(verdict: Verdict, given: Options) -> bool:
    """Whether a program is put aside."""
    return verdict is Verdict.FAILED or (given.strict and verdict is not Verdict.PASSED)


def _filter(job: files.Input, given: Options) -> Verdict:
    """Filter one program; return the verdict."""
    old = OldProgram.of(*files.read_input(job.source), given)
    given, axes = old.given, old.given.load_limits()
    with files.naming(old.name):
        found = filter_program(
            old.data,
            old.form,
            old.settings,
            **how_read(given),
            verify=not given.no_verify,
            axes=axes,
            paths=old.paths,
            processes=useful_processes(),
        )
    bad = _bad(found.verdict, given)
    with open_output(files.target_of(job.target), hold=bad, replace=given.force) as output:
        output.failed = bad
        output.stream.write(found.data)
    path = None if job.target == files.STANDARD else job.target + FAILED * bad
    saving = None if found.seconds is None else Saving(*found.seconds, against="the program as it was")
    contents = _reported(
        "filter",
        old,
        found,
        _judgement(found, old.settings.tolerance),
        nc_file(path, output.stream.digest, old.form),
        job.reports,
        saving,
        summary={
            "cuts": found.cuts,
            "smoothed": found.smoothed,
            "runs": found.runs,
            "lines_in": found.lines,
            "lines_out": found.new_lines,
        },
        left_as_it_is=[asdict(left) for left in found.left],
    )
    if given.as_json:
        show.say_json(contents)
    elif not given.quiet:
        _show(old.name, contents, found, given)
    elif loosened(old.settings.tolerance):
        show.print_line(f"{old.name}: {contents['verdict_text']}")
    return found.verdict


def verify_with_program(data: bytes, name: str, given: Options) -> int:
    """Compare an NC program with what was made of it; return the exit code of ``verify``."""
    new, new_name = files.read_input(given.text)
    if is_cl_file(new[:HEAD]):
        order = command_text(["cornersmooth", "verify", given.text, given.source])
        raise click.UsageError(f"{new_name} is a CL file, and the CL file comes first; write: {order}")
    old = OldProgram.of(data, name, given)
    how = {**how_read(old.given), "paths": old.paths, "processes": useful_processes()}
    with files.naming(name):
        found = verify_programs(data, new, old.form, old.settings, new_name=new_name, **how)
    assert found.checked is not None
    wrong, tolerance = found.checked.wrong, old.settings.tolerance
    judgement = Judgement(found.verdict, _to_check(found), 0, "", _problems(wrong) or _measured(found, tolerance))
    path = None if given.text == files.STANDARD else given.text
    program = nc_file(path, sha256_of(new), old.form) | {"form": None}
    contents = _reported("verify", old, found, judgement, program, given.reports)
    show_wrong(new_name, wrong)
    if given.as_json:
        show.say_json(contents)
    elif loosened(tolerance) or not given.quiet:
        show.say_line(contents["verdict_text"])
    return int(found.verdict is not Verdict.PASSED)


def _reported(
    kind: Kind,
    old: OldProgram,
    found: Filtered,
    judgement: Judgement,
    program: Mapping[str, Any],
    reports: Iterable[str],
    saving: Saving | None = None,
    **more: Any,
) -> dict[str, Any]:
    """Make the report of two programs, write it to paths, or a page of their runs."""
    axes, form, motions = old.given.load_limits(), old.form, found.motions
    contents = record(
        kind,
        judgement,
        source={"name": old.name, "sha256": sha256_of(old.data), "format": "nc"},
        program=program,
        settings=old.settings.as_dict(),
        command=command_line(),
        loosened=loosened(old.settings.tolerance),
        times=planned_times(saving, axes),
    )
    checked = found.checked
    contents["compared"] = checked and {
        "max_tip_deviation_mm": checked.tip,
        "max_axis_point_deviation_mm": checked.axis_point,
        "problem_count": len(checked.wrong),
        "problems": [{"code": one.code, "nc_line": one.nc_line, "text": one.text} for one in checked.wrong],
    }
    contents |= more

    def page() -> str:
        from cornersmooth.page import verified_page

        assert motions is not None
        return verified_page(
            *measure(*motions, old.settings, os.path.basename(old.name)),
            contents,
            machine=axes or form.machine,
            planner=form.table.lines.planner,
            origin="old program",
            runs=found.changed,
            left=[asdict(one) for one in found.left],
            saving=saving,
        )

    none = "no run differs" * (motions is None)
    files.write_reports(dict.fromkeys(reports, True), contents, page=page, no_page=none)
    return contents


def _problems(wrong: Sequence[Problem]) -> str:
    return f"{len(wrong)} problem{'s' * (len(wrong) != 1)}" if wrong else ""


def _measured(found: Filtered, tolerance: float) -> str:
    assert found.checked is not None
    tip, axis_point = found.checked.tip, found.checked.axis_point
    point = f", axis point {axis_point:.4g} mm" if axis_point == axis_point else ""
    corners, merged = found.own_tolerances
    parts = f"{tolerance:g} + {corners:g} at corners" + f" + {merged:g} where lines are merged" * bool(merged)
    own = f"; {tolerance + found.rounding:g} mm with the tolerance of the program itself ({parts})"
    more = own * bool(found.rounding)
    short, blocks, least = found.checked.short, found.checked.blocks, 1000.0 * found.block_time
    more += f"; CHECK: {short:,} of {blocks:,} blocks come faster than one in {least:g} ms" * bool(short)
    return f"within {tolerance:g} mm: tip {tip:.4g} mm{point}{more}"


def _show(name: str, contents: Mapping[str, Any], found: Filtered, given: Options) -> None:
    """Print the verdict, what was measured, and what was left as it is."""
    counts = f"{found.new_lines:,} lines from {found.lines:,} lines"
    if found.seconds is not None:
        before, after = found.seconds
        share = f"({100.0 * (after / before - 1.0):+.1f} %)"
        counts += f", {after:.1f} s instead of {before:.1f} s {share}{Saving(before, after).advice}"
    slow = bool(given.load_control().lines.planner) and given.limits is None and given.lines is None
    note = "arcs may take longer on LinuxCNC: give --limits"
    notes = [note] * (slow and 0 < found.new_lines < found.lines)
    show.print_verdict(contents, counts, [*notes, "all outside of runs is the same byte for byte"])
    if found.checked is not None:
        show_wrong(name, found.checked.wrong)
    if found.untimed is not None:
        what = f"{found.untimed.what}, so the time is not known and --limits has no effect"
        show.warn(what, f"{name}:{found.untimed.line}")
    if not found.units_said and given.units is None:
        show.warn("the program does not say its units: millimetres are taken; give --units", name)
    left = found.left if given.verbose else found.left[:_SHOWN]
    if left:
        show.print_line(f"{'left as it is':>13}  first line  reason")
    for cuts in left:
        show.print_line(f"{cuts.count:>13}  {cuts.line:>10}  {cuts.reason}")
    if len(left) < len(found.left):
        show.print_line(f"... {len(found.left) - len(left)} more reasons; -v shows them")
    if found.cuts and not found.smoothed and any("tool tip control is off" in one.reason for one in found.left):
        show.print_line("--tip-control says that tool tip control is on where the program begins")


def _judgement(found: Filtered, tolerance: float) -> Judgement:
    """Give the verdict, and what it rests on."""
    what, unverified = f"{found.smoothed} of {found.cuts} cuts smoothed in {found.runs} runs", ""
    if not found.runs:
        what = f"{what}; the program is the same byte for byte"
    elif found.checked is None:
        unverified = "it was not asked for"
        what = f"{what}; {unverified}"
    elif found.checked.wrong:
        what = f"{_problems(found.checked.wrong)}; {what}"
    else:
        what = f"{what} {_measured(found, tolerance)}"
    return Judgement(found.verdict, _to_check(found), 0, unverified, what)


def _to_check(found: Filtered) -> int:
    """Whether blocks are shorter than the control can take them."""
    return int(found.checked is not None and found.checked.short > 0)


def options_for(data: bytes, name: str, given: Options) -> Options:
    """Options for a program: the control that it looks like where none is named, no machine where nothing turns.

    Raises SettingsError CS267: no control is named, and FANUC would take the program for something else.
    """
    from cornersmooth.cli.options import recognised

    if is_cl_file(data[:HEAD]):  # who reads it will say so
        return given
    if isinstance(given.control, str) and given.control.lower() in ALIKE:  # else one of the shop settings
        if given.limits:
            show.warn(f"times are those of LinuxCNC's law: that of {given.control} is not known", name)
        given = replace(given, control="linuxcnc")
    try:
        given.load_control()
    except SettingsError as error:
        if error.code == "CS210":
            error = SettingsError("CS210", error.what, f"{error.hint}, or, read as LinuxCNC, {', '.join(ALIKE)}")
        raise error from None
    head = recognised(given, data[:HEAD])
    if head.remark:
        show.warn(head.remark, name)
    default = click.get_current_context().get_parameter_source("control") == click.core.ParameterSource.DEFAULT
    if default and not recognise_control(data[:HEAD]) and needs_its_control(data[:HEAD]):
        with files.naming(name):
            refuse_no_program(ProgramReader("fanuc", THREE_AXES).read(data))
        what = f"{name} does not say its control, and has numbers without a point or comments after a semicolon"
        raise SettingsError("CS267", what, "name it: --control grbl, mach3, linuxcnc, siemens or another")
    if head.given.machine:
        return head.given
    tip = names_tip_control(data)
    if tip is None:
        return replace(head.given, machine=THREE_AXES)
    control = head.given.load_control()
    if not any({"vector", "point"} & one.modes.keys() for one in control.forms.values()):
        what = f"the program has tip control, and {control.name} has it for rotary words alone"
        raise SettingsError("CS215", what, "name the machine of its rotary words with --machine", file=name, line=tip)
    return head.given


def how_read(given: Options) -> dict[str, Any]:
    """What is to be known of a program that it does not say."""
    return {"tip_from_start": given.tip_control, "inch": given.units == "inch"}


def axes_of(given: Options) -> Machine:
    """Machine under whose limits a program is planned."""
    axes = with_dynamics(given.load_limits() or given.load_machine())
    if axes is None:
        raise click.UsageError("programs are planned within limits of axes: name a machine with [dynamics]: --limits")
    return axes


def time_of_program(data: bytes, name: str, given: Options) -> int:
    """Say the time of a program as it is and smoothed, or beside another one; return the exit code of ``time``."""
    old = OldProgram.of(data, name, given)
    given, form, settings, axes = old.given, old.form, old.settings, axes_of(old.given)
    how = {**how_read(given), "axes": axes, "processes": useful_processes()}
    with files.naming(name):
        if given.text:
            new, new_name = files.read_input(given.text)
            found = verify_programs(data, new, form, settings, new_name=new_name, **how)
        else:
            found = filter_program(data, form, settings, verify=False, **how)
        if found.untimed is not None:
            raise found.untimed
        if found.seconds is None and not (found.checked and found.checked.wrong):  # nothing differs
            alone = Times(*read_program(data, form, settings, **how_read(given)), axes).as_it_is()
            found = replace(found, seconds=(alone, alone))
    if found.checked is not None and found.checked.wrong:
        show_wrong(given.text, found.checked.wrong)
        if {one.code for one in found.checked.wrong} <= {"CS521", "CS522"}:
            show.print_line("hint: no time is given: give -e and -H as the second program was made")
        return 1
    assert found.seconds is not None
    before, after = found.seconds
    whole = bool(form.table.lines.planner)
    contents = {
        "schema": "cornersmooth-time/1",
        "seconds": {"unsmoothed": before, "as_written": after},
        "unsmoothed": "the program as it is",
        "counted": "program" if whole else "smoothed runs",
        "cuts": found.cuts,
        "smoothed": found.smoothed,
    }
    share = f" ({100.0 * (after / before - 1.0):+.1f} %)" if before else ""
    what = "the whole program" if whole else "the runs that differ, without rapids"
    lines = (
        f"{before:>12.3f} s  {name} as it is",
        f"{after:>12.3f} s  {given.text or 'smoothed'}{share}",
        f"of {what}; {found.smoothed:,} of {found.cuts:,} cuts differ",
    )
    show.say(given, contents, lines)
    return 0


def explain_program(source: str, given: Options) -> int:
    """Show what the control does in each block of a program."""
    data, name = files.read_input(source)
    with files.naming(name):
        refuse_cl_file(data[:HEAD])
    control = given.reading_back()["control"]
    reader = ProgramReader(control, given.load_machine(), tcp=not given.no_tcp, **how_read(given))
    lines = list(listing(reader.stream(Text.of(data))))
    show.say(given, {"schema": "cornersmooth-stream/1", "name": name, "control": control, "stream": lines}, lines)
    return 0


def describe_program(data: bytes, name: str) -> dict[str, Any]:
    """Say what an NC program holds, as far as words tell that need no machine."""
    control = recognise_control(data[:HEAD])
    reading = ProgramReader(control if control in FILTERED else "fanuc", None).read(data)
    return {
        "schema": "cornersmooth-info/2",
        "name": name,
        "format": "nc",
        "looks_like": control or None,
        "lines": len(reading.why),
        "cuts": reading.cuts,
    }


def show_wrong(name: str, wrong: Sequence[Problem]) -> None:
    """Print the first problems of a program, and how many more there are."""
    for one in wrong[:_WRONG_SHOWN]:
        show.print_message(one.message(f"{name}:{one.nc_line}"))
    if len(wrong) > _WRONG_SHOWN:
        show.print_line(f"{name}: {more(len(wrong) - _WRONG_SHOWN, 'problem')}")
