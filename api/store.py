"""Where the robots that clients add are kept."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal, Protocol


@dataclass(frozen=True)
class StoredRobot:
    """A robot that a client added.

    Attributes:
        definition: The validated request that added it, as canonical JSON.
        description: The answer of GET /v1/robots/{id}, as JSON.
    """

    definition: bytes
    description: bytes


class RobotStore(Protocol):
    """Robots by id."""

    def get(self, robot_id: str) -> StoredRobot | None:
        """The robot with this id."""
        ...

    def add(self, robot_id: str, robot: StoredRobot) -> Literal["added", "same", "exists", "full"]:
        """Keep a robot unless another has its id or there is no room; `same`: it was there already."""
        ...

    def delete(self, robot_id: str) -> bool:
        """Forget a robot; False: there was none."""
        ...

    def all(self) -> list[StoredRobot]:
        """Every robot, in the order of their ids."""
        ...


class InMemoryRobotStore:
    """Keeps up to `capacity` robots for as long as the process lives."""

    def __init__(self, capacity: int) -> None:
        self._capacity = capacity
        self._robots: dict[str, StoredRobot] = {}

    def get(self, robot_id: str) -> StoredRobot | None:
        """See `RobotStore`."""
        return self._robots.get(robot_id)

    def add(self, robot_id: str, robot: StoredRobot) -> Literal["added", "same", "exists", "full"]:
        """See `RobotStore`."""
        kept = self._robots.get(robot_id)
        if kept is not None:
            return "same" if kept.definition == robot.definition else "exists"
        if len(self._robots) >= self._capacity:
            return "full"
        self._robots[robot_id] = robot
        return "added"

    def delete(self, robot_id: str) -> bool:
        """See `RobotStore`."""
        return self._robots.pop(robot_id, None) is not None

    def all(self) -> list[StoredRobot]:
        """See `RobotStore`."""
        return [self._robots[robot_id] for robot_id in sorted(self._robots)]
