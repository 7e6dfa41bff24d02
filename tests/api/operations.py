"""The operations of the service, as its OpenAPI document describes them."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from clients.document import openapi_document

JSON, LINES, PROBLEM = "application/json", "application/x-ndjson", "application/problem+json"


@dataclass(frozen=True)
class Operation:
    """One operation of the document.

    Attributes:
        scope: Scope that a key must have; None: no key is needed.
        request: The schema of the body; None: there is no body.
        examples: Bodies by name.
        answers: The statuses of answers that are no problem documents, the ordinary one first.
        shared: Whether equal requests have equal answers.
        lines: Whether the body may be lines of JSON.
        codes: Codes of problem documents that may be the answer.
    """

    id: str
    method: str
    path: str
    tag: str
    scope: str | None
    request: Any
    examples: dict[str, Any]
    answers: list[int]
    shared: bool
    lines: bool
    codes: list[str]

    def path_of(self, name: str) -> str:
        """Return the path to a robot, a scene, a batch or a project of this id or name."""
        return re.sub(r"\{\w+\}", name, self.path)


def _operation(path: str, method: str, entry: dict[str, Any]) -> Operation:
    scope = re.search("needs the scope `(.*)`", entry["description"])
    content = entry.get("requestBody", {}).get("content", {})
    responses = entry["responses"].items()
    return Operation(
        id=entry["operationId"],
        method=method.upper(),
        path=path,
        tag=entry["tags"][0],
        scope=scope and scope[1],
        request=content[JSON]["schema"] if content else None,
        examples={name: example["value"] for name, example in content.get(JSON, {}).get("examples", {}).items()},
        answers=[int(status) for status, one in responses if one.get("content", {}).keys() - {PROBLEM}],
        shared="ETag" in entry["responses"].get("200", {}).get("headers", {}),
        lines=LINES in content,
        codes=[
            code for _, one in responses for code in re.findall(r"`(\w+)`", one["description"]) if one.get("content")
        ],
    )


OPERATIONS = [
    _operation(path, method, entry)
    for path, item in openapi_document(1000)["paths"].items()
    for method, entry in item.items()
]
"""Every operation of the document, in its order."""
