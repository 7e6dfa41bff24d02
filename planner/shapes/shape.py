"""What every convex shape has, and the checks of its numbers, which come before any library sees them."""

from __future__ import annotations

import hashlib
from abc import ABC, abstractmethod
from dataclasses import fields
from functools import cached_property
from typing import NamedTuple

import coal
import numpy as np
from numpy.typing import ArrayLike

from planner.fields import PickledByFields
from planner.spatial import FloatArray

LEAST_SIZE = 1e-6
"""Smallest radius, length or side of a shape, m: whatever is thinner is drawn wrongly or has another unit."""

MOST_SIZE = 1e3
"""Largest radius, length or side of a shape, and distance of a vertex from the origin, m.

No cell is larger, and rounding stays below a nanometre.
"""

BOUND_ROUNDING = 1e-12
"""Relative amount by which the radius of a bounding capsule is larger than computed, for the rounding of its own
computation."""


class InvalidShape(ValueError):
    """A shape with numbers that no shape can have; the message says which.

    Attributes:
        field: Name of the field of the shape.

    Examples:
        >>> import planner
        >>> try:
        ...     planner.Capsule(float("nan"), 1.0)
        ... except planner.InvalidShape as error:
        ...     print(error)
        radius is not finite
    """

    def __init__(self, field: str, message: str) -> None:
        super().__init__(f"{field} {message}")
        self.field = field


class BoundingCapsule(NamedTuple):
    """All points within a radius of a line segment: a cheap bound of a shape.

    Attributes:
        start: One end of the segment (3,), m.
        end: The other end (3,), m; a sphere has both at one point.
        radius: m.

    Examples:
        >>> import planner
        >>> bound = planner.Cylinder(0.1, 0.6).bounding_capsule
        >>> isinstance(bound, planner.BoundingCapsule), round(bound.radius, 6)
        (True, 0.1)
    """

    start: FloatArray
    end: FloatArray
    radius: float

    @property
    def volume(self) -> float:
        """The volume, m^3."""
        length = float(np.linalg.norm(self.end - self.start))
        return np.pi * self.radius**2 * (length + 4.0 / 3.0 * self.radius)


class Shape(PickledByFields, ABC):
    """A convex shape in a frame of its own. Shapes of one kind with the same numbers are equal.

    Examples:
        >>> import planner
        >>> isinstance(planner.Sphere(0.1), planner.Shape), planner.Sphere(0.1) == planner.Sphere(0.1)
        (True, True)
    """

    def __post_init__(self) -> None:
        """Check the numbers: they are sizes but where a kind of shape says otherwise."""
        for field in fields(self):  # type: ignore[arg-type]  # every shape is a dataclass
            object.__setattr__(self, field.name, checked_size(field.name, getattr(self, field.name)))

    @abstractmethod
    def support(self, directions: ArrayLike) -> FloatArray:
        """Compute the support of the shape along directions: the largest n . x over its points x.

        Args:
            directions: Unit vectors n (N, 3) in the shape's frame; for others the result is scaled by their length.

        Returns:
            (N,), m, exact but for rounding.
        """

    @cached_property
    @abstractmethod
    def bounding_capsule(self) -> BoundingCapsule | None:
        """A capsule that contains the shape; None: it has no end, as a half space."""

    @cached_property
    @abstractmethod
    def geometry(self) -> coal.CollisionGeometry:
        """The shape as coal has it."""

    @cached_property
    def digest(self) -> str:
        """A name of the content: equal for equal shapes, and for no others."""
        content = hashlib.sha256(type(self).__name__.encode())
        for field in fields(self):  # type: ignore[arg-type]
            content.update(np.ascontiguousarray(getattr(self, field.name), dtype=np.float64).tobytes())
        return content.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Shape) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


def with_bounds(geometry: coal.CollisionGeometry) -> coal.CollisionGeometry:
    """Return a geometry of coal with the box around it computed, without which one of its searches throws."""
    geometry.computeLocalAABB()
    return geometry


def checked_size(field: str, value: float) -> float:
    """Return a radius or length, m, once it is known to be a usable one.

    Raises:
        InvalidShape: It is no number, not positive, or out of all proportion.
    """
    size = float(checked_numbers(field, value, ()))
    if not LEAST_SIZE <= size <= MOST_SIZE:
        raise InvalidShape(field, f"is {size:g} m: it has to be from {LEAST_SIZE:g} to {MOST_SIZE:g} m")
    return size


def checked_numbers(field: str, value: ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """Return finite numbers as a read-only array of a shape, in which -1 is any length.

    Raises:
        InvalidShape: They are no numbers, not finite, or of another shape.
    """
    try:
        numbers = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InvalidShape(field, "is not made of numbers") from None
    if len(shape) != numbers.ndim or any(n not in (-1, m) for n, m in zip(shape, numbers.shape, strict=True)):
        raise InvalidShape(field, f"has the shape {numbers.shape}, it needs {shape}")
    if not np.isfinite(numbers).all():
        raise InvalidShape(field, "is not finite")
    numbers.flags.writeable = False
    return numbers
