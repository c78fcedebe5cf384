"""Texts as other posts write them: they are measured like our own, and their habits are no problems."""

from pathlib import Path

import pytest

from oracle.command import DONE, run

#: exit code of a broken promise
FAILED = 1

_CL = """LOADTL/3
SPINDL/12000,CLW
COOLNT/ON
RAPID
GOTO/10.0,0.0,60.0,0.0,0.0,1.0
RAPID
GOTO/10.0,0.0,25.0,0.1,0.0,0.9949874
FEDRAT/500.0,MMPM
GOTO/10.0,0.0,20.0,0.1,0.0,0.9949874
FEDRAT/1500.0,MMPM
GOTO/12.0,1.0,20.1,0.12,0.0,0.9927739
GOTO/14.0,1.5,20.05,0.14,0.02,0.9899495
GOTO/16.0,0.5,20.2,0.16,0.03,0.9866610
FINI
"""

_FANUC = """%
O01001 (PART)
(T3 D=6. CR=3. BALL END MILL)
N10 G90 G94 G17 G49 G40 G80
N15 G21
N20 G28 G91 Z0.0
N25 G90
N30 T3 M06
N35 S12000 M03
N40 M08
N45 G54
N50 G43.5 H03
N55 G00 X10. Y0. Z60. I0. J0. K1.
N56 G00 X10. Y0. Z25. I0.1 J0. K0.994987
N60 G01 Z20. F500.
N65 X12. Y1. Z20.1 I0.12 J0. K0.992774 F1500.
N70 X14. Y1.5 Z20.05 I0.14 J0.02 K0.98995
N75 X16. Y0.5 Z20.2 I0.16 J0.03 K0.986661
N80 M09
N90 G28 G91 Z0.
N95 G90
N97 G49
N100 G28 G91 X0. Y0.
N105 G90
N110 M05
N115 M30
%
"""

_SIEMENS = """; %_N_1001_MPF
N10 G90 G94
N11 G710
N12 G17 G40
N13 G0 SUPA Z0 D0
N15 T3 M6
N16 S12000 M3
N17 M8
N18 TRAORI
N19 G54
N20 D1
N21 ORIWKS
N22 ORIVECT
N23 G0 X10 Y0 Z60 A3=0 B3=0 C3=1
N24 G0 X10 Y0 Z25 A3=0.1 B3=0 C3=0.994987
N25 G1 Z20 F500
N26 X12 Y1 Z20.1 A3=0.12 B3=0 C3=0.992774 F1500
N27 X14 Y1.5 Z20.05 A3=0.14 B3=0.02 C3=0.98995
N28 X16 Y0.5 Z20.2 A3=0.16 B3=0.03 C3=0.986661
N29 TRAFOOF
N30 M9
N31 M5
N32 G0 SUPA D0 Z0.0
N33 G0 SUPA X-300 Y0 D0
N34 M30
"""

_HEIDENHAIN = """0 BEGIN PGM PART MM
1 BLK FORM 0.1 Z X-50 Y-50 Z-20
2 BLK FORM 0.2 X+50 Y+50 Z+20
3 L Z-1 R0 FMAX M91
4 TOOL CALL 3 Z S12000 DL+0 DR+0
5 CYCL DEF 247 DATUM SETTING ~
    Q339=+1 ;DATUM NUMBER
6 L M3
7 L M8
8 FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR
9 LN X+10 Y+0 Z+60 TX+0 TY+0 TZ+1 R0 FMAX
10 LN X+10 Y+0 Z+25 TX+0.1 TY+0 TZ+0.994987 FMAX
11 LN X+10 Y+0 Z+20 TX+0.1 TY+0 TZ+0.994987 F500
12 LN X+12 Y+1 Z+20.1 TX+0.12 TY+0 TZ+0.992774 F1500
13 LN X+14 Y+1.5 Z+20.05 TX+0.14 TY+0.02 TZ+0.98995
14 LN X+16 Y+0.5 Z+20.2 TX+0.16 TY+0.03 TZ+0.986661
15 FUNCTION RESET TCPM
16 M9
17 M5
18 L Z-1 R0 FMAX M91
19 L X-200 Y-1 R0 FMAX M91
20 L M30
21 END PGM PART MM
"""

_TEXTS = {"fanuc": _FANUC, "siemens": _SIEMENS, "heidenhain": _HEIDENHAIN}


@pytest.fixture
def verified(tmp_path: Path):
    """Verify a text of a control against the CL file; what the command says."""
    cl = tmp_path / "part.cls"
    cl.write_text(_CL)

    def measure(control: str, text: str):
        nc = tmp_path / "part.nc"
        nc.write_text(text)
        return run("verify", cl, nc, "-e", "0.001", "--control", control)

    return measure


@pytest.mark.parametrize("control", _TEXTS)
def test_a_text_of_another_post_is_verified(control, verified):
    result = verified(control, _TEXTS[control])
    assert result.returncode == DONE, result.stderr.decode()


@pytest.mark.parametrize("control", _TEXTS)
def test_a_wrong_digit_in_it_is_found(control, verified):
    text = _TEXTS[control]
    wrong = text.replace("Y1.5", "Y1.502").replace("Y+1.5", "Y+1.502")
    assert wrong != text
    result = verified(control, wrong)
    assert result.returncode == FAILED
    assert "the tip leaves its path by 0.002000 mm" in result.stderr.decode()


@pytest.mark.parametrize(
    ("control", "high", "aside"),
    [
        ("fanuc", "N90 G28 G91 Z0.\n", "N90 G28 G91 X0. Y0.\n"),
        ("siemens", "N32 G0 SUPA D0 Z0.0\n", "N32 G0 SUPA X-300 Y0 D0\n"),
        ("heidenhain", "18 L Z-1 R0 FMAX M91\n", ""),
    ],
)
def test_axes_that_go_away_before_the_tool_is_high_are_found(control, high, aside, verified):
    text = _TEXTS[control]
    assert high in text
    result = verified(control, text.replace(high, aside))
    assert result.returncode == FAILED
    assert "without a retract before it" in result.stderr.decode()
