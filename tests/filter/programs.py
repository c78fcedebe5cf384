"""Finished programs of each control, for the tests of the filter: a zigzag that turns the tool."""

from __future__ import annotations

import numpy as np

N = 24
_T = np.linspace(0.0, 1.0, N)
X, Y, Z = 40 * _T, np.where(np.arange(N) % 2, 1.5, -1.5), 1 + np.sin(6 * _T)
A, C = 20 + 5 * np.sin(4 * _T), 30 + 40 * _T
_SINE = np.sin(np.radians(A))
VECTOR = np.column_stack((_SINE * np.cos(np.radians(C)), _SINE * np.sin(np.radians(C)), np.cos(np.radians(A))))


def cuts(form: str, *, feed: str, first: int = 0, last: int = N, end: str = "\n", scale: float = 1.0) -> str:
    """Cuts of the zigzag, with words in braces; the feed stands in the first."""
    lines = []
    for k in range(first, last):
        i, j, m = VECTOR[k].tolist()
        place = {"x": X[k] * scale, "y": Y[k] * scale, "z": Z[k] * scale, "a": A[k], "c": C[k], "i": i, "j": j, "m": m}
        lines.append(form.format(n=10 * k + 100, **place) + (f" {feed}" if k == first else "") + end)
    return "".join(lines)


ISO = (
    "%\nO100\n(A PART)\nG21 G90 G94 G40\nT1 M6\nS9000 M3\nG54\n"
    "{on}\nG0 X0. Y-1.5 Z20. {start}\n{cuts}G0 Z50.\nG49\nM30\n%\n"
)
WORDS = "G1 X{x:.3f} Y{y:.3f} Z{z:.3f} A{a:.3f} C{c:.3f}"
IJK = "N{n} G01X{x:.3f}Y{y:.3f}Z{z:.3f}I{i:.6f}J{j:.6f}K{m:.6f}"
SIEMENS = "G17 G90 G94 {units}\nT1 M6\nTRAORI\nG54\n{ori}\nG0 X0 Y-1.5 Z20 {start}\n{cuts}G0 Z50\nTRAFOOF\nM30\n"
KLARTEXT = (
    "0 BEGIN PGM X MM\n1 TOOL CALL 1 Z S9000\n2 {on}\n3 {rapid}\n{cuts}98 L Z+50 FMAX\n99 {off}\n100 END PGM X MM\n"
)
LN = "{n} LN X{x:+.3f} Y{y:+.3f} Z{z:+.3f} TX{i:+.6f} TY{j:+.6f} TZ{m:+.6f}"
LINUXCNC = "G21 G90 G94 {head}\nM428\nG0 X0 Y-1.5 Z20 A20 C30\n{cuts}G0 Z50\nM429\nM30\n"

#: a program for a control, and its machine; "" for tool vectors
PROGRAMS: dict[str, tuple[str, str, str]] = {
    "fanuc vectors": (
        "fanuc",
        "",
        ISO.format(on="G43.5 H1", start="I0.1 J0. K1.", cuts=cuts(IJK, feed="F1000", end="\r\n")),
    ),
    "fanuc words": ("fanuc", "table-ac", ISO.format(on="G43.4 H1", start="A20. C30.", cuts=cuts(WORDS, feed="F1000."))),
    "mitsubishi": (
        "mitsubishi",
        "table-ac",
        ISO.format(on="G43.4 H1", start="A20. C30.", cuts=cuts(WORDS, feed="F1000.")),
    ),
    "haas, inch, G93": (
        "haas",
        "table-ac",
        ISO.replace("G21", "G20").format(
            on="G234 H1", start="A20. C30.", cuts="G93\n" + cuts(WORDS + " F90.", feed="", scale=0.04) + "G94\n"
        ),
    ),
    "siemens vectors": (
        "siemens",
        "",
        SIEMENS.format(
            units="G710",
            ori="ORIWKS ORIVECT",
            start="A3=0.1 B3=0 C3=1",
            cuts=cuts("N{n} G1 X{x:.3f} Y{y:.3f} Z{z:.3f} A3={i:.6f} B3={j:.6f} C3={m:.6f}", feed="F1000"),
        ),
    ),
    "siemens words": (
        "siemens",
        "table-ac",
        SIEMENS.format(
            units="G71",
            ori="ORIAXES",
            start="A20 C30",
            cuts=cuts("G1 X{x:.3f} Y{y:.3f} Z{z:.3f} A={a:.3f} C={c:.3f}", feed="F1000"),
        ),
    ),
    "heidenhain vectors": (
        "heidenhain",
        "",
        KLARTEXT.format(
            on="FUNCTION TCPM F TCP AXIS POS PATHCTRL VECTOR",
            off="FUNCTION RESET TCPM",
            rapid="LN X+0 Y-1.5 Z+20 TX+0.1 TY+0 TZ+0.995 FMAX M3",
            cuts=cuts(LN, feed="F1000"),
        ),
    ),
    "heidenhain words": (
        "heidenhain",
        "table-ac",
        KLARTEXT.format(
            on="M128",
            off="M129",
            rapid="L X+0 Y-1.5 Z+20 A+20 C+30 R0 FMAX M3",
            cuts=cuts("{n} L X{x:+.3f} Y{y:+.3f} Z{z:+.3f} A{a:+.3f} C{c:+.3f}", feed="F1000"),
        ),
    ),
    "linuxcnc, G64, an arc inside": (
        "linuxcnc",
        "xyzac-trt",
        LINUXCNC.format(
            head="G64 P0.02 Q0.01",
            cuts=cuts(WORDS.lower(), feed="f1000", last=12) + "G2 X60 Y5 I5 J0\n" + cuts(WORDS, feed="", first=12),
        ),
    ),
    "linuxcnc, G91": (
        "linuxcnc",
        "xyzac-trt",
        LINUXCNC.format(
            head="",
            cuts="G91 G1 F1000\n" + "".join(f"X1.5 Y{(-1) ** k * 2.25:.3f} A0.125 C1.5\n" for k in range(20)) + "G90\n",
        ),
    ),
}
