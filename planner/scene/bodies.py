"""The convex pieces of a robot and its carried objects: their placements and displacements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planner.kinematics.following_errors import levers
from planner.robots import Robot
from planner.shapes import BoundingCapsule, Shape
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING
from planner.trajectories.polynomials import PiecewisePolynomial, bernstein_matrix, powers, shifted

SPHERES = 5
"""Number of spheres that cover a bounding capsule.

Fewer spheres are much wider than the capsule; more take longer than they save.
"""


class Body(NamedTuple):
    """A convex piece that moves with a joint.

    Attributes:
        name: Name of the link, or of the attached object, that it is a piece of.
        joint: Number of the joint that it moves with, as Pinocchio counts: 0 is the base.
        rotation: (3, 3), of the piece in the joint's frame.
        translation: (3,), m.
        shape: The piece in its own frame.
    """

    name: str
    joint: int
    rotation: FloatArray
    translation: FloatArray
    shape: Shape


class Placements(NamedTuple):
    """The placements of bodies at N joint positions, in the base frame.

    Attributes:
        rotations: (N, joints + 1, 3, 3): of the joints' frames; 0 is the base.
        origins: (N, joints + 1, 3), m.
        spheres: (N, bodies, SPHERES, 3), m: centers of spheres along the axis of each body's bounding capsule, the
            first and the last at its ends.
        levers: (N, bodies, joints): largest distance of the body from the axis of a revolute joint that moves it, m. 1
            for a prismatic joint that moves it; 0 for other joints.
    """

    rotations: FloatArray
    origins: FloatArray
    spheres: FloatArray
    levers: FloatArray


class Bodies:
    """The convex pieces that move with the joints of a robot.

    Attributes:
        pieces: The pieces.
        joints: (bodies,): number of the joint of each.
        radii: (bodies,), m: of the bounding capsules.
        is_moved: (bodies, joints): whether each joint moves the body.
    """

    def __init__(self, robot: Robot, pieces: Sequence[Body]) -> None:
        self.pieces = tuple(pieces)
        model = robot.model
        self.is_angle = robot.is_angle
        self._parents = [int(parent) for parent in list(model.parents)[1:]]
        placements = model.jointPlacements.tolist()[1:]
        self._turns = [placement.rotation.copy() for placement in placements]
        self._shifts = [placement.translation.copy() for placement in placements]
        chains = np.zeros((robot.dof + 1, robot.dof), dtype=bool)
        for k, parent in enumerate(self._parents):
            chains[k + 1] = chains[parent]
            chains[k + 1, k] = True
        self.joints = np.array([piece.joint for piece in self.pieces], dtype=int)
        self.is_moved = chains[self.joints]
        capsules = [bounding_capsule(piece.shape) for piece in self.pieces]
        starts, ends = (
            np.array([p.rotation @ end[k] + p.translation for p, end in zip(self.pieces, capsules, strict=True)])
            for k in (0, 1)
        )
        starts, ends = starts.reshape(-1, 3), ends.reshape(-1, 3)
        shares = np.linspace(0.0, 1.0, SPHERES)[:, None]
        self._spheres = starts[:, None] + shares * (ends - starts)[:, None]
        self.radii = np.array([capsule.radius for capsule in capsules])

    def displacements_by(self, robot: Robot) -> FloatArray:
        """Bound the displacements (bodies, joints), m, by the following errors of each joint, at any joint position."""
        reaches = np.linalg.norm(self._spheres, axis=2).max(axis=1) + self.radii
        each = zip(self.joints.tolist(), reaches.tolist(), strict=True)
        of_joints = np.array([levers(robot, joint, reach) for joint, reach in each]).reshape(-1, robot.dof)
        return of_joints * [joint.following_error for joint in robot.joints]

    def joint_rows(self) -> FloatArray:
        """Return rotation, origin, whether it turns, and the joint before of each joint, as the kernels read them."""
        turns, shifts = np.reshape(self._turns, (-1, 9)), np.reshape(self._shifts, (-1, 3))
        return np.column_stack([turns, shifts, self.is_angle, self._parents])

    def at(self, positions: FloatArray) -> Placements:
        """Compute the placements of the bodies at joint positions (N, joints), rad or m."""
        rotations, origins = self.frames(positions)
        spheres = np.matmul(self._spheres, rotations[:, self.joints].transpose(0, 1, 3, 2))
        spheres += origins[:, self.joints, None]
        return Placements(rotations, origins, spheres, self._levers(rotations, origins, spheres))

    def frames(self, positions: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Compute the frames of the joints, rotations (N, joints + 1, 3, 3) and origins (N, joints + 1, 3)."""
        count, joints = positions.shape
        rotations, origins = np.empty((count, joints + 1, 3, 3)), np.zeros((count, joints + 1, 3))
        rotations[:, 0] = np.eye(3)
        cosines, sines = np.cos(positions)[..., None], np.sin(positions)[..., None]
        for k, (parent, turn, shift) in enumerate(zip(self._parents, self._turns, self._shifts, strict=True)):
            before = rotations[:, parent] @ turn
            origins[:, k + 1] = origins[:, parent] + rotations[:, parent] @ shift
            if self.is_angle[k]:
                x, y, c, s = before[:, :, 0], before[:, :, 1], cosines[:, k], sines[:, k]
                rotations[:, k + 1] = np.stack([c * x + s * y, c * y - s * x, before[:, :, 2]], axis=-1)
            else:
                rotations[:, k + 1] = before
                origins[:, k + 1] += before[:, :, 2] * positions[:, k, None]
        return rotations, origins

    def _levers(self, rotations: FloatArray, origins: FloatArray, spheres: FloatArray) -> FloatArray:
        """Return the levers (N, bodies, joints); a convex function is largest at the ends of the capsule's axis."""
        axes = rotations[:, 1:, :, 2]
        ends = spheres[:, :, [0, -1]].reshape(len(axes), 2 * len(self.pieces), 3)
        along = ends @ axes.transpose(0, 2, 1) - (origins[:, 1:] * axes).sum(axis=-1)[:, None]
        feet = origins[:, None, 1:] + along[..., None] * axes[:, None]
        distances = np.linalg.norm(ends[:, :, None] - feet, axis=-1)
        levers = distances.reshape(len(axes), len(self.pieces), 2, axes.shape[1]).max(axis=2) + self.radii[:, None]
        levers = np.where(self.is_angle, levers * (1.0 + ROUNDING) + ROUNDING, 1.0)
        return np.where(self.is_moved, levers, 0.0)

    def displacements(self, placements: Placements, excursions: FloatArray) -> FloatArray:
        """Bound the displacements of the bodies by excursions of the joints, one joint after the other.

        A revolute joint moves no point of a body further than the chord of its angle at the largest distance from its
        axis. The joints before it do not change this distance. See Schwarzer, Saha and Latombe, Adaptive dynamic
        collision checking, IEEE Transactions on Robotics 21, 2005.

        Args:
            placements: The placements at N joint positions.
            excursions: Largest change of each joint (N, joints), rad or m.

        Returns:
            What each joint adds (N, bodies, joints), m.
        """
        chords = 2.0 * np.sin(np.minimum(excursions, np.pi) / 2.0)
        return placements.levers * np.where(self.is_angle, chords, excursions)[:, None]


def bounding_capsule(shape: Shape) -> BoundingCapsule:
    """Return the bounding capsule of a shape that has an end."""
    capsule = shape.bounding_capsule
    if capsule is None:
        raise ValueError("what moves with a robot has an end")
    return capsule


def excursions(
    curve: PiecewisePolynomial,
    starts: FloatArray,
    ends: FloatArray,
    positions: FloatArray,
    velocities: FloatArray | None = None,
) -> FloatArray:
    """Bound |q_j(t) - positions_j| for all t of intervals, by the Bernstein coefficients of the pieces in them.

    With velocities v it is |q_j(t) - positions_j - v_j (t - middle of the interval)|.

    Args:
        curve: The motion of the joints.
        starts: (N,), where the intervals begin.
        ends: (N,), where they end.
        positions: (N, joints).
        velocities: (N, joints); None: 0.

    Returns:
        (N, joints), rounding included.
    """
    breakpoints, lengths = curve.breakpoints, curve.lengths
    first = np.searchsorted(breakpoints[1:-1], starts, side="right")
    last = np.maximum(np.searchsorted(breakpoints[1:-1], ends, side="left"), first)
    count = last - first + 1
    rows = np.repeat(np.arange(len(starts)), count)
    offsets = np.cumsum(count) - count
    pieces = np.arange(len(rows)) - offsets[rows] + first[rows]
    begin = np.maximum(starts[rows] - breakpoints[pieces], 0.0)
    stop = np.maximum(np.minimum(ends[rows] - breakpoints[pieces], lengths[pieces]), begin)
    order = curve.coefficients.shape[2]
    coefficients = curve.coefficients[pieces]
    sizes = np.abs(coefficients) @ np.ascontiguousarray(powers(stop, order)[..., None])
    local = shifted(coefficients, begin[:, None]) * powers(stop - begin, order)[:, None]
    from_positions = local @ bernstein_matrix(order) - positions[rows][..., None]
    away = ROUNDING * (sizes[..., 0] + np.abs(positions[rows]))
    if velocities is not None:
        since = breakpoints[pieces] + begin - ((starts + ends) / 2.0)[rows]
        times = since[:, None] + (stop - begin)[:, None] * np.linspace(0.0, 1.0, order)
        from_positions -= velocities[rows][..., None] * times[:, None]
        away += ROUNDING * np.abs(velocities[rows]) * breakpoints[-1]
    away += np.abs(from_positions).max(axis=-1)
    return np.asarray(np.maximum.reduceat(away, offsets, axis=0), dtype=np.float64)
