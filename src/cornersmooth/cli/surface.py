"""``cornersmooth surface``: what smoothing does to the metal."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import click

from cornersmooth.cli.command import new_command
from cornersmooth.cli.files import STANDARD, check_inputs, check_reports, read_input, suffix_of, write_report
from cornersmooth.cli.options import READING
from cornersmooth.cli.show import say
from cornersmooth.cli.values import Given
from cornersmooth.errors import SettingsError
from cornersmooth.verdict import Verdict

if TYPE_CHECKING:
    from cornersmooth.model import Program
    from cornersmooth.surface import SurfaceMap, Tool


@new_command(
    "surface",
    "IN NC",
    f"tolerance axis_length tool stations levels control machine no_tcp {READING} reports as_json force quiet",
    epilog="Exit codes: 0 the surface is within the tolerance; 1 it is not; 2 wrong usage or configuration; 3 an input "
    "cannot be read or is not valid; 4 output cannot be written.",
    reports="Write what was found: .json, .csv for a row per point, .html, or a map: .png, .svg, .pdf. May be "
    "repeated.",
)
def command(given: Given) -> int:
    """Measure the surface that the NC program NC leaves against that of the CL file IN.

    Points are taken on the envelope of the original motion of the tool, up to the length of its cutting edge (-H). At
    each the distance to the volume that the written motion sweeps says whether metal is cut below the surface (overcut)
    or left on it (undercut). The tool is that of the file (CUTTER, TLDATA) or of --tool.

    \b
    Examples:
      cornersmooth surface part.cls part.nc -e 0.04 -H 12
      cornersmooth surface part.cls part.nc --tool 10,5 --report map.html
      cornersmooth surface part.cls part.nc --tool 12,0,3 --report points.csv
    """
    from cornersmooth.cl import read
    from cornersmooth.nc_reader import read_nc
    from cornersmooth.report.surface import surface_lines
    from cornersmooth.surface import measure_surface

    source, text = given.source, given.text
    if source == text == STANDARD:
        raise click.UsageError("only one of the inputs can be standard input")
    check_inputs(source, text)
    check_reports(given.reports, ".json, .csv, .html, .png, .svg, .pdf", [source, text], force=given.force)
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
    for path in given.reports:
        write_report(path, _report(suffix_of(path), program, data, written, nc, found, given))
    first = f"{Verdict.of(problems=not found.kept)}: the surface is {'' if found.kept else 'not '}within the tolerance"
    say(given, found.as_dict(), (first, *surface_lines(found)), indent=18)
    return 0 if found.kept else 1


def _tool(program: Program, asked: Tool | None) -> Tool:
    """The tool of the option, or the only one of the file."""
    from cornersmooth.surface import tools_of

    if asked is not None:
        return asked
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


def _report(
    form: str, program: Program, source: bytes, written: bytes | str, nc: Any, found: SurfaceMap, given: Given
) -> Iterator[str | bytes]:
    from cornersmooth.report import report_json
    from cornersmooth.report.surface import draw_surface, surface_csv

    if form == ".json":
        yield report_json(found.as_dict())
    elif form == ".csv":
        yield from surface_csv(found)
    elif form == ".html":
        from cornersmooth.page import verified_page
        from cornersmooth.verify import verify

        how = {"tolerance": given.tolerance, "axis_length": given.axis_length, **given.reading_back()}
        checked = verify(program, written, **how)
        name, control = written if isinstance(written, str) else "", given.load_control().name
        yield verified_page(program, nc, checked, name=name, control=control, source=source, surface=found)
    else:
        yield draw_surface(found, form[1:])
