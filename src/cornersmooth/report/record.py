"""What the JSON reports of all commands have in common: which files, made how, with which verdict.

``report.schema.json`` beside this module describes them. Two runs of one command make the same report, byte for byte:
nothing in it depends on the clock.
"""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterable, Mapping
from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from cornersmooth.errors import Finding
from cornersmooth.model import Move, Program
from cornersmooth.report.verdict import Judgement, Saving

if TYPE_CHECKING:
    from cornersmooth.kinematics import Machine
    from cornersmooth.nc import Form

SCHEMA = "cornersmooth-report/2"

Kind = Literal["smooth", "verify", "filter"]


@dataclass(frozen=True)
class NcFile:
    """The NC program that a report is about."""

    name: str | None  #: As the caller named it; None for a stream.
    sha256: str | None
    control: str
    form: str | None  #: none where a program does not name it
    machine: str | None  #: none without rotary words
    tcp: bool  #: whether the control keeps the tool tip

    @classmethod
    def of(cls, name: str | None, sha256: str, form: Form) -> NcFile:
        """A program of a form."""
        machine = form.machine.name if form.machine is not None and form.rotary else None
        return cls(name, sha256, form.control, form.name, machine, form.orientation != "machine")


def record(
    kind: Kind,
    judgement: Judgement,
    *,
    source: Mapping[str, Any],
    program: NcFile | None,
    settings: Mapping[str, Any],
    findings: Iterable[Finding] = (),
    command: str = "",
    loosened: str = "",
    times: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Begin a report of a command on its input, as `cl_file` gives it, and the program that was written, if any.

    Names of settings end with their unit. `loosened` says what settings made looser than the default, `times` is as
    `planned_times` gives them.
    """
    from cornersmooth import __version__

    text = "; ".join(filter(None, (judgement.text, loosened)))
    return {
        "schema": SCHEMA,
        "kind": kind,
        **judgement.as_dict(),
        "verdict_text": text,
        "not_verified": judgement.unverified,
        "made_by": {"name": "cornersmooth", "version": __version__, "command": command or None},
        "input": dict(source),
        "program": None if program is None else asdict(program),
        "settings": dict(settings),
        "times": None if times is None else dict(times),
        "findings": findings_table(findings),
    }


def cl_file(program: Program) -> dict[str, Any]:
    """The CL file that a program was read from."""
    source = program.source
    alone = {"operation": {"number": source.operation, "name": source.operation_name}} if source.operation else {}
    return {
        "name": source.name,
        "sha256": source.sha256 or None,
        "format": source.format,
        "dialect": source.dialect,
        **alone,
        "units": program.units,
        "poses": len(program),
        "feed_moves": int(np.isin(program.kind, (Move.LINEAR, Move.ARC)).sum()),
        "statements": len(program.statements),
        "chains": len(program.chains),
    }


def sha256_of(text: bytes | str | os.PathLike[str]) -> str:
    """SHA-256 of bytes, or of the file of that path, in hexadecimal digits."""
    if isinstance(text, bytes):
        return hashlib.sha256(text).hexdigest()
    with open(text, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def planned_times(saving: Saving | None, machine: Machine | None) -> dict[str, Any] | None:
    """Planned times, s, and the machine whose limits hold; None where nothing was planned."""
    if saving is None:
        return None
    return {
        "limits": None if machine is None else machine.name,
        "unsmoothed_s": saving.direct,
        "unsmoothed": saving.against or "lines of the CL file",
        "written_s": saving.written,
        "limited_by": [{"limit": name, "share_of_cutting_time": share} for name, share in saving.limits],
    }


def findings_table(findings: Iterable[Finding]) -> list[dict[str, Any]]:
    """Findings as plain values."""
    return [{**asdict(finding), "to_check": finding.to_check} for finding in findings]


def report_json(contents: Mapping[str, Any]) -> str:
    """Contents as JSON with a final line end; numbers that JSON has no word for (NaN, infinity) become null."""
    return json.dumps(_plain(contents), indent=1, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    return value
