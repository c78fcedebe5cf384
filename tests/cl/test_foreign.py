"""Tool paths in other formats are named, with what to export instead; Simulation CLD is read."""

from __future__ import annotations

import io

import pytest

from cornersmooth import postprocess
from cornersmooth.cl import read
from cornersmooth.errors import InputError, Verdict
from cornersmooth.model import Move
from cornersmooth.settings import Settings

FOREIGN = {
    "Mastercam NCI": b'1050\n17. 0 2019 11 27 10 1 2 1 0 "A"\n0\n0 0. 0. 50. -2. 0\n',
    "dump of an Autodesk post": b"0: onOpen()\n1: onSection()\n2: onRapid(0, 0, 40)\n",
    "KRL": b"&ACCESS RVP\nDEF part_a()\nLIN {X 0.0,Y 0.0,Z 40.0,A 0.0,B 0.0,C 0.0}\nEND\n",
    "RAPID": b"MODULE PartA\nPROC main()\nMoveL [[0,0,40],[0,0,1,0]],v50,z1,tool1;\nENDPROC\n",
    "FANUC TP": b"/PROG  TEST\n/MN\n1:L P[1] 100mm/sec FINE ;\n/END\n",
    "URScript": b"def prog():\n  movel(p[0.1,0.2,0.3,0,3.14,0], a=1.2, v=0.25)\nend\n",
    "Klartext": b"0 BEGIN PGM X MM\n1 L X+0 Y+0 Z+40 R0 FMAX M3\n2 END PGM X MM\n",
    "dump": b"!DEBUG:1\n  onParameter('operation', 'x')\n  onRapid(0, 0, 15)\n",
    "STEP file": b"ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#50=CARTESIAN_POINT('',(0.0,0.0,40.0));\n",
    "JSON": b'{"poses":[{"position":[0,0,40],"axis":[0,0,1]}]}\n',
    "YAML": b"poses:\n- position: {x: 0.0, y: 0.0, z: 0.04}\n",
    "YAML file": b"header:\n  seq: 0\nposes:\n  - x: 1\n",
    "MATLAB": b"P = [\n0 0 40 0 0 1;\n14 3 0 0.1 0 0.995;\n];\n",
    "SprutCAM": b"PARTNO A\nUNITS MM\nGOTO X 0 Y 0 Z 40\nMULTIGOTO X 14 Y 3 Z 0 A 5.7 C 90\n",
    "XML": b"<?xml version='1.0'?>\n<cld><linear/></cld>\n",
    "web page (HTML)": b'<!doctype html>\n<html lang="en">\n<style>\n.a { width: 9px; }\n</style>\n1, 2, 3\n</html>\n',
    "zip": b"PK\x03\x04\x14\x00\x00\x00",
    "NumPy": b"\x93NUMPY\x01\x00v\x00",
}

CLD = b"""UNIT MM
STOCK -50 -50 -20 50 50 0
# Flow
TOOL 3 8 4 22
MOVE X0 Y0 Z40 TX0 TY0 TZ1
RAPID Z5
CUT Z0 F800
CUT X14 Y3 TX0.1 TZ0.994987
CUT X27 Y0 TX0.2 TZ0.979796 F400
RAPID Z40
"""


@pytest.mark.parametrize("name", FOREIGN)
def test_a_foreign_format_is_named_with_what_to_export(name: str) -> None:
    with pytest.raises(InputError, match=r"^x:1: error\[CS206\]: not read: it is a .*\nhint: \w") as caught:
        read(FOREIGN[name], name="x")
    assert name in str(caught.value)
    assert caught.value.exit_code == 3


def test_simulation_cld_is_read() -> None:
    program = read(CLD, name="x.cld")
    assert program.tip.tolist() == [[0, 0, 40], [0, 0, 5], [0, 0, 0], [14, 3, 0], [27, 0, 0], [27, 0, 40]]
    assert program.kind.tolist() == [Move.RAPID, Move.RAPID, *[Move.LINEAR] * 3, Move.RAPID]
    assert program.axis[3:].tolist()[0] == pytest.approx([0.1, 0, 0.994987], abs=1e-6)
    assert program.axis[5].tolist() == program.axis[4].tolist()
    assert program.feed[2:5].tolist() == [800, 800, 400]
    assert program.line.tolist() == [5, 6, 7, 8, 9, 10]
    assert [one.word for one in program.statements if one.word != "$$"] == ["UNITS", "STOCK", "LOADTL", "CUTTER"]
    stream = io.BytesIO()
    assert postprocess(CLD, stream, Settings(tolerance=0.02)).verdict is Verdict.PASSED
    assert b"T3 M6" in stream.getvalue()


def test_inches_of_simulation_cld() -> None:
    program = read(CLD.replace(b"UNIT MM", b"# made\nUNIT IN"), name="x.cld")
    assert (program.units, program.tip[3, 0], program.feed[3]) == ("inch", 14 * 25.4, 800 * 25.4)


@pytest.mark.parametrize(
    ("old", "new", "line"),
    [(b"MOVE X0 Y0", b"MOVE X0", 5), (b"CUT Z0", b"ARC Z0", 7), (b"CUT Z0", b"CUT Q0", 7), (b"TOOL 3 8", b"TOOL 3", 4)],
)
def test_a_line_that_simulation_cld_has_not_is_an_error(old: bytes, new: bytes, line: int) -> None:
    with pytest.raises(InputError, match=rf"^x:{line}: error\[CS206\]"):
        read(CLD.replace(old, new), name="x")
