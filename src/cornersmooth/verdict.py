"""The one word that says how a program turned out; the same everywhere."""

from __future__ import annotations

from collections.abc import Iterable
from enum import StrEnum


class Verdict(StrEnum):
    """How an NC program turned out, from the best to the worst."""

    PASSED = "PASSED"  #: All that the CL file asks for is in the program, within ε, and was measured
    NOT_SMOOTHED = "NOT SMOOTHED"  #: Nothing was smoothed: the program is as it was
    INCOMPLETE = "INCOMPLETE"  #: An option left something out, such as holes; the rest was measured
    NOT_VERIFIED = "NOT VERIFIED"  #: Something that may bear on the motion was not looked at
    FAILED = "FAILED"  #: The program is wrong: verification found a problem

    @classmethod
    def of(cls, *, problems: int = 0, unverified: bool = False, left_out: int = 0) -> Verdict:
        """Give the worst verdict that applies, of problems found, things not looked at, and things left out.

        Returns
        -------
        Verdict
            FAILED, else NOT VERIFIED, else INCOMPLETE, else PASSED.
        """
        if problems:
            return cls.FAILED
        if unverified:
            return cls.NOT_VERIFIED
        return cls.INCOMPLETE if left_out else cls.PASSED

    @classmethod
    def worst(cls, verdicts: Iterable[Verdict]) -> Verdict:
        """Give the worst of several; PASSED of none.

        Returns
        -------
        Verdict
            The one that counts for all.
        """
        order = list(cls)
        return max(verdicts, key=order.index, default=cls.PASSED)
