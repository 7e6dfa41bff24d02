"""Connection to a robot of ROS 2 by rosbridge: recorded joint states, and goals of a trajectory action."""

from __future__ import annotations

import math
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import roslibpy

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

ACTION_TYPE = "control_msgs/action/FollowJointTrajectory"
"""The type of the action that runs a trajectory."""

STATE_TYPE = "sensor_msgs/msg/JointState"
"""The type of the messages with joint states."""

CONNECTION_SECONDS = 5.0
"""The time in which rosbridge must accept a connection, and the first joint state must come, s."""

NANOSECONDS = 1e9
"""Number of nanoseconds in a second."""

ERROR_NAMES = {
    -1: "INVALID_GOAL",
    -2: "INVALID_JOINTS",
    -3: "OLD_HEADER_TIMESTAMP",
    -4: "PATH_TOLERANCE_VIOLATED",
    -5: "GOAL_TOLERANCE_VIOLATED",
}
"""Names of the error codes in results of `control_msgs/action/FollowJointTrajectory`."""


class RosError(Exception):
    """A message for the user: the robot did not run the trajectory."""


@dataclass(frozen=True)
class JointState:
    """The positions of named joints at a time, s, of the robot's clock."""

    time: float
    positions: dict[str, float]


@dataclass
class Recording:
    """The messages of a run, in the order of their arrival."""

    sent: float
    """The time at which the trajectory was sent, s, of the robot's clock."""
    states: list[JointState] = field(default_factory=list)
    feedback: list[dict[str, Any]] = field(default_factory=list)


class Bridge:
    """A connection to rosbridge that records joint states and runs trajectories."""

    def __init__(self, ros: roslibpy.Ros, states: str, joints: Sequence[str]) -> None:
        self._ros, self._joints = ros, joints
        self._lacking: dict[str, float] = {}
        self._recording = Recording(-math.inf)
        self._received = threading.Event()
        self._clock_offset = math.inf
        self._states = roslibpy.Topic(ros, states, STATE_TYPE)
        self._states.subscribe(self._record_state)

    def _record_state(self, message: dict[str, Any]) -> None:
        stamp = message["header"]["stamp"]
        seconds = stamp["sec"] + stamp["nanosec"] / NANOSECONDS
        now = time.time()
        seconds = seconds or now
        self._clock_offset = min(self._clock_offset, now - seconds)  # the fastest message tells most
        positions = dict(zip(message["name"], message["position"], strict=True))
        if not positions.keys() >= {*self._joints}:  # of a gripper, say, which has a publisher of its own
            self._lacking = positions
            return
        self._recording.states.append(JointState(seconds, positions))
        self._received.set()

    def current_positions(self) -> list[float]:
        """Return the current positions of the joints, rad or m.

        Raises:
            RosError: No joint states come, or they lack a joint.
        """
        self._received.clear()
        if not self._received.wait(CONNECTION_SECONDS):
            if not self._lacking:
                raise RosError(f"no joint state came on {self._states.name} within {CONNECTION_SECONDS:g} s")
            missing = [name for name in self._joints if name not in self._lacking]
            raise RosError(f"the joint states lack {', '.join(missing)}; they have {', '.join(self._lacking)}")
        positions = self._recording.states[-1].positions
        return [positions[name] for name in self._joints]

    def run_trajectory(self, trajectory: dict[str, Any], action: str, seconds: float) -> Recording:
        """Send a trajectory to an action server, wait for its result, and return the messages of this run.

        Args:
            trajectory: A message `trajectory_msgs/JointTrajectory`.
            action: The name of the action.
            seconds: The time in which the result must come, s; after it, or at an interrupt, the goal is cancelled.

        Raises:
            RosError: The goal was rejected, aborted or cancelled, or its result did not come in time.
        """
        self._recording = Recording(time.time() - self._clock_offset)
        finished = threading.Event()
        outcome: dict[str, Any] = {}

        def finish(result: Any) -> None:
            outcome.update(result)
            finished.set()

        def lose(_connection: Any) -> None:
            finish({"values": "the connection to rosbridge broke, and the robot may still move", "status": None})

        self._ros.on("close", lose)
        client = roslibpy.ActionClient(self._ros, action, ACTION_TYPE)
        goal = client.send_goal(
            roslibpy.Goal({"trajectory": trajectory}), finish, self._recording.feedback.append, finish
        )
        try:
            if not finished.wait(seconds):
                raise RosError(f"{action} sent no result within {seconds:.3g} s; the goal was cancelled")
        finally:
            self._ros.off("close", lose)
            if not finished.is_set():
                client.cancel_goal(goal)
        if message := _failure(outcome):
            raise RosError(f"{action}: {message}")
        if not self._recording.states:
            raise RosError(f"{action} succeeded, but no joint state came on {self._states.name} during the motion")
        return self._recording


def _failure(outcome: dict[str, Any]) -> str:
    """Return the reason of a failed goal; empty: it succeeded."""
    values, status = outcome["values"], outcome["status"]
    if not isinstance(values, dict):  # rosbridge's own message: no such action, or a rejected goal
        return str(values)
    code = values.get("error_code", 0)
    if code == 0 and status is roslibpy.core.GoalStatus.SUCCEEDED:
        return ""
    return ": ".join(
        part for part in (status.name.lower(), ERROR_NAMES.get(code, ""), values.get("error_string", "")) if part
    )


@contextmanager
def connected(host: str, port: int, states: str, joints: Sequence[str]) -> Iterator[Bridge]:
    """Connect to rosbridge until the block ends.

    Args:
        host: The name of the machine that runs rosbridge.
        port: The port of its WebSocket server.
        states: The topic of the joint states.
        joints: The joints of the robot; messages that lack one are left out.

    Raises:
        RosError: Nothing accepts the connection.
    """
    ros = roslibpy.Ros(host, port, transport="asyncio")
    try:
        ros.run(CONNECTION_SECONDS)
    except roslibpy.core.RosTimeoutError:
        ros.close()
        raise RosError(f"no rosbridge accepts a connection at ws://{host}:{port}") from None
    try:
        yield Bridge(ros, states, joints)
    finally:
        ros.close()
