"""What the writers notice, counted: one finding for each code and text, at the line where it was first met."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace

from cornersmooth.errors import Finding, Severity
from cornersmooth.model import Ints


@dataclass
class Findings:
    """Findings of one output, in the order in which they were first met."""

    _found: dict[tuple[str, str], Finding] = field(default_factory=dict)

    def add(self, code: str, severity: Severity, line: int, text: str, count: int = 1) -> None:
        """Count something that was noticed."""
        old = self._found.get((code, text))
        new = Finding(code, severity, line, text, count) if old is None else replace(old, count=old.count + count)
        self._found[code, text] = new

    def add_each(self, code: str, severity: Severity, lines: Ints, text: str) -> None:
        """Count what was noticed at each of some lines of the CL file, if any."""
        if len(lines):
            self.add(code, severity, int(lines[0]), text, len(lines))

    def add_all(self, others: Iterable[Finding]) -> None:
        """Count what was noticed elsewhere."""
        for finding in others:
            self.add(finding.code, finding.severity, finding.line, finding.text, finding.count)

    def all(self) -> tuple[Finding, ...]:
        """Everything that was noticed."""
        return tuple(self._found.values())
