"""Added robots, as workers make them and the database keeps them."""

from __future__ import annotations

from dataclasses import dataclass

import orjson


@dataclass(frozen=True)
class RobotContent:
    """The content of an added robot, without its id.

    Attributes:
        digest: The SHA-256 of the definition, `sha256:...`: two contents with the same digest are the same.
        definition: The validated request that added it, without the id, as canonical JSON.
        description: The answer of GET /v1/robots/{id}, without the id, as a JSON object.
        summary: Its entry in the answer of GET /v1/robots, without the id, as a JSON object.
        visuals: Its visual meshes as glTF; empty: it has none, or the robot was read without them.
    """

    digest: str
    definition: bytes
    description: bytes
    summary: bytes
    visuals: bytes = b""

    @property
    def size(self) -> int:
        """The bytes that it takes to keep."""
        return len(self.definition) + len(self.description) + len(self.summary) + len(self.visuals)

    def described_as(self, robot_id: str) -> bytes:
        """Write the answer of GET /v1/robots/{id} as JSON."""
        return with_id(robot_id, self.description)


def with_id(robot_id: str, description: bytes) -> bytes:
    """Write the id into a JSON object, before all else."""
    return b'{"id":' + orjson.dumps(robot_id) + b"," + description.removeprefix(b"{")
