"""Writes docs/codes.md and cli/codes.toml: every code with its messages and hints, as the source has them.

The cause of each and what to do are written by hand, in cli/causes.toml.

python tools/make_codes.py
"""

from __future__ import annotations

import ast
import json
import re
import tomllib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from cornersmooth.cli.lookup import PARTS
from cornersmooth.errors import Finding

ROOT = Path(__file__).resolve().parent.parent
SOURCE = ROOT / "src" / "cornersmooth"
TABLE = SOURCE / "cli" / "codes.toml"
CAUSES = SOURCE / "cli" / "causes.toml"
#: a code; with a ``b`` behind it in tables of texts, for another text of it
CODE = re.compile(r"CS\d{3}b?")
SEVERITIES = ("note", "warning", "error")

HEAD = """# Codes

Errors, warnings and notes carry a code that does not change; reports name it. `cornersmooth explain CS337` prints a row
of this table, with the hint of each message. `…` is filled in. The table is made by `python tools/make_codes.py`.

An *error* ends the command, with exit code 2 for settings, 3 for input, 4 for output. A *problem* is a fault of a
program that verification finds (exit code 1). After *warnings* and *notes* the work goes on.
A warning *to check* bears on the metal. The verdict counts it: `PASSED, 3 to check`.
CS551 to CS559 and CS566 are about one word each: missing, not asked for, another one, or in another place.
"""
#: arguments by which a code is given to a method that is called with its texts
CALLS = {"wrong_value": "wrong"}
ERRORS = ("InputError", "SettingsError", "OutputError", "VerdictError", "CornersmoothError")


@dataclass(frozen=True, order=True)
class Entry:
    """One code at one place of the source."""

    code: str
    text: str
    kind: str
    package: str
    hint: str = ""


def called(call: ast.Call) -> str:
    """Name of what is called."""
    return call.func.attr if isinstance(call.func, ast.Attribute) else getattr(call.func, "id", "")


def checked(code: str, kind: str) -> str:
    """Whether a warning is counted with the verdict."""
    return ", to check" if kind == "warning" and Finding(code, "warning", 0, "").to_check else ""


class Module:
    """A source file, with what encloses each of its nodes."""

    def __init__(self, path: Path, names: dict[str, frozenset[str]]) -> None:
        self.package = path.relative_to(SOURCE).with_suffix("").parts[0]
        self.tree = parsed(path)
        self.names = names
        self.nodes = list(ast.walk(self.tree))
        self.calls = [node for node in self.nodes if isinstance(node, ast.Call)]
        self.parent = {child: node for node in self.nodes for child in ast.iter_child_nodes(node)}

    def entries(self) -> Iterator[Entry]:
        """Codes with the texts beside them."""
        for node in self.nodes:
            for code in self.codes(node):
                around, siblings = self._beside(node)
                texts = [list(self._texts(sibling)) for sibling in siblings]
                kind = next((text for several in texts for text in several if text in SEVERITIES), "")
                kind = kind or self._kind(around, code)
                said = [[text for text in several if re.search("[A-Za-z]", text)] for several in texts]
                first = next((k for k, several in enumerate(said) if several and several != [kind]), len(said))
                for text in said[first] if first < len(said) else ():
                    what, _, hint = text.partition("; ")
                    if kind == "error" and first + 1 < len(said):
                        what, hint = text, next(iter(said[first + 1]), "")
                    if what != kind and not re.match("CS[…0-9]", what) and (kind, self.package) != ("problem", "cl"):
                        yield Entry(code, what, kind, self.package, hint)

    def codes(self, node: ast.AST) -> frozenset[str]:
        """Codes that a node stands for."""
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and CODE.fullmatch(node.value):
            return frozenset({node.value[:5]})
        name = node.id if isinstance(node, ast.Name) else node.attr if isinstance(node, ast.Attribute) else ""
        return self.names.get(name, frozenset())

    def _beside(self, node: ast.AST) -> tuple[ast.AST, list[ast.expr]]:
        """What a code stands in, and what stands behind it there."""
        around = self.parent[node]
        if isinstance(around, ast.Dict) and node in around.keys:
            value = around.values[around.keys.index(node)]
            parts = value.elts if isinstance(value, ast.Tuple) else [value]
            return around, parts
        items = around.args if isinstance(around, ast.Call) else getattr(around, "elts", [])
        if node in items:
            return around, items[items.index(node) + 1 :] or items[:-1]
        if isinstance(around, ast.keyword) and around.arg in CALLS:
            name = CALLS[around.arg]
            calls = [call for call in self.calls if called(call) == name]
            return around, [ast.Tuple([call.args[0] for call in calls])]
        return around, []

    def _kind(self, around: ast.AST, code: str) -> str:
        """Whether it is an error, or what the loop over a table of codes makes of it."""
        call = around
        while call in self.parent and not isinstance(call, (ast.Call, ast.For)):
            call = self.parent[call]
            if isinstance(call, ast.Assign | ast.AnnAssign):
                named = ast.unparse(call.targets[0] if isinstance(call, ast.Assign) else call.target).lower()
                if named[:-1] in SEVERITIES:
                    return named[:-1]
        if isinstance(call, ast.Call) and called(call) in ERRORS:
            return "error"
        for node in ast.walk(call) if isinstance(call, ast.For) else ():
            if isinstance(node, ast.Constant) and node.value in SEVERITIES:
                return str(node.value)
        return "problem" if code.startswith("CS5") else "error"

    def _texts(self, node: ast.expr) -> Iterator[str]:
        if isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield re.sub(r"\{[^{}]*\}", "…", node.value)
        elif isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "…" for part in node.values)
        elif isinstance(node, ast.Tuple):
            for item in node.elts:
                yield from self._texts(item)
        elif isinstance(node, ast.IfExp):
            yield from self._texts(node.body)
            yield from self._texts(node.orelse)
        elif isinstance(node, ast.BinOp):
            parts = [next(self._texts(side), "…") for side in (node.left, node.right)]
            yield "".join(parts)
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "format":
            yield from self._texts(node.func.value)
        elif isinstance(node, ast.Name):
            yield from self._assigned(node)

    def _assigned(self, name: ast.Name) -> Iterator[str]:
        """Texts that a name is given in the function it stands in, or by those who call that function."""
        around: ast.AST = name
        while around in self.parent and not isinstance(around, ast.FunctionDef):
            around = self.parent[around]
        given_here = [
            node
            for node in ast.walk(around)
            if isinstance(node, ast.Assign)
            and getattr(node.targets[0], "id", "") == name.id
            and node.lineno <= name.lineno
        ]
        if given_here:
            yield from self._texts(max(given_here, key=lambda node: node.lineno).value)
        if isinstance(around, ast.FunctionDef):
            names = [argument.arg for argument in around.args.args]
            own = set(ast.walk(around))  # a method that calls that of its base hands the name on
            for call in self.calls if name.id in names else ():
                if called(call) == around.name and call not in own:
                    given = call.args[names.index(name.id) - (names[0] == "self") :][:1]
                    yield from (text for value in given for text in self._texts(value))


@cache
def text_of(path: Path) -> str:
    """Text of a source file."""
    return path.read_text(encoding="utf-8")


@cache
def parsed(path: Path) -> ast.Module:
    """A source file."""
    return ast.parse(text_of(path))


def with_codes(names: Iterable[str]) -> list[Path]:
    """Source files with a code in them, or with one of the names."""
    told = re.compile("|".join((r'"CS\d{3}"', *(rf"\b{re.escape(name)}\b" for name in names))))
    return [path for path in SOURCE.rglob("*.py") if told.search(text_of(path))]


@cache
def names_of_codes() -> dict[str, frozenset[str]]:
    """Names of the source that stand for codes: constants, and arguments by name."""
    found: dict[str, set[str]] = {}
    for path in with_codes(()):
        for node in ast.walk(parsed(path)):
            if not isinstance(node, (ast.keyword, ast.Assign, ast.AnnAssign)):
                continue
            if isinstance(node.value, ast.Constant) and CODE.fullmatch(str(node.value.value)):
                if isinstance(node, ast.keyword):
                    name = node.arg or ""
                else:
                    name = ast.unparse(node.targets[0] if isinstance(node, ast.Assign) else node.target)
                found.setdefault(name, set()).add(str(node.value.value))
    return {name: frozenset(codes) for name, codes in found.items()}


@cache
def entries() -> list[Entry]:
    """Every code of the source with its texts, sorted."""
    names = names_of_codes()
    return sorted({entry for path in with_codes(names) for entry in Module(path, names).entries()})


def codes_in_source() -> set[str]:
    """Every code that is written anywhere in the source, but in running text."""
    return {code for path in SOURCE.rglob("*.py") for code in re.findall(r'"(CS\d{3})"', text_of(path))}


def page() -> str:
    """Text of docs/codes.md: a row for each code."""
    causes = tomllib.loads(CAUSES.read_text(encoding="utf-8"))
    rows: dict[str, list[Entry]] = {}
    for entry in entries():
        rows.setdefault(entry.code, []).append(entry)
    lines = [HEAD]
    for digit, title in PARTS.items():
        lines += [
            f"## CS{digit}xx: {title}",
            "",
            "| code | kind | message | why | what to do |",
            "|---|---|---|---|---|",
        ]
        for code, found in rows.items():
            if code[2] == digit:
                kinds = dict.fromkeys(entry.kind + checked(code, entry.kind) for entry in found)
                messages = dict.fromkeys(entry.text for entry in found)
                why = causes.get(code, {})
                cells = (code, " or ".join(kinds), "<br>".join(messages), why.get("cause", ""), why.get("remedy", ""))
                lines.append("| " + " | ".join(cell.replace("|", r"\|") for cell in cells) + " |")
        lines.append("")
    return "\n".join(lines)


def table() -> str:
    """Text of cli/codes.toml: for each code rows of kind, message and what to do, for ``cornersmooth explain``."""
    rows: dict[str, list[tuple[str, str, str]]] = {}
    for entry in entries():
        row = (entry.kind + checked(entry.code, entry.kind), entry.text, entry.hint)
        if row not in rows.setdefault(entry.code, []):
            rows[entry.code].append(row)
    lines = [f"{code} = {json.dumps(found, ensure_ascii=False)}" for code, found in rows.items()]
    return "\n".join(["# made by tools/make_codes.py: kind, message, what to do", *lines, ""])


if __name__ == "__main__":
    (ROOT / "docs" / "codes.md").write_text(page(), encoding="utf-8")
    TABLE.write_text(table(), encoding="utf-8")
