"""Point files: every layout, every complaint, and both ways through the table."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from cornersmooth import cl
from cornersmooth.cl import points_table
from cornersmooth.cl.points import looks_like_points, read_points
from cornersmooth.errors import InputError
from cornersmooth.kinematics import load_machine
from cornersmooth.model import FeedMode, Move, Program
from oracle.loops import bytecodes
from oracle.messages import one_line
from oracle.share import how_many

TIPS = np.array([[0.0, 0, 5], [1.5, -2.25, 5], [3, 0.5, 6.125], [4, 0.5, 7]])
AXES = np.array([[0.0, 0, 1], [0.6, 0, 0.8], [0, -0.6, 0.8], [0.28, 0, 0.96]])


def rows(*parts: np.ndarray, separator: str = ",", decimals: int = 4) -> str:
    table = np.column_stack(parts)
    return "\n".join(separator.join(f"{value:.{decimals}f}" for value in row) for row in table) + "\n"


def read(text: str | bytes, **options: object) -> Program:
    data = text if isinstance(text, bytes) else text.encode()
    return read_points(data, **{"name": "path.csv"} | options)


def message(text: str | bytes, **options: object) -> str:
    with pytest.raises(InputError) as caught:
        read(text, **options)
    return one_line(caught.value)


def codes(program: Program) -> list[str]:
    """Codes of the findings but for the assumed unit and the first rapid."""
    return [finding.code for finding in program.findings if finding.code not in ("CS176", "CS177")]


def check(program: Program) -> None:
    np.testing.assert_array_equal(program.tip, TIPS)
    np.testing.assert_allclose(program.axis, AXES, atol=1e-15)


def test_a_table_that_ends_in_a_number_is_to_check() -> None:
    found = {end: cl.read(f"1,2,3\r\n4,5,6{end}".encode()).findings for end in ("", "\r\n", "\n# end")}
    assert [[one.line for one in all_ if one.code == "CS275"] for all_ in found.values()] == [[2], [], []]


# layouts


def test_plain_file_is_linear_moves_with_line_numbers():
    program = read(rows(TIPS, AXES))
    check(program)
    assert program.kind.tolist() == [Move.RAPID] + 3 * [Move.LINEAR]
    assert np.isnan(program.feed).all()
    assert program.line.tolist() == [1, 2, 3, 4]
    assert (program.source.name, program.source.format, program.source.dialect) == ("path.csv", "points", "csv")
    assert program.units == "mm"
    first = "no column says which moves are rapid: the first pose is reached in rapid, all others at feed"
    assert [finding.text for finding in program.findings] == ["the file states no units: mm assumed", first]
    assert [finding.text for finding in read(rows(TIPS, AXES), units="mm").findings] == [first]
    assert program.chains.tolist() == [[0, 3]]
    assert read(rows(TIPS), name="folder/path.csv").source.name == "path.csv"
    assert message("1,2\n", name="folder/path.csv").startswith("folder/path.csv:1: error: 2 columns")


@pytest.mark.parametrize("separator", [",", ";", "\t", " ", "  ", " , ", ", ", "\t,", " ;\t"])
@pytest.mark.parametrize("header", ["", "x,y,z,i,j,k\n", "X Y Z NX NY NZ\n", "x\ty\tz\tu\tv\tw\n", "x;y;z;ti;tj;tk\n"])
def test_separators_and_headers(separator: str, header: str):
    check(read(header + rows(TIPS, AXES, separator=separator)))


@pytest.mark.parametrize("separator", [";", "\t", " ; "])
def test_decimal_commas(separator: str):
    text = rows(TIPS, AXES, np.full(4, 1200.5), separator=separator).replace(".", ",")
    program = read(text)
    check(program)
    assert program.feed.tolist() == [1200.5] * 4
    check(read("x;y;z;i;j;k;f\n" + text))


@pytest.mark.parametrize("comma", [False, True])
def test_cells_in_quotes(comma: bool):
    """As spreadsheets and `csv.QUOTE_ALL` write them."""
    lines = rows(TIPS, AXES, np.full(4, 1200.5)).splitlines()
    quoted = "".join(",".join(f'"{cell}"' for cell in line.split(",")) + "\n" for line in lines)
    text = quoted.replace(".", ",") if comma else quoted
    program = read(text)
    assert looks_like_points(text.encode())
    check(read('"x","y","z","i","j","k","f"\n' + text))
    check(program)
    assert program.feed.tolist() == [1200.5] * 4


def test_decimal_commas_that_start_late_and_whole_numbers():
    program = read("0;0;0;0;0;1\n1;2;3;0;0;1\n1,5;2;3;0;0,6;0,8\n")
    assert program.tip[2].tolist() == [1.5, 2, 3]
    np.testing.assert_allclose(program.axis[2], [0, 0.6, 0.8], atol=1e-15)


def test_point_and_vector_as_two_comma_lists():
    check(
        read("\n".join(f"{a}, {b}, {c}; {i}, {j}, {k}" for a, b, c, i, j, k in np.column_stack((TIPS, AXES)).tolist()))
    )


def test_columns_go_by_their_names():
    text = "n;f;k;j;i;Z [mm];Y [mm];X [mm]\n" + rows(
        np.arange(4), np.full(4, 500), AXES[:, ::-1], TIPS[:, ::-1], separator=";"
    )
    program = read(text)
    check(program)
    assert program.feed.tolist() == [500] * 4
    assert codes(program) == []


@pytest.mark.parametrize(
    "names",
    [
        *("xa,ya,za,xb,yb,zb", "x1,y1,z1,x2,y2,z2", "ax,ay,az,bx,by,bz", "A_x A_y A_z B_x B_y B_z"),
        *("x,y,z,u,v,w", '"XA","YA","ZA","XB","YB","ZB"', "px,py,pz,qx,qy,qz", ""),
    ],
)
def test_second_points(names: str):
    program = read((names + "\n" if names else "") + rows(TIPS, TIPS + 12.5 * AXES))
    check(program)
    assert codes(program) == ["CS171"]
    assert "12.5 mm" in program.findings[1].text


def test_second_points_at_distance_one_are_told_from_vectors():
    far = TIPS + np.array([100.0, 50, 20])
    np.testing.assert_allclose(read(rows(far, far + AXES)).axis, AXES, atol=1e-13)


def test_second_points_whose_distance_varies_are_reported():
    program = read("xa,ya,za,xb,yb,zb\n" + rows(TIPS, TIPS + [[10], [10], [12], [10]] * AXES))
    np.testing.assert_allclose(program.axis, AXES, atol=1e-15)
    finding = program.findings[2]
    assert (finding.code, finding.severity, finding.line) == ("CS172", "warning", 4)
    assert "from 10 to 12 mm" in finding.text


def test_tips_alone_stand_along_z():
    for text in (rows(TIPS), "x,y,z\n" + rows(TIPS)):
        program = read(text)
        np.testing.assert_array_equal(program.tip, TIPS)
        np.testing.assert_array_equal(program.axis, np.tile([0.0, 0, 1], (4, 1)))
        assert codes(program) == ["CS170"]


def test_feed_is_per_minute_and_stays_until_changed():
    program = read("x,y,z,i,j,k,feedrate\n0,0,0,0,0,1,\n1,0,0,0,0,1,300\n2,0,0,0,0,1,\n3,0,0,0,0,1,2.5e2\n")
    assert np.isnan(program.feed[0])
    assert program.feed[1:].tolist() == [300, 300, 250]
    assert (program.feed_mode == FeedMode.PER_MINUTE).all()
    assert read("x,y,z,f\n0,0,0,100\n1,0,0,200\n").feed.tolist() == [100, 200]


def test_inches_become_millimetres():
    for program in (
        read(rows(TIPS, AXES, np.full(4, 10)), units="inch"),
        read("x[in],y[in],z[in],i,j,k,f[ipm]\n" + rows(TIPS, AXES, np.full(4, 10))),
        read("x_in y_in z_in i j k f\n" + rows(TIPS, AXES, np.full(4, 10), separator=" ")),
    ):
        assert program.units == "inch"
        np.testing.assert_allclose(program.tip, TIPS * 25.4, rtol=1e-15)
        np.testing.assert_allclose(program.feed, 254, rtol=1e-15)
    assert read("x (in), y (in), z (in)\n" + rows(TIPS), units="mm").units == "mm"


def test_unused_columns_are_named():
    program = read("x,y,z,i,j,k,name,load\n0,0,0,0,0,1,linear,3\n1,0,0,0,0,1,linear,4\n")
    assert codes(program) == ["CS173"]
    assert any("name, load" in finding.text for finding in program.findings)


@pytest.mark.parametrize(
    ("column", "cells", "line"),
    [
        ("tool", (1, 1, 2), 4),
        ("T", (3, 3, 3, 1), 5),
        ("spindle [rpm]", (8000, 9000, 8000), 3),
        ("coolant", ("on", "ON", "off"), 4),
        ("M", ("M8", "", ""), 3),
    ],
)
def test_a_change_of_tool_or_speed_is_an_error(column: str, cells: tuple[object, ...], line: int):
    text = f"x,y,z,i,j,k,{column}\n" + "".join(f"{n},0,0,0,0,1,{cell}\n" for n, cell in enumerate(cells))
    with pytest.raises(InputError, match=rf":{line}: .*the column '{column.split()[0]}"):
        read(text)


@pytest.mark.parametrize(
    ("column", "cells"), [("tool", (4, 4, 4)), ("t", (0, 0.5, 1.25)), ("coolant", ("on", "on", "On")), ("s", (0, 1, 2))]
)
def test_orders_that_never_change_and_times_are_columns_not_used(column: str, cells: tuple[object, ...]):
    text = f"x,y,z,i,j,k,{column}\n" + "".join(f"{n},0,0,0,0,1,{cell}\n" for n, cell in enumerate(cells))
    assert len(read(text)) == 3


# text around the rows


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_comments_blank_lines_and_line_ends(end: str):
    text = "# made by hand\n\n% x,y,z,i,j,k\n0 0 0 0 0 1 // start\n\n   \n1 0 0 0 0 1 # on\n// x y z\n2 0 0 0 0 1"
    program = read(text.replace("\n", end))
    assert program.line.tolist() == [4, 7, 9]
    assert program.tip[:, 0].tolist() == [0, 1, 2]


def test_header_in_a_comment_counts_when_it_fits():
    program = read("# z y x k j i\n" + rows(TIPS[:, ::-1], AXES[:, ::-1], separator=" "))
    check(program)
    check(read("# x y z\n" + rows(TIPS, AXES, separator=" ")))


@pytest.mark.parametrize("encode", ["utf-8-sig", "utf-8", "cp1252", "utf-16"])
def test_encodings(encode: str):
    check(read(("# Fräsbahn für Schaufel\nx,y,z,i,j,k\n" + rows(TIPS, AXES)).encode(encode)))


def test_trailing_separators_and_rows_of_separators():
    check(read(rows(TIPS, AXES).replace("\n", ",\n")))
    check(read("x,y,z,i,j,k\n" + rows(TIPS, AXES).replace("\n", ",,\n") + ",,,,,\n"))


def test_exponents_signs_and_bare_points():
    program = read("1.5E+01,+.5,-3.,0d0,0,1\n1.5D1 , 5e-1, -3 , 0,0,1.0\n")
    assert program.tip.tolist() == [[15, 0.5, -3]] * 2


# complaints

UNIT = "0,0,0,0,0,1\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("", "path.csv:1: error: no poses in the file; give one pose a line: x y z, or x y z i j k"),
        ("# nothing\n\n", "path.csv:1: error: no poses"),
        ("x,y,z,i,j,k\n", "path.csv:1: error: no poses"),
        (UNIT + "\n1,2,3,0,0\n", "path.csv:3: error: 5 columns where 6 are expected; give every line the same"),
        (UNIT + "1,2,3,0,0,1,4\n", "path.csv:2: error: 7 columns where 6 are expected"),
        (UNIT + "1,2,3,0,0\n1,2,3,0,0,1,4\n", "path.csv:2: error: 5 columns"),
        ("x,y,z\n" + UNIT, "path.csv:2: error: 6 columns where 3 are expected"),
        (UNIT + "1,2,x3,0,0,1\n", "path.csv:2: error: 'x3' is not a number; give decimal numbers"),
        (UNIT + "1,,3,0,0,1\n", "path.csv:2: error: an empty cell where a number is expected"),
        (UNIT + "1,2-3,3,0,0,1\n", "path.csv:2: error: '2-3' is not a number"),
        (UNIT + "1,1_0,3,0,0,1\n", "path.csv:2: error: '1_0' is not a number"),
        ("1,abc,3,0,0,1\n" + UNIT, "path.csv:1: error: 'abc' is not a number"),
        (UNIT + "1,nan,3,0,0,1\n", "path.csv:2: error: 'nan' is not a finite number; give finite"),
        (UNIT + "1,-Inf,3,0,0,1\n", "path.csv:2: error: '-Inf' is not a finite number"),
        (UNIT + "1,1e999,3,0,0,1\n", "path.csv:2: error: '1e999' is not a finite number"),
        (UNIT + "1,1e20,3,0,0,1\n", "path.csv:2: error: coordinate beyond 1e+07"),
        (UNIT * 3 + "1,2,3,0,0,0\n", "path.csv:4: error: tool axis of length zero; give a vector"),
        ("xa ya za xb yb zb\n0 0 0 0 0 9\n1 2 3 1 2 3\n", "path.csv:3: error: tool axis of length zero"),
        (UNIT + "1,2,3,0,0,1.02\n", "path.csv:2: error: tool axis is 1.02 long, not 1; give unit vectors"),
        ("x,y,z,i,j,k\n0,0,0,0,0,7\n", "path.csv:2: error: tool axis is 7 long"),
        ("0,0,0,0,3,7\n0,0,0,0,1,7\n", "path.csv:1: error: cannot tell whether columns 4 to 6 are axis vectors or"),
        ("0,0,0,0,0,7\n", "path.csv:1: error: cannot tell whether"),
        ("\n1,2,3,4\n", "path.csv:2: error: 4 columns and no header; give 3, 6 or 7 columns, or name them"),
        ("1,2,3,4,5\n", "path.csv:1: error: 5 columns and no header"),
        ("a,b,c\n1,2,3\n", "path.csv:1: error: cannot make out the columns of the header: no x, y and z in 'a,b,c'"),
        (
            "x,y,z,b,c\n1,2,3,4,5\n",
            "path.csv:1: error: cannot make out the columns of the header: no tool axis in b, c",
        ),
        ("x,y,z,i,j\n1,2,3,4,5\n", "path.csv:1: error: cannot make out the columns of the header: no tool axis"),
        ("x,y,z,x,y,z\n" + UNIT, "path.csv:1: error: cannot make out the columns of the header: 'x' stands there"),
        ("x[mm],y[in],z\n1,2,3\n", "path.csv:1: error: cannot make out the columns of the header: mm and inch"),
        ("x[ft],y[ft],z[ft]\n1,2,3\n", "path.csv:1: error: column 'x[ft]' is in 'ft'; give lengths in mm, m or inch"),
        ("x,y,z,f[mm/rev]\n1,2,3,4\n", "path.csv:1: error: column 'f[mm/rev]' is in 'mm/rev'"),
        ("x,y,z,f\n1,2,3,4\n1,2,3,0\n", "path.csv:3: error: feed 0 is not positive; give the feed per minute"),
        ("x,y,z,f\n1,2,3,fast\n", "path.csv:2: error: 'fast' is not a number"),
        ("0,5 1,5 2,5 0,0 0,0 1,0\n", "path.csv:1: error: cannot tell decimal commas from separating commas; put semi"),
        (b"\n1,2,3\x00\x01\n", "path.csv:2: error: the file holds bytes that are no characters"),
        ("1,2,\N{MINUS SIGN}3\n", "path.csv:1: error: '\N{MINUS SIGN}3' is not a number"),
    ],
)
def test_complaints(text: str | bytes, expected: str):
    assert message(text).startswith(expected)


def test_lenient_reading_normalises_axes_and_skips_feeds():
    text = "x,y,z,i,j,k,f\n0,0,0,0,0,1,100\n1,0,0,0,3,4,-5\n2,0,0,0,0,2,0\n"
    program = read(text, lenient=True)
    np.testing.assert_allclose(program.axis, [[0, 0, 1], [0, 0.6, 0.8], [0, 0, 1]], atol=1e-15)
    assert program.feed.tolist() == [100] * 3
    assert [(f.code, f.line, f.count) for f in program.findings[1:3]] == [("CS174", 3, 2), ("CS175", 3, 2)]
    assert message("x,y,z,i,j,k\n0,0,0,0,0,0\n", lenient=True).startswith("path.csv:2: error: tool axis of length zero")


# recognition


@pytest.mark.parametrize(
    "text",
    [
        *("x,y,z,i,j,k\n", "1 2 3\n", "\n\n# a\n1,2,3,0,0,1\n", "a,b,c\n1,2,3\n", "1,x,3\n1,2,3\n", "1;2,5;3\n"),
        *("x/mm y/mm z/mm\n1 2 3\n", "// x y z\n1 2 3", "nan 1 2\n", "% matlab\n-1.5e3\t2\t3\n"),
    ],
)
def test_point_files_are_recognised(text: str):
    assert looks_like_points(text.encode())
    assert looks_like_points(text.encode("utf-8-sig"))
    assert looks_like_points(text.encode("utf-16"))


@pytest.mark.parametrize(
    "text",
    [
        *("", "\n", "GOTO/1,2,3\n4,5,6\n", "PARTNO X\nMULTAX\n", "$$ c\nGOTO/1,2,3\n", "%\nO0001\nG1 X1 Y2 Z3\n"),
        *("GOTO / 1.0, 2.0, 3.0, $\n0., 0., 1.\n", "one two\nthree four\n", "1 2\n3 4\n"),
    ],
)
def test_other_files_are_not(text: str):
    assert not looks_like_points(text.encode())


# both ways give one table

CELLS = st.sampled_from(["0", "-0", "1.5", "-.25", "3.", "12345.678901", "1e2", "1D-3", "", "x", "nan", "1-2", "--1"])
ROW = st.tuples(
    st.lists(CELLS, min_size=5, max_size=7), st.sampled_from([",", " ", ", ", "\t", " ,", ",,"]), st.booleans()
).map(lambda row: row[1].join(row[0]) + ("," if row[2] else ""))
GOOD_ROW = st.lists(CELLS.filter(lambda cell: cell[:1].isdigit()), min_size=6, max_size=6).map(",".join)


@settings(max_examples=how_many(50, 300), deadline=None)
@given(st.lists(st.one_of(GOOD_ROW, GOOD_ROW, ROW, st.just(""), st.just(", ,")), max_size=8))
def test_fast_way_equals_careful_way(lines: list[str]):
    columns = points_table.Columns(6, (0, 1, 2), (3, 4, 5), "vectors")
    text = points_table.clean(("x,y,z,i,j,k\n" + "\n".join(lines)).encode(), "path.csv")
    outcomes = []
    for blocks in (True, False):
        with pytest.MonkeyPatch.context() as patch:
            if not blocks:
                patch.setattr(points_table, "_fast", lambda *_: None)
            try:
                table, line = points_table.numbers(text, columns, "path.csv")
                outcomes.append((table.tobytes(), line.tolist()))
            except InputError as error:
                outcomes.append(str(error))
    assert outcomes[0] == outcomes[1]


def test_fast_way_takes_what_it_should(monkeypatch: pytest.MonkeyPatch):
    def careful(*_: object) -> None:
        raise AssertionError("the careful way was taken")

    monkeypatch.setattr(points_table, "careful", careful)
    monkeypatch.setattr(points_table, "_CHUNK", 1000)
    expected = np.round(np.random.default_rng(1).uniform(-99, 99, (500, 3)), 4)
    axes = np.tile([0.0, 0.6, 0.8], (500, 1))
    for text in (
        rows(expected, axes),
        rows(expected, axes, separator="\t"),
        "x y z i j k\n\n" + rows(expected, axes, separator=" ; ").replace("\n", ";\n\n"),
        rows(expected, axes, separator=";").replace(".", ","),
    ):
        program = read(text)
        np.testing.assert_array_equal(program.tip, expected)
        lines = [line.replace(",", ".") for line in text.splitlines()]
        for line, (x, _, _) in zip(program.line.tolist(), expected.tolist(), strict=True):
            assert lines[line - 1].startswith(f"{x:.4f}")


def test_rows_are_read_without_a_loop_over_them():
    text = (rows(np.linspace([0.0, 0, 0], [200, 300, 400], 1000), np.tile([0.0, 0.6, 0.8], (1000, 1))) * 50).encode()
    assert len(read(text)) == 50_000
    assert bytecodes(lambda: read(text)) < 2 * 50_000


# real files


@pytest.mark.corpus
@pytest.mark.parametrize(
    ("file", "poses", "first_line", "codes_"),
    [
        ("hecc_point_zigzag.csv", 940, 2, []),
        ("shenmuxin_5x_path.csv", 55, 2, []),
        ("hust_5x_toolpath_fan.txt", 25, 1, []),
    ],
)
def test_real_files(corpus: Path, file: str, poses: int, first_line: int, codes_: list[str]):
    data = (corpus / file).read_bytes()
    assert looks_like_points(data)
    program = read(data)
    assert (len(program), program.line[0], codes(program)) == (poses, first_line, codes_)
    by_hand = [line.replace(",", " ").split() for line in data.decode().splitlines()[first_line - 1 :]]
    values = np.array([[float(cell) for cell in row] for row in by_hand if row])
    np.testing.assert_array_equal(program.tip, values[:, :3])
    np.testing.assert_allclose(program.axis, values[:, 3:], atol=1e-3)
    np.testing.assert_allclose(np.linalg.norm(program.axis, axis=1), 1, atol=1e-15)


@pytest.mark.corpus
def test_no_other_real_file_looks_like_points(corpus: Path):
    point_files = {"hecc_point_zigzag.csv", "shenmuxin_5x_path.csv", "hust_5x_toolpath_fan.txt"}
    found = {path.name for path in corpus.iterdir() if path.is_file() and looks_like_points(path.read_bytes())}
    assert found == point_files


# rapids


@pytest.mark.parametrize(
    ("name", "cells"),
    [
        ("is_rapid", "1 0 0 1"),
        ("rapid", "True false FALSE true"),
        ("Rapid", "1.0 0.0 0 1"),
        ("isRapid", "yes no no yes"),
        ("type", "rapid feed cut rapid"),
        ("Type", "G0 G1 G01 G00"),
        ("move_type", "RAPID LINEAR Plunge Rapid"),
        ("move type", "rapid lead_in lead-out rapid"),
        ("g", "0 1 1 0"),
        ("gcode", "g00 g1 g01 g0"),
    ],
)
@pytest.mark.parametrize("separator", [",", ";", "\t"])
def test_rapids_have_a_column(name: str, cells: str, separator: str):
    marked = zip(cells.split(), rows(TIPS, AXES, separator=separator).splitlines(), strict=True)
    text = separator.join((name, *"xyzijk")) + "\n" + "".join(f"{cell}{separator}{row}\n" for cell, row in marked)
    program = read(text)
    check(program)
    assert program.kind.tolist() == [Move.RAPID, Move.LINEAR, Move.LINEAR, Move.RAPID]
    assert [finding.code for finding in program.findings] == ["CS176"]


def test_rapids_with_decimal_commas_and_their_feeds():
    program = read(
        "x;y;z;f;type\n0,5;0;0;0;rapid\n1,5;0;0;500,5;feed\n2,5;0;0;;feed\n3,5;0;0;9000;rapid\n4;0;0;;feed\n"
    )
    assert program.tip[:, 0].tolist() == [0.5, 1.5, 2.5, 3.5, 4]
    assert program.kind.tolist() == [1, 2, 2, 1, 2]
    assert program.feed[[1, 2, 4]].tolist() == [500.5] * 3


@pytest.mark.parametrize(
    ("name", "cell", "want"),
    [
        ("type", "0", "give rapid or feed in words"),
        ("type", "1", "give rapid or feed in words"),
        ("type", "arc", "give rapid or feed in words"),
        ("type", "", "give rapid or feed in words"),
        ("rapid", "2", "give 1 or 0"),
        ("is_rapid", "maybe", "give 1 or 0"),
        ("g", "2", "give G0 or G1"),
    ],
)
def test_rapids_that_nobody_can_tell(name: str, cell: str, want: str):
    said = message(f"x,y,z,{name}\n1,2,3,{cell}\n")
    assert said == f"path.csv:2: error: {cell!r} in the column {name!r} is neither rapid nor feed; {want}"


# quaternions


@pytest.mark.parametrize(
    "names",
    [
        *("x,y,z,qx,qy,qz,qw", "x,y,z,qw,qx,qy,qz", "X Y Z Q_X Q_Y Q_Z Q_W", "x;y;z;w;qx;qy;qz", "x,y,z,qx,qy,qz,q4"),
        *("x,y,z,q0,q1,q2,q3", "x,y,z,q1,q2,q3,q4", "px,py,pz,w,x,y,z", "px,py,pz,x,y,z,w", "x,y,z,ow,ox,oy,oz"),
        *(
            "x,y,z,quat_x,quat_y,quat_z,quat_w",
            "x,y,z,rx,ry,rz,rw",
            "x,y,z,w,i,j,k",
            "x,y,z,i,j,k,w",
            "x,y,z,qw,qi,qj,qk",
        ),
        *("x,y,z,e0,e1,e2,e3", "x,y,z,qr,qi,qj,qk", "qw,qx,qy,qz,x,y,z", "t,x,y,z,qz,qy,qx,qw,f", "x,y,z,qx,qy,qz,s"),
        "position.x,position.y,position.z,orientation.x,orientation.y,orientation.z,orientation.w",
    ],
)
def test_a_quaternion_is_no_axis(names: str):
    count = len(names.replace(";", ",").replace(" ", ",").split(","))
    said = message(names + "\n" + ",".join(["1"] * count) + "\n")
    assert "are a quaternion, not a tool axis" in said or "cannot make out the columns of the header" in said


@pytest.mark.parametrize("order", [[0, 1, 2, 3], [3, 0, 1, 2]])
def test_a_quaternion_without_a_header(order: list[int]):
    flips = np.array([[1.0, 0, 0, 0.0099], [0.9995, 0.03, 0, 0.0099], [0.6, 0.8, 0, 0.0099], [0.8, 0.6, 0, 0.0099]])
    assert "the columns 4 to 7 are a quaternion" in message(rows(TIPS, flips[:, order]))


@pytest.mark.parametrize("names", ["nx,ny,nz,tx,ty,tz", "tx,ty,tz,i,j,k", "u,v,w,nx,ny,nz", "xb,yb,zb,i,j,k"])
def test_two_triples_that_may_be_the_axis_are_an_error_that_names_them(names: str):
    cells = names.split(",")
    first, second = ",".join(cells[:3]), ",".join(cells[3:])
    said = message(f"x,y,z,{names}\n" + "0,0,0,0,1,0,0,0,1\n14,3,0,0,1,0,0,0,1\n")
    assert said.startswith("path.csv:1: error: cannot make out the columns of the header: ")
    assert first in said
    assert second in said
    assert "may each be the tool axis" in said


def parted(text: str) -> list[tuple[int, int]]:
    """Line and count of findings of rows after a gap or another pass."""
    return [(one.line, one.count) for one in read(text, units="mm").findings if one.code == "CS200"]


def test_a_feed_move_over_a_gap_is_to_be_checked():
    one, two = "0,0,0,0,0,1\n9,0,0,0,0,1\n", "9,5,0,0,0,1\n0,5,0,0,0,1\n"
    head = "x,y,z,i,j,k\n"
    assert parted(head + one + two) == []
    for gap in ("\n", "# pass 2\n", "\n\n", "// next\n"):
        assert parted(head + one + gap + two) == [(4 + gap.count("\n"), 1)]
    assert parted(head + one + "\n" + two + "\n" + one) == [(5, 2)]
    assert parted("\n\n" + head + "\n" + one + two + "\n") == []
    every = head + (one + two).replace("\n", "\n\n")
    assert parted(every) == []
    rapid = "type,x,y,z,i,j,k\n" + (one + "\n" + two).replace("9,5", "R9,5").replace("\n0", "\nfeed,0")
    rapid = rapid.replace("\n9", "\nfeed,9").replace("R", "rapid,").replace("i,j,k\n0", "i,j,k\nfeed,0")
    assert parted(rapid) == []


def test_a_column_of_passes_is_to_be_checked_where_it_changes():
    text = "pass,x,y,z,i,j,k\n1,0,0,0,0,0,1\n1,9,0,0,0,0,1\n2,9,5,0,0,0,1\n2,0,5,0,0,0,1\n"
    assert parted(text) == [(4, 1)]
    assert parted(text.replace("\n2,", "\n1,")) == []


def test_a_path_that_is_a_part_of_a_millimetre_may_be_in_metres():
    text = "x,y,z,i,j,k\n0,0,0.04,0,0,1\n0.014,0.003,0,0,0,1\n0.041,0.003,0,0,0,1\n"
    found = [one for one in read(text).findings if one.code == "CS209"]
    assert [(one.severity, one.text.partition(";")[0]) for one in found] == [
        ("warning", "the whole path is 0.041 mm long: are the numbers metres?")
    ]
    assert "CS209" not in codes(read(text.replace("0.041", "4.1")))
    assert "CS209" not in codes(read(text.replace("x,y,z", "x [mm],y [mm],z [mm]")))


def ruled(text: str, **options: object) -> Program:
    return cl.read(text.encode(), name="path.csv", **options)  # type: ignore[arg-type]


def test_metres_by_header_or_option():
    body = "0,0,0.04,0,0,1,0.5\n0.014,0.003,0,0,0,1,0.5\n0.041,0.003,0,0,0,1,0.5\n"
    named = read("x [m],y [m],z [m],i,j,k,f [mm/s]\n" + body)
    assert named.tip.tolist() == [[0, 0, 40], [14, 3, 0], [41, 3, 0]]
    assert named.feed.tolist() == [30.0] * 3
    assert named.units == "mm"
    assert not {"CS176", "CS209"} & set(codes(named))
    scaled = ruled("x,y,z,i,j,k,f\n" + body, scale=1000.0)
    assert scaled.tip == pytest.approx(named.tip)
    assert scaled.feed.tolist() == [500.0] * 3
    assert ruled("x,y,z,i,j,k,f [mm/min]\n" + body, scale=1000.0).feed.tolist() == [0.5] * 3
    inches = ruled("x,y,z\n1,2,3\n2,2,3\n", units="inch", scale=0.5)
    assert inches.tip == pytest.approx(np.array([[12.7, 25.4, 38.1], [25.4, 25.4, 38.1]]))
    points = ruled("xa,ya,za,xb,yb,zb\n0,0,0,0,0,0.1\n0.02,0,0,0.02,0.06,0.08\n", scale=1000.0)
    assert points.axis == pytest.approx(np.array([[0, 0, 1], [0, 0.6, 0.8]]))


def test_axes_that_point_down_are_turned_round():
    assert ruled("0,0,0,0,0,-1\n1,0,0,0.6,0,-0.8\n", flip_axis=True).axis.tolist() == [[0, 0, 1], [-0.6, 0, 0.8]]


def test_between_passes_the_tool_goes_back_over_and_down():
    one, two = "0,0,0,0,0,1,90\n9,0,0,0.6,0,0.8,90\n", "9,5,0,0.6,0,0.8,70\n0,5,0,0,0,1,70\n"
    for text in (
        "x,y,z,i,j,k,f\n" + one + "\n" + two,
        "x,y,z,i,j,k,f\n" + one + "# pass 2\n" + two,
        "pass,x,y,z,i,j,k,f\n" + "".join(f"{1 + k // 2},{row}\n" for k, row in enumerate((one + two).split())),
    ):
        program = ruled(text, between_passes=10.0, units="mm")
        assert program.kind.tolist() == [1, 2, 1, 1, 2, 2]
        back = np.array([[9, 0, 0], [15, 0, 8], [15, 5, 8], [9, 5, 0]])
        assert program.tip[1:5] == pytest.approx(back)
        assert program.axis[1:5] == pytest.approx(np.array([[0.6, 0, 0.8]] * 4))
        assert program.feed[[1, 4, 5]].tolist() == [90, 70, 70]
        assert program.line[[1, 2, 3, 4]].tolist() == [*program.line[[1, 1, 4, 4]]]
        assert "CS200" not in codes(program)
    same = "x,y,z,i,j,k\n0,0,0,0,0,1\n9,0,0,0,0,1\n"
    assert ruled(same, between_passes=10.0).tip.tolist() == read(same).tip.tolist()


def test_a_normal_beside_a_named_tool_axis_is_not_the_axis():
    for names in ("i,j,k,nx,ny,nz", "tool_axis_x,tool_axis_y,tool_axis_z,normal_x,normal_y,normal_z"):
        program = read(f"x,y,z,{names}\n0,0,0,0,0,1,0,1,0\n9,0,0,0,0,1,0,1,0\n")
        assert program.axis.tolist() == [[0, 0, 1]] * 2
        assert "CS173" in codes(program)


@pytest.mark.parametrize("head", ["type,x,y,z,i,j,k,f", "move_type;x;y;z;i;j;k;f", "g,x,y,z,i,j,k,f"])
def test_rapids_in_the_first_column(head: str):
    words = ("G0", "G1") if head.startswith("g") else ("rapid", "feed")
    rows = [f"{words[k in (1, 2)]},0,{k},0,0,0,1,{500 * (k in (1, 2)) or ''}" for k in range(4)]
    text = head + "\n" + "\n".join(rows).replace(",", ";" if ";" in head else ",") + "\n"
    program = cl.read(text.encode(), name="path.csv")
    assert program.source.format == "points"
    assert program.kind.tolist() == [1, 2, 2, 1]


@pytest.mark.parametrize(("names", "unit"), [("A [deg],C [deg]", 1.0), ("a_rad,c_rad", np.radians(1.0))])
def test_angles_of_a_machine_take_the_place_of_the_tool_axis(names: str, unit: float):
    machine = load_machine("table-ac")
    angles = [(0.0, 0.0), (30.0, 0.0), (30.0, 90.0)]
    rows = "".join(f"{k},0,0,{a * unit:.12f},{c * unit:.12f}\n" for k, (a, c) in enumerate(angles))
    program = ruled(f"x,y,z,{names}\n{rows}", machine=machine)
    assert program.tip[:, 0].tolist() == [0, 1, 2]
    assert program.axis[:, 2] == pytest.approx(np.cos(np.radians([0, 30, 30])))
    # ISO 841: a table turns against its sign, so the tool turns with it, seen from the part: about X, then about Z
    assert program.axis == pytest.approx(np.array([[0, 0, 1], [0, -0.5, 0.75**0.5], [0.5, 0, 0.75**0.5]]), abs=1e-9)
    with pytest.raises(InputError, match=r"no tool axis in .*; angles of its rotary axes need --machine"):
        ruled(f"x,y,z,{names}\n{rows}")
    with pytest.raises(InputError, match=r"A, C are angles without \[deg\] or \[rad\]"):
        ruled(f"x,y,z,a,c\n{rows}", machine=machine)


def test_tips_alone_may_have_a_column_of_passes():
    program = ruled("pass,x,y,z\n1,0,0,0\n1,9,0,0\n2,9,5,0\n", between_passes=5.0)
    assert program.axis.tolist() == [[0, 0, 1]] * 5


@pytest.mark.parametrize("first", ["PARTNO X Y Z", "PPRINT X,Y,Z", "REMARK x y z i j k", "$$ X Y Z", "PARTNO/X,Y,Z"])
def test_a_text_of_a_cl_file_is_no_header(first: str):
    program = cl.read(f"{first}\nRAPID\nGOTO/0,0,0,0,0,1\nGOTO/1,0,0\n".encode(), name="x")
    assert (program.source.format, len(program)) == ("apt", 2)
