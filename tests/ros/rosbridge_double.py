"""A double of rosbridge and of a robot behind it: the published protocol 2.1, over a WebSocket on loopback.

The robot follows a goal as ROS 2's joint_trajectory_controller does, by cubic Hermite splines between the points, and
stays behind by a known delay.
"""

from __future__ import annotations

import asyncio
import json
import threading
import time
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
from autobahn.asyncio.websocket import WebSocketServerFactory, WebSocketServerProtocol
from scipy.interpolate import CubicHermiteSpline

from tests.ros.messages import check

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

STATE_PERIOD = 0.01
"""The period of the joint states, s."""

FEEDBACK_STATES = 5
"""Number of joint states between two messages of feedback."""

SUCCEEDED, CANCELED, ABORTED = 4, 5, 6
"""States of goals, by action_msgs/msg/GoalStatus."""

TIMEOUT = 30.0
"""The time in which a client must answer, s."""


@dataclass
class Robot:
    """A robot with a trajectory controller, and faults by wish."""

    joints: list[str]
    position: list[float]
    delay: float = 0.0
    """The time by which the arm is behind its goal, s."""
    bias: float = 0.0
    """The distance by which the first joint misses its goal while it moves, rad or m."""
    rejects: bool = False
    aborts_at: float = float("inf")
    """The time since the start at which the controller aborts, s."""
    breaks_at: float = float("inf")
    """The time since the start at which the connection breaks, s."""
    publishes: bool = True
    other_joints: list[str] = field(default_factory=list)
    """Joints of a gripper, whose states come in messages of their own on the same topic."""
    goals: list[dict[str, Any]] = field(default_factory=list)
    cancelled: list[str] = field(default_factory=list)
    motion: Callable[[float], list[float]] | None = None
    """The positions that the arm has at a time of the server's clock; None: it stands."""

    def move(self, now: float) -> None:
        if self.motion is not None:
            self.position = self.motion(now)


class Rosbridge:
    """The server: clients subscribe, send goals, and offer services that tests call."""

    def __init__(self, robot: Robot) -> None:
        self.robot = robot
        self.loop = asyncio.new_event_loop()
        self.clients: list[Client] = []
        self.services: dict[str, Client] = {}
        self.port = 0
        self._answers: dict[str, dict[str, Any]] = {}
        self._answered = threading.Condition()

    def call(self, service: str, request: dict[str, Any]) -> dict[str, Any]:
        """Call a service that a client advertised, and return its response."""
        key = f"call_service:{service}:{time.monotonic_ns()}"
        message = {"op": "call_service", "id": key, "service": service, "args": request}
        self.loop.call_soon_threadsafe(self.services[service].send, message)
        with self._answered:
            assert self._answered.wait_for(lambda: key in self._answers, TIMEOUT), f"{service} sent no response"
            return self._answers.pop(key)

    def wait_for(self, condition: Callable[[], object]) -> None:
        """Wait until a condition is true that a client's message makes true."""
        end = time.monotonic() + TIMEOUT
        while not condition():
            assert time.monotonic() < end
            time.sleep(0.01)

    def take(self, response: dict[str, Any]) -> None:
        with self._answered:
            self._answers[response["id"]] = response
            self._answered.notify_all()

    async def publish_states(self) -> None:
        while True:
            await asyncio.sleep(STATE_PERIOD)
            if self.robot.publishes:
                self.publish_state()

    def publish_state(self) -> None:
        self.robot.move(self.loop.time())
        position = list(map(float, self.robot.position))
        others = self.robot.other_joints
        for names, values in ((self.robot.joints, position), (others, [0.0] * len(others))):
            message = {"header": _header(), "name": names, "position": values, "velocity": [], "effort": []}
            for client in self.clients if names else ():
                for topic in client.topics:
                    client.send({"op": "publish", "topic": topic, "msg": message})

    async def run_goal(self, client: Client, goal: dict[str, Any]) -> None:
        robot, key = self.robot, {"action": goal["action"], "id": goal["id"]}
        try:
            check(goal["args"], "FollowJointTrajectoryGoal")
        except ValueError as error:
            client.send({"op": "action_result", **key, "values": str(error), "status": 0, "result": False})
            return
        robot.goals.append(goal)
        if robot.rejects:
            values = "Action goal was rejected!"
            client.send({"op": "action_result", **key, "values": values, "status": 0, "result": False})
            return
        motion = _spline(goal["args"]["trajectory"])
        names = goal["args"]["trajectory"]["joint_names"]
        order = [names.index(name) for name in robot.joints]
        start, end, step = self.loop.time(), float(motion.x[-1]), 0

        def position(at: float) -> np.ndarray:
            reached = motion(np.clip(at - start - robot.delay, 0.0, end))[order]
            reached[0] += robot.bias * (0.0 < at - start < end)
            return reached

        robot.motion = lambda at: position(at).tolist()
        while (now := self.loop.time() - start) < end + robot.delay and now < robot.aborts_at:
            if step % FEEDBACK_STATES == 0 and goal.get("feedback"):
                wanted, reached = motion(min(now, end))[order], position(start + now)
                feedback = {
                    "header": _header(),
                    "joint_names": robot.joints,
                    "desired": _point(wanted),
                    "actual": _point(reached),
                    "error": _point(wanted - reached),
                }
                client.send({"op": "action_feedback", **key, "values": feedback})
            if now >= robot.breaks_at:
                client.transport.abort()
                return
            step += 1
            await asyncio.sleep(STATE_PERIOD / 2.0)
            if goal["id"] in robot.cancelled:
                values = {"error_code": 0, "error_string": ""}
                client.send({"op": "action_result", **key, "values": values, "status": CANCELED, "result": True})
                return
        if now >= robot.aborts_at:
            values = {"error_code": -4, "error_string": f"path tolerance of {robot.joints[0]}"}
            client.send({"op": "action_result", **key, "values": values, "status": ABORTED, "result": True})
            return
        self.publish_state()
        values = {"error_code": 0, "error_string": ""}
        client.send({"op": "action_result", **key, "values": values, "status": SUCCEEDED, "result": True})


class Client(WebSocketServerProtocol):  # type: ignore[misc]
    """The server's end of a client's connection."""

    bridge: Rosbridge

    def onOpen(self) -> None:
        self.topics: list[str] = []
        self.goals: set[asyncio.Task[None]] = set()
        self.bridge.clients.append(self)

    def onMessage(self, payload: bytes, isBinary: bool) -> None:
        assert not isBinary
        message = json.loads(payload)
        match message["op"]:
            case "subscribe":
                assert message["type"] == "sensor_msgs/msg/JointState"
                self.topics.append(message["topic"])
            case "send_action_goal":
                assert message["action_type"] == "control_msgs/action/FollowJointTrajectory"
                self.goals.add(self.bridge.loop.create_task(self.bridge.run_goal(self, message)))
            case "cancel_action_goal":
                self.bridge.robot.cancelled.append(message["id"])
            case "advertise_service":
                self.bridge.services[message["service"]] = self
            case "service_response":
                self.bridge.take(message)
            case "unsubscribe" | "unadvertise_service":
                pass
            case unknown:
                self.send({"op": "status", "level": "error", "msg": f"Unknown operation: {unknown}"})

    def onClose(self, wasClean: bool, code: int, reason: str) -> None:
        if self in self.bridge.clients:
            self.bridge.clients.remove(self)

    def send(self, message: dict[str, Any]) -> None:
        self.sendMessage(json.dumps(message).encode(), isBinary=False)


def _spline(trajectory: dict[str, Any]) -> CubicHermiteSpline:
    points = trajectory["points"]
    times = [point["time_from_start"]["sec"] + 1e-9 * point["time_from_start"]["nanosec"] for point in points]
    positions, velocities = ([point[name] for point in points] for name in ("positions", "velocities"))
    return CubicHermiteSpline(times, np.array(positions), np.array(velocities))


def _point(positions: np.ndarray) -> dict[str, Any]:
    return {"positions": positions.tolist(), "time_from_start": {"sec": 0, "nanosec": 0}}


def _header() -> dict[str, Any]:
    now = time.time_ns()
    return {"stamp": {"sec": now // 10**9, "nanosec": now % 10**9}, "frame_id": ""}


@contextmanager
def rosbridge(robot: Robot) -> Iterator[Rosbridge]:
    """Run the double on a free port until the block ends."""
    bridge = Rosbridge(robot)
    protocol = type("ClientOfTest", (Client,), {"bridge": bridge})
    started = threading.Event()

    def run() -> None:
        asyncio.set_event_loop(bridge.loop)
        factory = WebSocketServerFactory(loop=bridge.loop)
        factory.protocol = protocol
        server = bridge.loop.run_until_complete(bridge.loop.create_server(factory, "127.0.0.1", 0))
        bridge.port = server.sockets[0].getsockname()[1]
        states = bridge.loop.create_task(bridge.publish_states())
        started.set()
        bridge.loop.run_forever()
        states.cancel()
        for client in bridge.clients:
            client.transport.abort()
        server.close()
        bridge.loop.run_until_complete(server.wait_closed())
        for task in asyncio.all_tasks(bridge.loop):
            task.cancel()
        bridge.loop.run_until_complete(asyncio.sleep(0))
        bridge.loop.close()

    thread = threading.Thread(target=run, daemon=True)
    thread.start()
    assert started.wait(TIMEOUT)
    try:
        yield bridge
    finally:
        bridge.loop.call_soon_threadsafe(bridge.loop.stop)
        thread.join(TIMEOUT)
