"""Quantities of joints and tool over time, in units for people, with the limits in force and the waypoints."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np

from planner.backends.base import BackEnd
from planner.certificate.checks import Certificate
from planner.errors import InvalidProblem
from planner.fields import FieldPath
from planner.paths import JointPath
from planner.plots.style import AXIS_COLOURS, colour_of
from planner.problems.motion_around import as_requested
from planner.problems.problem import PlanningProblem, ViaWaypoint
from planner.problems.rides import RideEnd
from planner.robots import Robot
from planner.samples import Samples, sample_at
from planner.spatial import FloatArray
from planner.trajectories.trajectory import PlanWarning, Trajectory

DRAWN_SAMPLES = 1000
"""The number of samples that curves are drawn with: about as many as a picture has columns."""

LEAST_PICTURE_PERIOD = 1e-6
"""The least time between two of them, s, for motions that take no time."""


class Planned(Protocol):
    """What of a plan is drawn; a `planner.Plan` has all of it, and pictures lie below plans in the library's layers."""

    @property
    def problem(self) -> PlanningProblem:
        """The request."""

    @property
    def backend(self) -> BackEnd:
        """What put time on the path."""

    @property
    def path(self) -> JointPath:
        """The path of the joints."""

    @property
    def trajectory(self) -> Trajectory:
        """The path with time on it."""

    @property
    def certificate(self) -> Certificate:
        """The check of the trajectory."""

    @property
    def warnings(self) -> tuple[PlanWarning, ...]:
        """What there is to know besides."""


class NamedStop(NamedTuple):
    """A requested waypoint: its row in the path, its name, and its time, s."""

    row: int
    name: str
    arrival: float
    departure: float


def stops_of(plan: Planned) -> list[NamedStop]:
    """List the requested waypoints, without the corners of detours; a waypoint without a name has its number."""
    requested = [
        row
        for row, waypoint in enumerate(plan.problem.waypoints)
        if not isinstance(as_requested(waypoint), ViaWaypoint | RideEnd)
    ]
    times = plan.trajectory.arrivals, plan.trajectory.departures
    return [
        NamedStop(row, plan.problem.waypoints[row].name or str(index), *(float(column[row]) for column in times))
        for index, row in enumerate(requested)
    ]


def kept_limits(plan: Planned) -> str:
    """Tell in words whether the plan keeps its limits."""
    return "every enforced limit kept" if plan.certificate.satisfied else "limits violated"


def drawn_times(plan: Planned) -> FloatArray:
    """Return the times (N,), s, at which curves are evaluated."""
    return plan.trajectory.sample_times(max(plan.trajectory.duration / DRAWN_SAMPLES, LEAST_PICTURE_PERIOD))


MILLIMETRES = 1000.0
"""The number of millimetres in a metre: lengths are drawn in mm, as on the drawings of machines."""

JOINT_UNITS = {
    "position": ("°", "mm"),
    "velocity": ("°/s", "mm/s"),
    "acceleration": ("°/s²", "mm/s²"),
    "jerk": ("°/s³", "mm/s³"),
    "torque": ("N m", "N"),
}
"""The quantities of the joints that can be drawn, with their units at joints that turn and at joints that slide."""

XYZ = ("x", "y", "z")
"""The axes of the base frame."""


class ToolQuantity(NamedTuple):
    """A quantity of the tool: its unit, the names of its curves, what samples need for it, and its limit, if any."""

    unit: str
    names: tuple[str, ...]
    include: str
    limit: str | None = None


TOOL_QUANTITIES = {
    "tcp_position": ToolQuantity("mm", XYZ, "tcp_pose"),
    "tcp_orientation": ToolQuantity("°", ("roll", "pitch", "yaw"), "tcp_rpy"),
    "tcp_velocity": ToolQuantity("mm/s", XYZ, "tcp_velocity"),
    "tcp_angular_velocity": ToolQuantity("°/s", XYZ, "tcp_velocity"),
    "tcp_acceleration": ToolQuantity("mm/s²", XYZ, "tcp_acceleration"),
    "tcp_angular_acceleration": ToolQuantity("°/s²", XYZ, "tcp_acceleration"),
    "tcp_speed": ToolQuantity("mm/s", ("speed",), "tcp_velocity", "tcp_linear_velocity"),
}
"""The quantities of the tool that can be drawn, in the axes of the base."""


@dataclass(frozen=True, eq=False)
class Curves:
    """Curves of one quantity and one unit over time.

    Attributes:
        quantity: The quantity.
        unit: Their unit.
        names: (curves,), the names of the joints or of the axes.
        colours: (curves,).
        values: (N, curves).
        lower: (N, curves), the lower limits in force; infinite: none.
        upper: (N, curves), the upper limits in force; infinite: none.
    """

    quantity: str
    unit: str
    names: tuple[str, ...]
    colours: tuple[str, ...]
    values: FloatArray
    lower: FloatArray
    upper: FloatArray

    @property
    def label(self) -> str:
        """The label of their axis."""
        name = "force" if self.unit == "N" else self.quantity.replace("tcp_", "tool ").replace("_", " ")
        return f"{name} ({self.unit})"


def joint_indices(robot: Robot, names: Collection[str] | None, field: FieldPath = ("joints",)) -> list[int]:
    """Return the indices of the joints with these names, in the robot's order; None: all joints.

    Raises:
        InvalidProblem: The robot has no joint of a name, or none is named; at this field.
    """
    if names is None:
        return list(range(robot.dof))
    unknown = [(i, name) for i, name in enumerate(names) if name not in robot.joint_names]
    if unknown:
        known = ", ".join(robot.joint_names)
        raise InvalidProblem([((*field, i), f"{robot.id} has no joint {name!r}, but {known}") for i, name in unknown])
    if not names:
        raise InvalidProblem([(field, "a picture of no joint shows nothing")])
    return [index for index, name in enumerate(robot.joint_names) if name in names]


def samples_for(plan: Planned, quantities: Collection[str], times: FloatArray) -> Samples:
    """Evaluate what these quantities need at times (N,), s.

    Raises:
        MissingDynamics: Torques are requested of a robot without inertias and payload.
    """
    include = {TOOL_QUANTITIES[name].include if name in TOOL_QUANTITIES else name for name in quantities}
    return sample_at(plan.path.dynamics, plan.trajectory, times, include)


def joint_curves(plan: Planned, samples: Samples, quantity: str, joints: Sequence[int]) -> list[Curves]:
    """Return the curves of turning joints and of sliding joints, if there are any."""
    robot, limits = plan.path.robot, plan.path.limits
    if quantity == "position":
        lower, upper = (np.tile(robot.limit(side), (len(samples.time), 1)) for side in ("lower", "upper"))
    else:
        lower, upper = (side[samples.segment] for side in limits.bounds(quantity))
    values = getattr(samples, quantity)
    groups = []
    for turns in (True, False):
        rows = [joint for joint in joints if robot.is_angle[joint] == turns]
        if rows:
            scale = 1.0 if quantity == "torque" else np.degrees(1.0) if turns else MILLIMETRES
            names, colours = tuple(robot.joint_names[joint] for joint in rows), tuple(map(colour_of, rows))
            columns = (side[:, rows] * scale for side in (values, lower, upper))
            groups.append(Curves(quantity, JOINT_UNITS[quantity][not turns], names, colours, *columns))
    return groups


def tool_curves(plan: Planned, samples: Samples, quantity: str, axes: Collection[str] | None) -> Curves:
    """Return the curves of a quantity of the tool along axes of the base; None: all axes."""
    drawn = TOOL_QUANTITIES[quantity]
    values = _tool_values(samples, quantity)
    along = [k for k, name in enumerate(drawn.names) if drawn.names != XYZ or axes is None or name in axes]
    limit = np.full(len(samples.time), np.inf)
    if drawn.limit is not None:
        limit = plan.path.limits.magnitudes(drawn.limit)[samples.segment, 0] * MILLIMETRES
    names, colours = tuple(drawn.names[k] for k in along), tuple(AXIS_COLOURS[k] for k in along)
    upper = np.tile(limit[:, None], (1, len(along)))
    return Curves(quantity, drawn.unit, names, colours, values[:, along], np.full_like(upper, -np.inf), upper)


def _tool_values(samples: Samples, quantity: str) -> FloatArray:
    """Return the values (N, curves) of a quantity of the tool, mm or degrees by powers of s."""
    if quantity == "tcp_position":
        return np.asarray(samples.tcp_position) * MILLIMETRES
    if quantity == "tcp_orientation":
        return np.asarray(np.degrees(np.unwrap(np.asarray(samples.tcp_rpy), axis=0)))  # no jump from 180 to -180
    linear, angular = np.asarray(
        samples.tcp_acceleration if quantity.endswith("acceleration") else samples.tcp_velocity
    )
    if "angular" in quantity:
        return np.asarray(np.degrees(angular))
    if quantity == "tcp_speed":
        return np.asarray(np.linalg.norm(linear, axis=1, keepdims=True) * MILLIMETRES)
    return np.asarray(linear * MILLIMETRES)
