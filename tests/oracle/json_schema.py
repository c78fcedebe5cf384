"""The part of JSON Schema that the schema of reports uses; a word that it does not know is an error."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import Any

TYPES: dict[str, Any] = {
    "object": dict,
    "array": list,
    "string": str,
    "integer": int,
    "number": (int, float),
    "boolean": bool,
    "null": type(None),
}
WORDS = set(
    "$schema $id $defs $ref title description type const enum pattern minimum required properties "
    "additionalProperties items anyOf allOf if then".split()
)


def faults(value: Any, schema: Mapping[str, Any], root: Mapping[str, Any], at: str = "$") -> Iterator[str]:
    """Say where a value is not what a schema asks for."""
    assert schema.keys() <= WORDS, schema.keys() - WORDS
    if "$ref" in schema:
        yield from faults(value, root["$defs"][schema["$ref"].removeprefix("#/$defs/")], root, at)
    if "type" in schema and not _is(value, schema["type"]):
        yield f"{at}: {value!r} is no {schema['type']}"
        return
    if "const" in schema and value != schema["const"]:
        yield f"{at}: {value!r} is not {schema['const']!r}"
    if "enum" in schema and value not in schema["enum"]:
        yield f"{at}: {value!r} is none of {schema['enum']}"
    if isinstance(value, str) and not re.search(schema.get("pattern", ""), value):
        yield f"{at}: {value!r} is not {schema['pattern']}"
    if isinstance(value, (int, float)) and value < schema.get("minimum", value):
        yield f"{at}: {value} is less than {schema['minimum']}"
    for part in schema.get("allOf", ()):
        yield from faults(value, part, root, at)
    if "anyOf" in schema and all(list(faults(value, part, root, at)) for part in schema["anyOf"]):
        yield f"{at}: {value!r} is none of what is allowed"
    if "if" in schema and not list(faults(value, schema["if"], root, at)):
        yield from faults(value, schema["then"], root, at)
    if isinstance(value, list) and "items" in schema:
        for number, item in enumerate(value):
            yield from faults(item, schema["items"], root, f"{at}[{number}]")
    if isinstance(value, dict):
        yield from (f"{at}: {name} is missing" for name in schema.get("required", ()) if name not in value)
        properties, more = schema.get("properties", {}), schema.get("additionalProperties", True)
        for name, item in value.items():
            if name in properties or isinstance(more, dict):
                yield from faults(item, properties.get(name, more), root, f"{at}.{name}")
            elif more is False:
                yield f"{at}: {name} is not known"


def _is(value: Any, names: str | list[str]) -> bool:
    for name in [names] if isinstance(names, str) else names:
        if isinstance(value, TYPES[name]) and not (isinstance(value, bool) and name in ("integer", "number")):
            return True
    return False
