"""NC text to path elements, as a control understands it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cornersmooth.control import source
from cornersmooth.errors import InputError, SettingsError
from cornersmooth.kinematics import load_machine
from cornersmooth.nc_reader import read_nc
from cornersmooth.nc_reader.elements import Element
from cornersmooth.nc_reader.rotary import MOST_LINES
from cornersmooth.nc_reader.tool import written_at
from oracle.messages import one_line
from verify.writing import simple_text, wavy

HEAD = b"%\nO0001\nG21 G90 G94 G17 G40 G49 G80\n"
CURVE = b"""G6.2 P4 K0. X0.0000 Y0.0000 Z0.0000 U0.0000 V0.0000 W10.0000 R1.
K0. X1.0000 Y0.0000 Z0.0000 U1.0000 V0.0000 W10.0000 R1.
K0. X2.0000 Y0.0000 Z0.0000 U2.0000 V0.0000 W10.0000 R2.
K0. X2.0000 Y1.0000 Z0.0000 U2.0000 V1.0000 W10.0000 R1.
K0.5 X2.0000 Y2.0000 Z0.0000 U2.0000 V2.0000 W10.0000 R1.
K1.
K1.
K1.
K1.
"""
START = (
    b"G0 X0.0000 Y0.0000 Z0.0000 U0.0000 V0.0000 W10.0000\nG1 X0.0000 Y0.0000 Z0.0000 U0.0000 V0.0000 W10.0000 F100.\n"
)


def codes(text):
    return [(problem.code, problem.nc_line) for problem in read_nc(text).problems]


def test_lines_with_vectors():
    nc = read_nc(HEAD + b"G43.5 H1\nG0 X1. Y2. Z3. I0. J0.6 K0.8\nG1 X1.5 F250.\nY-2.5 I1.\nG0 Z50.\nM30\n%\n")
    assert nc.kind.tolist() == [Element.RAPID, Element.LINE, Element.LINE, Element.RAPID]
    assert nc.tip.tolist() == [[1, 2, 3], [1.5, 2, 3], [1.5, -2.5, 3], [1.5, -2.5, 50]]
    assert nc.second.tolist() == [[0, 0.6, 0.8], [0, 0.6, 0.8], [1, 0, 0], [1, 0, 0]]
    assert nc.line.tolist() == [5, 6, 7, 8]
    assert np.isnan(nc.feed[[0, 3]]).all()
    assert nc.feed[[1, 2]].tolist() == [250, 250]
    assert [(event.letter, event.value, event.element) for event in nc.events][-1] == ("M", 30.0, 4)
    assert nc.second_is == "vector"
    assert nc.problems == ()


def test_inches_become_millimetres():
    nc = read_nc(
        b"G20 G90\nG43.5 H1\nG0 X1.00000 Y0.00000 Z2.00000 I0.0000000 J0.0000000 K1.0000000\nG1 X1.50000 F10.\n"
    )
    assert nc.units == "inch"
    assert np.allclose(nc.tip, [[25.4, 0, 50.8], [38.1, 0, 50.8]], atol=1e-12)
    assert nc.feed[1] == pytest.approx(254.0)
    assert nc.tip_step == pytest.approx(25.4e-5)
    assert nc.second_step == pytest.approx(1e-7)


def test_the_centre_of_an_arc_is_no_tool_vector():
    lines = b"G0 X0. Y0. Z3.0000\nG1 Z0. F100.\nG2 X10. Y0. %s\nM30\n"
    with_radius, with_centre = (read_nc(HEAD + lines % word, control="fanuc") for word in (b"R5.", b"I5.0000 J0.0000"))
    assert with_centre.problems == ()
    assert with_centre.second_step == with_radius.second_step == 0.0


def test_curve():
    nc = read_nc(HEAD + START + CURVE + b"G1 X2.0000 Y3.0000 Z0.0000 U2.0000 V3.0000 W10.0000\n")
    assert nc.problems == ()
    assert nc.kind.tolist() == [Element.RAPID, Element.LINE, Element.CURVE, Element.LINE]
    assert nc.line.tolist() == [4, 5, 6, 15]
    assert nc.curves.knot.tolist() == [0, 0, 0, 0, 0.5, 1, 1, 1, 1]
    assert nc.curves.weight.tolist() == [1, 1, 2, 1, 1]
    assert nc.curves.point[2].tolist() == [2, 0, 0, 2, 0, 10]
    assert nc.curves.point[3].tolist() == [2, 1, 0, 2, 1, 10]
    assert nc.tip[2].tolist() == [2, 2, 0]
    assert nc.second_is == "point"


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        (b"K0. X1.0000", b"X1.0000", ("CS512", 7)),
        (b"K1.\nK1.\nK1.\nK1.\n", b"K1.\nK1.\nK1.\n", ("CS513", 6)),
        (b"K1.\nK1.\nK1.\nK1.\n", b"K1.\nK1.\nK1.\nK1.\nK1.\n", ("CS513", 6)),
        (b"K0.5 X2", b"K-0.5 X2", ("CS516", 10)),
        (b"K1.\nK1.\nK1.\nK1.\n", b"K1.\nK1.\nK1.\nK2.\n", ("CS517", 6)),
        (b"K0.5 X2", b"K0. X2", ("CS517", 10)),  # five times: the curve begins at its second control point
        (b"R2.", b"R0.", ("CS518", 8)),
        (b"P4 K0. X0.0000", b"P4 K0. X0.0001", ("CS519", 6)),
        (b"V0.0000 W10.0000 R1.\nK0. X1.", b"V0.0001 W10.0000 R1.\nK0. X1.", ("CS519", 6)),
        (b"R2.\n", b"R2. F50.\n", ("CS511", 8)),
    ],
)
def test_rules_of_curves(old, new, expected):
    assert old in CURVE
    found = codes(HEAD + START + CURVE.replace(old, new))
    assert expected in found


@pytest.mark.parametrize(
    "more", [b"R2.\n(COMMENT)\n", b"R2.\n\n", b"R2. (COMMENT)\n", b"(COMMENT) R2.\n", b"R2.\nN5\n"]
)
def test_comments_inside_a_curve_do_not_break_it(more):
    assert codes(HEAD + START + CURVE.replace(b"R2.\n", more)) == []


def test_words_inside_a_curve_break_it():
    found = codes(HEAD + START + CURVE.replace(b"R2.\n", b"R2.\nM8\n"))
    assert ("CS513", 6) in found


def test_arcs_by_radius_and_by_centre():
    nc = read_nc(
        HEAD + b"G43 H1\nG0 X10. Y0. Z0.\nG3 X0. Y10. R10. F100.\nG2 X10. Y0. I0. J-10.\nG3 X10. Y0. I-10. J0.\n"
    )
    assert np.allclose(nc.arcs.centre, 0, atol=1e-12)
    assert np.allclose(np.degrees(nc.arcs.sweep), [90, 90, 360])
    assert nc.arcs.normal[:, 2].tolist() == [1, -1, 1]
    nc = read_nc(HEAD + b"G43.5 H1\nG18\nG0 X10. Y5. Z0. I0. J1. K0.\nG2 X0. Y6. Z10. R10. F100.\n")
    # about +Y a clockwise G2 turns from +X towards +Z
    assert np.allclose(nc.arcs.centre[0][[0, 2]], 0, atol=1e-12)
    assert np.allclose(np.degrees(nc.arcs.sweep), [90])
    assert codes(HEAD + b"G43 H1\nG0 X0. Y0. Z0.\nG2 X30. Y0. R10. F100.\n") == [("CS520", 6)]


def test_where_the_tool_is_must_be_known_before_it_cuts():
    nc = read_nc(HEAD + b"G43 H1\nG0 X1. Y2.\nZ50.\nG1 Z0. F100.\n")
    assert nc.tip.tolist() == [[1, 2, 50], [1, 2, 50], [1, 2, 0]]
    for text in (b"G0 X1. Y2.\nG1 Z0. F100.\n", b"G0 X1.\nG1 X3. F100.\n", b"G0 Z5.\nG1 X1. Y2. F100.\n"):
        with pytest.raises(InputError, match="not all of the position is known") as caught:
            read_nc(HEAD + b"G43 H1\n" + text)
        assert caught.value.line == 6
    # points on the axis that begin in the middle
    with pytest.raises(InputError, match="not all of the position is known") as caught:
        read_nc(HEAD + b"G43 H1\nG0 X1. Y2. Z3.\nG1 X2. F100.\nM8\nX3. U3. V2. W13.\n")
    assert caught.value.line == 8
    nc = read_nc(HEAD + b"G43 H1\nG0 Z90.\nM8\nX1. Y2. Z3. U1. V2. W13.\nG1 X2. U2. F100.\n")
    assert nc.second.tolist() == [[1, 2, 13], [1, 2, 13], [2, 2, 13]]


def test_vectors_must_be_in_force_and_have_a_length():
    lines = b"G43 H1\nG0 X0. Y0. Z0.\nG1 X1. F100.\nG2 X2. Y1. I0. J1.\nG1 X3. I0.1 J0. K1.\n"
    assert codes(HEAD + lines) == [("CS506", 8)]
    assert codes(HEAD + b"G43.5 H1\nG0 X0. Y0. Z0. I0. J0. K1.\nG1 X1. F100.\nX2. I0. J0. K0.\n") == [("CS507", 7)]


def test_curves_name_their_axes_at_once_and_where_they_may_stand():
    def text(on: bytes, word: bytes) -> bytes:
        start = HEAD + b"G43 H1\n" + on + b"G0 X0. Y0. Z0.\nG1 X1. F100.\nG6.2 P2 K0. X1. Y0." + word
        return start + b"\nK0. X2. Y1. Z1.\nK1. X3. Y0. Z0.\nK2.\nK2.\n"

    assert codes(text(b"", b"")) == [("CS511", 8), ("CS511", 9)]
    assert codes(text(b"", b" Z0.")) == []
    for on, wrong in ((b"", 1), (b"G5 P0\n", 1), (b"G5 P1\n", 1), (b"G5 P10000\n", 0)):
        found = read_nc(text(on, b" Z0."), control="mitsubishi").problems
        assert [problem.code for problem in found] == wrong * ["CS506"]


def test_events_stand_where_they_stand():
    nc = read_nc(
        HEAD + b"T3 M6\nS1200 M3\nG43.5 H3\nG0 X0. Y0. Z0. I0. J0. K1.\nM8\nG4 P1500\nG1 X1. F10.\nM0\nG1 X2.\nM30\n"
    )
    found = [(event.element, event.letter, event.value) for event in nc.events if event.letter in "TSM"]
    assert found == [(0, "T", 3), (0, "M", 6), (0, "S", 1200), (0, "M", 3), (1, "M", 8), (2, "M", 0), (3, "M", 30)]
    assert [event.text for event in nc.events if event.letter == "G" and event.value == 4] == ["1500"]


def test_feed_modes():
    nc = read_nc(HEAD + b"G43.5 H1\nG0 X0. Y0. Z0. I0. J0. K1.\nG95\nG1 X1. F0.2\nG94\nG1 X2. F300.\n")
    assert nc.per_revolution.tolist() == [False, True, False]
    assert nc.feed[1:].tolist() == [0.2, 300]


def test_unreadable_text_says_where():
    with pytest.raises(InputError) as caught:
        read_nc(b"%\nG21 G90\nG1 X1.0 ?\n", name="part.nc")
    assert one_line(caught.value).startswith("part.nc:3: error: '?' is no NC word")
    for block in (b"G X1.0", b"G1 X Y2.0"):  # a letter alone is no call of a program, nor zero
        with pytest.raises(InputError, match="is no NC word"):
            read_nc(block + b"\n", control="siemens")
    for digits in (14, 200, 400):  # larger ones overflow where they are squared
        with pytest.raises(InputError, match=r"part.nc:3: error\[\w+\]: 'X9999.* is no NC word"):
            read_nc(b"%%\nG21 G90\nG1 X%b.5 F100.\n" % (b"9" * digits), name="part.nc")
    with pytest.raises(InputError, match="G68 is not understood"):
        read_nc(b"G68\n")
    with pytest.raises(SettingsError, match="unknown control"):
        read_nc(b"", control="no such")


def test_number_that_is_none_is_refused():
    with pytest.raises(InputError, match=":2: error"):
        read_nc(b"G0 X1.0 Y1.0\nG1 X1.0.0 Y2.0\n")


@pytest.mark.parametrize("form", ["g1", "g6.2"])
def test_runs_and_single_lines_give_the_same(form, tmp_path):
    tip, axis = wavy(60)
    text = simple_text(tip, axis, 0.02, 10.0, form)
    fast = read_nc(text)
    # a block number, a comment or lower case make every line one that is read on its own
    spoilt = b"\n".join(line.lower() if line[:1] in b"GK" else line for line in text.split(b"\n"))
    path = tmp_path / "part.nc"
    path.write_bytes(spoilt)
    slow = read_nc(path)
    for name in ("kind", "tip", "second", "line", "feed"):
        assert np.array_equal(getattr(fast, name), getattr(slow, name), equal_nan=name == "feed"), name
    for name in ("element", "order", "points", "point", "weight", "knot"):
        assert np.array_equal(getattr(fast.curves, name), getattr(slow.curves, name)), name
    assert fast.problems == slow.problems == ()


def test_chunks_make_no_difference(monkeypatch):

    tip, axis = wavy(60)
    text = simple_text(tip, axis, 0.02, 10.0, "g6.2")
    whole = read_nc(text)
    monkeypatch.setattr(source, "CHUNK", 500)
    pieces = read_nc(text)
    assert np.array_equal(whole.tip, pieces.tip)
    assert np.array_equal(whole.curves.knot, pieces.curves.knot)
    assert np.array_equal(whole.curves.element, pieces.curves.element)
    assert pieces.problems == ()


def test_cycles_of_siemens_stand_alone_and_need_no_speed() -> None:
    head = b"G90 G94 G17 G40 G710\nG0 X1. Y2. Z60.\n"
    drilled = read_nc(head + b"CYCLE81(60.0,0.0,3.0,-9.0)\n", control="siemens")
    assert drilled.tip[:, 2].tolist() == [60.0, 60.0, 3.0, -9.0, 60.0]
    with pytest.raises(InputError, match="MCALL is not understood"):
        read_nc(head + b"MCALL CYCLE81(60.0,0.0,3.0,-9.0)\n", control="siemens")


def test_finer_digits_of_a_later_chunk_leave_the_tool_in_the_spindle(monkeypatch):
    """Words of the machine's axes with a head: the tip hangs on the length of the tool that was changed in before."""
    machine = replace(load_machine("head-ac"), tool_length=100.0, tool_lengths=((1, 50.0),))
    text = HEAD + b"G91 G28 Z0.\nG90\nT1 M6\nG43 H1\nG0 X0. Y0. A0. C0.\nZ50.\nG1 X1. A10. F100.\n"
    text += b"".join(b"X%d. A10.\n" % k for k in range(2, 60)) + b"X60.0001 A20.0001\n"
    whole = read_nc(text, machine=machine, tcp=False)
    monkeypatch.setattr(source, "CHUNK", 500)
    cut = read_nc(text, machine=machine, tcp=False)
    assert cut.tip[-1].tolist() == whole.tip[-1].tolist()


def test_digits_before_the_first_word_are_none():
    with pytest.raises(InputError, match=":4: error"):
        read_nc(b"G43.5 H1\nG0 X0. Y0. Z0. I0. J0. K1.\nG1 X0.5 F100.\n3 X1.0\nX2.0\n")


def test_block_numbers_make_no_difference(monkeypatch):

    tip, axis = wavy(60)
    text = simple_text(tip, axis, 0.02, 10.0, "g6.2")
    numbered = b"\n".join(
        b"N%d %b" % (i, line) if line[:1] in b"GK" else line for i, line in enumerate(text.split(b"\n"))
    )
    monkeypatch.setattr(source, "CHUNK", 500)
    plain, other = read_nc(text), read_nc(numbered)
    assert np.array_equal(plain.tip, other.tip)
    assert np.array_equal(plain.curves.point, other.curves.point)
    assert other.problems == ()


@pytest.mark.parametrize("c", ["1250.", "125000.", "174139545."])
def test_an_angle_that_lost_its_point_is_found_and_has_few_lines(c):
    text = (
        HEAD + b"G43.4 H1\nG0 X0. Y0. Z0. A20. C0.\nG1 X1. A20. F100.\nX2. A30. C" + c.encode() + b"\nX3. C0.\nM30\n%\n"
    )
    nc = read_nc(text, machine=load_machine("table-ac"))
    own = np.flatnonzero(nc.line == 7)
    assert len(own) <= MOST_LINES
    assert nc.tip[own[-1], 0] == pytest.approx(2.0, abs=1e-12)
    assert np.degrees(np.arccos(nc.second[own[-1], 2])) == pytest.approx(30, abs=1e-9)
    assert ("CS526", 7) in [(problem.code, problem.nc_line) for problem in nc.problems]


@pytest.mark.parametrize("tcp", [True, False])
def test_an_arc_is_turned_with_the_table_that_carries_it(tcp: bool) -> None:
    head = (
        f"%\nO1\nG21 G90 G94 G17 G40 G49 G80\nG54\nG0 A20. C10.\n{'G43.4' if tcp else 'G43'} H1\nG0 X50. Y0.\nG0 Z5.\n"
    )
    arc, lines = (
        read_nc(f"{head}{block}\nM30\n%\n".encode(), machine=load_machine("table-ac"), tcp=tcp)
        for block in ("G2 X60. Y0. I5. J0. F500.", "G1 X55. Y5. F500.\nX60. Y0.")
    )
    element = np.array([int(np.argmax(arc.kind == Element.ARC))])
    tip, _ = written_at(arc, element, np.array([0.5]))
    np.testing.assert_allclose(tip[0], lines.tip[-2], atol=1e-9)
    assert arc.unlooked == ()


def test_an_arc_on_which_an_axis_turns_is_not_looked_at() -> None:
    head = "%\nO1\nG21 G90 G94 G17 G40 G49 G80\nG54\nG0 A20. C10.\nG43.4 H1\nG0 X50. Y0.\nG0 Z5.\n"
    text = f"{head}G2 X60. Y0. I5. J0. A0. F500.\nM30\n%\n"
    assert read_nc(text.encode(), machine=load_machine("table-ac")).unlooked == ((9, "an arc on which an axis turns"),)


def test_a_word_beside_a_dwell_changes_what_holds():
    text = b"TRAORI\nORIWKS ORICURVE\nG0 X0 Y0 Z0 XH=0 YH=0 ZH=10\nG1 X1 F100\nG4 F1.5 TRAFOOF\nG1 X2 XH=1 YH=1 ZH=11\n"
    (found,) = read_nc(text, control="siemens").problems
    assert (found.code, found.nc_line) == ("CS506", 6)


@pytest.mark.parametrize("block", ["A3=1", "G1 B3=1 C3=1", "X2 A3=1 B3=0"])
def test_a_vector_beside_points_on_the_tool_axis_is_not_read_over(block):
    text = f"TRAORI\nORIWKS ORICURVE\nG0 X0 Y0 Z0 XH=0 YH=0 ZH=10\nG1 X1 F100\n{block}\nX3 XH=3\n".encode()
    found = read_nc(text, control="siemens").problems
    assert ("CS503", 5, "a tool vector beside points on the tool axis") in {(p.code, p.nc_line, p.text) for p in found}


@pytest.mark.parametrize("word", ["M98", "M60"])
def test_motion_after_a_word_that_may_change_what_holds_was_not_looked_at(word):
    text = f"G21 G90 G94 G17\nG0 X0. Y0. Z0.\nG1 X1. F100.\n{word}\nX2.\n{word}\nM30\n".encode()
    found = read_nc(text)
    assert found.unlooked == ((5, f"motion after {word}, which may change what holds"),)
    assert found.tip[-1].tolist() == [2.0, 0.0, 0.0]


def test_another_transformation_is_no_tip_control():
    text = "{}\nORIWKS ORIVECT\nG0 X0 Y0 Z0 A3=0 B3=0 C3=1\nG1 X1 F100\n"
    first, second = (read_nc(text.format(word).encode(), control="siemens") for word in ("TRAORI", "TRAORI(2)"))
    assert first.problems == ()
    assert [problem.code for problem in second.problems] == ["CS506"]


def test_words_of_vectors_say_what_the_tool_axis_is(tmp_path):
    """Those of Siemens were overlooked: the axis had room as if no word said anything of it."""
    text = b"G90 G94 G17 G40 G710\nTRAORI\nORIWKS ORIVECT\nG0 X1.000 Y2.000 Z3.000 A3=0.0000000 B3=0.1 C3=1.\n"
    nc = read_nc(text + b"G1 X2.000 F100.\nM30\n", control="siemens")
    assert (nc.tip_step, nc.second_step) == pytest.approx((1e-3, 1e-7), rel=0.01)
    assert not nc.second_room.any()
