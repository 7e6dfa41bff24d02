"""Added scenes, as workers make them and the database keeps them."""

from __future__ import annotations

from dataclasses import dataclass

import orjson

from api.store.contents.robots import with_id


@dataclass(frozen=True)
class SceneContent:
    """The content of an added scene, without its id.

    Attributes:
        digest: The SHA-256 of the definition, `sha256:...`: two contents with the same digest are the same.
        definition: The scene as canonical JSON.
        summary: Its entry in the answer of GET /v1/scenes, without the id, as a JSON object.
    """

    digest: str
    definition: bytes
    summary: bytes

    @property
    def size(self) -> int:
        """The bytes that it takes to keep."""
        return len(self.definition) + len(self.summary)

    def described_as(self, scene_id: str) -> bytes:
        """Write the answer of GET /v1/scenes/{id} as JSON."""
        content = b'{"content":' + orjson.dumps(self.digest) + b"," + self.definition.removeprefix(b"{")
        return with_id(scene_id, content)
