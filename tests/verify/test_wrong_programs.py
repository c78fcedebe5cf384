"""Small wrong programs, each of a kind that has passed once: a word or a block of a right program is another one."""

from __future__ import annotations

import io
import re
from itertools import pairwise

import pytest

from cornersmooth.errors import InputError, Verdict
from cornersmooth.kinematics import load_machine
from cornersmooth.nc import Frame, choose_form
from cornersmooth.pipeline import postprocess
from cornersmooth.settings import Settings
from cornersmooth.verify import verify
from oracle.share import share

from .small import codes, found, program, right

ISO = ("fanuc", "haas", "linuxcnc", "mitsubishi")
CONTROLS = (*ISO, "generic", "heidenhain", "siemens")

TWO_TOOLS = """LOADTL/3
SPINDL/RPM,3000,CLW
COOLNT/ON
RAPID
GOTO/0,0,50,0,0,1
RAPID
GOTO/0,0,5
FEDRAT/MMPM,500
GOTO/0,0,0
GOTO/10,0,0
RAPID
GOTO/10,0,50
LOADTL/4
SPINDL/RPM,2000,CLW
RAPID
GOTO/0,0,50
RAPID
GOTO/0,0,5
FEDRAT/MMPM,500
GOTO/0,0,0
GOTO/10,10,0
RAPID
GOTO/10,10,50
FINI
"""
HOLES = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
CYCLE/{},DEPTH,15,CLEAR,2
GOTO/40,0,0
CYCLE/OFF
RAPID
GOTO/40,0,80
SPINDL/OFF
FINI
"""


def passes(text: str, control: str, lines: tuple[str, ...]) -> bool:
    """Whether a program passes."""
    try:
        return found(text, lines, control).verdict == Verdict.PASSED
    except InputError:
        return False


def put(lines: tuple[str, ...], at: int, block: str, control: str, *, gone: int = 0) -> tuple[str, ...]:
    """A program with a block more, in place of some."""
    return *lines[:at], f"99 {block}" if control == "heidenhain" else block, *lines[at + gone :]


def where(lines: tuple[str, ...], pattern: str, number: int = 0) -> int:
    """The line of a pattern."""
    return [k for k, line in enumerate(lines) if re.search(pattern, line) and line[:1] not in "(;"][number]


# blending, and other smoothing of the control, without a limit


@pytest.mark.parametrize("word", ["G64", "G64 P0", "G64 P0.000 Q0", "G64 Q0"])
def test_path_control_without_a_tolerance(word: str) -> None:
    lines = right(TWO_TOOLS, "linuxcnc")
    assert not passes(TWO_TOOLS, "linuxcnc", put(lines, where(lines, "G64"), word, "linuxcnc", gone=1))


# words beside a tool change


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("word", ["M3", "M4"])
def test_the_spindle_is_started_before_a_tool_change(control: str, word: str) -> None:
    lines = tuple(line for line in right(TWO_TOOLS, control) if "CORNERSMOOTH" not in line)  # also of another post
    change = where(lines, "^(T4|.*TOOL CALL 4)", 0)
    assert not passes(TWO_TOOLS, control, put(lines, change, word, control))
    stop = where(lines[:change], r"\bM1\b", -1) if control != "generic" else change - 1
    assert not passes(TWO_TOOLS, control, put(lines, stop, word, control, gone=1))


@pytest.mark.parametrize("control", CONTROLS)
@pytest.mark.parametrize("word", ["M4", "M7"])
def test_what_is_switched_on_for_no_motion(control: str, word: str) -> None:
    lines = right(TWO_TOOLS, control)
    for place in (where(lines, r"\bM9\b"), where(lines, r"\bM3\b", 1)):
        assert not passes(TWO_TOOLS, control, put(lines, place, word, control))


# planes under tip control


@pytest.mark.parametrize(
    ("control", "word"),
    [
        ("siemens", "CYCLE800()"),
        ("siemens", 'CYCLE800(1,"TC",0,57,0.,0.,0.,0.,0.,0.,0.,0.,0.,-1)'),
        ("heidenhain", "PLANE RESET STAY"),
        ("heidenhain", "PLANE SPATIAL SPA+0.0 SPB+0.0 SPC+0.0 TURN FMAX"),
        ("fanuc", "G69"),
        ("fanuc", "G68.2 X0. Y0. Z0. I0. J0. K0."),
        ("mitsubishi", "G69"),
        ("haas", "G255"),
    ],
)
def test_planes_under_tip_control(control: str, word: str) -> None:
    lines = right(TWO_TOOLS, control)
    on = where(lines, "G43.5|TRAORI|FUNCTION TCPM F|G234")
    for place in (on + 1, where(lines, r"^(\d+ )?(G1|LN) .*") + 1):
        assert not passes(TWO_TOOLS, control, put(lines, place, word, control))


# holes


@pytest.mark.parametrize("words", ["DRILL,STEP,3", "SPOT,INCR,3", "REAM,1STPECK,3"])
def test_pecks_of_a_cycle_that_does_not_peck_are_not_understood(words: str) -> None:
    text = HOLES.format(f"{words},MMPM,100")
    with pytest.raises(InputError, match="CS342"):
        right(text, "fanuc")
    plain = right(HOLES.format("DRILL,MMPM,100"), "fanuc", "native")
    assert not passes(text, "fanuc", plain)


#: cycles, with the words of CL files that ask for them
CYCLES = {
    "drilling": "DRILL,MMPM,100",
    "dwelling": "DRILL,DWELL,0.5,MMPM,100",
    "deep": "DRILL,DEEP,STEP,3,MMPM,100",
    "chips": "DRILL,BRKCHP,STEP,3,MMPM,100",
    "tapping": "TAP,MMPR,1.5",
    "boring": "BORE,MMPM,100",
    "reaming": "REAM,DWELL,0.5,MMPM,100",
}
NATIVE = r"CYCLE8\d\(|G73|G8[1-59]|CYCL DEF 20\d"
#: addresses that a block of ISO words might have, too
LETTERS = "ABCDEFHIJKLPQRSUVW"


#: what may be another number
ALLOWED = "|".join(
    (
        r"CYCLE8\d\((49|55)|Q204=.(49|55)",  # the height in the end: any above that of the cycle
        r"CYCLE84\(.*(,,,3,|,,3000)|CYCLE85\(.*,,,100|G84 [^P]*$",  # nothing for zero
        r"CYCLE85\(.*,0\.013,|Q211=.0\.013",  # a dwell more
        r"Q202=.16",  # one peck, deeper than the hole
    )
)


def changed(number: str) -> list[str]:
    """A number that is another one: a little, and by much, larger and smaller; zero; with the other sign."""
    value = float(number)
    others = {value * 1.1 + 0.013, value - 1.0} - {value}
    return [f"{other:+.6f}" if number[0] == "+" else f"{other:.6f}".rstrip("0") for other in sorted(others)]


def other_cycles(line: str, control: str) -> list[str]:
    """A block with each of its numbers changed or taken out, and with others in all places that it leaves empty."""
    found: list[str] = []
    if control == "siemens":
        name, args = line[:-1].split("(")
        parts = args.split(",")
        for k, part in enumerate(parts):
            new = changed(part) if part else ["0.5", "-3"]
            found += [
                f"{name}({','.join([*parts[:k], value, *parts[k + 1 :]])})" for value in [*new, ""] if value != part
            ]
        return [*found, f"{line[:-1]},1)", f"{name}({','.join(parts[:-1])})"]
    pattern = r"(Q\d+=)([-+]?[\d.]+)" if control == "heidenhain" else r"\b([A-FH-Z])([-+]?[\d.]+)"
    for word in re.finditer(pattern, line):
        before, after = line[: word.start()], line[word.end() :]
        found += [f"{before}{word[1]}{value}{after}" for value in changed(word[2])] + [before.rstrip() + after]
    if control == "heidenhain":
        return [
            *found,
            *(f"{line} Q{number}=+1" for number in (208, 212, 213, 256, 351, 395) if f"Q{number}" not in line),
        ]
    return [*found, *(f"{line} {letter}{value}" for letter in LETTERS for value in ("1.", "0.5"))]


def kinds_of_cycle(line: str, control: str) -> list[str]:
    """The same hole by another cycle of the control."""
    if control == "heidenhain":
        names = {"200 DRILLING": 200, "201 REAMING": 201, "207 RIGID TAPPING NEW": 207}
        return [re.sub("|".join(names), name, line) for name in names if name not in line]
    if control == "siemens":
        return [line.replace(line[:7], f"CYCLE8{k}") for k in range(1, 10) if f"CYCLE8{k}" not in line]
    codes = [73, 74, 76, *range(81, 90)]
    return [re.sub(r"G(73|8\d)", f"G{code}", line) for code in codes if f"G{code} " not in line]


@pytest.mark.parametrize(("number", "cycle"), list(enumerate(CYCLES)))
@pytest.mark.parametrize("control", ["fanuc", "heidenhain", "linuxcnc", "siemens"])
def test_each_number_of_each_cycle_is_compared(control: str, number: int, cycle: str) -> None:
    """By default each second of the changes, in turn: each of those that a letter or a place has, on some cycle."""
    text = HOLES.format(CYCLES[cycle])
    lines = right(text, control, "native")
    found = [
        k for k, line in enumerate(lines) if re.search(NATIVE, line) and line[:1] not in "(;" and "G21" not in line
    ]
    if not found:
        pytest.skip("it is written as moves")
    block, others = found[0], (*other_cycles(lines[found[0]], control), *kinds_of_cycle(lines[found[0]], control))
    tried = share(others, 2, number)
    wrong = [line for line in tried if passes(text, control, (*lines[:block], line, *lines[block + 1 :]))]
    assert [line for line in wrong if not re.search(ALLOWED, line)] == []


# ways between holes of different heights


HEIGHTS = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/5,5,2,0,0,1
CYCLE/DRILL,FEDTO,12,RAPTO,3,RTRCTO,5,MMPM,200
GOTO/5,5,0
GOTO/15,5,30
CYCLE/DRILL,FEDTO,10,RAPTO,2,RTRCTO,2,MMPM,200
GOTO/25,5,40
GOTO/35,5,20
CYCLE/OFF
RAPID
GOTO/35,5,80
SPINDL/OFF
FINI
"""


@pytest.mark.parametrize("cycles", ["moves", "native"])
@pytest.mark.parametrize("control", CONTROLS)
def test_a_rapid_between_holes_never_goes_aslant(control: str, cycles: str) -> None:
    rapids = [line for line in right(HEIGHTS, control, cycles) if re.match(r"G0|G43|\d+ LN? .*FMAX", line)]
    found = (re.search(r" X\+?([\d.]+) .* Z\+?([\d.]+)", line) for line in rapids)
    places = [(float(one[1]), float(one[2])) for one in found if one]
    ways = [(one, other) for one, other in pairwise(places) if one[0] != other[0]]
    # from the hole at 0 to that at 30, from there to that at 40, down to that at 20: at the higher height each time
    assert ways == [((5.0, 35.0), (15.0, 35.0)), ((15.0, 42.0), (25.0, 42.0)), ((25.0, 42.0), (35.0, 42.0))]


@pytest.mark.parametrize("control", CONTROLS)
def test_the_way_across_to_the_next_hole_is_lost(control: str) -> None:
    lines = right(HEIGHTS, control)
    for x, z in ((15, 35), (35, 42)):
        at = where(lines, rf"X\+?{x}\.?0* Y\+?5\.?0* Z\+?{z}(\.0*)?( |$)")
        assert not passes(HEIGHTS, control, (*lines[:at], *lines[at + 1 :]))


# states over holes that are left out


LEFT_OUT = """LOADTL/2
SPINDL/RPM,1500,CLW
RAPID
GOTO/5,5,30,0,0,1
CYCLE/THREAD,RAPTO,3,FEDTO,12,RTRCTO,5,MMPM,200,FOO,3
GOTO/5,5,0
COOLNT/ON
GOTO/15,5,0
COOLNT/OFF
GOTO/35,5,0
CYCLE/OFF
RAPID
GOTO/35,5,80
SPINDL/OFF
FINI
"""


def test_states_over_holes_that_are_left_out_are_not_verified() -> None:
    """Coolant that no motion meets, in the right program and in one without it."""
    form, stream = choose_form("fanuc", "g1"), io.BytesIO()
    frame = Frame(skip_cycles=True)
    postprocess(program(LEFT_OUT), stream, Settings(tolerance=0.02), form=form, frame=frame, verify=False)
    text = stream.getvalue()
    for some in (text, text.replace(b"M8\n", b"")):
        one = verify(program(LEFT_OUT), some, tolerance=0.02, skip_cycles=True)
        assert one.verdict is Verdict.NOT_VERIFIED
        assert one.unverified.endswith("only over holes that are left out: coolant FLOOD of CL line 7")


@pytest.mark.parametrize("control", ["fanuc", "mitsubishi", "siemens", "heidenhain"])
def test_a_vector_before_tip_control_on_the_way_back(control: str) -> None:
    """A rapid with the words of a vector, before the control takes such words: it stops there."""
    lines = right(TWO_TOOLS, control)
    on = where(lines, r"G43\.5|TRAORI|FUNCTION TCPM")
    over = next(k for k in range(on, len(lines)) if re.search(r"^(\d+ )?(G0|LN) X", lines[k]))
    moved = (*lines[:on], lines[over], *lines[on:over], *lines[over + 1 :])
    assert not passes(TWO_TOOLS, control, moved)


# programs without a head of ours, around their retracts


def another_post(lines: tuple[str, ...]) -> tuple[str, ...]:
    """A program without any comment."""
    return tuple(line for line in lines if not re.match(r"\(|;|\d+ ;", line))


@pytest.mark.parametrize("control", ["siemens", "heidenhain"])
def test_tip_control_that_holds_at_the_retract_is_not_verified(control: str) -> None:
    lines = another_post(right(TWO_TOOLS, control))
    off = where(lines, "TRAFOOF|FUNCTION RESET TCPM", -2)
    assert passes(TWO_TOOLS, control, lines)
    one = found(TWO_TOOLS, (*lines[:off], lines[off + 1], lines[off], *lines[off + 2 :]), control)
    assert one.verdict is Verdict.NOT_VERIFIED
    assert " under " in one.unverified


@pytest.mark.parametrize("control", ["fanuc", "haas", "mitsubishi"])
def test_a_length_that_ends_before_the_retract_is_not_verified(control: str) -> None:
    lines = another_post(right(TWO_TOOLS, control))
    up = where(lines, r"G91 G28 Z0\.|G53 G0 Z0", 1)
    one = found(TWO_TOOLS, put(lines, up, "G49", control), control)
    assert one.verdict is Verdict.NOT_VERIFIED
    assert "G49 before the retract" in one.unverified


@pytest.mark.parametrize("control", CONTROLS)
def test_one_block_from_the_retract_to_the_first_pose_is_to_check(control: str) -> None:
    lines = another_post(right(TWO_TOOLS, control))
    if not any(re.search(r"G28|G53|SUPA|M91", line) for line in lines):
        pytest.skip("it has no retracts")
    over = where(lines, r"^(\d+ )?(G0|LN?) X")
    assert not found(TWO_TOOLS, lines, control).trusted
    one = found(TWO_TOOLS, (*lines[:over], *lines[over + 1 :]), control)
    assert [text for _, text in one.trusted] == ["the tool comes down from a retract before it is over its place"]


def test_the_length_of_a_tool_that_a_position_of_the_machine_drops() -> None:
    lines = right(TWO_TOOLS, "siemens")
    changed = put(lines, where(lines, "^D1$") + 1, "SUPA G0 X0 Y0 D0", "siemens")
    assert not passes(TWO_TOOLS, "siemens", changed)


@pytest.mark.parametrize("control", CONTROLS)
def test_a_program_of_a_version_without_digests_is_not_verified(control: str) -> None:
    lines = right(TWO_TOOLS, control)
    old = tuple(re.sub(r"(CORNERSMOOTH) \S+:", r"\1 0.2.0:", line) for line in lines)
    assert old != lines
    assert found(TWO_TOOLS, old, control).verdict is Verdict.NOT_VERIFIED


@pytest.mark.parametrize("control", ["siemens", "linuxcnc", "mitsubishi", "heidenhain"])
def test_two_m_words_in_a_block(control: str) -> None:
    """Where the control takes several: FANUC takes them by a parameter, Haas never."""
    lines = right(TWO_TOOLS, control)
    start = where(lines, r"\bM3$")
    number = "" if control != "heidenhain" else "99 "
    both = number + re.sub(r"^\d+ ", "", lines[start]) + " M8"
    assert re.search("M8", lines[start + 1])
    assert passes(TWO_TOOLS, control, (*lines[:start], both, *lines[start + 2 :]))
    assert not passes(TWO_TOOLS, control, (*lines[:start], both.replace("M8", "M5"), *lines[start + 1 :]))


@pytest.mark.parametrize("control", CONTROLS)
def test_m2_ends_a_program(control: str) -> None:
    lines = right(TWO_TOOLS, control)
    end = where(lines, r"\bM(30|2)$")
    text = re.sub("M(30|2)$", "M02" if control != "heidenhain" else "M2", lines[end])
    assert passes(TWO_TOOLS, control, (*lines[:end], text, *lines[end + 1 :]))
    assert not passes(TWO_TOOLS, control, (*lines[: end - 5], text, *lines[end - 5 : end], *lines[end + 1 :]))


# what holds beside tip control


TURNED = """LOADTL/1
SPINDL/RPM,3000,CLW
RAPID
GOTO/0,0,50,0,0,1
FEDRAT/MMPM,500
GOTO/0,0,0,0,0,1
GOTO/10,3,0,0.1,0,0.9949874
RAPID
GOTO/10,3,50,0.1,0,0.9949874
LOADTL/2
SPINDL/RPM,1500,CLW
RAPID
GOTO/5,5,30,0,0,1
CYCLE/DRILL,RAPTO,3,FEDTO,12,RTRCTO,5,MMPM,200
GOTO/5,5,0
CYCLE/OFF
RAPID
GOTO/5,5,60
SPINDL/OFF
FINI
"""


@pytest.mark.parametrize("control", ["fanuc", "siemens", "heidenhain", "mitsubishi"])
def test_rotary_axes_stay_turned_where_nothing_keeps_the_tip(control: str) -> None:
    """Holes drilled beside their places: the table has not been turned back."""
    form, stream = choose_form(control, "g1", machine=load_machine("table-ac")), io.BytesIO()
    frame, how = Frame(cycles="native"), {"tolerance": 0.02, "control": control, "machine": form.machine}
    postprocess(program(TURNED), stream, Settings(tolerance=0.02), form=form, frame=frame, verify=False)
    lines = another_post(tuple(stream.getvalue().decode().splitlines()))
    turns = where(lines, r"^(\d+ )?(G0|L) A\S+ C\S+( FMAX)?$", -2)
    assert verify(program(TURNED), "\n".join(lines).encode(), **how).verdict is Verdict.PASSED
    half = re.sub(r"(C[-+]?)0\.0", r"\g<1>0.5", lines[turns])
    assert half != lines[turns]
    for block in ((), (half,)):
        one = verify(program(TURNED), "\n".join((*lines[:turns], *block, *lines[turns + 1 :])).encode(), **how)
        assert "no tool tip control where rotary axes are away from zero" in [some.text for some in one.problems]


def test_the_length_of_the_first_tool_needs_its_word() -> None:
    cl = TWO_TOOLS.replace("LOADTL/3", "LOADTL/1")
    lines = another_post(right(cl, "linuxcnc"))
    at = where(lines, r"^G43 H1$")
    assert not passes(cl, "linuxcnc", (*lines[:at], *lines[at + 1 :]))


LEVELS = """LOADTL/3
SPINDL/RPM,3000,CLW
RAPID
GOTO/40,40,50,0,0,1
CYCLE/DRILL,RAPTO,2,FEDTO,7,MMPM,180,RTRCTO,20
GOTO/60,40,0
CYCLE/OFF
RAPID
GOTO/60,40,20
RAPID
GOTO/80,50,5
CYCLE/DRILL,RAPTO,2,FEDTO,7,MMPM,180,RTRCTO,20
GOTO/80,50,0
GOTO/90,50,0
CYCLE/OFF
RAPID
GOTO/90,50,70
FINI
"""


@pytest.mark.parametrize("control", ISO)
def test_a_rapid_ends_a_run_of_cycles_as_g80_does(control: str) -> None:
    """Behind it G98 goes back to where the tool is then: here below the height of the cycle."""
    lines = right(LEVELS, control, "native")
    risen = [k for k, line in enumerate(lines) if re.match(r"G0 X80\S* Y50\S* Z20", line)]
    low = [line for k, line in enumerate(lines) if k not in risen]
    assert len(risen) == 1
    assert "CS563" in codes(LEVELS, low, control)
    low.remove("G80")
    assert "CS563" in codes(LEVELS, low, control)


@pytest.mark.parametrize("control", ["fanuc", "mitsubishi"])  # the others retract with G0, which ends cycles
def test_a_retract_within_hole_cycles_is_not_understood(control: str) -> None:
    """Whether a modal cycle drills where the retract is, no manual says."""
    text = LEVELS.replace("GOTO/90,50,0\nCYCLE/OFF\nRAPID\nGOTO/90,50,70\n", "GOTO/90,50,0\nCYCLE/OFF\nGOHOME\n")
    lines = right(text, control, "native")
    last = len(lines) - 1 - lines[::-1].index("G80")
    with pytest.raises(InputError, match="within hole cycles"):
        found(text, (*lines[:last], *lines[last + 1 :]), control)


@pytest.mark.parametrize("control", [one for one in CONTROLS if one != "generic"])
def test_a_tap_of_the_control_is_right_handed(control: str) -> None:
    text = HOLES.format("TAP,MMPR,1.5")
    lines = [re.sub(r"\bM3$", "M4", line) for line in right(text, control, "native")]
    assert "CS552" in codes(text, lines, control)
    assert codes(text.replace("CLW", "CCLW"), lines, control) - {"CS567"} == {"CS566"}


def test_a_part_of_a_vector_in_klartext_is_not_understood() -> None:
    text = "\n".join(right(TWO_TOOLS, "heidenhain"))
    part, count = re.subn(r"(LN X\+10\.\S* Y\+10\.\S* Z\+0\.\S*) TX\S* TY\S*", r"\1", text, count=1)
    assert count
    with pytest.raises(InputError, match="this kind of block"):
        found(TWO_TOOLS, part.split("\n"), "heidenhain")


@pytest.mark.parametrize("control", [one for one in CONTROLS if one not in ("haas", "heidenhain")])
def test_another_coolant_flows_beside_the_one_before(control: str) -> None:
    """The interpreter of LinuxCNC: M7 behind M8 lets both flow, until M9."""
    text = TWO_TOOLS.replace("GOTO/10,0,0\n", "COOLNT/MIST\nGOTO/10,0,0\n", 1)
    lines = list(right(text, control))
    mist = lines.index("M7")
    assert lines.pop(mist - 1) == "M9"
    assert "CS553" in codes(text, lines, control)
    assert "CS553" in codes(TWO_TOOLS, lines, control)
