"""Options about what is written where, and what is said."""

from __future__ import annotations

from cornersmooth.cli.headings import Decorator, flag, option
from cornersmooth.cli.options.parameters import PATH, Jobs

output = option(
    "Everyday", "-o", "--output", type=PATH, help="NC file, - for standard output. [default: - for a single input]"
)
directory = option(
    "Batches",
    "-d",
    "--directory",
    type=PATH,
    help="Folder for the NC files of several inputs, made where missing; folders below an input stay folders.",
)
glob = option(
    "Batches",
    "--glob",
    metavar="PATTERN",
    multiple=True,
    help="Files to take from folders, as in '*.cls'. May be repeated. [default: names of CL files]",
)
skip_existing = flag(
    "Batches", "--skip-existing", help="Leave outputs that exist as they are, whatever they were made of."
)
summary = option("Batches", "--summary", type=PATH, help="Write a row for each file of a batch: .json or .csv.")
jobs = option(
    "Batches",
    "-j",
    "--jobs",
    type=Jobs(),
    default=1,
    is_flag=False,
    flag_value=0,
    help="Processes for several inputs; a bare -j takes all cores. [default: 1]",
)
scheduler = option(
    "Batches",
    "--scheduler",
    metavar="ADDRESS|FILE",
    help="Have a Dask cluster do the files of a batch: tcp://HOST:8786, or the scheduler's file. See docs/batch.md.",
)


def _reports(text: str) -> Decorator:
    return option("Everyday", "--report", "reports", type=PATH, multiple=True, help=text)


reports = _reports(
    "Write a report; .json, .csv or .html (a page to look at) decides the form. May be repeated; {stem} is "
    "the input's name."
)
json_reports = _reports(
    "Write what was done: .json, or .html for a page to look at. May be repeated; {stem} is the input's name."
)
found_reports = _reports(
    "Write what was found: .json for the results, .csv for a row per pose, .html for a page to look at. May be "
    "repeated."
)
page_reports = _reports("Write a page to look at: .html. May be repeated.")
surface_reports = _reports(
    "Write what was found: .json, .csv for a row per point, .html, or a map: .png, .svg, .pdf. May be repeated."
)
as_json = flag("Output", "--json", "as_json", help="One JSON object instead of lines to read.")
table = flag("Output", "--table", help="Print the table of the name: what a TOML file of your own starts from.")
force = flag("Everyday", "--force", help="Replace existing files.")
quiet = flag("Output", "-q", "--quiet", help="Only errors.")
verbose = option("Output", "-v", "--verbose", count=True, help="More: every finding, times of the stages.")
verbose_found = option(
    "Output",
    "-v",
    "--verbose",
    count=True,
    help="More: every problem, and how large deviations are and where along the path.",
)
