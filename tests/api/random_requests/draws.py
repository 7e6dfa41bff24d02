"""Parts of random requests: random numbers, limits and joint positions of a robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.robots import Robot

TOOL_LIMITS = {
    "tcp_linear_velocity": (0.05, 1.0),
    "tcp_angular_velocity": (0.2, 3.0),
    "tcp_linear_acceleration": (0.2, 5.0),
    "tcp_angular_acceleration": (0.5, 10.0),
    "tcp_centripetal_acceleration": (0.1, 3.0),
    "tcp_linear_jerk": (2.0, 100.0),
    "tcp_angular_jerk": (5.0, 200.0),
}
"""Limits of the tool, each with the least and the greatest requested value."""


class Draws:
    """Draws for requests of one robot, by random numbers.

    Attributes:
        robot: Robot with the limits and joints of the requests.
        handles: Whether requests attach and detach objects of a scene.
        compares: Whether back ends are compared.
        validates: Whether planned trajectories are validated.
        slows: Whether operations in a scene, and checks of it, have speed zones.
        rides: Whether plans meet moving objects.
    """

    def __init__(self, robot: Robot, random: np.random.Generator) -> None:
        """Begin; separate random numbers for the options leave requests without them unchanged."""
        self.robot, self.random = robot, random
        apart = random.spawn(1)[0].random(5) < (0.5, 0.04, 0.1, 0.4, 0.05)
        self.handles, self.compares, self.validates, self.slows, self.rides = apart.tolist()

    def chance(self, share: float) -> bool:
        return bool(self.random.random() < share)

    def choice(self, items: Sequence[Any]) -> Any:
        return items[int(self.random.integers(len(items)))]

    def between(self, least: float, most: float) -> float:
        """Draw a number between two ends, uniform in its logarithm."""
        return float(np.exp(self.random.uniform(np.log(least), np.log(most))))

    def limits(self, share: float) -> dict[str, Any]:
        """Draw joint limits by value or direction, tool limits and scales, each with a given probability."""
        asked: dict[str, Any] = {}
        quantities = ("velocity", "acceleration", "jerk", *(["torque"] if self.robot.has_dynamics else []))
        for quantity in quantities:
            own = np.minimum(self.robot.limit(quantity), 1e4)
            least = 0.6 if quantity == "torque" else 0.2  # what holds the arm up takes a share of its own
            if self.chance(share):
                asked[quantity] = (own * self.random.uniform(least, 1.0, len(own))).tolist()
            if quantity != "jerk" and self.chance(share):
                lower, upper = self.random.uniform(least, 1.0, (2, len(own))) * own
                asked[f"{quantity}_range"] = np.stack([-lower, upper], axis=1).tolist()
            if quantity in ("velocity", "acceleration") and self.chance(share):
                asked[f"{quantity}_scale"] = self.random.uniform(0.2, 1.0)
        for quantity, (least, most) in TOOL_LIMITS.items():
            if self.chance(share):
                asked[quantity] = self.between(least, most)
        if self.robot.has_dynamics and self.chance(share):
            asked["total_power"] = self.between(20.0, 500.0)
        if self.robot.has_dynamics and self.chance(share):
            asked["power"] = [self.between(10.0, 300.0) for _ in self.robot.joints]
        return asked

    def payload(self) -> dict[str, Any]:
        moments = self.random.uniform(1.0, 2.0, 3) * self.between(1e-6, 1e-2)
        center = self.random.normal(scale=0.05, size=3)
        return {"mass": self.between(1e-3, 8.0), "center_of_mass": center.tolist(), "inertia": moments.tolist()}

    def velocity(self) -> list[float]:
        """Draw velocities of all joints, each a fraction of its limit."""
        shares = self.random.uniform(-0.3, 0.3, self.robot.dof)
        return (shares * self.between(0.05, 1.0) * np.minimum(self.robot.limit("velocity"), 1e4)).tolist()

    def position(self, near: np.ndarray | None) -> np.ndarray:
        """Draw a joint position within the limits, near another one if given, sometimes at a limit or equal to it."""
        lower = np.maximum(self.robot.limit("lower"), -np.pi)
        upper = np.minimum(self.robot.limit("upper"), np.pi)
        if near is None:
            if self.chance(0.05):
                return np.clip(np.zeros(self.robot.dof), lower, upper)
            return np.asarray(self.random.uniform(0.7 * lower + 0.3 * upper, 0.3 * lower + 0.7 * upper))
        step = self.random.normal(size=len(near)) * self.between(1e-3, 0.5)
        match int(self.random.integers(30)):
            case 0:
                step *= 1e-7
            case 1:
                step *= 0.0
            case 2:
                step *= np.arange(len(near)) == self.random.integers(len(near))
            case 3:
                step += 10.0 * (self.random.random(len(near)) < 0.2)
            case 4:
                step = np.round(near + step, 1) - near
        return np.asarray(np.clip(near + step, lower, upper))
