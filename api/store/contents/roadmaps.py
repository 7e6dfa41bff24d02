"""Roadmaps of scenes, as workers make them and the database keeps them."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class RoadmapContent:
    """A roadmap of a robot in a scene.

    Attributes:
        robot: The id of the robot.
        definition_digest: The SHA-256 of the definition of an added robot; empty: a robot of the catalogue.
        request: The request that built it, as canonical JSON.
        content: Its bytes.
        summary: Its entry in the answer of GET /v1/scenes/{id}/roadmap, without `is_current`, as a JSON object.
    """

    robot: str
    definition_digest: str
    request: bytes
    content: bytes
    summary: bytes

    @property
    def size(self) -> int:
        """The bytes that it takes to keep."""
        return len(self.request) + len(self.content) + len(self.summary)

    def described_as(self, is_current: bool) -> bytes:
        """Write its entry in the answer of GET /v1/scenes/{id}/roadmap as JSON."""
        return b'{"is_current":%b,' % (b"true" if is_current else b"false") + self.summary.removeprefix(b"{")
