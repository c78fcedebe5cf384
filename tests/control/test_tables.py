"""The rows of each control: well formed, inherited and taken back, and of one mind with the tables of the writer."""

from __future__ import annotations

import math
import re
import shutil
from pathlib import Path

import pytest

import cornersmooth as cs
from cornersmooth.control import table as word_tables
from cornersmooth.control.program import Act, Text, execute, listing
from cornersmooth.control.state import Rows, State
from cornersmooth.control.table import CONTROLS, UNKNOWN, UNLISTED, Row, table_of
from cornersmooth.errors import InputError
from cornersmooth.filter.runs import ProgramReader
from cornersmooth.nc_reader import read_nc
from cornersmooth.nc_reader.dialects import dialect_of
from cornersmooth.nc_words.blocks import ruled_words

GOLDEN = sorted((Path(__file__).parents[1] / "nc" / "golden").glob("*.nc"))
AXES = ("X", "Y", "Z", "A", "C")


def after(control: str, *blocks: str) -> State:
    """State behind some blocks, where all places were known and a tip control of both kinds was on."""
    lexer, state = dialect_of(control, "AC").lexer, State(table_of(control), AXES)
    state.place, state.feed = dict.fromkeys(AXES, 1.0), 100.0
    state.groups |= {"motion": "line", "tip": "both"}
    for block in blocks:
        execute(state, block.encode(), lexer)
    return state


@pytest.mark.parametrize("control", CONTROLS)
def test_rows_are_well_formed(control: str) -> None:
    table = table_of(control)
    assert table.row("G0" if control != "heidenhain" else "RAPID").sets == (("motion", "rapid"),)


@pytest.mark.parametrize("text", ["tipp=off", "tip=of", "places", "units=inches", "feed", "tip=off; length; off"])
def test_a_row_with_a_slip_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not one of"):
        Row.all_of("G43", text)


@pytest.mark.parametrize("control", CONTROLS)
def test_a_word_without_a_row_may_do_anything(control: str) -> None:
    assert table_of(control).row("WHOKNOWS") is UNKNOWN
    state = after(control, "G777" if control != "heidenhain" else "WHO KNOWS")
    assert set(state.groups.values()) == {None}
    assert all(map(math.isnan, (*state.place.values(), state.feed)))


@pytest.mark.parametrize("control", CONTROLS)
def test_blocks_that_the_writer_has_for_tip_control_do_that(control: str) -> None:
    """The writer's table is the manual told again: what switches a mode on and off there does so here."""
    tip, count = {"vector": ("vectors", "both"), "angles": ("angles", "both")}, 0
    for form in cs.nc.load_control(control).forms.values():
        for orientation, mode in form.modes.items():
            if orientation not in tip or not mode.on or control == "linuxcnc":  # there the machine's file has the words
                continue
            on = [block.replace("{offset}", "1") for block in mode.on]
            state = after(control, *on)
            assert state.groups["tip"] in tip[orientation], (form.name, orientation)
            assert state.frames == ()
            off = after(control, *on, *mode.off)
            assert off.groups["tip"] == "off", (form.name, orientation)
            count += 1
    assert count or control in ("linuxcnc", "generic")


@pytest.mark.parametrize("control", CONTROLS)
def test_units_coolant_and_spindle_of_the_writer_are_those_of_the_table(control: str) -> None:
    table = cs.nc.load_control(control)
    for units, word in table.layout.units.items():
        block = f"BEGIN PGM A {word}" if control == "heidenhain" else word
        assert after(control, block).groups["units"] == units
    for name, blocks in table.words.coolant.items():
        state = after(control, *(f"L {block}" if control == "heidenhain" else block for block in blocks))
        assert state.groups["coolant"] in (name, "FLOOD" if name == "ON" else name)
        assert state.groups["motion"] == "line"


@pytest.mark.parametrize("control", CONTROLS)
def test_feeds_of_rising_arcs_are_read_as_they_are_written(control: str) -> None:
    forms = cs.nc.load_control(control).forms.values()
    written = {mode.feed_in_plane for form in forms for mode in form.modes.values()}
    assert written == {read_nc(b"", control=control).feed_in_plane}
    assert written == {control in ("fanuc", "haas", "mitsubishi", "generic")}


@pytest.mark.parametrize("path", GOLDEN, ids=[path.stem for path in GOLDEN])
def test_every_word_that_the_writer_writes_has_a_row(path: Path) -> None:
    """Nothing but the end of a program makes all unknown."""
    parts = re.fullmatch(r"\w+\.(\w+?)-(?:g1|g6\.2|bspline|poly|spl)-?(.*?)(-axes)?", path.stem)
    assert parts is not None
    control, machine, _ = parts.groups()
    reader = ProgramReader(control, cs.load_machine(machine) if machine else None)
    ends = [
        item.text.decode()
        for item in reader.stream(Text.of(path.read_bytes()))
        if isinstance(item, Act) and item.after.groups["units"] is None
    ]
    assert ends
    assert re.fullmatch(r"(N?\d+ )?(M30|M2|%|END PGM.*|L M30)", ends[0].strip()), ends[0]


def test_a_table_that_is_like_another_has_its_rows_and_takes_some_back(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A shop's Haas that has G43.4, a word of its own, and not G254."""
    lists = Path(str(word_tables._LISTS))
    shutil.copytree(lists, tmp_path / "lists")
    (tmp_path / "lists" / "shop.toml").write_text(
        'like = "haas"\n[grammar]\n[words]\n"G254" = ""\n"M321" = "nothing; alone; the pallet"\n'
        '"G43.4" = "tool_length=. tip=angles length: H\\\\d+!=;; tip control"\n'
    )
    monkeypatch.setattr(word_tables, "_LISTS", tmp_path / "lists")
    word_tables.word_table.cache_clear()
    try:
        shop, haas = table_of.__wrapped__("shop"), table_of("haas")
    finally:
        word_tables.word_table.cache_clear()
    (mine, _), (theirs, _) = (ruled_words(table, ("G43.4", "H1")) for table in (shop, haas))
    assert mine[1].tip_on
    assert theirs[1] is UNLISTED
    ((_, pallet),), ((_, any_function),) = (ruled_words(table, ("M321",)) for table in (shop, haas))
    assert pallet.alone
    assert any_function.compared
    assert [ruled_words(table, ("G254",))[0][1] is UNLISTED for table in (shop, haas)] == [True, False]
    assert haas.row("G43.4") is UNKNOWN
    assert shop.row("G43.4").sets == (("tool_length", "."), ("tip", "angles"))
    assert shop.row("G43.4").beside == {"H"}
    assert shop.row("G234") == haas.row("G234")
    assert shop.row("G254") is UNKNOWN
    assert shop.row("M321").does == {"nothing"}
    assert shop.row("M88").sets == (("coolant", "THRU"),)


@pytest.mark.parametrize(
    ("control", "block", "lost"),
    [
        ("fanuc", "G4 P500 X2.", ""),
        ("fanuc", "G43.4 H1", "XYZ"),
        ("fanuc", "G10 L2 P1 X5.", "XYZAC"),
        ("fanuc", "G55", "XYZAC"),
        ("fanuc", "M6", "XYZAC"),
        ("fanuc", "G1 X5. L2", "XYZAC"),
        ("linuxcnc", "G43 H1", "XYZ"),
        ("linuxcnc", "G53 G0 Z0", "XYZAC"),  # under tip control the part turns with the tables
        ("siemens", 'T="MILL"', "XYZAC"),
        ("siemens", "MCALL CYCLE81(1,2,3)", "XYZAC"),
        ("siemens", "R1=5", "XYZAC"),
        ("siemens", "X=R1", "X"),
        ("heidenhain", "L X+5 RR", ""),
        ("heidenhain", "CC X+5 Y+5", ""),
        ("heidenhain", "L IX+5", "XYZAC"),
    ],
)
def test_what_a_block_leaves_unknown(control: str, block: str, lost: str) -> None:
    state = after(control, block)
    assert "".join(letter for letter in AXES if math.isnan(state.place[letter])) == lost


def test_modal_words_that_keep_their_letters() -> None:
    """R of an arc is no word of its own, nor in the blocks after it."""
    assert after("fanuc", "G2 X5. R8.", "X9. R8.").place == {"X": 9.0, "Y": 1.0, "Z": 1.0, "A": 1.0, "C": 1.0}
    assert math.isnan(after("fanuc", "G1 X5. R8.").place["X"])
    assert after("linuxcnc", "G64 P0.03 Q0.01", "G4 P1.5").rounding == "G64 P0.03 Q0.01"
    assert after("haas", "G154 P2", "X5.", "G154 P2").place["X"] == 5.0
    assert math.isnan(after("haas", "G154 P2", "X5.", "G154 P3").place["X"])


def smoothed_frames(control: str, *lines: str) -> tuple[str, ...] | None:
    """Frames at the end of a program."""
    stream = ProgramReader(control, None).stream(Text.of("".join(f"{line}\n" for line in lines).encode()))
    return [item.after(1) if isinstance(item, Rows) else item.after for item in stream][-1].frames


@pytest.mark.parametrize(
    ("control", "lines", "frames"),
    [
        # a call leaves off what the program names nowhere
        ("fanuc", ["M98 P5", "X1."], ()),
        ("fanuc", ["IF [#1 EQ 1] GOTO 5", "X1."], ()),
        ("fanuc", ["M98 P5", "X1.", "G69"], ()),
        ("fanuc", ["M98 P5", "G0 X1.", "G50"], ()),
        ("fanuc", ["G68 R30.", "G69", "M98 P5"], None),
        ("fanuc", ["G68 R30.", "M98 P5"], None),
        ("fanuc", ["G54.2 P1"], ("G54.2",)),
        ("fanuc", ["G54.2 P1", "G54.2 P0"], ()),
        ("fanuc", ["M98 P5", "G1 X1. (G 068 IS ON)"], None),
        ("fanuc", ["M98 P5", "G69", "M98 P6"], None),
        # a word that is in no table may be a frame itself
        ("fanuc", ["G7.1 C10.", "X1."], None),
        ("haas", ["G101 X0.", "X1."], None),
        ("fanuc", ["G#1 X1."], None),
        ("siemens", ["TRACYL(40)", "X1"], None),
        ("siemens", ["MCALL CYCLE81(1,2)", "X1"], None),
        ("siemens", ["L100", "X1"], ()),
        ("siemens", ["TOROT", "TOROTOF"], ()),
        ("heidenhain", ["CALL LBL 5", "L X+1"], ()),
        ("heidenhain", ["CALL LBL 5", "PLANE RESET STAY"], ()),
        ("heidenhain", ["PLANE RESET STAY", "CALL LBL 5"], None),
        ("heidenhain", ["WHO KNOWS", "L X+1"], None),
    ],
)
def test_frames_that_are_known(control: str, lines: list[str], frames: tuple[str, ...] | None) -> None:
    assert smoothed_frames(control, *lines) == frames


@pytest.mark.parametrize("block", ["G94", "G93", "G21 G90 G94"])
def test_a_word_of_the_kind_of_feed_loses_the_feed(block: str) -> None:
    assert math.isnan(after("linuxcnc", block).feed)
    assert after("linuxcnc", f"{block} F50.").feed == 50.0


def test_a_skipped_block_leaves_what_both_ways_have() -> None:
    state = after("fanuc", "/G0 G91 X5. M8")
    assert (state.groups["motion"], state.groups["distance"], state.groups["coolant"]) == (None, None, None)
    assert state.groups["tip"] == "both"
    assert math.isnan(state.place["X"])
    assert state.place["Y"] == 1.0


def test_a_listing_shows_what_is_not_known() -> None:
    reader = ProgramReader("fanuc", None)
    shown = list(listing(reader.stream(Text.of(b"G21 G90\nG0 X1. Y2.\nG777\n"))))
    assert shown[1].endswith("rapid X1 Y2 Z? I? J? K?")
    assert shown[2].endswith("all unknown")


@pytest.mark.parametrize(
    ("control", "blocks", "group", "word"),
    [
        ("siemens", ["D1", "SUPA G0 Z0 D0"], "edge", "D1"),  # D0 suppresses for a block, and is not an edge
        ("siemens", ["D1", "WHO KNOWS"], "edge", "D1"),
        ("fanuc", ["G54.1 P2"], "offset", "G54.1 P2"),
        ("fanuc", ["G43.4 H5"], "tool_length", "G43.4"),  # H is compared with the CL file
        ("linuxcnc", ["G64 P0.01 Q0"], "path", "G64 Q0"),  # P may change from block to block
        ("heidenhain", ["L X+1 RL"], "compensation", "RL"),
    ],
)
def test_the_last_word_of_a_group_is_remembered_whatever_becomes_of_it(
    control: str, blocks: list[str], group: str, word: str
) -> None:
    assert after(control, *blocks).last_words[group].text == word


@pytest.mark.parametrize("block", ["G44 H1", "G43.1 H1", "G99.5", "G52 X1."])
def test_a_word_whose_row_says_no_more_than_that_it_loses_something_is_not_read(block: str) -> None:
    with pytest.raises(InputError, match="not understood"):
        read_nc(f"G21 G90\nG0 X0. Y0. Z5.\n{block}\nG1 X1. F100.\n".encode())
