"""Writes programs for a control, reads the text back strictly and measures it against the CL path."""

from __future__ import annotations

import io
from dataclasses import replace
from itertools import pairwise

import numpy as np

from cornersmooth.cl import read
from cornersmooth.model import Move, Program, SmoothProgram
from cornersmooth.nc import Form, Frame, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from nc.cases import Case
from nc.grammars import reader
from oracle.chains import AXIS_DECIMALS, Chain, cl_text, random_chains
from oracle.judge import Verdict, judge
from oracle.library import original_motion
from oracle.motion import Original, unit


def written(program: Program, form: Form, settings: Settings) -> tuple[str, SmoothProgram]:
    """NC text whose blocks are counted as they stand in it, and what it was made of."""
    stream = io.BytesIO()
    with np.errstate(all="raise", under="ignore"):
        smoothed = smooth(program, fit_settings(settings, form, program.units))
        found = write(smoothed, stream, form=form, frame=Frame(skip_cycles=True))
    text = stream.getvalue().decode("ascii")
    assert found.blocks == sum(not line.endswith(" ~") for line in text.splitlines())
    return text, smoothed


def verdict(program: Program, originals: list[Original], case: Case, form: Form, settings: Settings) -> Verdict:
    """How far the motion that the control makes of the text is from the runs of the original."""
    text, _ = written(program, form, settings)
    found = reader(case.control, case.form, case.machine, case.tcp, program.units).read(
        text, settings.axis_length, settings.tolerance
    )
    return judge(found.runs(settings.axis_length), originals, settings.axis_length, settings.tolerance)


# ------------------------------------------------------------------------------------------------ random chains


def tame(chain: Chain, machine: str) -> Chain:
    """Chain with axes that the machine can reach, still through the pole and with large steps."""
    if not machine:
        return chain
    x, y, z = chain.axis.T
    flatter = 0.25 if machine.endswith("trt") else 1.0
    axis = unit(np.stack((flatter * x, flatter * y, np.abs(z) + 0.2), axis=1))
    return replace(chain, axis=np.round(axis, AXIS_DECIMALS))


def upright(chain: Chain) -> Chain:
    """Chain with the tool parallel to Z."""
    return replace(chain, axis=np.broadcast_to((0.0, 0.0, 1.0), chain.axis.shape))


def random_verdict(case: Case, settings: Settings, seed: int, count: int = 48, units: str = "mm") -> Verdict:
    """Verdict on random chains of every character."""
    form = case.choose()
    chains = [
        upright(chain) if form.orientation == "fixed" else tame(chain, case.machine)
        for chain in random_chains(seed, count, corners=4)
    ]
    text = cl_text(chains)[0]
    if units == "inch":
        text = text.replace(b"UNITS/MM", b"UNITS/INCHES").replace(b"MMPM", b"IPM")
    program = read(text, name="chains.cls")
    scale = program.mm_per_unit
    originals = [
        Original(scale * chain.tip, unit(chain.axis))
        for chain in chains
        if np.ptp(chain.tip, axis=0).any() or np.ptp(chain.axis, axis=0).any()
    ]
    return verdict(program, originals, case, form, settings)


# ------------------------------------------------------------------------------------------------ real files


def without_holes(program: Program) -> Program:
    """Program without the positions of hole cycles, whose moves are the cycle's and not the file's."""
    kept = np.flatnonzero(program.kind != Move.HOLE)
    if len(kept) == len(program):
        return program
    new = np.cumsum(program.kind != Move.HOLE)
    return replace(
        program,
        **{name: getattr(program, name)[kept] for name in ("tip", "axis", "kind", "feed", "line", "feed_mode", "keep")},
        arcs=replace(program.arcs, pose=new[program.arcs.pose] - 1),
        statements=tuple(
            replace(one, pose=int(new[one.pose - 1]) if one.pose else 0)
            for one in program.statements
            if one.word != "CYCLE"
        ),
    )


def runs_of(program: Program, limit: float) -> list[Original]:
    """Feed motion between rapids."""
    cuts = [*np.flatnonzero(program.kind == Move.RAPID).tolist(), len(program)]
    runs = []
    for begin, end in pairwise([0, *cuts] if cuts[0] else cuts):
        part = np.arange(begin, end)
        if (program.kind[part] == Move.FROM).all():
            continue
        arcs = np.flatnonzero((program.arcs.pose > begin) & (program.arcs.pose < end))
        run = original_motion(
            replace(
                program,
                **{name: getattr(program, name)[part] for name in ("tip", "axis", "kind", "feed", "line")},
                **{name: getattr(program, name)[part] for name in ("feed_mode", "keep")},
                arcs=replace(
                    program.arcs,
                    pose=program.arcs.pose[arcs] - begin,
                    **{name: getattr(program.arcs, name)[arcs] for name in ("centre", "normal", "sweep")},
                ),
                statements=(),
            ),
            limit,
        )
        if len(run) > 1 and (np.ptp(run.tip, axis=0).any() or np.ptp(run.axis, axis=0).any()):
            runs.append(run)
    return runs
