"""The vocabulary of CL files: which words are carried out, which are refused, which carry text, which do nothing.

What may move the tool, turn the coordinates, repeat or include is in one table (`_REFUSED`) with the source of each
word; the readers raise an error there, since a path without it would be another path. Words outside all sets are kept
as statements and reported once; with a row of numbers they are refused, too.
"""

from __future__ import annotations

from typing import Final

from cornersmooth.statements.asked import NOTHING

#: statements whose rest is text and never taken apart
TEXT_WORDS: Final = frozenset({"PARTNO", "PPRINT", "INSERT", "REMARK", "LETTER", "TPRINT", "DISPLY", "TOOL PATH"})

#: positions: ICAM reads CONT and MOVE as the same record as GOTO (CLDATA 5000:5)
GOTO_WORDS: Final = frozenset({"GOTO", "CONT", "MOVE"})

#: words that move the tool or place it; the readers carry them out
MOTION_WORDS: Final = GOTO_WORDS | {
    *("FROM", "GODLTA", "GOHOME", "RETRCT", "CIRCLE", "MOVARC", "HELICAL", "NURBS", "KNOT", "CNTRL"),
    *("MOVNRB", "INDIRV", "INDIRP", "AUTOPS", "PSIS", "TLON,GOFWD"),
}

#: codes for words that are not carried out
MOVES, TURNS, REPEATS = "CS108", "CS117", "CS186"

#: words that are not carried out: what they do, where they are described, the words
_REFUSED: Final = (
    # motion of part programs, which a processor turns into GOTO
    (MOVES, "APT 360, ISO 4343: language", "GO GOFWD GOBACK GOLFT GORGT GOUP GODOWN GODLTI TLLFT TLRGT POCKET"),
    (MOVES, "APT 360, ISO 4343: surfaces", "GCONIC LCONIC SPLINE BSPLIN SCURV SSURF LOFT TABCYL"),
    (MOVES, "NCL 2020", "GOPARM CONTUR SCRUB PMILL RMILL SMILL FMILL AMILL REGMIL PROFIL"),
    # arcs and indexed motion: Varimetrix, Solution 3000, Gerber; the depth of a helix
    (MOVES, "PostWorks 15.1, G.1 and G.2", "ARCMOV ARCDAT ARCSLP CW CCW GOCLW GOCCLW"),
    # words of post-processors; THREAD, COUPLE and PITCH make threads of the positions after them
    (MOVES, "APT 360: postprocessor words", "GOCLER PLUNGE DRESS PICKUP PROBX PROBY FACEML PENUP PENDWN DRAWLI MOVETO"),
    (MOVES, "APT 360: postprocessor words", "ASLOPE SAFETY REGBRK THREAD COUPLE PITCH"),
    (MOVES, "ICAM: vocabulary", "POSITN INDPOS SAFPOS"),
    (MOVES, "IMSpost", "GOINCR HOME"),
    (MOVES, "PostWorks 15.1: a tape break retracts the tool", "BREAK RETURN"),
    (MOVES, "CATIA V5", "PROBE"),
    (MOVES, "plain English", "APPROACH DEPART ENGAGE INDEXED LEADIN LEADOUT MOVEARC RETRACT WITHDRAW"),
    # coordinates
    (TURNS, "APT 360, ISO 4343", "TRANS TRACUT ORIGIN ROTATE ROTABL ROTHED REFSYS MATRIX REVERS ZSURF"),
    (TURNS, "APT 360: postprocessor words", "VTLAXS ZERO HEAD"),
    (TURNS, "ICAM: vocabulary", "LCS ROTREF TRFORM TLCOMP"),
    (TURNS, "IMSpost", "WPLANE"),
    (TURNS, "plain English", "MIRROR SCALE WORKPLANE WORKPL WRKPLN"),
    # statements that are elsewhere, or mean several
    (REPEATS, "APT 360, ISO 4343", "COPY INDEX MACRO TERMAC CALL LOOPST LOOPND JUMPTO IF READ INCLUD PATERN"),
    (REPEATS, "APT 360: postprocessor words", "MDWRIT MDEND"),
    (REPEATS, "NCL 2020", "DO DOEND"),
    (REPEATS, "PTC Creo, ICAM", "DEFSUB ENDSUB CALSUB"),
    (REPEATS, "plain English", "INCLUDE REPEAT WHILE UNTIL"),
)

#: word: code of the error
REFUSED_WORDS: Final = {word: code for code, _, words in _REFUSED for word in words.split()}

#: words of state that the reader acts on
STATE_WORDS: Final = frozenset(
    """
    CAMERA CLEARP CLRSRF CSYS CUTCOM CYCLE END FEDRAT FINI FIXTUR FIXTURE MCS MCSYS MODE MSYS MULTAX RAPID SET SYN SYS
    TLAXIS TRNTYP UNIT UNITS WCS
    """.split()
)

#: words that neither move nor change coordinates, beside those that ask for nothing
PLAIN_WORDS: Final = NOTHING | frozenset(
    """
    AIR APPLY AUXFUN BEGIN CHUCK CLAMP COOLNT CUTTER CUTTING DELAY DELETE ENDATA GLOBAL INTPOL LEADER LOAD LOADTL MAXDP
    MAXDPM MAXVEL MCHFIN MCHTOL NOPOST NOPS OFSTNO OPSKIP OPSTOP PBS PIVOTZ POST POSTN PPFUN PPOPT PPTOL REMOVE RESET
    PPWORD PREFUN REWIND SAVE SELCTL SELECT SEQUENCE SLOWDN SMOOTH SPINDL START STARTUP STOP SWITCH TAPE TCP TCPCTL
    TLDATA TLNOSE TLSPEC TMARK TOOL TOOLNO TOOLST TURRET UNLOAD WCORN
    """.split()
)

#: beginnings of vendor words that are known to be parameters
PLAIN_PREFIXES: Final = ("CSI_",)

#: all words that a misspelt one is compared with, because missing them would change the path
GUARDED_WORDS: Final = frozenset(
    {"GOTO", "FROM", "GODLTA", "GOHOME", "CIRCLE", "MOVARC", "HELICAL", "NURBS", "CNTRL", "INDIRV", "INDIRP", "RAPID"}
    | {"FEDRAT", "UNITS", "MULTAX", "TLAXIS", "CYCLE", "CUTCOM", "TLON,GOFWD", "RETRCT"}
)

KNOWN_WORDS: Final = TEXT_WORDS | MOTION_WORDS | set(REFUSED_WORDS) | STATE_WORDS | PLAIN_WORDS


def near_motion_word(word: str) -> str | None:
    """Return the guarded word that `word` misses by one letter (wrong, missing, added or swapped) or runs on from.

    Short names of post-processor words are not mistaken for motion: words below four letters are never near.
    """
    if len(word) < 4 or word in KNOWN_WORDS:
        return None
    letters = word[: next((i for i, letter in enumerate(word) if not letter.isalpha()), len(word))]
    if letters in GUARDED_WORDS:  # GOTO12.5,3: its slash is missing
        return letters
    return next((guarded for guarded in sorted(GUARDED_WORDS) if _one_edit(word, guarded)), None)


def _one_edit(left: str, right: str) -> bool:
    short, long = sorted((left, right), key=len)
    if len(long) - len(short) > 1:
        return False
    at = next((i for i, (a, b) in enumerate(zip(short, long, strict=False)) if a != b), len(short))
    if len(short) < len(long):
        return short[at:] == long[at + 1 :]
    swapped = short[at + 1 : at + 2] + short[at : at + 1] + short[at + 2 :]
    return short[at + 1 :] == long[at + 1 :] or swapped == long[at:]
