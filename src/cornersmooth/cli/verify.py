"""``cornersmooth verify`` and ``surface``: an NC program against the CL file, in its motion or in the metal."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import replace
from functools import partial

import click

from cornersmooth.cl import read
from cornersmooth.cli import files
from cornersmooth.cli.options import Options, take_head
from cornersmooth.cli.shop import command_line, loosened
from cornersmooth.cli.show import more, print_line, print_message, say, say_json, say_line, show_findings, warn
from cornersmooth.control.source import readable_twice
from cornersmooth.errors import SettingsError, Verdict
from cornersmooth.geometry.tool import Tool, tools_of
from cornersmooth.model import Program
from cornersmooth.nc import own_words
from cornersmooth.nc_reader import read_nc
from cornersmooth.report import cl_file, findings_table, record, sha256_of
from cornersmooth.report.tables import verification_csv
from cornersmooth.report.verdict import judge, trusted_blocks
from cornersmooth.system.processes import return_large_arrays
from cornersmooth.verify import Verification, Where, useful_processes, verify
from cornersmooth.verify.task import APART, length_of

#: problems shown without -v
_PROBLEMS_SHOWN = 20

#: rewinds shown
_REWINDS_SHOWN = 5


def run_verify(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    files.check_pair(given)
    return_large_arrays()
    text = given.text
    data, name, is_program = given.read()
    if is_program:
        from cornersmooth.cli.filter import verify_with_program

        return verify_with_program(data, name, given)
    nc: bytes | str | os.PathLike[str] = files.read_input(text)[0] if text == files.STANDARD else text
    head = take_head(given, nc, data)
    given = head.given
    given.check_axis()
    if given.work_offset not in (None, "none"):
        raise click.UsageError(
            "--work-offset takes 'none' here: any other is read from the program. To change it, write the program with "
            "'smooth --work-offset'"
        )
    control, reader = given.load_control(), given.reading_back()
    machine = reader["machine"]
    measures = {name: getattr(given, name) for name in ("tolerance", "axis_length", "axis_tolerance")}
    program = read(data, name=name, **given.reading())
    if given.reports or given.as_json:  # it is looked at more than once
        nc = readable_twice(nc)
    trusted = [line for path in given.trusted for line in files.read_lines(path)]
    if given.work_offset:
        trusted.append("work offset")
    if head.remark:  # first: what follows may be hard to understand without it
        warn(head.remark, text)
    found = verify(
        program,
        nc,
        **measures,
        **reader,
        trusted=(*own_words(control), *trusted),
        accepted=control.trusted,
        weights=head.weights,
        slower=given.slower,
        skip_cycles=given.skip_cycles,
        processes=useful_processes(),
    )
    found = replace(found, taken_from_head=head.taken).not_verified(*head.loose)
    if head.problem is not None:
        found = found.with_problem(head.problem)
    findings = (*program.findings, *trusted_blocks(found))
    loose = loosened(given.tolerance)
    contents = record(
        "verify",
        judge(found, findings),
        source=cl_file(program),
        program={
            "name": None if text == files.STANDARD else text,
            "sha256": sha256_of(nc) if isinstance(nc, bytes) or os.path.isfile(nc) else None,
            "control": control.name,
            "form": head.form,
            "machine": None if machine is None else machine.name,
            "tcp": not given.no_tcp,
        },
        settings={
            "tolerance_mm": given.tolerance,
            "axis_length_mm": given.axis_length,
            "axis_tolerance_deg": given.axis_tolerance,
        },
        findings=findings,
        command=command_line(),
        loosened=loose,
    )
    contents["verification"] = found.to_dict()

    def page() -> str:
        from cornersmooth.page import verified_page

        own = given.axis_tolerance
        length = given.axis_length if own is None else length_of(given.tolerance, own)
        return verified_page(
            program,
            read_nc(nc, **reader, tolerance=given.tolerance, axis_length=length),
            found,
            contents,
            machine=machine,
            planner=control.lines.planner,
            tool=given.tool,
        )

    reports, table = dict.fromkeys(given.reports, True), partial(verification_csv, program, found)
    files.write_reports(reports, contents, table=table, page=page, no_page=files.STILL * (not found.elements))
    for line in _problems(found, name, "<stdin>" if text == files.STANDARD else text, given.verbose):
        print_message(line)
    verdict = contents["verdict_text"]
    if given.as_json:
        say_json(contents)
    elif given.quiet:
        if loose or found.verdict not in (Verdict.PASSED, Verdict.FAILED):
            print_line(f"{text}: {verdict}")
    else:
        show_findings(name, findings_table(findings), given.verbose)
        say_line(verdict)
        for line in _summary(found):
            say_line(line, indent=18)
    taken = (Verdict.PASSED,) if given.strict else (Verdict.PASSED, Verdict.INCOMPLETE)
    return 0 if found.verdict in taken else 1


def _problems(found: Verification, name: str, text: str, verbose: int) -> Iterator[str]:
    """Problems with the place to edit first: that in the text, or in the CL file where the text has none."""
    shown = found.problems if verbose else found.problems[:_PROBLEMS_SHOWN]
    for problem in shown:
        cl = f"CL line {problem.cl_line}" if problem.cl_line else ""
        if problem.nc_line:
            yield problem.message(f"{text}:{problem.nc_line}", cl)
        else:
            yield problem.message(f"{name}:{problem.cl_line}" if cl else text)
    if found.problem_count > len(shown):
        rest = more(found.problem_count - len(shown), "problem")
        yield f"{text}: {rest}; -v shows more, a JSON report lists them"


def _summary(found: Verification) -> Iterator[str]:
    """Label and text of everything measured."""
    if found.taken_from_head:
        yield f"{'from the head':<18}{' '.join(found.taken_from_head)}"
    own_axis = found.axis_tolerance is not None
    second = f"tool axis {found.axis_tolerance:g} deg" if own_axis else f"axis point at {found.axis_length:g} mm"
    yield f"{'tolerance':<18}{found.tolerance:g} mm, {second}"
    one, both = found.tolerance, (APART if found.apart else 1.0) * found.tolerance
    yield f"{'tip':<18}{_place(found.tip, 'mm', one)}"
    if not own_axis:
        yield f"{'axis point':<18}{_place(found.axis_point, 'mm', one)}"
    yield f"{'tool axis':<18}{_place(found.orientation, 'deg', found.axis_tolerance)}"
    if not own_axis:
        yield f"{'common pose':<18}tip {_place(found.together_tip, 'mm', both)}"
        yield f"{'':<18}axis point {_place(found.together_axis_point, 'mm', both)}"
        if found.apart:
            yield f"{'':<18}tip and axis point each keep the tolerance, but not at common poses"
    yield f"{'tangent jump':<18}{_place(found.tangent_jump, 'deg')}"
    for out, back in found.rewinds[:_REWINDS_SHOWN]:
        yield f"{'rewind':<18}the cut is left at NC line {out}, and gone on with at NC line {back}"
    if len(found.rewinds) > _REWINDS_SHOWN:
        yield f"{'':<18}{more(len(found.rewinds) - _REWINDS_SHOWN, 'rewind')}"
    least = f", shortest move {_place(found.shortest, 'mm')}" if found.shortest.nc_line else ""
    yield f"{'blocks':<18}{found.blocks}{least}"


def _place(where: Where, unit: str, limit: float | None = None) -> str:
    """Value, the limit that it has, and where it is."""
    allowed = f" (limit {limit:g})" if limit is not None else ""
    lines = f" at CL line {where.cl_line}, NC line {where.nc_line}" if where.nc_line else ""
    return f"{where.value:.6g} {unit}{allowed}{lines}"


def run_surface(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    from cornersmooth.report.tables import surface_csv, surface_lines
    from cornersmooth.surface import measure_surface

    files.check_pair(given)
    source, text = given.source, given.text
    how = given.reading_back()
    data, name = files.read_input(source, size_limit=not given.no_size_limit)
    program = read(data, name=name, **given.reading())
    tool = _tool(program, given.tool)
    written = files.read_input(text)[0] if text == files.STANDARD else text
    nc = read_nc(written, tolerance=given.tolerance, axis_length=given.axis_length, **how)
    found = measure_surface(
        program,
        nc,
        tool,
        tolerance=given.tolerance,
        edge=given.axis_length,
        levels=given.levels,
        stations=given.stations,
    )

    def page() -> str:
        from cornersmooth.page import verified_page

        checked = verify(program, written, tolerance=given.tolerance, axis_length=given.axis_length, **how)
        findings = (*program.findings, *trusted_blocks(checked))
        file = {"name": written if isinstance(written, str) else None, "control": given.load_control().name}
        judged = judge(checked, findings)
        contents = record("verify", judged, source=cl_file(program), program=file, settings={}, findings=findings)
        return verified_page(program, nc, checked, contents, surface=found)

    reports, table = dict.fromkeys(given.reports, True), partial(surface_csv, found)
    files.write_reports(reports, found.as_dict(), table=table, page=page, no_page=files.STILL * (not len(nc)))
    first = f"{Verdict.of(problems=not found.kept)}: the surface is {'' if found.kept else 'not '}within the tolerance"
    say(given, found.as_dict(), (first, *surface_lines(found)), indent=18)
    return 0 if found.kept else 1


def _tool(program: Program, chosen: Tool | None) -> Tool:
    """The tool of the option, or the only one of the file."""
    if chosen is not None:
        return chosen
    tools = tools_of(program)
    distinct = list({tool: line for _, tool, line in tools}.items())
    if len(distinct) == 1:
        return distinct[0][0]
    what = "the file describes no tool"
    if distinct:
        what = "the file has tools of several shapes: " + ", ".join(
            f"{tool.describe()} (line {line})" for tool, line in distinct[:4]
        )
    raise SettingsError("CS272", what, "say the tool's shape, as in --tool 10,5", file=program.source.name)
