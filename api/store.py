"""The robots that clients add are kept here: contents by their digest, and names that point at contents."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, NamedTuple, Protocol

import orjson


@dataclass(frozen=True)
class RobotContent:
    """What a client added, whatever it is called.

    Attributes:
        digest: The SHA-256 of the definition, `sha256:...`: two contents with the same digest are the same.
        definition: The validated request that added it, without the id, as canonical JSON.
        description: The answer of GET /v1/robots/{id}, without the id, as a JSON object.
        summary: Its entry in the answer of GET /v1/robots, without the id, as a JSON object.
    """

    digest: str
    definition: bytes
    description: bytes
    summary: bytes

    @property
    def size(self) -> int:
        """The bytes that it takes to keep."""
        return len(self.definition) + len(self.description) + len(self.summary)

    def described_as(self, robot_id: str) -> bytes:
        """Write the answer of GET /v1/robots/{id} as JSON."""
        return with_id(robot_id, self.description)

    def summarised_as(self, robot_id: str) -> bytes:
        """Write the entry in the answer of GET /v1/robots as JSON."""
        return with_id(robot_id, self.summary)


def with_id(robot_id: str, description: bytes) -> bytes:
    """Write the id into a JSON object, before all else."""
    return b'{"id":' + orjson.dumps(robot_id) + b"," + description.removeprefix(b"{")


class RobotStore(Protocol):
    """A store of robots by id. An id is a name: several may point at one content, which is kept once."""

    def get(self, robot_id: str) -> RobotContent | None:
        """Find the robot with this id."""
        ...

    def add(
        self, robot_id: str, content: RobotContent, owner: str
    ) -> Literal["added", "same", "exists", "full", "too_many"]:
        """Let an id point at a content, in the name of a client.

        Returns:
            `same`: it does already; `exists`: it points at another; `full`: there is no room; `too_many`: the client
            has as many ids as one may have.
        """
        ...

    def delete(self, robot_id: str, owner: str) -> Literal["deleted", "unknown", "of_another"]:
        """Forget an id that the client added, and the content that no other id points at."""
        ...

    def all(self) -> list[tuple[str, RobotContent]]:
        """List all ids with their robots, in the order of the ids."""
        ...


class _Name(NamedTuple):
    """What an id points at, and the client that says so."""

    digest: str
    owner: str


class InMemoryRobotStore:
    """A store for as long as the process lives.

    Args:
        capacity: The most ids that it keeps.
        capacity_of_owner: The most ids of one client.
        most_bytes: The most bytes of contents that it keeps.
    """

    def __init__(self, capacity: int, capacity_of_owner: int, most_bytes: int) -> None:
        self._capacity = capacity
        self._capacity_of_owner = capacity_of_owner
        self._most_bytes = most_bytes
        self._names: dict[str, _Name] = {}
        self._contents: dict[str, RobotContent] = {}

    def get(self, robot_id: str) -> RobotContent | None:
        """See `RobotStore`."""
        name = self._names.get(robot_id)
        return None if name is None else self._contents[name.digest]

    def add(
        self, robot_id: str, content: RobotContent, owner: str
    ) -> Literal["added", "same", "exists", "full", "too_many"]:
        """See `RobotStore`."""
        kept = self._names.get(robot_id)
        if kept is not None:
            return "same" if kept.digest == content.digest else "exists"
        if sum(name.owner == owner for name in self._names.values()) >= self._capacity_of_owner:
            return "too_many"
        more = 0 if content.digest in self._contents else content.size
        is_too_large = sum(known.size for known in self._contents.values()) + more > self._most_bytes
        if is_too_large or len(self._names) >= self._capacity:
            return "full"
        self._names[robot_id] = _Name(content.digest, owner)
        self._contents.setdefault(content.digest, content)
        return "added"

    def delete(self, robot_id: str, owner: str) -> Literal["deleted", "unknown", "of_another"]:
        """See `RobotStore`."""
        name = self._names.get(robot_id)
        if name is None:
            return "unknown"
        if name.owner != owner:
            return "of_another"
        del self._names[robot_id]
        if name.digest not in {other.digest for other in self._names.values()}:
            del self._contents[name.digest]
        return "deleted"

    def all(self) -> list[tuple[str, RobotContent]]:
        """See `RobotStore`."""
        return [(robot_id, self._contents[name.digest]) for robot_id, name in sorted(self._names.items())]
