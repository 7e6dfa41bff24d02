"""Shapes defined by a few numbers, each centred at the origin of its frame, with its axis, if any, along z."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import coal
import numpy as np
from numpy.typing import ArrayLike

from planner.shapes.shape import (
    BOUND_ROUNDING,
    MOST_SIZE,
    BoundingCapsule,
    InvalidShape,
    Shape,
    checked_numbers,
    checked_size,
    with_bounds,
)
from planner.spatial import FloatArray

LEAST_NORMAL = 1e-9
"""Length below which a normal has no direction that survives rounding."""


@dataclass(frozen=True, eq=False)
class Sphere(Shape):
    """A ball.

    Attributes:
        radius: m.

    Examples:
        >>> import planner
        >>> planner.Sphere(0.1).support([[0.0, 0.0, 1.0]])
        array([0.1])
    """

    radius: float

    def support(self, directions: ArrayLike) -> FloatArray:
        """Compute the largest n . x over the ball: r |n|."""
        return self.radius * _lengths(np.asarray(directions))

    @cached_property
    def bounding_capsule(self) -> BoundingCapsule:
        """The ball itself."""
        return _along_z(0.0, self.radius)

    @cached_property
    def geometry(self) -> coal.Sphere:
        """The ball as coal has it."""
        return with_bounds(coal.Sphere(self.radius))


@dataclass(frozen=True, eq=False)
class Box(Shape):
    """A cuboid.

    Attributes:
        size: Lengths of the sides along x, y and z (3,), m.

    Examples:
        >>> import planner
        >>> planner.Box([0.2, 0.4, 0.6]).support([[0.0, 0.0, 1.0]])
        array([0.3])
    """

    size: FloatArray

    if TYPE_CHECKING:

        def __init__(self, size: ArrayLike) -> None: ...

    def __post_init__(self) -> None:
        """Check the numbers."""
        object.__setattr__(self, "size", checked_numbers("size", self.size, (3,)))
        for side in self.size.tolist():
            checked_size("size", side)

    def support(self, directions: ArrayLike) -> FloatArray:
        """Compute the largest n . x over the box: the sum of |n_k| h_k with the half sides h."""
        support: FloatArray = np.abs(np.asarray(directions)) @ (self.size / 2.0)
        return support

    @cached_property
    def bounding_capsule(self) -> BoundingCapsule:
        """The smaller one of the capsule around the box's longest axis and the ball around it."""
        half = self.size / 2.0
        long = int(np.argmax(half))
        end = np.zeros(3)
        end[long] = half[long]
        radius = float(np.linalg.norm(np.delete(half, long))) * (1.0 + BOUND_ROUNDING)
        ball = _along_z(0.0, float(np.linalg.norm(half)))
        return min(ball, BoundingCapsule(-end, end, radius), key=lambda capsule: capsule.volume)

    @cached_property
    def geometry(self) -> coal.Box:
        """The box as coal has it."""
        return with_bounds(coal.Box(*self.size.tolist()))


@dataclass(frozen=True, eq=False)
class Cylinder(Shape):
    """A circular cylinder with flat ends, along z.

    Attributes:
        radius: m.
        length: m.

    Examples:
        >>> import planner
        >>> planner.Cylinder(0.1, 0.6).support([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
        array([0.3, 0.1])
    """

    radius: float
    length: float

    def support(self, directions: ArrayLike) -> FloatArray:
        """Compute the largest n . x over the cylinder: r |(n_x, n_y)| + h |n_z| with half its length h."""
        n = np.asarray(directions)
        support: FloatArray = self.radius * np.hypot(n[:, 0], n[:, 1]) + self.length / 2.0 * np.abs(n[:, 2])
        return support

    @cached_property
    def bounding_capsule(self) -> BoundingCapsule:
        """The smaller one of the capsule around the cylinder's axis and the ball around it."""
        half = self.length / 2.0
        candidates = _along_z(half, self.radius), _along_z(0.0, float(np.hypot(half, self.radius)))
        return min(candidates, key=lambda capsule: capsule.volume)

    @cached_property
    def geometry(self) -> coal.Cylinder:
        """The cylinder as coal has it."""
        return with_bounds(coal.Cylinder(self.radius, self.length))


@dataclass(frozen=True, eq=False)
class Capsule(Shape):
    """A circular cylinder along z with half balls at its ends.

    Attributes:
        radius: m.
        length: Length between the centres of the half balls, m.

    Examples:
        >>> import planner
        >>> planner.Capsule(0.1, 0.6).support([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])
        array([0.4, 0.1])
    """

    radius: float
    length: float

    def support(self, directions: ArrayLike) -> FloatArray:
        """Compute the largest n . x over the capsule: r |n| + h |n_z| with half its length h."""
        n = np.asarray(directions)
        support: FloatArray = self.radius * _lengths(n) + self.length / 2.0 * np.abs(n[:, 2])
        return support

    @cached_property
    def bounding_capsule(self) -> BoundingCapsule:
        """The capsule itself."""
        return _along_z(self.length / 2.0, self.radius)

    @cached_property
    def geometry(self) -> coal.Capsule:
        """The capsule as coal has it."""
        return with_bounds(coal.Capsule(self.radius, self.length))


@dataclass(frozen=True, eq=False)
class HalfSpace(Shape):
    """All points x with normal . x <= offset: a floor, a wall, a ceiling.

    The distance of another shape follows from that shape's support alone: -support(-normal) - offset.

    Attributes:
        normal: Direction out of the half space (3,); it is made a unit vector.
        offset: Distance of the plane from the origin along the normal, m.

    Examples:
        >>> import planner
        >>> planner.HalfSpace([0.0, 0.0, 2.0], -0.1).normal
        array([0., 0., 1.])
    """

    normal: FloatArray
    offset: float = 0.0

    if TYPE_CHECKING:

        def __init__(self, normal: ArrayLike, offset: float = 0.0) -> None: ...

    def __post_init__(self) -> None:
        """Check the numbers."""
        normal = checked_numbers("normal", self.normal, (3,))
        largest = float(np.abs(normal).max())
        if largest < LEAST_NORMAL:
            raise InvalidShape("normal", "has no direction")
        normal = normal / largest  # first, so that no square overflows
        normal = normal / np.linalg.norm(normal)
        normal.flags.writeable = False
        offset = float(checked_numbers("offset", self.offset, ()))
        if abs(offset) > MOST_SIZE:
            raise InvalidShape("offset", f"is {offset:g} m: it has to be within {MOST_SIZE:g} m")
        object.__setattr__(self, "normal", normal)
        object.__setattr__(self, "offset", offset)

    def support(self, directions: ArrayLike) -> FloatArray:
        """Compute the largest n . x over the half space: infinite but for its own normal itself."""
        own = (np.asarray(directions) == self.normal).all(axis=1)
        return np.where(own, self.offset, np.inf)

    @cached_property
    def bounding_capsule(self) -> None:
        """None: a half space has no end."""
        return

    @cached_property
    def geometry(self) -> coal.Halfspace:
        """The half space as coal has it."""
        return with_bounds(coal.Halfspace(self.normal, self.offset))


def _lengths(vectors: FloatArray) -> FloatArray:
    """Return the lengths (N,) of vectors (N, 3)."""
    lengths: FloatArray = np.linalg.norm(vectors, axis=1)
    return lengths


def _along_z(half_length: float, radius: float) -> BoundingCapsule:
    """Return the capsule about z with its ends at +-half_length."""
    end = np.array([0.0, 0.0, half_length])
    return BoundingCapsule(-end, end, radius * (1.0 + BOUND_ROUNDING))
