"""Random plan requests over all that may be asked at waypoints and of the whole, and operations on what comes back.

Most of them can be planned; what contradicts itself is to be refused, never to fail.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.robots import Robot

BACKENDS: Sequence[dict[str, Any]] = (
    {"kind": "cubic"},
    {"kind": "quintic"},
    {"kind": "trapezoidal"},
    {"kind": "ruckig"},
    {"kind": "ruckig", "synchronization": "time"},
    {"kind": "toppra"},
    {"kind": "toppra", "jerk_limited": True},
    {"kind": "auto"},
)
"""Back ends that take milliseconds; `min_effort` has properties of its own, and takes seconds."""

FRAMES = {"pallet": {"position": [0.2, -0.1, 0.05], "orientation": {"kind": "rpy", "rpy": [0.1, -0.2, 0.7]}}}
TOOLS = (
    {"position": [0.0, 0.0, 0.1], "orientation": None},
    {"position": [0.05, 0.0, 0.1], "orientation": {"kind": "rpy", "rpy": [0.0, 0.4, 0.0]}},
)
MOUNTING = {"position": [0.0, 0.0, 0.5], "orientation": {"kind": "rpy", "rpy": [0.3, 0.0, 0.2]}}
TOOL_LIMITS = {
    "tcp_linear_velocity": (0.05, 1.0),
    "tcp_angular_velocity": (0.2, 3.0),
    "tcp_linear_acceleration": (0.2, 5.0),
    "tcp_angular_acceleration": (0.5, 10.0),
    "tcp_centripetal_acceleration": (0.1, 3.0),
    "tcp_linear_jerk": (2.0, 100.0),
    "tcp_angular_jerk": (5.0, 200.0),
}
"""Limits of the tool, each with the least and the most that is asked."""


class Requests:
    """Requests of one robot, by random numbers.

    Attributes:
        robot: Whose limits and joints they heed.
    """

    def __init__(self, robot: Robot, random: np.random.Generator) -> None:
        self.robot, self.random = robot, random

    def chance(self, share: float) -> bool:
        return bool(self.random.random() < share)

    def choice(self, items: Sequence[Any]) -> Any:
        return items[int(self.random.integers(len(items)))]

    def between(self, least: float, most: float) -> float:
        """As often a hundredth as a tenth of the largest."""
        return float(np.exp(self.random.uniform(np.log(least), np.log(most))))

    def limits(self, share: float) -> dict[str, Any]:
        """Limits of joints by value or by direction, of the tool, and scales; each with this probability."""
        asked: dict[str, Any] = {}
        for quantity in ("velocity", "acceleration", "jerk"):
            if self.chance(share):
                own = np.minimum(self.robot.limit(quantity), 1e4)
                asked[quantity] = (own * self.random.uniform(0.2, 1.0, len(own))).tolist()
        for quantity in ("velocity", "acceleration"):
            if self.chance(share):
                own = np.minimum(self.robot.limit(quantity), 1e4)
                lower, upper = self.random.uniform(0.2, 1.0, (2, len(own))) * own
                asked[f"{quantity}_range"] = np.stack([-lower, upper], axis=1).tolist()
            if self.chance(share):
                asked[f"{quantity}_scale"] = self.random.uniform(0.2, 1.0)
        for quantity, (least, most) in TOOL_LIMITS.items():
            if self.chance(share):
                asked[quantity] = self.between(least, most)
        return asked

    def position(self, near: np.ndarray | None) -> np.ndarray:
        """Within the limits, half a radian or so from another one."""
        lower = np.maximum(self.robot.limit("lower"), -np.pi)
        upper = np.minimum(self.robot.limit("upper"), np.pi)
        if near is None:
            return np.asarray(self.random.uniform(0.7 * lower + 0.3 * upper, 0.3 * lower + 0.7 * upper))
        step = self.random.normal(size=len(near)) * self.between(1e-3, 0.5)
        return np.asarray(np.clip(near + step, lower, upper))

    def waypoint(self, near: np.ndarray) -> tuple[dict[str, Any], np.ndarray]:
        """A waypoint after one at a joint position, and the joint position to go on from."""
        if self.chance(0.55):
            position = self.position(near)
            return {"kind": "joint", "position": position.tolist()}, position
        reach = self.between(0.005, 0.1)
        move = {"kind": "cartesian", "translation": (reach * self.random.normal(size=3)).tolist(), "orientation": None}
        made: dict[str, Any] = {"kind": "relative", "frame": self.choice(("tool", "base")), "move": move}
        if self.chance(0.7):
            made["motion"] = {"kind": "linear", "singularity": self.choice(("refuse", "slow", "deviate"))}
        return made, near

    def plan(self) -> dict[str, Any]:
        """A request to plan, with some of all that may be asked."""
        near = self.position(None)
        waypoints: list[dict[str, Any]] = [{"kind": "joint", "position": near.tolist()}]
        count = 2 + int(self.random.integers(3))
        for k in range(1, count):
            made, near = self.waypoint(near)
            if k < count - 1 and self.chance(0.6):
                made["transition"] = self.choice(
                    (
                        {"kind": "through"},
                        {"kind": "blend", "radius": self.between(1e-3, 0.1)},
                        {"kind": "through", "velocity": self.velocity()},
                    )
                )
            elif self.chance(0.3):
                made["dwell"] = self.between(0.01, 1.0)
            if self.chance(0.15):
                made["duration"] = self.between(0.1, 10.0)
            elif self.chance(0.15):
                made["minimum_duration"] = self.between(0.1, 5.0)
            if self.chance(0.3):
                made["limits"] = self.limits(0.15)
            waypoints.append(made)
        request: dict[str, Any] = {
            "robot": self.robot.id,
            "waypoints": waypoints,
            "backend": dict(self.choice(BACKENDS)),
            "limits": self.limits(0.12),
            "include": ["polynomials"],
            "sample_period": 0.5,
            "deadline": 30.0,
        }
        if self.chance(0.1):
            request["duration"] = self.between(0.5, 20.0)
        if self.chance(0.2):
            request["tool"] = self.choice(TOOLS)
        if self.chance(0.1):
            request["mounting"] = MOUNTING
        if self.chance(0.1):
            request["frames"] = FRAMES
        if self.chance(0.15) and request["backend"]["kind"] == "ruckig":
            request["backend"]["initial_velocity"] = self.velocity()
        if self.chance(0.2):
            at = self.choice(({"waypoint": 0}, {"waypoint": 1}, {"time": 0.01}, {"distance": 0.0}))
            request["actions"] = [{"kind": "set_output", "at": at, "name": "gripper", "value": True}]
        return request

    def velocity(self) -> list[float]:
        """Of each joint, a share of its limit."""
        shares = self.random.uniform(-0.3, 0.3, self.robot.dof)
        return (shares * self.between(0.05, 1.0) * np.minimum(self.robot.limit("velocity"), 1e4)).tolist()

    def operation(self, planned: dict[str, Any]) -> tuple[str, dict[str, Any]]:
        """An operation on a planned trajectory: its path after /v1/trajectories/, and the request."""
        trajectory, duration = {"polynomials": planned["polynomials"]}, planned["duration"]
        asked: dict[str, Any] = {"robot": self.robot.id, "include": ["polynomials"], "deadline": 30.0}
        if self.chance(0.4):
            asked["limits"] = self.limits(0.1)
        if self.chance(0.3):
            quantities = ("position", "velocity", "acceleration", "jerk", *TOOL_LIMITS)
            asked["enforced"] = [quantity for quantity in quantities if self.chance(0.6)]
        at = sorted(self.random.uniform(0.0, 1.0, 2) * duration)
        name = self.choice(("retime", "stop", "stop", "reverse", "slice", "join", "resample"))
        if name == "retime":
            asked.pop("enforced", None)
            asked |= {"backend": self.choice(BACKENDS), "max_deviation": self.between(1e-3, 0.05)}
            asked |= {"points": self.points()} if self.chance(0.5) else {"trajectory": trajectory}
        elif name == "stop":
            asked |= {"trajectory": trajectory, "time": at[0], "mode": self.choice(("on_path", "joints"))}
        elif name == "slice":
            asked |= {"trajectory": trajectory, "start": at[0], "end": at[1]}
        elif name == "join":
            asked |= {"trajectories": [trajectory, trajectory] if self.chance(0.3) else [trajectory]}
        elif name == "resample":
            asked |= {"trajectory": trajectory, "period": self.between(0.01, 0.5)}
        else:
            asked |= {"trajectory": trajectory}
        return name, asked

    def points(self) -> list[list[float]]:
        """A walk of joint positions, smooth or rough, some of them repeated."""
        count, step = 2 + int(self.random.integers(40)), self.between(1e-4, 0.05)
        walk = self.position(None) + np.cumsum(self.random.normal(scale=step, size=(count, self.robot.dof)), axis=0)
        walk = np.clip(walk, self.robot.limit("lower"), self.robot.limit("upper"))
        rows = np.sort(self.random.integers(0, count, count)) if self.chance(0.3) else np.arange(count)
        return np.asarray(walk[rows]).tolist()
