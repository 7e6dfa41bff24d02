"""The robots that clients add are kept here: contents by their digest, and names that point at contents."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol

import orjson


@dataclass(frozen=True)
class RobotContent:
    """What a client added, whatever it is called.

    Attributes:
        digest: The SHA-256 of the definition, `sha256:...`: two contents with the same digest are the same.
        definition: The validated request that added it, without the id, as canonical JSON.
        description: The answer of GET /v1/robots/{id}, without the id, as a JSON object.
    """

    digest: str
    definition: bytes
    description: bytes

    def described_as(self, robot_id: str) -> bytes:
        """Write the answer of GET /v1/robots/{id} as JSON."""
        return b'{"id":' + orjson.dumps(robot_id) + b"," + self.description.removeprefix(b"{")


class RobotStore(Protocol):
    """A store of robots by id. An id is a name: several may point at one content, which is kept once."""

    def get(self, robot_id: str) -> RobotContent | None:
        """Find the robot with this id."""
        ...

    def add(self, robot_id: str, content: RobotContent) -> Literal["added", "same", "exists", "full"]:
        """Let an id point at a content, unless it points at another or there is no room; `same`: it does already."""
        ...

    def delete(self, robot_id: str) -> bool:
        """Forget an id, and the content that no other id points at; False: there was no such id."""
        ...

    def all(self) -> list[tuple[str, RobotContent]]:
        """List all ids with their robots, in the order of the ids."""
        ...


class InMemoryRobotStore:
    """A store that keeps up to `capacity` ids for as long as the process lives."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._digests: dict[str, str] = {}
        self._contents: dict[str, RobotContent] = {}

    def get(self, robot_id: str) -> RobotContent | None:
        """See `RobotStore`."""
        digest = self._digests.get(robot_id)
        return None if digest is None else self._contents[digest]

    def add(self, robot_id: str, content: RobotContent) -> Literal["added", "same", "exists", "full"]:
        """See `RobotStore`."""
        kept = self._digests.get(robot_id)
        if kept is not None:
            return "same" if kept == content.digest else "exists"
        if len(self._digests) >= self._capacity:
            return "full"
        self._digests[robot_id] = content.digest
        self._contents.setdefault(content.digest, content)
        return "added"

    def delete(self, robot_id: str) -> bool:
        """See `RobotStore`."""
        digest = self._digests.pop(robot_id, None)
        if digest is not None and digest not in self._digests.values():
            del self._contents[digest]
        return digest is not None

    def all(self) -> list[tuple[str, RobotContent]]:
        """See `RobotStore`."""
        return [(robot_id, self._contents[digest]) for robot_id, digest in sorted(self._digests.items())]
