"""Rapids, holes and their order outside of runs, before and after the filter, by readers that share no code with it."""

from __future__ import annotations

import random
import re
import shutil
from pathlib import Path

import pytest

import cornersmooth as cs
from cornersmooth.filter import filter_program
from filter.foreign import by_rs274, by_words, difference
from filter.programs import PROGRAMS
from filter.test_filter import form_of
from oracle.interpreter import RefusedError
from oracle.share import how_many, share

EPS = 0.02
THREE_AXES = Path(__file__).parents[2] / "samples" / "machines" / "three-axis.toml"


def three_axes(text: str | bytes, control: str) -> bytes:
    """Text that the filter makes for a machine without rotary axes."""
    data = text.encode() if isinstance(text, str) else text
    form = cs.choose_form(control, "g1", machine=cs.load_machine(THREE_AXES))
    return filter_program(data, form, cs.Settings(tolerance=EPS, lines="dense")).data


# small programs, each with what another reader would do otherwise


def zigzag(rng: random.Random, count: int, first: str = "G1 ", feed: str = " F500") -> list[str]:
    """Cuts with corners; the first has the words given."""
    places = [(round(3.0 * k + rng.random(), 3), round(4 * rng.random(), 3)) for k in range(count)]
    return [f"{first if k == 0 else ''}X{x:.3f} Y{y:.3f}{feed if k == 0 else ''}" for k, (x, y) in enumerate(places)]


CYCLE_L0 = (
    "%\nO7\nG21 G90 G94 G17 G40 G49 G80\nT2 M6\nG54 G0 X0. Y0. S2500 M3\nG43 H2 Z25.\n"
    "G99 G81 X12. Y8. Z-7. R3. F110. L0\nX24. Y9. Z-7.\nX37. Y14. Z-8.5\nX44. Y31. Z-7.\nX58. Y22. Z-8.5\nG80\n"
    "G0 Z25.\nG1 Z-1. F200.\nX5. Y5.\nX10. Y0.\nX15. Y5.\nG0 Z25.\nM30\n%\n"
)


@pytest.mark.parametrize("control", ["fanuc", "haas", "mitsubishi"])
@pytest.mark.parametrize(
    "cycle", ["G81 Z-7. R3. L0", "G83 Z-7. R3. Q2. L0", "G82 Z-7. R3. P200 L0", "G73 Z-7. R3. Q1. L0"]
)
def test_holes_stay_holes_behind_a_cycle_that_drills_none(control: str, cycle: str) -> None:
    text = CYCLE_L0.replace("G81 X12. Y8. Z-7. R3. F110. L0", f"{cycle} X12. Y8. F110.")
    new = three_axes(text, control)
    assert difference(by_words(text.encode()), by_words(new), EPS) == ""
    assert new != text.encode()


@pytest.mark.parametrize("control", ["fanuc", "haas", "mitsubishi", "linuxcnc"])
@pytest.mark.parametrize("block", ["G10 L2 P2 X0 Y-60 Z0", "G10 L20 P1 X0 Y0", "G10 L1 P1 Z0", "G10 L10 P1 Z0"])
def test_modal_rapids_stay_rapids_behind_words_with_l(control: str, block: str) -> None:
    text = f"G21 G90 G94 G17\nG54\nG0 X0. Y0. Z15.\nG1 Z-1. F240.\nX12. Y1.\nX20. Y0.\nG0 Z15.\n{block}\nG55\n" + (
        "X70. Y0. Z15.\nX70. Y45.\nX25. Y66.\nX0. Y0.\nG1 Z-1. F240.\nX12. Y1.\nX20. Y0.\nG0 Z15.\nM2\n"
    )
    new = three_axes(text, control)
    assert difference(by_words(text.encode()), by_words(new), EPS) == ""
    assert new != text.encode()


RUN = "X12. Y1.\nX20. Y0.\nX25. Y3.\nX30. Y0.\n"


@pytest.mark.parametrize(
    ("control", "blocks"),
    [
        # G60 may be modal: each of the places behind it is approached from one side
        ("fanuc", "G60 X5. Y5."),
        ("haas", "G60 X5. Y5."),
        # probing is of group 01
        ("linuxcnc", "G38.2 Z-3 F100"),
        # a value for a variable, and words of the block beside it
        ("linuxcnc", "#1=5 G0"),
        ("linuxcnc", "#1=[2+3] #2=4 G0"),
        ("linuxcnc", "N5 #<depth>=3 G0"),
        ("siemens", "X=R1 G0"),
        ("siemens", "R1=R2+5 G0"),
        ("siemens", 'T="MILL" G0'),
        ("siemens", "G[1]=1"),
        # a call of what nobody has seen
        ("siemens", "G0 L200"),
        ("fanuc", "L2 M98 P100"),
        ("fanuc", "M98 P100 L2"),
        # a block that the operator may skip, with what the control works out
        ("fanuc", "/G0 X#5"),
        ("fanuc", "N20 /G0 X#5"),
    ],
)
def test_what_is_no_cut_any_more_stays(control: str, blocks: str) -> None:
    text = f"G90 G94 G17\nG54\nG0 X0. Y0. Z15.\nG1 Z-1. F240.\n{blocks}\nX0. Y0. Z-1.\n{RUN}G0 Z15.\nM2\n"
    assert three_axes(text, control) == text.encode()


@pytest.mark.parametrize("block", ["/G1 X#5 F100.", "/2 G1 X#5 F100."])
def test_rapids_behind_a_skipped_cut_stay(block: str) -> None:
    text = f"G90 G94 G17\nG54\nG0 X0. Y0. Z15. F200.\n{block}\nX0. Y0. Z15.\n{RUN}M2\n"
    assert three_axes(text, "fanuc") == text.encode()


@pytest.mark.parametrize(
    ("control", "blocks"),
    [
        ("fanuc", "#1=5."),
        ("fanuc", "#1=SIN[#2]*3.+#[4+#5]"),
        ("linuxcnc", "#<depth>=[3 + #1]"),
        ("siemens", "R1=R2+5*SIN(R3)"),
        ("siemens", "DEPTH=5"),
    ],
)
def test_values_for_variables_lose_the_place_alone(control: str, blocks: str) -> None:
    text = f"G90 G94 G17\nG54\nG0 X0. Y0. Z15.\nG1 Z-1. F240.\n{blocks}\nX0. Y0. Z-1.\n{RUN}G0 Z15.\nM2\n"
    assert three_axes(text, control) != text.encode()


@pytest.mark.parametrize("block", ["L X+Q1 RL F300", "L IX+1 RR", "L X+Q1 M136", "L M144 X+Q1"])
def test_paths_of_klartext_that_tell_more_than_a_place_stay(block: str) -> None:
    cut = "".join(f"L X+{5 * k} Y+{k % 2}\n" for k in range(3, 8))
    text = f"0 BEGIN PGM X MM\nL X+0 Y+0 Z+5 R0 FMAX\n{block}\nL X+10 Y+0 Z-1 F300\n{cut}L Z+50 FMAX\nEND PGM X MM\n"
    assert three_axes(text, "heidenhain") == text.encode()


def test_a_feed_per_revolution_of_klartext_is_not_ended_by_a_word_of_others() -> None:
    text = f"G90 G95 G17\nG54\nG0 X0. Y0. Z15.\nG1 Z-1. F0.2\nM137\nG0 X0. Y0. Z-1.\nG1 X5. Y0.\n{RUN}G0 Z15.\nM30\n"
    assert three_axes(text, "fanuc") == text.encode()


def test_words_of_a_dwell_are_not_those_of_the_blending() -> None:
    text = f"G21 G90 G94 G17\nG64 P0.03 Q0.01\nG0 X0 Y0 Z15\nG4 P1.5\nG1 Z-1 F240\n{RUN}G0 Z15\nM2\n"
    new = three_axes(text, "linuxcnc").decode()
    assert re.findall(r"G64 .*", new)[-1] == "G64 P0.03 Q0.01"
    assert new.count("P1.5") == 1


# seeded programs


def seeded(seed: int) -> str:
    """Random program of LinuxCNC: cuts between cycles, offsets, variables, subprograms, distances, curves, skips."""
    rng = random.Random(seed)
    subprograms = rng.randint(0, 2)
    inside = ["G91", "G90", "G0 Z5", "G1 Z1 F100", "G55", "X1 Y1", "G2 X1 Y1 R5", "#5=3", "G4 P0.1", "G20", "G21"]
    lines = []
    for number in range(subprograms):
        body = "\n".join(rng.choice(inside) for _ in range(rng.randint(1, 3)))
        lines.append(f"o{100 + number} sub\n{body}\no{100 + number} endsub")
    lines.append("G21 G90 G94 G17 G40 G80 G49\nG0 X0 Y0 Z15")

    def cuts() -> list[str]:
        way = rng.choice(["G0 Z15", "G0 X1 Y1 Z15", "G0 Z15\nX3 Y4", "G1 Z-1 F200", "G4 P0.1"])
        return [way, "G1 Z-1 F300", *zigzag(rng, rng.randint(3, 7), rng.choice(["G1 ", "G01 ", "G1 G90 "]))]

    def cycle() -> list[str]:
        kind = rng.choice(["G81", "G82 P0.1", "G83 Q1", "G73 Q1", "G85", "G89 P0.2"])
        first = f"{rng.choice(['G98 ', 'G99 ', ''])}{kind} X5 Y5 Z-3 R2 F100{rng.choice(['', ' L1', ' L2', ' L3'])}"
        holes = [f"X{rng.randint(0, 30)} Y{rng.randint(0, 30)}" for _ in range(rng.randint(0, 4))]
        return [first, *holes, rng.choice(["G80\nG0 Z15", "G80\nG1 Z0 F200", "G0 Z15", "G1 Z3 F100"])]

    others = [
        *("G10 L2 P2 X1 Y-6 Z0", "G10 L20 P1 X0 Y0", "G10 L2 P1 R20", "G10 L2 P1 R0", "G10 L20 P2 Z3"),
        *("G54", "G55", "G59.1", "G92 X3", "G92.1", "G52 X1", "G92.2", "G92.3"),
        *("#1=5", "#1=5 G91", "#1=3 G0", "#2=[3+4] X#2", "G0 X[#1+2]", "G1 Y#2 F200", "#1=4 F300", "#<a>=5 Z20"),
        *("G90 #1=2", "N50 #1=7 G91", "G64 P0.01", "G61", "G64 P0.02 Q0.01", "G53 G0 Z0", "G4 P0.2 G90", "G28 Z5"),
        *("G91 G28 Z0\nG90", "G0 X0 Y0 Z2\nG1 F200 X0 Y0\nG2 X10 Y0 R7\nG1 X5", "G91", "G90", "G91 X1", "G20", "G21"),
        *("G0 X0 Y0 Z2\nG1 F200 X0 Y0\nG18 G2 X10 Z2 R9\nG17\nG1 X2", "G93\nG1 X5 Y5 F20\nX8 Y3 F20\nG94 F200"),
        *("/G0 Z15", "/G91", "/X5", "/#1=5 G91", "/G0 X#1", "M3 S100", "T3", "(hello)", "G40", "F300"),
        "G0 X0 Y0 Z1\nG5.2 X1 Y1 P1 L3\nX2 Y2 P1\nX3 Y0 P1\nG5.3\nG1 X9",
        *(f"o{100 + number} call" for number in range(subprograms)),
    ]
    for _ in range(rng.randint(4, 14)):
        lines += rng.choice((cuts, cuts, cycle, lambda: [rng.choice(others)], lambda: [rng.choice(others)]))()
    return "\n".join([*lines, "G0 Z15", "M2"]) + "\n"


@pytest.mark.linuxcnc
@pytest.mark.skipif(shutil.which("rs274") is None, reason="LinuxCNC is not installed")
def test_linuxcnc_finds_the_same_outside_of_runs_in_seeded_programs(tmp_path: Path) -> None:
    changed = 0
    for seed in range(how_many(60, 1000)):
        text = seeded(seed).encode()
        try:
            old = by_rs274(text, tmp_path)
        except RefusedError:  # no program of LinuxCNC
            continue
        new = three_axes(text, "linuxcnc")
        assert difference(old, by_rs274(new, tmp_path), EPS) == "", seed
        changed += new != text
    assert changed >= how_many(15, 250)


def seeded_iso(seed: int) -> str:
    """Random program of FANUC's and Haas's words: cycles with L, G10, subprograms, distances, cuts."""
    rng = random.Random(seed)
    lines = ["%", "O7", "G21 G90 G94 G17 G40 G49 G80", "G54 G0 X0. Y0. Z25."]
    blocks = [
        "G99 G81 X12. Y8. Z-7. R3. F110. L{n}\nX24. Y9.\nX37. Y14.\nG80",
        "G98 G83 X12. Y8. Z-7. R3. Q2. F110. L{n}\nX24. Y9.\nX37. Y14.",
        "G91 G81 X5. Y0. Z-10. R-12. F100. L{n}\nG80\nG90",
        "G10 L2 P{n} X0. Y0. Z0.",
        "G10 L20 P{n} X0. Y0.",
        "G10 L2 P1 X0. Y0.\nX70. Y0. Z15.\nX70. Y45.",
        "M98 P100 L{n}",
        "G0 X5. Y5. Z15.\nX7. Y8.",
        "G0 Z25.",
        "G1 Z-1. F200.\n" + RUN,
        "G1 Z-1. F200.\n" + RUN,
        "G0 X0. Y0.\nG1 Z-2. F200.\n" + RUN,
        "G91\nG1 X2. Y1.\nX2. Y-1.\nX2. Y1.\nX2.\nG90",
        "#100=#100+1",
        "/G0 Z25.",
        "G55",
    ]
    lines += [rng.choice(blocks).format(n=rng.randint(0, 3)) for _ in range(rng.randint(4, 14))]
    return "\n".join([*lines, "G0 Z25.", "M30", "%"]) + "\n"


@pytest.mark.parametrize(("number", "control"), [(0, "fanuc"), (1, "haas"), (2, "mitsubishi")])
def test_plain_readers_find_the_same_outside_of_runs_in_seeded_programs(number: int, control: str) -> None:
    """By default each program for one of the controls."""
    changed = 0
    for seed in share(range(how_many(60, 1000)), 3, number):
        text = seeded_iso(seed).encode()
        new = three_axes(text, control)
        assert difference(by_words(text), by_words(new), EPS) == "", seed
        changed += new != text
    assert changed >= 5


@pytest.mark.parametrize("name", [name for name in PROGRAMS if "linuxcnc" not in name])
def test_plain_readers_find_the_same_in_programs_of_each_control(name: str) -> None:
    control, machine, text = PROGRAMS[name]
    new = filter_program(text.encode(), form_of(control, machine), cs.Settings(tolerance=EPS, lines="dense")).data
    assert new != text.encode()
    scale = 25.4 if "inch" in name else 1.0
    assert difference(by_words(text.encode()), by_words(new), EPS / scale) == ""


@pytest.mark.parametrize("name", ["linuxcnc_boat-xyzac.ngc", "linuxcnc_impeller-7bl-xyzac.ngc"])
def test_linuxcnc_finds_the_same_in_real_programs(name: str, corpus: Path, tmp_path: Path) -> None:
    text = (corpus / "nc" / name).read_bytes()
    new = filter_program(text, form_of("linuxcnc", "xyzac-trt"), cs.Settings(tolerance=EPS, lines="dense")).data
    assert new != text
    assert difference(by_rs274(text, tmp_path), by_rs274(new, tmp_path), EPS) == ""


def test_plain_readers_find_the_same_in_a_real_program(corpus: Path) -> None:
    text = (corpus / "nc" / "nx_haas_umc750_inch_head.nc").read_bytes()
    new = filter_program(text, form_of("haas", "table-bc"), cs.Settings(tolerance=EPS, lines="dense")).data
    assert new != text
    assert difference(by_words(text), by_words(new), EPS / 25.4) == ""
