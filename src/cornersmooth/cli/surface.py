"""``cornersmooth surface``: what smoothing does to the metal."""

from __future__ import annotations

from functools import partial

from cornersmooth.cl import read
from cornersmooth.cli.files import STANDARD, check_pair, read_input, write_reports
from cornersmooth.cli.options import Options
from cornersmooth.cli.show import say
from cornersmooth.errors import SettingsError, Verdict
from cornersmooth.geometry.tool import Tool, tools_of
from cornersmooth.model import Program
from cornersmooth.nc_reader import read_nc
from cornersmooth.report import NcFile
from cornersmooth.report.record import cl_file, record
from cornersmooth.report.tables import surface_csv, surface_lines
from cornersmooth.report.verdict import judge, trusted_blocks
from cornersmooth.surface import measure_surface
from cornersmooth.verify import verify


def run_surface(given: Options) -> int:
    """Do the work of the command; return its exit code."""
    check_pair(given)
    source, text = given.source, given.text
    how = given.reading_back()
    data, name = read_input(source, size_limit=not given.no_size_limit)
    program = read(data, name=name, **given.reading())
    tool = _tool(program, given.tool)
    written = read_input(text)[0] if text == STANDARD else text
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
        file = NcFile(written if isinstance(written, str) else None, None, given.load_control().name, None, None, True)
        judged = judge(checked, findings)
        contents = record("verify", judged, source=cl_file(program), program=file, settings={}, findings=findings)
        return verified_page(program, nc, checked, contents, surface=found)

    write_reports(dict.fromkeys(given.reports, True), found.as_dict(), table=partial(surface_csv, found), page=page)
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
