"""Messages as tests write them: in one line, without the code."""

from __future__ import annotations

import re


def one_line(said: object) -> str:
    """``FILE:LINE: error: what; what to do`` for each message as it is printed, in bytes, text or an exception."""
    text = said.decode() if isinstance(said, bytes) else str(said)
    return re.sub(r"\b(error|warning|note)\[CS\d{3}\]: ", r"\1: ", text).replace("\nhint: ", "; ")
