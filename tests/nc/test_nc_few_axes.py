"""Machines with one rotary axis and with none: words, refusals, verification, planned times."""

from __future__ import annotations

import io
import re
from itertools import product

import numpy as np
import pytest

from cornersmooth.cl import read
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.feedrate import Limits, direct
from cornersmooth.kinematics import Machine, machine_position, parse_machine, solutions, tip_position, tool_axis
from cornersmooth.nc import Frame, choose_form, fit_settings, write
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.smoothing import smooth
from cornersmooth.verify import verify
from oracle.messages import one_line
from oracle.share import covering_share, share

EPS = 0.02
WORD = re.compile(r"([A-Z])(?:=)?([-+]?\d+\.?\d*)")
CONTROLS = ("fanuc", "mitsubishi", "haas", "siemens", "heidenhain", "linuxcnc", "generic")


def four_axis(name: str, carrier: str, direction, **more) -> Machine:
    point = more.pop("point", [0.0, 0.0, 0.0])
    axis = {"name": name, "carrier": carrier, "direction": list(direction), "point": point, **more.pop("axis", {})}
    return parse_machine({"axis": [axis], **more})


#: by name: table about X, table about Y, head about Y with a long tool
FOUR = {
    "table A": four_axis("A", "table", (1, 0, 0), point=[0, 3, -7]),
    "table B": four_axis("B", "table", (0, 1, 0), axis={"positive": "table"}),
    "head B": four_axis("B", "head", (0, 1, 0), point=[0, 0, 150], tool_length=90),
}
THREE = parse_machine({"axis": [], "travel": {"Z": [-100.0, 300.0]}})


def rows(about: str, count: int = 24, step: float = 9.0) -> list[str]:
    """Poses whose axes turn about X or Y."""
    lines = []
    for k in range(count):
        turn = np.radians(step * k)
        lean = (0.0, np.sin(turn), np.cos(turn)) if about == "X" else (np.sin(turn), 0.0, np.cos(turn))
        place = (2.0 * k, 20 * lean[1], 20 * lean[2]) if about == "X" else (20 * lean[0], 2.0 * k, 20 * lean[2])
        lines.append("GOTO/" + ",".join(f"{value:.7f}" for value in (*place, *lean)))
    return lines


def program_of(lines: list[str], axis: str = "0,0,1"):
    head = ["UNITS/MM", "LOADTL/2", "SPINDL/8000,RPM,CLW", "RAPID", f"GOTO/0,0,60,{axis}", "FEDRAT/500,MMPM"]
    return read(("\n".join([*head, *lines, "RAPID", "GOTO/0,0,90,0,0,1", "FINI"]) + "\n").encode())


def text_of(program, form, **frame) -> bytes:
    stream = io.BytesIO()
    smoothed = smooth(program, fit_settings(Settings(tolerance=EPS), form, "mm"))
    write(smoothed, stream, form=form, frame=Frame(**frame))
    return stream.getvalue()


def turned(axis: str, degrees: float) -> np.ndarray:
    """Right-handed rotation about X or Y."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[1, 0, 0], [0, c, -s], [0, s, c]] if axis == "A" else [[c, 0, s], [0, 1, 0], [-s, 0, c]])


@pytest.mark.parametrize("name", FOUR)
def test_one_axis_gives_the_tool_axis_and_the_position(name: str) -> None:
    machine, word = FOUR[name], FOUR[name].names[0]
    sign = -1.0 if name == "table B" else 1.0
    angles = np.array([[-170.0, 0.0], [-33.0, 0.0], [0.0, 0.0], [12.5, 0.0], [179.0, 0.0]])
    tips = np.array([[1.0, 2, 3], [40, -20, 7], [0, 0, 0], [-3, 8, 60], [5, 5, 5]])
    for k, (angle, _) in enumerate(angles.tolist()):
        turn = turned(word, sign * angle)
        np.testing.assert_allclose(tool_axis(machine, angles[[k]])[0], turn @ (0, 0, 1), atol=1e-12)
        place = machine_position(machine, tips[[k]], angles[[k]])[0]
        if "table" in name:  # the part turns the other way about the point
            point = np.array(machine.axes[0].point)
            expected = point + turn.T @ (tips[k] - point)
        else:  # the tip swings about the pivot
            pivot = np.array((0.0, 0.0, 90.0 + 150.0))
            expected = tips[k] - (pivot - turn @ pivot)
        np.testing.assert_allclose(place, expected, atol=1e-9)
    np.testing.assert_allclose(tip_position(machine, machine_position(machine, tips, angles), angles), tips, atol=1e-9)
    found = solutions(machine, tool_axis(machine, angles))
    np.testing.assert_allclose(found.angles[:, 0], angles, atol=1e-9)
    assert found.beyond.max() < 1e-9


@pytest.mark.parametrize("name", FOUR)
@pytest.mark.parametrize("tolerance", [0.002, 0.02, 0.2])
def test_curves_of_whole_runs_turn_the_tool_no_further_than_the_axis_does(name: str, tolerance: float) -> None:
    machine = FOUR[name]
    noisy, rng = rows("X" if machine.names[0] == "A" else "Y", count=40, step=2.0), np.random.default_rng(7)
    for k, line in enumerate(noisy):  # off the circle to all sides
        place = [float(word) for word in line[5:].split(",")]
        place[:3] += rng.uniform(-0.5, 0.5, 3)
        noisy[k] = "GOTO/" + ",".join(f"{value:.7f}" for value in place)
    form = choose_form("fanuc", machine=machine)
    result = postprocess(
        program_of(noisy), io.BytesIO(), Settings(method="global", tolerance=tolerance), form=form, processes=1
    )
    assert result.verification is not None
    assert result.verification.passed
    assert result.smoothed.runs is not None
    assert result.smoothed.runs.count.sum() >= 40


@pytest.mark.parametrize(
    ("arranged", "control"),
    covering_share(product([("table A", True), ("table B", False), ("head B", True)], CONTROLS), 3),
)
def test_words_of_one_axis(arranged: tuple[str, bool], control: str) -> None:
    name, tcp = arranged
    machine, word = FOUR[name], FOUR[name].names[0]
    if control == "heidenhain" and not tcp:
        return
    program = program_of(rows("X" if word == "A" else "Y"))
    form = choose_form(control, machine=machine, tcp=tcp)
    text = text_of(program, form)
    found = verify(program, text, tolerance=EPS, control=control, machine=machine, tcp=tcp)
    assert found.problems == ()
    words = [
        dict(WORD.findall(line)) for line in text.decode().splitlines() if re.search(r"\b(G1|L) X(?!.*FMAX)", line)
    ]
    assert {"X", "Y", "Z", word} <= set(words[-1])
    assert not {"A", "B", "C"} - {word} & set(words[-1])
    last = max(abs(float(one[word])) for one in words)
    np.testing.assert_allclose(last, 23 * 9.0, atol=1e-3)


def test_what_goes_wrong_is_found() -> None:
    machine = FOUR["table A"]
    program = program_of(rows("X"))
    lines = text_of(program, choose_form("fanuc", machine=machine)).decode().splitlines()
    k = [number for number, line in enumerate(lines) if line.startswith("G1 X")][40]
    for old, new in ((r"A(-?\d+\.\d+)", "A5.0"), (r" A-?\d+\.\d+", " B5.0"), (r"Y(-?\d+\.\d+)", "Y5.0")):
        wrong = [*lines[:k], re.sub(old, new, lines[k]), *lines[k + 1 :]]
        assert wrong != lines
        try:
            passed = verify(program, "\n".join([*wrong, ""]).encode(), tolerance=EPS, machine=machine).passed
        except InputError:
            passed = False
        assert not passed


def test_a_pose_that_the_machine_does_not_reach_is_named() -> None:
    program = program_of(rows("Y", 4))
    with pytest.raises(InputError, match=r"9\.000 deg beyond the reach of A of machine\nhint: turn the part") as error:
        text_of(program, choose_form("fanuc", machine=FOUR["table A"]))
    assert (error.value.code, error.value.line) == ("CS361", 8)


def test_a_method_that_turns_the_tool_elsewhere_is_refused() -> None:
    """Where tip and axis point are rounded each by itself, the tool leans out of the plane in which A turns it."""
    turn = np.radians(np.arange(0.0, 90.0, 9.0))
    lines = [f"GOTO/{12 * (k % 3)},{k},0,0,{-np.sin(a):.7f},{np.cos(a):.7f}" for k, a in enumerate(turn.tolist())]
    program, form, stream = program_of(lines), choose_form("fanuc", machine=FOUR["table A"]), io.BytesIO()
    fitted = fit_settings(Settings(tolerance=EPS, method="zhang2016"), form, "mm")
    with pytest.raises(InputError, match=r"beyond the reach of A of machine\n.*--method proportional"):
        write(smooth(program, fitted), stream, form=form)
    assert verify(program, text_of(program, form), tolerance=EPS, machine=FOUR["table A"]).problems == ()


def test_one_axis_turns_back_within_a_cut() -> None:
    machine = four_axis("A", "table", (1, 0, 0), axis={"limits": [-200.0, 200.0]})
    program = program_of(rows("X", 60))
    form = choose_form("fanuc", machine=machine, rewind=30.0)
    found = verify(program, text_of(program, form), tolerance=EPS, machine=machine)
    assert found.problems == ()
    assert len(found.rewinds) == 1
    with pytest.raises(InputError, match="A would have to go to"):
        text_of(program, choose_form("fanuc", machine=machine))


def level(count: int = 12) -> list[str]:
    return [f"GOTO/{3 * k},{5 * (k % 3)},{(k * 7) % 4},0,0,1" for k in range(count)]


@pytest.mark.parametrize("control", CONTROLS)
def test_no_axis_and_a_tool_along_z(control: str) -> None:
    program = program_of(level())
    form = choose_form(control, machine=THREE)
    text = text_of(program, form)
    assert verify(program, text, tolerance=EPS, control=control, machine=THREE).problems == ()
    assert not re.search(r"(^|\s)[ABCIJK][-+]?\d|TX|A3=|G43\.4|G43\.5|G234|TRAORI|TCPM", text.decode())
    if control in ("fanuc", "linuxcnc"):
        assert re.search(r"^G43 H2( G0 X\S+ Y\S+ Z\S+)?$", text.decode(), re.MULTILINE)


ROUND = ["GOTO/0,0,0,0,0,1", "GOTO/30,0,0", "CIRCLE/30,10,0,0,0,1,10", "GOTO/40,10,0", "CIRCLE/50,10,0,0,0,-1,10"]


@pytest.mark.parametrize(("last", "control"), covering_share(product(["GOTO/50,20,0", "GOTO/50,20,2"], CONTROLS), 3))
def test_arcs_of_a_machine_without_rotary_axes_are_circular_blocks(control: str, last: str) -> None:
    program, form = program_of([*ROUND, last]), choose_form(control, machine=THREE)
    lines = text_of(program, form).decode().splitlines()
    if control == "heidenhain":
        said = [(turn, "Z" in line) for line in lines for turn in re.findall(r"CR .* DR([-+])", line)]
        wanted = [("+", False), ("-", False)][: 1 + last.endswith(",0")]  # CR does not climb
    else:
        said = [(code, "Z2." in line) for line in lines for code in re.findall(r"^G([23]) .*R=?10\.", line)]
        wanted = [("3", False), ("2", last.endswith(",2"))]
    assert said == wanted

    def found(lines: list[str]) -> list[str]:
        text = ("\n".join(lines) + "\n").encode()
        checked = verify(program, text, tolerance=EPS, control=control, machine=THREE)
        return [problem.code for problem in checked.problems]

    assert found(lines) == []
    other = {"G2 ": "G3 ", "G3 ": "G2 ", "DR-": "DR+", "DR+": "DR-", "10.00": "11.00"}
    mutants = [
        (k, line[::-1].replace(old[::-1], new[::-1], 1)[::-1])
        for k, line in enumerate(lines)
        for old, new in other.items()
        if re.search(r"G[23] | CR ", line) and old in line
    ]
    assert len(mutants) > 1
    for k, wrong in share(mutants, 2, last.endswith(",2")):
        assert found([*lines[:k], wrong, *lines[k + 1 :]]), wrong


def test_no_axis_and_holes_as_cycles() -> None:
    program = program_of(["CYCLE/DRILL,DEPTH,8,MMPM,100,CLEAR,2", "GOTO/5,5,0,0,0,1", "GOTO/9,5,0,0,0,1", "CYCLE/OFF"])
    form = choose_form("fanuc", machine=THREE)
    text = text_of(program, form, cycles="native")
    assert b"G98 G81" in text
    assert verify(program, text, tolerance=EPS, machine=THREE).problems == ()


def test_what_a_machine_without_axes_cannot_do_is_named() -> None:
    form = choose_form("fanuc", machine=THREE)
    tilted = program_of([*level(3), "GOTO/9,9,0,0.1,0,0.99499"])
    with pytest.raises(SettingsError, match="the tool is not parallel to Z, and machine has no rotary axis") as error:
        text_of(tilted, form)
    assert error.value.line == 10
    with pytest.raises(InputError, match="Z of machine would have to go to 400") as travel:
        text_of(program_of([*level(3), "GOTO/9,9,400"]), form)
    assert travel.value.code == "CS374"
    with pytest.raises(SettingsError, match="no rotary axes here that could turn back"):
        choose_form("fanuc", machine=THREE, rewind=20.0)
    with pytest.raises(SettingsError, match="no blocks without words of the tool axis\nhint: use -f g1"):
        choose_form("generic", "g6.2", machine=THREE)
    with pytest.raises(SettingsError, match="has no rotary words\nhint: use -f g1"):
        choose_form("fanuc", "g6.2", machine=FOUR["table A"])


@pytest.mark.parametrize("method", ["exact_stop", "velocity_jump"])
def test_times_keep_the_limits_of_one_axis(method: str) -> None:
    """The part turns evenly under a tip that stands still on it: the axis alone decides."""
    dynamics = {"A": {"velocity": 600.0, "acceleration": 100.0, "jerk": 1e6}}
    machine = four_axis("A", "table", (1, 0, 0), dynamics=dynamics)
    program = program_of(rows("X", 3, 60.0))
    slow = direct(program, Limits(), method, machine=machine).total
    fast = direct(program, Limits(), method).total
    assert slow > fast + 8.0  # 120 degrees at 10 degrees a second


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("name = 'x'", "no rotary axis is described; write [[axis]], or axis = [] for a machine without"),
        ("axis = []\ntool_direction = [0, 1, 0]", "a tool_direction that is not Z"),
        ("axis = []\npreferred = 'A+'", "preferred names 'A'"),
        ("[[axis]]\nname = 'A'\ncarrier = 'none'\ndirection = [1, 0, 0]", "carrier is 'none'"),
    ],
)
def test_machine_files_that_say_too_little(text: str, says: str) -> None:
    with pytest.raises(SettingsError) as error:
        parse_machine(text)
    assert says in one_line(error.value)


def test_arcs_go_farther_than_their_ends() -> None:
    """Half a circle about 30, 0 of radius 30: Y goes to 30, its ends are at 0."""
    rows = ["GOTO/0,0,0,0,0,1", "MOVARC/30,0,0,0,0,-1,30,ANGLE,180", "GOTO/60,0,0"]
    program = program_of(rows)
    assert len(program.arcs) == 1
    for high, fits in ((29.9, False), (30.1, True)):
        machine = parse_machine({"axis": [], "travel": {"Y": [-1.0, high]}})
        form = choose_form("fanuc", machine=machine)
        if fits:
            assert text_of(program, form)
            continue
        with pytest.raises(InputError, match="Y of machine would have to go to 29"):
            text_of(program, form)
