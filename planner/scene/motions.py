"""Known motions of objects: parts on belts, doors, gates."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from planner.fields import FieldPath
from planner.spatial import FloatArray, Pose, as_pose, is_rotation, rotation_vector


class Leg(NamedTuple):
    """A part of a motion with constant velocities.

    Attributes:
        begin: When it begins, s.
        end: When it ends, s; infinite: never.
        position: (3,), m: the origin of the object in the world when it begins.
        rotation: (3, 3), of the object in the world when it begins.
        velocity: (3,), m/s: of the origin, in the world.
        spin: (3,), rad/s: the angular velocity, in the world.
    """

    begin: float
    end: float
    position: FloatArray
    rotation: FloatArray
    velocity: FloatArray
    spin: FloatArray


@dataclass(frozen=True, eq=False)
class ConstantVelocity:
    """The motion of an object on a straight line from time 0 on, such as that of a part on a belt.

    Time 0 is the start of the robot's trajectory.

    Attributes:
        velocity: (3,), m/s, in the world.
        end: The time at which the object stops, s; None: it moves on without end.

    Examples:
        >>> import planner
        >>> planner.ConstantVelocity([0.0, 0.25, 0.0], end=4.0).end
        4.0
    """

    velocity: ArrayLike
    end: float | None = None

    def __post_init__(self) -> None:
        """Keep the velocity in an array."""
        object.__setattr__(self, "velocity", np.array(self.velocity, dtype=np.float64))

    @property
    def stop(self) -> float | None:
        """The time at which the object stops, s; None: never."""
        return self.end

    def legs(self, start: Pose) -> Iterator[Leg]:
        """Yield the parts of the motion from a pose in the world at time 0."""
        position, rotation, still = start.position, _axes(start), np.zeros(3)
        velocity = np.asarray(self.velocity)
        if self.end is None:
            yield Leg(0.0, np.inf, position, rotation, velocity, still)
            return
        yield Leg(0.0, self.end, position, rotation, velocity, still)
        yield Leg(self.end, np.inf, position + self.end * velocity, rotation, still, still)

    def faults(self) -> Iterator[tuple[FieldPath, str]]:
        """Find the faults of the motion, with their fields in it."""
        velocity = np.asarray(self.velocity)
        if velocity.shape != (3,) or not np.isfinite(velocity).all():
            yield ("velocity",), "must be three finite numbers"
        if self.end is not None and not 0.0 < self.end < np.inf:
            yield ("end",), f"must be greater than 0 and finite; got {self.end:g}"


@dataclass(frozen=True, eq=False)
class TimedPoses:
    """The motion of an object from its pose at time 0 through poses at given times, such as that of a door.

    Between two of them the origin of the object moves at constant velocity. The object turns at constant speed, by the
    shortest rotation. After the last pose it rests.

    Attributes:
        times: (poses,), s, greater than 0 and ascending; time 0 is the start of the robot's trajectory.
        poses: The poses of the object in the world at these times; one without a rotation keeps the rotation before.

    Examples:
        >>> import planner
        >>> planner.TimedPoses([1.0, 3.0], [planner.Pose([1.0, 0.0, 0.0]), planner.Pose([1.0, 0.5, 0.0])]).times
        (1.0, 3.0)
    """

    times: Sequence[float]
    poses: Sequence[Pose]

    def __post_init__(self) -> None:
        """Convert other types of poses; keep lists in tuples, which cannot change."""
        object.__setattr__(self, "times", tuple(map(float, self.times)))
        object.__setattr__(self, "poses", tuple(as_pose(pose, f"poses[{i}]") for i, pose in enumerate(self.poses)))

    @property
    def stop(self) -> float | None:
        """The time at which the object stops, s."""
        return self.times[-1] if self.times else None

    def legs(self, start: Pose) -> Iterator[Leg]:
        """Yield the parts of the motion from a pose in the world at time 0."""
        rotations = [_axes(start)]
        for pose in self.poses:
            rotations.append(rotations[-1] if pose.rotation is None else pose.rotation)
        positions = [start.position, *(pose.position for pose in self.poses)]
        knots = list(zip([0.0, *self.times], positions, rotations, strict=True))
        for (begin, here, turn), (end, there, turned) in pairwise(knots):
            duration = end - begin
            spin = turn @ rotation_vector(turn.T @ turned) / duration
            yield Leg(begin, end, here, turn, (there - here) / duration, spin)
        end, there, turned = knots[-1]
        yield Leg(end, np.inf, there, turned, np.zeros(3), np.zeros(3))

    def faults(self) -> Iterator[tuple[FieldPath, str]]:
        """Find the faults of the motion, with their fields in it."""
        times = np.array([0.0, *self.times])
        if not self.times:
            yield ("times",), "must have at least one time"
        if not np.isfinite(times).all() or not (np.diff(times) > 0.0).all():
            yield ("times",), "must be finite, greater than 0 and strictly ascending"
        if len(self.poses) != len(self.times):
            yield ("poses",), f"must be as many as the times, {len(self.times)}; got {len(self.poses)}"
        for i, pose in enumerate(self.poses):
            is_turn = pose.rotation is None or bool(is_rotation(pose.rotation))
            if not (pose.position.shape == (3,) and np.isfinite(pose.position).all() and is_turn):
                yield ("poses", i), "must have a finite position and a rotation"


ObjectMotion = ConstantVelocity | TimedPoses
"""Type of the motions of objects."""


def _axes(pose: Pose) -> FloatArray:
    return np.eye(3) if pose.rotation is None else pose.rotation
