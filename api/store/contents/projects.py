"""Saved projects of the page, as the database keeps them."""

from __future__ import annotations

from dataclasses import dataclass
from datetime import UTC, datetime

import orjson

from api.store.contents.digests import sha256


@dataclass(frozen=True)
class ProjectContent:
    """The content of a project, without its name.

    Attributes:
        digest: The SHA-256 of the definition, `sha256:...`: two contents with the same digest are the same.
        definition: The project as JSON, byte for byte as it was sent.
        summary: Its entry in the answer of GET /v1/projects, without name and time, as a JSON object.
    """

    digest: str
    definition: bytes
    summary: bytes

    @property
    def size(self) -> int:
        """The bytes that it takes to keep."""
        return len(self.definition) + len(self.summary)


def project_content(definition: bytes) -> ProjectContent:
    """Make the content of a project from its JSON."""
    digest = sha256(definition)
    return ProjectContent(digest, definition, orjson.dumps({"content": digest, "size": len(definition)}))


def project_entry(name: str, summary: bytes, changed: float) -> bytes:
    """Write the entry of a project in the answer of GET /v1/projects as JSON.

    Args:
        name: The name of the project.
        summary: See `ProjectContent`.
        changed: When it was saved last, s since 1970.
    """
    time = datetime.fromtimestamp(changed, UTC).isoformat(timespec="milliseconds")
    return orjson.dumps({"name": name, "changed": time, **orjson.loads(summary)})
