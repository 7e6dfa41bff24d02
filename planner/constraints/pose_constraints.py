"""Constraints on the pose of the tool: angles and distances that do not exceed a value."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import ClassVar

import numpy as np

from planner.fields import FieldPath
from planner.spatial import FloatArray, Pose, rotation_from_quaternion, rotation_vector

LEAST_KEPT_ANGLE = 0.02
"""The least angle of a constraint, rad: straight joint motions hardly keep a smaller one."""

LEAST_KEPT_DISTANCE = 0.001
"""The least distance of a constraint, and the least length of a box, m: straight joint motions hardly keep less."""

RANGES = {True: ("rad", LEAST_KEPT_ANGLE, np.pi), False: ("m", LEAST_KEPT_DISTANCE, np.inf)}
"""The unit, the least limit and the end of the limits of constraints on angles, and on distances."""

POSE_CONSTRAINT_TOLERANCE = 1e-6
"""The excess over a constraint, rad or m, that counts as rounding: inverse kinematics reaches poses to as much."""

PROJECTED_SHARE = 0.98
"""The share of the allowed value to which a projection leads: straight motions between such positions have room."""

PROJECTED_DEPTH = 0.005
"""The largest depth in a box or half-space to which a projection leads, m."""

VECTORS_KEPT = 256
"""Number of unit vectors, and of rotations, that a process keeps."""


class PoseConstraint(ABC):
    """A value of the tool's pose with a limit, such as the angle of an upright cup.

    The value grows with a gauge: a convex function of the tool's position or of its rotation matrix. Both are twice
    differentiable along a motion, so the gauge between two samples has a bound, see
    `planner.constraints.kept_poses.KeptPoses`.

    Attributes:
        kind: Its name among the kinds.
        quantity: The quantity of its check, one of `planner.quantities.MEASURES`.
        field: The field with its limit.
        is_angle: Whether the gauge is a negative cosine of the rotation, rad; otherwise a distance of the position, m.

    Examples:
        >>> import planner
        >>> isinstance(planner.ToolInHalfSpace((0.0, 0.0, 1.0), 0.6), planner.PoseConstraint)
        True
    """

    kind: ClassVar[str]
    quantity: ClassVar[str]
    field: ClassVar[str]
    is_angle: ClassVar[bool]

    @property
    def limit(self) -> float:
        """The largest value, rad or m."""
        return float(getattr(self, self.field))

    @property
    def target(self) -> float:
        """The largest value to which a projection leads, rad or m."""
        return PROJECTED_SHARE * self.limit

    @property
    def room(self) -> float:
        """The distance between the border and the middle of the allowed values, rad or m; may be infinite."""
        return self.limit

    def faults(self, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
        """Find invalid values, with their fields."""
        for name, value in vars(self).items():
            if name in ("direction", "axis", "normal", "point"):
                numbers = np.asarray(value, dtype=np.float64)
                is_point = name == "point"
                if numbers.shape != (3,) or not np.isfinite(numbers).all() or not (is_point or numbers.any()):
                    yield (
                        (*field, name),
                        f"must be three finite numbers{'' if is_point else ', not all 0'}; got {value}",
                    )
        yield from self._limit_faults(field)

    def _limit_faults(self, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
        """Find an invalid limit, or an invalid region."""
        limit, (unit, least, end) = self.limit, RANGES[self.is_angle]
        if not least <= limit < end:
            yield (*field, self.field), f"must be at least {least:g} {unit} and less than {end:.3g}; got {limit:g}"

    @abstractmethod
    def gauges(self, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Compute the gauges (N,) at positions (N, 3), m, and rotations (N, 3, 3) of the tool."""

    @abstractmethod
    def slope(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the derivative (6,) of the value by the tool's twist, linear over angular; 0: it is unknown."""

    @property
    def largest_gauge(self) -> float:
        """The gauge at the limit with its tolerance."""
        largest = self.limit + POSE_CONSTRAINT_TOLERANCE
        return -float(np.cos(min(largest, np.pi))) if self.is_angle else largest

    def value(self, gauge: float) -> float:
        """Return the value, rad or m, at a gauge."""
        return float(np.arccos(np.clip(-gauge, -1.0, 1.0))) if self.is_angle else gauge

    def ratio(self, value: float) -> float:
        """Return the share of the limit at a value, rad or m; 1 plus the value at limit 0."""
        if self.limit == 0.0:
            return 1.0 + value - POSE_CONSTRAINT_TOLERANCE
        return value / (self.limit + POSE_CONSTRAINT_TOLERANCE)


@dataclass(frozen=True)
class ToolAxis(PoseConstraint):
    """The constraint that an axis of the tool stays within an angle of a direction, such as an upright cup.

    Attributes:
        direction: The direction in the base frame; its length does not count.
        angle: The largest angle between the axis and the direction, rad.
        axis: The axis in the tool frame; its length does not count.

    Examples:
        >>> import planner
        >>> upright = planner.ToolAxis((0.0, 0.0, 1.0), 0.2)
        >>> planner.FreeMotion(keep=(upright,)).keep[0].limit
        0.2
    """

    direction: tuple[float, float, float]
    angle: float
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)

    kind: ClassVar[str] = "tool_axis"
    quantity: ClassVar[str] = "tool_axis_angle"
    field: ClassVar[str] = "angle"
    is_angle: ClassVar[bool] = True

    def gauges(self, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Compute the negative cosines (N,) of the angle."""
        return -np.asarray((rotations @ _unit(self.axis)) @ _unit(self.direction), dtype=np.float64)

    def slope(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the derivative (6,) of the angle: the tool turns about the normal of axis and direction."""
        (a, b, c), (x, y, z) = _unit(self.direction), rotation @ _unit(self.axis)
        return _slope(np.array([b * z - c * y, c * x - a * z, a * y - b * x]), is_angle=True)


@dataclass(frozen=True)
class ToolOrientation(PoseConstraint):
    """The constraint that the orientation of the tool stays within an angle of a given one.

    Attributes:
        orientation: The orientation in the base frame, a quaternion x, y, z, w; its length does not count.
        angle: The largest angle of the rotation between the two, rad.

    Examples:
        >>> import planner
        >>> planner.ToolOrientation((1.0, 0.0, 0.0, 0.0), 0.1).limit
        0.1
    """

    orientation: tuple[float, float, float, float]
    angle: float

    kind: ClassVar[str] = "orientation"
    quantity: ClassVar[str] = "tool_orientation_angle"
    field: ClassVar[str] = "angle"
    is_angle: ClassVar[bool] = True

    def faults(self, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
        """Find invalid values, with their fields."""
        if len(self.orientation) != 4 or not np.isfinite(self.orientation).all() or not np.any(self.orientation):
            yield (*field, "orientation"), f"must be four finite numbers, not all 0; got {self.orientation}"
        yield from super().faults(field)

    def gauges(self, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Compute the negative cosines (N,) of the angle, from the trace of the rotation between the two."""
        traces = np.einsum("ij,nij->n", _rotation_of(self.orientation), rotations)
        return np.asarray((1.0 - traces) / 2.0, dtype=np.float64)

    def slope(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the derivative (6,) of the angle: the tool turns about the axis of the rotation between the two."""
        return _slope(rotation_vector(rotation @ _rotation_of(self.orientation).T), is_angle=True)


@dataclass(frozen=True)
class ToolNearPlane(PoseConstraint):
    """The constraint that the tool stays within a distance of a plane, on either side.

    Attributes:
        point: A point of the plane in the base frame, m.
        normal: The normal of the plane in the base frame; its length does not count.
        distance: The largest distance of the tool, m.

    Examples:
        >>> import planner
        >>> planner.ToolNearPlane((0.0, 0.0, 0.3), (0.0, 0.0, 1.0), 0.01).limit
        0.01
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    distance: float

    kind: ClassVar[str] = "plane"
    quantity: ClassVar[str] = "tool_plane_distance"
    field: ClassVar[str] = "distance"
    is_angle: ClassVar[bool] = False

    def gauges(self, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Compute the distances (N,) from the plane."""
        return np.asarray(np.abs((positions - np.array(self.point)) @ _unit(self.normal)), dtype=np.float64)

    def slope(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the derivative (6,) of the distance: along the normal."""
        normal = _unit(self.normal)
        return _slope(normal * np.sign((position - np.array(self.point)) @ normal), is_angle=False)


@dataclass(frozen=True)
class ToolNearLine(PoseConstraint):
    """The constraint that the tool stays within a distance of an infinite line.

    Attributes:
        point: A point of the line in the base frame, m.
        direction: The direction of the line in the base frame; its length does not count.
        distance: The largest distance of the tool, m.

    Examples:
        >>> import planner
        >>> planner.ToolNearLine((0.5, 0.0, 0.3), (0.0, 1.0, 0.0), 0.02).limit
        0.02
    """

    point: tuple[float, float, float]
    direction: tuple[float, float, float]
    distance: float

    kind: ClassVar[str] = "line"
    quantity: ClassVar[str] = "tool_line_distance"
    field: ClassVar[str] = "distance"
    is_angle: ClassVar[bool] = False

    def gauges(self, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Compute the distances (N,) from the line."""
        return np.asarray(np.linalg.norm(self._across(positions), axis=1), dtype=np.float64)

    def slope(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the derivative (6,) of the distance: away from the line."""
        return _slope(self._across(position[None])[0], is_angle=False)

    def _across(self, positions: FloatArray) -> FloatArray:
        """Return the vectors (N, 3), m, from the line to positions (N, 3)."""
        direction = _unit(self.direction)
        offsets = positions - np.array(self.point)
        return np.asarray(offsets - (offsets @ direction)[:, None] * direction, dtype=np.float64)


class _Region(PoseConstraint):
    """The constraint that the tool stays inside a convex region: it is not beyond its border."""

    is_angle: ClassVar[bool] = False

    @property
    def limit(self) -> float:
        """No distance beyond the region is allowed."""
        return 0.0

    @property
    def target(self) -> float:
        """A depth inside the region, negative, m."""
        return -min(PROJECTED_DEPTH, (1.0 - PROJECTED_SHARE) * self.room)


@dataclass(frozen=True)
class ToolInBox(_Region):
    """The constraint that the tool stays inside a box.

    Attributes:
        pose: The pose of the box's centre and axes in the base frame; without a rotation, the axes are the base's.
        size: The lengths of the box along its axes, m.

    Examples:
        >>> import planner
        >>> planner.ToolInBox(planner.Pose([0.5, 0.0, 0.3]), (0.4, 0.8, 0.2)).limit
        0.0
    """

    pose: Pose
    size: tuple[float, float, float]

    kind: ClassVar[str] = "box"
    quantity: ClassVar[str] = "tool_beyond_box"
    field: ClassVar[str] = "size"

    @property
    def room(self) -> float:
        """Half of the shortest length, m."""
        return min(self.size) / 2.0

    def _limit_faults(self, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
        if not np.isfinite(self.pose.position).all():
            yield (*field, "pose"), f"must have a finite position; got {self.pose.position.tolist()}"
        if len(self.size) != 3 or not all(LEAST_KEPT_DISTANCE <= own < np.inf for own in self.size):
            least = f"{LEAST_KEPT_DISTANCE:g} m"
            yield (*field, "size"), f"must be three finite numbers of at least {least}; got {self.size}"

    def gauges(self, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Compute the distances (N,) beyond the nearest face; negative inside."""
        return np.asarray((np.abs(self._inside(positions)) - np.array(self.size) / 2.0).max(axis=1), dtype=np.float64)

    def slope(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the derivative (6,) of the distance: along the normal of the nearest face."""
        inside = self._inside(position[None])[0]
        face = int((np.abs(inside) - np.array(self.size) / 2.0).argmax())
        return _slope(self._axes[:, face] * np.sign(inside[face]), is_angle=False)

    @property
    def _axes(self) -> FloatArray:
        """The axes of the box, the columns (3, 3)."""
        return np.eye(3) if self.pose.rotation is None else self.pose.rotation

    def _inside(self, positions: FloatArray) -> FloatArray:
        """Return the coordinates (N, 3), m, of positions (N, 3) in the box."""
        return np.asarray((positions - self.pose.position) @ self._axes, dtype=np.float64)


@dataclass(frozen=True)
class ToolInHalfSpace(_Region):
    """The constraint that the tool stays in a half-space: normal . position <= offset.

    Attributes:
        normal: The direction out of the half-space in the base frame; its length does not count.
        offset: The distance of its plane from the origin along the normal, m.

    Examples:
        >>> import planner
        >>> planner.ToolInHalfSpace((0.0, 0.0, 1.0), 0.6).offset
        0.6
    """

    normal: tuple[float, float, float]
    offset: float

    kind: ClassVar[str] = "half_space"
    quantity: ClassVar[str] = "tool_beyond_half_space"
    field: ClassVar[str] = "offset"

    @property
    def room(self) -> float:
        """Infinite."""
        return np.inf

    def _limit_faults(self, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
        if not np.isfinite(self.offset):
            yield (*field, "offset"), f"must be finite; got {self.offset}"

    def gauges(self, positions: FloatArray, rotations: FloatArray) -> FloatArray:
        """Compute the distances (N,) beyond the plane; negative inside."""
        return np.asarray(positions @ _unit(self.normal) - self.offset, dtype=np.float64)

    def slope(self, position: FloatArray, rotation: FloatArray) -> FloatArray:
        """Return the derivative (6,) of the distance: along the normal."""
        return _slope(_unit(self.normal), is_angle=False)


@lru_cache(maxsize=VECTORS_KEPT)
def _unit(vector: tuple[float, ...]) -> FloatArray:
    """Return the unit vector (3,) of a direction."""
    values = np.array(vector, dtype=np.float64)
    values /= np.linalg.norm(values)
    values.flags.writeable = False
    return values


@lru_cache(maxsize=VECTORS_KEPT)
def _rotation_of(xyzw: tuple[float, ...]) -> FloatArray:
    """Return the rotation (3, 3) of a quaternion."""
    rotation = rotation_from_quaternion(np.array(xyzw, dtype=np.float64))
    rotation.flags.writeable = False
    return rotation


def _slope(direction: FloatArray, *, is_angle: bool) -> FloatArray:
    """Return the slope (6,) of a value that grows along a direction (3,), or by rotation about it; 0: none."""
    slope, length = np.zeros(6), float(np.sqrt(direction @ direction))
    if length > 0.0:
        slope[3 * is_angle : 3 + 3 * is_angle] = direction / length
    return slope
