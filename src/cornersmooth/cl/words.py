"""The vocabulary of CL files: which words move, which carry text, which are known to do neither.

Sources: NCCS PostWorks 15.1 manual, ICAM "Other CL File Commands", Siemens NX and CATIA output (see the format notes
of the project); words outside these sets are kept as statements and reported once.
"""

from __future__ import annotations

from typing import Final

#: statements whose rest is text and never taken apart
TEXT_WORDS: Final = frozenset({"PARTNO", "PPRINT", "INSERT", "REMARK", "LETTER", "TPRINT", "DISPLY", "TOOL PATH"})

#: words that move the tool or place it; the readers know them
MOTION_WORDS: Final = frozenset(
    {"GOTO", "FROM", "GODLTA", "GOHOME", "CIRCLE", "MOVARC", "HELICAL", "NURBS", "KNOT", "CNTRL"}
    | {"INDIRV", "INDIRP", "AUTOPS", "PSIS", "TLON,GOFWD"}
)

#: words that move the tool in ways no reader here knows: a path without them would be another path
STRANGE_MOTION_WORDS: Final = frozenset(
    {"ARCMOV", "ARCDAT", "ARCSLP", "CW", "CCW", "GOCLW", "GOCCLW", "GO", "GOFWD", "GOBACK", "GOLFT", "GORGT", "GOUP"}
    | {"GODOWN", "GOPARM", "GODLTI", "GCONIC", "LCONIC", "SPLINE", "BSPLIN", "SCURV", "POCKET", "CONTUR", "SCRUB"}
    | {"PMILL", "RMILL", "SMILL", "FMILL", "AMILL", "REGMIL", "TLLFT", "TLRGT", "INDEXED", "MOVETO", "MOVEARC"}
)

#: words that change the meaning of coordinates
FRAME_WORDS: Final = frozenset({"TRANS", "ORIGIN", "TRACUT", "ROTATE", "COPY", "INDEX", "ROTABL", "ROTHED", "REFSYS"})

#: words of state that the reader acts on
STATE_WORDS: Final = frozenset(
    {
        "RAPID",
        "FEDRAT",
        "UNITS",
        "UNIT",
        "MULTAX",
        "TLAXIS",
        "CUTCOM",
        "CYCLE",
        "CSYS",
        "MSYS",
        "MCS",
        "MCSYS",
        "MODE",
        "SET",
        "SYN",
    }
    | {"TRNTYP", "FINI", "END"}
)

#: words that neither move nor change coordinates
PLAIN_WORDS: Final = frozenset(
    """
    AIR AUXFUN BREAK CALSUB CHUCK CLAMP CLEARP CLRSRF COOLNT COUPLE CUTTER CUTTING DEBUG DELAY DELETE DRAFT
    END-OF-PATH ENDATA FIXTURE GLOBAL HEAD HEADER INCLUD INTOL INTPOL ISN LEADER LINTOL LOAD LOADTL LPRINT MACHIN
    MAXDP MAXVEL MCHFIN MCHTOL NOPOST NOPS OFFSET OFSTNO OPSKIP OPSTOP OUTTOL OVPLOT PAINT PALETTE PBS PIVOTZ
    PITCH PLABEL PLOT POSITN POSTN POST PPFUN PPLOT PPOPT PPTOL PPWORD PREFUN PROBE REGBRK REMOVE RESET RETRCT RETURN
    REWIND SAFETY SAFPOS SAVE SELCTL SELECT SEQNO SEQUENCE SLOWDN SMOOTH SPINDL START STARTUP STOP SWITCH TAPE TCP
    TCPCTL THREAD TLDATA TLNOSE TLSPEC TMARK TOLER TOOL TOOLNO TOOLST TURRET UNLOAD VTLAXS WCORN WCS ZERO ZSURF
    """.split()
)

#: beginnings of vendor words that are known to be parameters
PLAIN_PREFIXES: Final = ("CSI_",)

#: all words that a misspelt one is compared with, because missing them would change the path
GUARDED_WORDS: Final = frozenset(
    {"GOTO", "FROM", "GODLTA", "GOHOME", "CIRCLE", "MOVARC", "HELICAL", "NURBS", "CNTRL", "INDIRV", "INDIRP", "RAPID"}
    | {"FEDRAT", "UNITS", "MULTAX", "TLAXIS", "CYCLE", "CUTCOM", "TLON,GOFWD"}
)

KNOWN_WORDS: Final = TEXT_WORDS | MOTION_WORDS | STRANGE_MOTION_WORDS | FRAME_WORDS | STATE_WORDS | PLAIN_WORDS


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
