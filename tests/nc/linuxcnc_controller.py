"""Runs our text on LinuxCNC's whole controller, without a display, and measures where its servo loop sends the axes.

    python tests/nc/linuxcnc_controller.py samples/impeller.cls -e 0.01

The interpreter, the trajectory planner with its blending, and the kinematics are LinuxCNC's; nothing but the machine is
missing. In every servo cycle the commands to the five motors are recorded; tip and axis are computed from them by the
formulas of trtfuncs.c and compared with the CL file. Debian: ``apt-get install --no-install-recommends
linuxcnc-uspace``. Exit code 0 if the program ran to its end, and the tip stayed within the tolerance and what G64 adds
to it (the axis point within twice of that: G64 bounds the linear axes only), 1 if not.
"""

from __future__ import annotations

import argparse
import fcntl
import io
import os
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from cornersmooth.cl import read
from cornersmooth.kinematics import load_machine
from cornersmooth.model import Program, rapid_moves
from cornersmooth.nc import choose_form, fit_settings, write
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth

Floats = NDArray[np.float64]

#: LinuxCNC's modules belong to Debian's Python
DEBIAN_PYTHON = "/usr/bin/python3"
#: rtapi refuses to run as root: this user does it then
USER = "nobody"
#: ours of the machine, and what LinuxCNC's configuration of it says too
MACHINE, KINEMATICS, AXES = "xyzac-trt", "xyzac-trt-kins", "XYZAC"
#: as LinuxCNC's own configurations have it: it starts without tip control, and M428 and M429 switch it
IDENTITY_FIRST = f"{KINEMATICS} sparm=identityfirst"
#: what the control needs for that, as a part of its INI; `write_remaps` writes the subroutines
REMAPS = """SUBROUTINE_PATH = {folder}
REMAP = M428 modalgroup=10 ngc=428remap
REMAP = M429 modalgroup=10 ngc=429remap
"""
SERVO_SECONDS = 0.001
#: mm/s
FASTEST = 500
#: velocity and acceleration of linear and rotary axes, mm or degrees, and seconds
LINEAR, ROTARY = (FASTEST, 3000.0), (360.0, 3000.0)
#: those of a machine of a usual size, for comparisons of time
STATED = {
    **dict.fromkeys("XYZ", (FASTEST, 1000.0)),
    "A": (120.0, 400.0),
    "C": (180.0, 500.0),
}
#: G64's tolerance over that of the smoothing, as the table of the control writes it
BLEND = 0.1
#: distance of the points that the original motion is sampled at, mm
STEP = 0.01
#: motion.motion-type of rapids and feed moves
TRAVERSING, FEEDING = 1, 2
#: mm from the zero of the part up to where retracts go
HEIGHT = 300.0
#: degrees from which on a tool counts as tilted, and mm that a rapid may be beside one of the CL file
LEAST_TILT, ASIDE = 1.0, 0.05

INI = """[EMC]
VERSION = 1.1
MACHINE = headless
[DISPLAY]
DISPLAY = {folder}/drive.py
[RS274NGC]
PARAMETER_FILE = {folder}/linuxcnc.var
{remaps}[KINS]
KINEMATICS = {kinematics}
JOINTS = 5
[HAL]
HALFILE = {folder}/headless.hal
[TRAJ]
COORDINATES = X Y Z A C
LINEAR_UNITS = mm
ANGULAR_UNITS = deg
DEFAULT_LINEAR_VELOCITY = 50
MAX_LINEAR_VELOCITY = {fastest}
DEFAULT_LINEAR_ACCELERATION = {acceleration:g}
MAX_LINEAR_ACCELERATION = {acceleration:g}
[EMCMOT]
EMCMOT = motmod
SERVO_PERIOD = {period:.0f}
COMM_TIMEOUT = 1
[TASK]
TASK = milltask
CYCLE_TIME = 0.002
[EMCIO]
EMCIO = io
CYCLE_TIME = 0.1
TOOL_TABLE = {folder}/tool.tbl
"""
AXIS = """[AXIS_{letter}]
MIN_LIMIT = {low:g}
MAX_LIMIT = {high:g}
MAX_VELOCITY = {velocity:g}
MAX_ACCELERATION = {acceleration:g}
[JOINT_{joint}]
TYPE = {kind}
HOME = 0
HOME_SEARCH_VEL = 0
HOME_SEQUENCE = 0
MIN_LIMIT = {low:g}
MAX_LIMIT = {high:g}
MAX_VELOCITY = {velocity:g}
MAX_ACCELERATION = {acceleration:g}
"""
HAL = """loadrt {identity_first}
loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS
loadrt sampler depth=65536 cfg=fffffs
addf motion-command-handler servo-thread
addf motion-controller servo-thread
addf sampler.0 servo-thread
net j0 joint.0.motor-pos-cmd => joint.0.motor-pos-fb sampler.0.pin.0
net j1 joint.1.motor-pos-cmd => joint.1.motor-pos-fb sampler.0.pin.1
net j2 joint.2.motor-pos-cmd => joint.2.motor-pos-fb sampler.0.pin.2
net j3 joint.3.motor-pos-cmd => joint.3.motor-pos-fb sampler.0.pin.3
net j4 joint.4.motor-pos-cmd => joint.4.motor-pos-fb sampler.0.pin.4
net kind motion.motion-type => sampler.0.pin.5
net speed spindle.0.speed-out-rps => spindle.0.speed-in
net kinstype-select motion.analog-out-03 => motion.switchkins-type
setp {kinematics}.y-offset 0
setp {kinematics}.z-offset 0
net stop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in
net prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared
net change iocontrol.0.tool-change => iocontrol.0.tool-changed
"""
DRIVE = """#!{python}
import linuxcnc, subprocess, sys, time

folder = {folder!r}


def ready(condition, seconds):
    end = time.time() + seconds
    while time.time() < end:
        status.poll()
        if condition():
            return
        report()
        time.sleep(0.02)
    finish("timed out")


def report():
    while (message := errors.poll()) is not None:
        if message[0] in (linuxcnc.NML_ERROR, linuxcnc.OPERATOR_ERROR):
            finish("error: " + str(message[1]))


def finish(word):
    time.sleep(0.5)
    sampler.terminate()
    sampler.wait()
    open(folder + "/result.txt", "w").write(word)
    sys.exit(0)


sampler = subprocess.Popen(["halsampler", "-t"], stdout=open(folder + "/samples.txt", "w"))
time.sleep(1)
command, status, errors = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
command.state(linuxcnc.STATE_ESTOP_RESET)
command.wait_complete()
command.state(linuxcnc.STATE_ON)
command.wait_complete()
for joint in range(5):
    command.home(joint)
    command.wait_complete()
ready(lambda: all(status.homed[:5]), 10)
command.teleop_enable(1)
command.wait_complete()
command.mode(linuxcnc.MODE_AUTO)
command.wait_complete()
command.set_optional_stop(False)
command.wait_complete()
command.program_open(folder + "/program.ngc")
command.wait_complete()
command.auto(linuxcnc.AUTO_RUN, 0)
ready(lambda: status.interp_state != linuxcnc.INTERP_IDLE, 10)
ready(lambda: status.interp_state == linuxcnc.INTERP_IDLE and status.inpos, {seconds})
report()
finish("done")
"""


Dynamics = Mapping[str, tuple[float, float]]


def write_configuration(
    folder: Path, text: bytes, seconds: float, dynamics: Dynamics | None = None, height: float = 0.0
) -> None:
    """Everything that the controller reads.

    Parameters
    ----------
    dynamics : mapping
        How fast each axis may go and speed up.
    height : float, mm
        Of the machine's zero of Z, where retracts go to, above the zero of the part.
    """
    dynamics = dynamics or {**dict.fromkeys("XYZ", LINEAR), **dict.fromkeys("AC", ROTARY)}
    ini = INI.format(
        folder=folder,
        kinematics=IDENTITY_FIRST,
        remaps=REMAPS.format(folder=folder),
        period=SERVO_SECONDS * 1e9,
        fastest=FASTEST,
        acceleration=dynamics["X"][1],
    )
    limits = dict(zip(load_machine(MACHINE).names, load_machine(MACHINE).limits.tolist(), strict=True))
    for joint, letter in enumerate(AXES):
        low, high = limits.get(letter, (-2000.0, 2000.0))
        velocity, acceleration = dynamics[letter]
        ini += AXIS.format(
            letter=letter,
            joint=joint,
            kind="ANGULAR" if letter in limits else "LINEAR",
            low=low,
            high=high,
            velocity=velocity,
            acceleration=acceleration,
        )
    (folder / "headless.ini").write_text(ini)
    (folder / "headless.hal").write_text(HAL.format(kinematics=KINEMATICS, identity_first=IDENTITY_FIRST))
    write_remaps(folder)
    (folder / "tool.tbl").write_text("".join(f"T{number} P{number} Z0 D1\n" for number in range(1, 60)))
    offsets = {**dict.fromkeys((5161, 5210, 5220, 5221, 5390), 0.0), 5223: -height}
    (folder / "linuxcnc.var").write_text("".join(f"{number} {value:g}\n" for number, value in sorted(offsets.items())))
    (folder / "program.ngc").write_bytes(text)
    drive = folder / "drive.py"
    drive.write_text(DRIVE.format(python=DEBIAN_PYTHON, folder=str(folder), seconds=seconds))
    drive.chmod(0o755)


def write_remaps(folder: Path) -> None:
    """Subroutines of M428, which switches tip control on, and M429, as those of LinuxCNC's configurations do."""
    for number, kind in ((428, 1), (429, 0)):
        name = f"{number}remap"
        (folder / f"{name}.ngc").write_text(f"o<{name}> sub\nM68 E3 Q{kind}\nM66 E0 L0\no<{name}> endsub\nM2\n")


def run_controller(text: bytes, seconds: float, dynamics: Dynamics | None = None) -> tuple[str, Floats, float]:
    """What became of a program, the commands to the motors while it fed (m, 5), and the seconds of motion."""
    word, samples = run_samples(text, seconds, dynamics)
    moving = samples[samples[:, 5] != 0]
    return word, samples[samples[:, 5] == FEEDING, :5], len(moving) * SERVO_SECONDS


def run_samples(
    text: bytes, seconds: float, dynamics: Dynamics | None = None, height: float = 0.0
) -> tuple[str, Floats]:
    """What became of a program, and every servo cycle: commands to the motors and the kind of motion (m, 6)."""
    with one_at_a_time(), tempfile.TemporaryDirectory(prefix="linuxcnc-") as name:
        folder = Path(name)
        write_configuration(folder, text, seconds, dynamics, height)
        user: list[str] = []
        if os.geteuid() == 0:
            for path in (folder, *folder.iterdir()):
                shutil.chown(path, USER)
            user = ["runuser", "-u", USER, "--"]
        inner = f"linuxcnc {folder}/headless.ini"
        environment = ["env", "-i", f"HOME={folder}", "PATH=/usr/bin:/bin", "LANG=C"]
        # `script` gives it the terminal that it wants to print on
        command = [*user, *environment, "script", "-qec", inner, "/dev/null"]
        with (folder / "log.txt").open("wb") as log:
            subprocess.run(
                command, stdin=subprocess.DEVNULL, stdout=log, stderr=log, timeout=seconds + 60, check=False, cwd=folder
            )
        result = folder / "result.txt"
        if not result.exists():
            tail = (folder / "log.txt").read_text(errors="replace").splitlines()[-15:]
            return "\n".join(["the controller did not start:", *tail]), np.zeros((0, 6))
        lines = [line.split() for line in (folder / "samples.txt").read_text().splitlines() if "overrun" not in line]
        samples = np.array([[float(number) for number in line] for line in lines if len(line) == 7])
        overrun = (folder / "samples.txt").read_text().count("overrun")
        word = result.read_text() if not overrun else f"{overrun} samples lost"
        return word, samples[:, 1:].reshape(-1, 6)


@contextmanager
def one_at_a_time() -> Iterator[None]:
    """Wait until no other controller runs: all of them share one memory."""
    with (Path(tempfile.gettempdir()) / "linuxcnc-controller.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        yield


def tool(joints: Floats) -> tuple[Floats, Floats]:
    """Tip and axis in the part by the formulas of trtfuncs.c (offsets 0): (m, 5) -> (m, 3) twice."""
    x, y, z, a, c = (*joints[:, :3].T, *np.radians(joints[:, 3:]).T)
    level = np.cos(a) * y + np.sin(a) * z
    tip = (np.cos(c) * x + np.sin(c) * level, -np.sin(c) * x + np.cos(c) * level, -np.sin(a) * y + np.cos(a) * z)
    axis = (np.sin(c) * np.sin(a), np.cos(c) * np.sin(a), np.cos(a))
    return np.stack(tip, axis=1), np.stack(axis, axis=1)


def original(program: Program, axis_length: float) -> list[Floats]:
    """Tip and axis point of every cut of the CL file, densely: (k, 6) each."""
    cuts: list[list[Floats]] = []
    rapid = rapid_moves(program.kind)
    for pose in range(1, len(program)):
        if rapid[pose]:
            continue
        start, end = (np.concatenate((program.tip[i], program.axis[i])) for i in (pose - 1, pose))
        turn = axis_length * np.linalg.norm(end[3:] - start[3:])
        count = 1 + int(np.ceil((np.linalg.norm(end[:3] - start[:3]) + turn) / STEP))
        share = np.linspace(0, 1, count + 1)[:, None]
        place = start * (1 - share) + end * share
        place[:, 3:] = place[:, :3] + axis_length * place[:, 3:] / np.linalg.norm(place[:, 3:], axis=1, keepdims=True)
        if rapid[pose - 1] or not cuts:
            cuts.append([])
        cuts[-1].append(place)
    return [np.concatenate(cut) for cut in cuts]


def deviations(poses: Floats, cuts: list[Floats]) -> tuple[float, float]:
    """Largest distances of tip and axis point of (m, 6) poses from the nearest place of the original motion."""
    start = np.concatenate([cut[:-1] for cut in cuts])
    way = np.concatenate([np.diff(cut, axis=0) for cut in cuts])
    square = np.maximum((way**2).sum(axis=1), 1e-30)
    worst = np.full((2, len(poses)), np.inf)
    _, near = cKDTree(start).query(poses, k=4, workers=1)
    for choice in near.T:
        for step in (-1, 0):
            row = np.clip(choice + step, 0, len(start) - 1)
            share = np.clip(((poses - start[row]) * way[row]).sum(axis=1) / square[row], 0, 1)
            off = poses - start[row] - share[:, None] * way[row]
            both = np.stack((np.linalg.norm(off[:, :3], axis=1), np.linalg.norm(off[:, 3:], axis=1)))
            worst = np.where(both.max(axis=0) < worst.max(axis=0), both, worst)
    return float(worst[0].max()), float(worst[1].max())


def check_rapids(name: str, program: Program, text: bytes, seconds: float) -> int:
    """Run a program and look where rapids move a tilted tool: along those of the CL file, or above their ends."""
    word, samples = run_samples(text, seconds, height=HEIGHT)
    moving = samples[samples[:, 5] == TRAVERSING]
    tip, axis = tool(moving[:, :5])
    tip = tip + (0.0, 0.0, HEIGHT)
    tilted = tip[axis[:, 2] < np.cos(np.radians(LEAST_TILT))]
    ends = np.flatnonzero(rapid_moves(program.kind) & (np.arange(len(program)) > 0))
    start, way = program.tip[ends - 1], program.tip[ends] - program.tip[ends - 1]
    off = np.full(len(tilted), np.inf)
    for begin, step in zip(start, way, strict=True):
        share = np.clip(((tilted - begin) @ step) / max(float(step @ step), 1e-30), 0, 1)
        off = np.minimum(off, np.linalg.norm(tilted - begin - share[:, None] * step, axis=1))
    leaning = ends[program.axis[ends, 2] < np.cos(np.radians(LEAST_TILT))]
    clearance = float(program.tip[leaning, 2].min(initial=np.inf))
    elsewhere = tilted[off > ASIDE]
    lowest = float(elsewhere[:, 2].min()) if len(elsewhere) else np.inf
    print(f"{name}: {word}; {len(moving)} servo cycles in rapid, {len(tilted)} of them with a tilted tool")
    print(
        f"{len(elsewhere)} of these more than {ASIDE:g} mm beside the rapids of the CL file, "
        f"the lowest at Z{lowest:.3f}; the lowest of these with a tilted tool ends at Z{clearance:.3f}"
    )
    return 0 if word == "done" and len(moving) and lowest >= clearance - ASIDE else 1


def main() -> int:
    """Run one CL file and print what came of it."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("cl", type=Path)
    parser.add_argument("-e", "--tolerance", type=float, default=0.01, help="mm")
    parser.add_argument("-H", "--axis-length", type=float, default=10.0, help="mm")
    parser.add_argument("--feed", type=float, default=500.0, help="mm/min where the CL file gives none")
    parser.add_argument("--seconds", type=float, default=600.0, help="give up after so long")
    parser.add_argument("--rapids", action="store_true", help="look at the rapids instead of the cuts")
    given = parser.parse_args()
    program = read(given.cl.read_bytes(), name=given.cl.name)
    program = replace(program, feed=np.where(np.isnan(program.feed), given.feed, program.feed))
    form = choose_form("linuxcnc", machine=load_machine(MACHINE))
    settings = Settings(tolerance=given.tolerance, axis_length=given.axis_length)
    smoothed = smooth(program, fit_settings(settings, form, program.units))
    text = io.BytesIO()
    blocks = write(smoothed, text, form=form).blocks
    if given.rapids:
        return check_rapids(given.cl.name, program, text.getvalue(), given.seconds)
    begin = time.monotonic()
    word, joints, moving = run_controller(text.getvalue(), given.seconds)
    print(
        f"{given.cl.name}: {word}; {blocks} blocks, {moving:.1f} s of motion, {time.monotonic() - begin:.0f} s in all"
    )
    if not len(joints):
        return 1
    tip, axis = tool(joints)
    poses = np.concatenate((tip, tip + given.axis_length * axis), axis=1)
    cuts = original(program, given.axis_length)
    start = np.linalg.norm(poses - cuts[0][0], axis=1) < 2 * given.tolerance
    poses = poses[int(np.argmax(start)) :]  # a file without rapids is approached with its feed
    tip_error, axis_error = deviations(poses, cuts)
    every = np.concatenate(cuts)
    left, _ = cKDTree(poses).query(every, workers=1)
    print(f"{len(poses)} commands: tip within {tip_error:.4f} mm of the CL path, axis point within {axis_error:.4f} mm")
    print(f"no place of the CL path is farther than {left.max():.3f} mm from a command")
    kept = tip_error <= given.tolerance * (1 + BLEND) and axis_error <= given.tolerance * (1 + 2 * BLEND)
    # the way in one servo cycle at the fastest is all that may be left out
    complete = left.max() <= FASTEST * SERVO_SECONDS + given.tolerance
    return 0 if word == "done" and complete and kept else 1


if __name__ == "__main__":
    sys.exit(main())
