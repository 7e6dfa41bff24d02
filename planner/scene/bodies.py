"""The convex pieces of a robot and its carried objects: their placements and displacements."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple, Self

import numpy as np

from planner.robots import Robot
from planner.robots.derived.standing import placement_in_world, tree_joints
from planner.shapes import BoundingCapsule, Shape
from planner.spatial import FloatArray, Pose
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

    @classmethod
    def on(cls, robot: Robot, name: str, joint: int, placement: Any, shape: Shape) -> Self:
        """Return a piece that is placed in the frame of a joint of the robot's model."""
        number, there = placement_in_world(robot, joint, placement)
        return cls(name, number, there.rotation, there.translation, shape)


class JointTree(NamedTuple):
    """Joints that turn about, or slide along, the z axis of their frames; several may start at the base.

    The base stands still: with a positioner, that is the frame in which it and the arm stand.

    Attributes:
        is_angle: (joints,): whether each joint turns.
        parents: The number of the joint before each, from 1; 0 is the base. Only joints of a positioner come before
            their parents.
        turns: (joints, 3, 3): rotation of each joint's frame in the frame before it, at a joint position of 0.
        shifts: (joints, 3), m.
    """

    is_angle: np.ndarray
    parents: tuple[int, ...]
    turns: FloatArray
    shifts: FloatArray

    @classmethod
    def of(cls, robot: Robot) -> Self:
        """Return the joints of a robot."""
        parents, placements = tree_joints(robot)
        turns = np.reshape([placement.rotation for placement in placements], (-1, 3, 3))
        shifts = np.reshape([placement.translation for placement in placements], (-1, 3))
        return cls(robot.is_angle, tuple(parents), turns, shifts)

    @property
    def order(self) -> list[int]:
        """The indices of the joints from the base on: each behind its parent."""
        ascending = [parent <= k for k, parent in enumerate(self.parents)]
        numbers = range(len(ascending))
        return [k for k in numbers if ascending[k]] + [k for k in reversed(numbers) if not ascending[k]]

    def placed(self, rotation: FloatArray, translation: FloatArray) -> Self:
        """Return the joints with their base at a rotation (3, 3) and a translation (3,), m."""
        first = np.array(self.parents, dtype=int) == 0
        turns, shifts = self.turns.copy(), self.shifts.copy()
        turns[first], shifts[first] = rotation @ turns[first], shifts[first] @ rotation.T + translation
        return self._replace(turns=turns, shifts=shifts)

    def beside(self, other: JointTree) -> JointTree:
        """Return these joints, and then other joints on the same base."""
        count = len(self.parents)
        parents = (*self.parents, *(parent + count if parent else 0 for parent in other.parents))
        is_angle = np.concatenate([self.is_angle, other.is_angle])
        turns, shifts = np.concatenate([self.turns, other.turns]), np.concatenate([self.shifts, other.shifts])
        return JointTree(is_angle, parents, turns, shifts)


class Placements(NamedTuple):
    """The placements of bodies at N joint positions, in the base frame of the tree.

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
    """The convex pieces that move with the joints of one robot or of several.

    Attributes:
        tree: The joints.
        pieces: The pieces.
        joints: (bodies,): number of the joint of each.
        radii: (bodies,), m: of the bounding capsules.
        is_moved: (bodies, joints): whether each joint moves the body.
    """

    def __init__(self, tree: JointTree, pieces: Sequence[Body]) -> None:
        self.tree, self.pieces = tree, tuple(pieces)
        self.is_angle = tree.is_angle
        chains = np.zeros((len(tree.parents) + 1, len(tree.parents)), dtype=bool)
        for k in tree.order:
            chains[k + 1] = chains[tree.parents[k]]
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

    def placed(self, base: Pose | None) -> Bodies:
        """Return the bodies with their base at a pose; without a rotation, it has the same axes."""
        if base is None:
            return self
        rotation = np.eye(3) if base.rotation is None else base.rotation
        pieces = [
            piece
            if piece.joint
            else piece._replace(
                rotation=rotation @ piece.rotation, translation=rotation @ piece.translation + base.position
            )
            for piece in self.pieces
        ]
        return Bodies(self.tree.placed(rotation, base.position), pieces)

    def beside(self, other: Bodies) -> Bodies:
        """Return these bodies, and then other bodies on the same base."""
        count = len(self.tree.parents)
        moved = (piece._replace(joint=piece.joint + count) if piece.joint else piece for piece in other.pieces)
        return Bodies(self.tree.beside(other.tree), [*self.pieces, *moved])

    def displacements_by(self, changes: FloatArray, farthest: FloatArray) -> FloatArray:
        """Bound the displacements (bodies, joints), m, by changes of the joints, at any joint position.

        Args:
            changes: (joints,), the largest change of each joint, rad or m.
            farthest: (joints,), the largest magnitude of each joint's position; only joints that slide count.
        """
        reaches = np.linalg.norm(self._spheres, axis=2).max(axis=1) + self.radii
        offsets = np.linalg.norm(self.tree.shifts, axis=1) + np.where(self.is_angle, 0.0, farthest)
        levers = np.zeros(self.is_moved.shape)
        for row, (joint, away) in enumerate(zip(self.joints.tolist(), reaches.tolist(), strict=True)):
            while joint:
                levers[row, joint - 1] = away if self.is_angle[joint - 1] else 1.0
                away += offsets[joint - 1]
                joint = self.tree.parents[joint - 1]
        return levers * changes

    def joint_rows(self) -> FloatArray:
        """Return rotation, origin, whether it turns, and the joint before of each joint, as the kernels read them."""
        tree = self.tree
        return np.column_stack([tree.turns.reshape(-1, 9), tree.shifts, self.is_angle, tree.parents])

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
        for k in self.tree.order:
            parent, turn, shift = (values[k] for values in self.tree[1:])
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
