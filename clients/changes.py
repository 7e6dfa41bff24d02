"""Finds what breaks clients between two OpenAPI documents: `python -m clients.changes before.json after.json`.

Every valid request must stay valid, and every field of an answer must stay there with its type. Operations,
optional fields of requests, fields of answers, kinds, formats and codes may be added. A document of a new major version
(before 1.0 a new minor one) may break anything.
"""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Iterator

JsonObject = dict[str, Any]

LEAST = ("minimum", "exclusiveMinimum", "minLength", "minItems", "minProperties")
"""The keywords of JSON Schema that bound a value from below."""

MOST = ("maximum", "exclusiveMaximum", "maxLength", "maxItems", "maxProperties")
"""The keywords of JSON Schema that bound a value from above."""


def breaking_changes(before: JsonObject, after: JsonObject) -> list[str]:
    """List what clients of the document before would stumble over in the one after."""
    found: list[str] = []
    for path, methods in before["paths"].items():
        for method, old in methods.items():
            name = old["operationId"]
            new = after["paths"].get(path, {}).get(method)
            if new is None:
                found.append(f"{name}: {method.upper()} {path} is gone")
            else:
                found += [f"{name}: {change}" for change in _of_operation(before, after, old, new)]
    return found


def _of_operation(before: JsonObject, after: JsonObject, old: JsonObject, new: JsonObject) -> Iterator[str]:
    if old["operationId"] != new["operationId"]:
        yield f"it is called {new['operationId']}"
    if {} in old.get("security", [{}]) and {} not in new.get("security", [{}]):
        yield "it asks for a key"
    request = _Comparison(narrow=before, wide=after, is_request=True)
    answer = _Comparison(narrow=after, wide=before, is_request=False)
    parameters = [{(one["name"], one["in"]): one for one in op.get("parameters", ())} for op in (old, new)]
    for key, parameter in parameters[0].items():
        if key not in parameters[1]:
            yield f"the parameter {key[0]} is gone"
        else:
            yield from request.compare(parameter["schema"], parameters[1][key]["schema"], f"parameter {key[0]}")
    for key, parameter in parameters[1].items():
        if parameter.get("required") and not parameters[0].get(key, {}).get("required"):
            yield f"the parameter {key[0]} is required"
    bodies = [op.get("requestBody", {}).get("content", {}) for op in (old, new)]
    for media_type, content in bodies[0].items():
        if media_type not in bodies[1]:
            yield f"{media_type} is not taken"
        else:
            yield from request.compare(content["schema"], bodies[1][media_type]["schema"], "request")
    for status, response in old["responses"].items():
        if status >= "300":
            continue  # clients read all problems alike
        if status not in new["responses"]:
            yield f"it does not answer {status}"
            continue
        for part in ("content", "headers"):
            there = new["responses"][status].get(part, {})
            for name, content in response.get(part, {}).items():
                if name not in there:
                    yield f"its answer {status} has no {name}"
                else:
                    yield from answer.compare(there[name]["schema"], content["schema"], f"answer {status}")


@dataclass
class _Comparison:
    """The question whether values of one schema are accepted by another.

    Attributes:
        narrow: The document of the values: the one before for requests, the one after for answers.
        wide: The document that has to accept them.
        is_request: Whether they come from a request, which may have no unknown field; in an answer, fields and
             values of enumerations may be added.
        seen: The pairs of references that have been compared.
    """

    narrow: JsonObject
    wide: JsonObject
    is_request: bool
    seen: set[tuple[str, str]] = field(default_factory=set)

    def compare(self, narrow: JsonObject, wide: JsonObject, where: str) -> Iterator[str]:
        """List what of one schema the other does not accept."""
        references = (str(narrow.get("$ref")), str(wide.get("$ref")))
        if "$ref" in narrow and "$ref" in wide:
            if references in self.seen:
                return
            self.seen.add(references)
        accepted = _variants(wide, self.wide)
        if None in accepted:
            return
        for kind, variant in _variants(narrow, self.narrow).items():
            other = accepted.get(kind)
            if other is not None:
                yield from self._compare_variants(variant, other, where)
            elif self.is_request or not str(kind).startswith("kind "):
                yield f"{where}: {kind or 'anything'} {'is not taken' if self.is_request else 'may come'}"

    def _compare_variants(self, narrow: JsonObject, wide: JsonObject, where: str) -> Iterator[str]:
        if self.is_request:
            yield from _narrowed(narrow, wide, where)
        if "items" in narrow and "items" in wide:
            yield from self.compare(narrow["items"], wide["items"], f"{where}[]")
        values = [schema.get("additionalProperties") for schema in (narrow, wide)]
        if isinstance(values[0], dict) and isinstance(values[1], dict):
            yield from self.compare(values[0], values[1], f"{where}.*")
        fields, others = narrow.get("properties", {}), wide.get("properties", {})
        for name in sorted(set(wide.get("required", ())) - set(narrow.get("required", ()))):
            if name in fields or self.is_request:
                yield f"{where}: {name} is {'required' if self.is_request else 'not always there'}"
        for name in sorted(others.keys() - fields.keys()):
            if not self.is_request:
                yield f"{where}: {name} is gone"
        for name, schema in fields.items():
            if name in others:
                yield from self.compare(schema, others[name], f"{where}.{name}")
            elif self.is_request and wide.get("additionalProperties") is False:
                yield f"{where}: {name} is not taken"


def _variants(schema: JsonObject, document: JsonObject) -> dict[str | None, JsonObject]:
    """List the types that a value may have, objects by their `kind`; None stands for any value."""
    while "$ref" in schema:
        schema = document["components"]["schemas"][schema["$ref"].rpartition("/")[2]]
    for keyword in ("anyOf", "oneOf"):
        if keyword in schema:
            return {kind: one for part in schema[keyword] for kind, one in _variants(part, document).items()}
    kind = schema.get("properties", {}).get("kind", {}).get("const")
    if kind is not None:
        return {f"kind {kind}": schema}
    types = schema.get("type")
    return dict.fromkeys(types if isinstance(types, list) else [types], schema)


def _narrowed(before: JsonObject, after: JsonObject, where: str) -> Iterator[str]:
    """List the changes that make valid values invalid."""
    for keyword in LEAST:
        if after.get(keyword, float("-inf")) > before.get(keyword, float("-inf")):
            yield f"{where}: {keyword} is {after[keyword]}, was {before.get(keyword)}"
    for keyword in MOST:
        if after.get(keyword, float("inf")) < before.get(keyword, float("inf")):
            yield f"{where}: {keyword} is {after[keyword]}, was {before.get(keyword)}"
    if after.get("pattern", before.get("pattern")) != before.get("pattern"):
        yield f"{where}: the pattern is {after['pattern']}"
    allowed, values = (
        schema.get("enum", [schema["const"]] if "const" in schema else None) for schema in (after, before)
    )
    gone = [] if allowed is None else [value for value in values or ["other values"] if value not in allowed]
    if gone:
        yield f"{where}: {', '.join(map(str, gone))} not taken"


def may_break(before: str, after: str) -> bool:
    """Tell whether the version of a document allows changes that break clients (Semantic Versioning)."""
    old, new = (version.split(".") for version in (before, after))
    leading = 2 if old[0] == "0" else 1
    return old[:leading] != new[:leading]


def main() -> None:
    """Print what breaks clients, and end with 1 if the version does not allow it."""
    before, after = (json.loads(Path(name).read_bytes()) for name in sys.argv[1:3])
    changes = breaking_changes(before, after)
    print(*changes, f"{len(changes)} changes break clients", sep="\n")
    if changes and not may_break(before["info"]["version"], after["info"]["version"]):
        sys.exit(1)


if __name__ == "__main__":
    main()
