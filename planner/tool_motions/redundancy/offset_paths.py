"""Paths of the tool that leave another path by offsets within a tolerance region, seen by an arm on moving axes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from planner.kinematics.screws import Screws, screws_of
from planner.problems.regions import Region
from planner.robots import Robot
from planner.spatial import FloatArray, Pose, rotations_from_vectors
from planner.tool_motions.polylines import Polyline
from planner.tool_motions.pose_paths import PosePath
from planner.tool_motions.pose_splines import PoseSpline
from planner.trajectories.polynomials import PiecewisePolynomial


@dataclass(frozen=True, eq=False)
class AxisFrame:
    """The frame in which external axes carry an arm, seen from the base frame.

    Attributes:
        screws: The axes, with the base frame as their tip at position 0.
        home: The placement of this frame while the axes are fixed.
    """

    screws: Screws
    home: pin.SE3

    @classmethod
    def of(cls, robot: Robot, fixed: FloatArray) -> AxisFrame:
        """Return the frame of a robot's external axes, whose arm alone has them fixed at positions (axes,)."""
        axes = screws_of(robot).of_first(len(robot.external_axes))
        (position,), (rotation,) = axes.poses(fixed[None], np.zeros(3))
        return cls(axes, pin.SE3(rotation, position))

    def seen(
        self, axes: FloatArray, positions: FloatArray, rotations: FloatArray | None
    ) -> tuple[FloatArray, FloatArray | None]:
        """Return the poses for the arm with fixed axes, given poses with the axes at positions (N, axes)."""
        origins, frames = self.screws.poses(axes, np.zeros(3))
        turns = self.home.rotation @ frames.transpose(0, 2, 1)
        moved = self.home.translation + (turns @ (positions - origins)[..., None])[..., 0]
        return moved, None if rotations is None else turns @ rotations

    def seen_twists(self, axes: FloatArray, rates: FloatArray, positions: FloatArray, twists: FloatArray) -> FloatArray:
        """Return the twists (N, 6) for the arm with fixed axes, given twists at positions (N, 3)."""
        origins, frames, J = self.screws.reach(axes, np.zeros(3))
        own = (J @ rates[..., None])[..., 0]
        turns = self.home.rotation @ frames.transpose(0, 2, 1)
        linear = twists[:, :3] - own[:, :3] - np.cross(own[:, 3:], positions - origins)
        seen = np.stack([linear, twists[:, 3:] - own[:, 3:]], axis=1) @ turns.transpose(0, 2, 1)
        twists_of_arm: FloatArray = seen.reshape(-1, 6)
        return twists_of_arm


def poses_in_region(
    region: Region, offsets: FloatArray, positions: FloatArray, rotations: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the poses at offsets (N, ranges) within a region of poses (N, 3) and (N, 3, 3)."""
    shifts, turns = np.zeros((len(positions), 3)), rotations
    for name, values in zip(region.ranges, offsets.T, strict=True):
        axis = np.eye(3)["xyz".index(name[-1])]
        if name.startswith("rotation"):
            turns = turns @ rotations_from_vectors(values[:, None] * axis)
        else:
            shifts = shifts + values[:, None] * axis
    return positions + (rotations @ shifts[..., None])[..., 0], turns


@dataclass(frozen=True, eq=False)
class OffsetPath:
    """A path that differs from another path by offsets, which are zero at the ends.

    Attributes:
        path: The other path, with a rotation.
        region: What may be off.
        offsets: (pieces, coordinates, 6), over u from 0 to 1, m or rad.
        breakpoints: (n,), the parameters from 0 to 1 between which it is followed.
        frame: The frame of the external axes, in which an arm follows the path while they move; None: none move.
        axes: (pieces, axes, 6), their positions over u from 0 to 1, rad or m.
    """

    path: PosePath
    region: Region
    offsets: PiecewisePolynomial
    breakpoints: FloatArray
    frame: AxisFrame | None = None
    axes: PiecewisePolynomial | None = None

    def pose(self, u: float) -> Pose:
        """Return the pose at u."""
        (position,), rotations = self.poses(np.array([u]))
        return Pose(position, None if rotations is None else rotations[0])

    def twist(self, u: float) -> FloatArray:
        """Return the linear over the angular velocity (6,) by u."""
        (twist,) = self.twists(np.array([u]))
        return np.asarray(twist)

    def poses(self, u: FloatArray) -> tuple[FloatArray, FloatArray | None]:
        """Return positions (N, 3), m, and rotations (N, 3, 3) at parameters (N,)."""
        positions, rotations = poses_at(self.path, u)
        if self.region.ranges:
            positions, rotations = poses_in_region(self.region, self.offsets.evaluate(u, [0])[0], positions, rotations)
        if self.frame is None or self.axes is None:
            return positions, rotations
        return self.frame.seen(self.axes.evaluate(u, [0])[0], positions, rotations)

    def twists(self, u: FloatArray) -> FloatArray:
        """Return linear over angular velocities (N, 6) by u, in the base frame of the arm alone."""
        (positions, rotations), twists = poses_at(self.path, u), twists_at(self.path, u)
        if self.region.ranges:
            values, rates = self.offsets.evaluate(u, [0, 1])
            shift, linear, angular = np.zeros((3, len(u), 3))
            turned = np.broadcast_to(np.eye(3), (len(u), 3, 3))
            for name, value, rate in zip(self.region.ranges, values.T[..., None], rates.T[..., None], strict=True):
                axis = np.eye(3)["xyz".index(name[-1])]
                if name.startswith("rotation"):
                    angular = angular + rate * (turned @ axis)
                    turned = turned @ rotations_from_vectors(value * axis)
                else:
                    shift, linear = shift + value * axis, linear + rate * axis
            shift, linear, angular = ((rotations @ vectors[..., None])[..., 0] for vectors in (shift, linear, angular))
            twists = np.hstack([twists[:, :3] + np.cross(twists[:, 3:], shift) + linear, twists[:, 3:] + angular])
            positions = positions + shift
        if self.frame is None or self.axes is None:
            return twists
        axes, rates = self.axes.evaluate(u, [0, 1])
        return self.frame.seen_twists(axes, rates, positions, twists)


def poses_at(path: PosePath, u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return positions (N, 3) and rotations (N, 3, 3) of a path with a rotation at parameters (N,)."""
    if isinstance(path, Polyline | PoseSpline | OffsetPath):
        positions, rotations = path.poses(u)
        assert rotations is not None  # noqa: S101 - there are no offsets without rotations
        return positions, rotations
    poses = [path.pose(at) for at in u.tolist()]
    return np.array([pose.position for pose in poses]), np.array([pose.rotation for pose in poses])


def twists_at(path: PosePath, u: FloatArray) -> FloatArray:
    """Return the twists (N, 6) of a path with a rotation at parameters (N,)."""
    if isinstance(path, Polyline | PoseSpline | OffsetPath):
        return path.twists(u)
    return np.array([path.twist(at) for at in u.tolist()])
