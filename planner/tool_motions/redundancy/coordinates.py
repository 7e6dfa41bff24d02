"""The coordinates that a motion of the tool leaves open, and the arm's solutions for values of them."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planner.kinematics.closed_form import ClosedForm
from planner.kinematics.configurations import sides_of
from planner.kinematics.descent import Target, seed_table
from planner.kinematics.screws import screws_of
from planner.kinematics.turns import TURN
from planner.problems.regions import Region
from planner.robots import Robot
from planner.robots.derived.changes import with_locked
from planner.robots.findings import Findings
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING
from planner.tool_motions.redundancy.offset_paths import AxisFrame, poses_in_region
from planner.tool_motions.redundancy.smoothing import ROOM_OFF_LIMITS

CANDIDATE_MISS = 1e-4
"""Largest distance, m, and difference of a rotation's elements at which a candidate of a closed form is a solution."""

MOST_SOLVED_TOGETHER = 8192
"""Number of poses whose solutions are found at once: their arrays take some 10 MB."""


class States(NamedTuple):
    """Joint positions that reach poses at values of the coordinates.

    Attributes:
        rows: The row of each in the given poses, ascending, (states,).
        positions: (states, joints), rad or m, external axes first.
    """

    rows: np.ndarray
    positions: FloatArray


@dataclass(frozen=True, eq=False)
class OpenCoordinates:
    """External axes, and then the offsets of a region, in their order.

    Attributes:
        robot: The robot, with its tool.
        region: The tolerance region of the poses; without ranges, the axes alone are open.
    """

    robot: Robot
    region: Region

    @property
    def carried(self) -> int:
        """The number of external axes."""
        return len(self.robot.external_axes)

    @cached_property
    def lower(self) -> FloatArray:
        """The lower ends (coordinates,), rad or m; -inf for offsets that make a whole turn."""
        return self._ends(0)

    @cached_property
    def upper(self) -> FloatArray:
        """The upper ends (coordinates,), rad or m; inf for offsets that make a whole turn."""
        return self._ends(1)

    @cached_property
    def room(self) -> FloatArray:
        """The room (coordinates,) between chosen values and the ends, in which smooth curves through them stay."""
        room = np.where(np.isfinite(self.upper - self.lower), ROOM_OFF_LIMITS * (self.upper - self.lower), 0.0)
        room[: self.carried] = 0.0  # states keep external axes off their limits, as all joints
        return np.asarray(room)

    @property
    def first(self) -> FloatArray:
        """The least values that are chosen (coordinates,): at most 0 for offsets."""
        return np.where(np.arange(len(self.lower)) < self.carried, self.lower, np.minimum(self.lower + self.room, 0.0))

    @property
    def last(self) -> FloatArray:
        """The largest values that are chosen (coordinates,): at least 0 for offsets."""
        return np.where(np.arange(len(self.lower)) < self.carried, self.upper, np.maximum(self.upper - self.room, 0.0))

    def _ends(self, side: int) -> FloatArray:
        axes = self.robot.limit("upper" if side else "lower")[: self.carried]
        region = [pair[side] for pair in self.region.ranges.values()]
        ends = np.array([*axes, *region], dtype=np.float64)
        ends[self.carried :][self.is_round[self.carried :]] = np.inf if side else -np.inf
        return ends

    @cached_property
    def is_angle(self) -> np.ndarray:
        """Whether each coordinate is an angle (coordinates,), bool."""
        turns = [name.startswith("rotation") for name in self.region.ranges]
        return np.array([*self.robot.is_angle[: self.carried], *turns], dtype=bool)

    @cached_property
    def is_round(self) -> np.ndarray:
        """Whether each coordinate is an angle that makes a whole turn (coordinates,), bool."""
        axes = self.robot.limit("upper")[: self.carried] - self.robot.limit("lower")[: self.carried]
        spans = np.array([*axes, *(high - low for low, high in self.region.ranges.values())])
        return self.is_angle & (spans >= TURN * (1.0 - ROUNDING))

    @cached_property
    def fixed(self) -> FloatArray:
        """The positions (axes,) of the external axes while the arm moves alone: 0, or the limits nearest to 0."""
        return np.clip(0.0, *(self.robot.limit(name)[: self.carried] for name in ("lower", "upper")))

    @cached_property
    def arm(self) -> Robot:
        """The arm alone, with the external axes fixed."""
        return with_locked(
            self.robot, dict(zip(self.robot.external_axes, self.fixed.tolist(), strict=True)), Findings()
        )

    @cached_property
    def frame(self) -> AxisFrame | None:
        """The frame of the external axes; None: there are none."""
        return AxisFrame.of(self.robot, self.fixed) if self.carried else None

    @cached_property
    def form(self) -> ClosedForm | None:
        """The closed form of the arm alone; None: it has none."""
        if self.arm.dof != 6:
            return None
        nowhere = Target(screws_of(self.arm), np.zeros((1, 3)), np.eye(3)[None], np.zeros(3))
        return seed_table(self.arm).form(nowhere)

    def states(
        self,
        positions: FloatArray,
        rotations: FloatArray,
        values: FloatArray,
        like: FloatArray | None,
        room: FloatArray,
    ) -> States:
        """Find the joint positions that reach poses, in the configurations of others.

        Args:
            positions: (N, 3), m: the poses as they are written.
            rotations: (N, 3, 3).
            values: (N, coordinates).
            like: (N, joints): where this is singular, or the arm has no names, every configuration counts, and with
                None.
            room: (N,): the share of its range that each joint keeps off its limits.
        """
        parts = []
        for first in range(0, len(positions), MOST_SOLVED_TOGETHER):
            some = slice(first, first + MOST_SOLVED_TOGETHER)
            near = None if like is None else like[some]
            rows, found = self._some_states(positions[some], rotations[some], values[some], near, room[some])
            parts.append((rows + first, found))
        return States(*map(np.concatenate, zip(*parts, strict=True)))

    def seen(self, positions: FloatArray, rotations: FloatArray, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return tool positions (N, 3) and tip rotations (N, 3, 3) for the arm with fixed axes."""
        if self.region.ranges:
            positions, rotations = poses_in_region(self.region, values[:, self.carried :], positions, rotations)
        if self.frame is not None:
            positions, turned = self.frame.seen(values[:, : self.carried], positions, rotations)
            rotations = rotations if turned is None else turned
        return positions, rotations @ self.arm.tool_in_tip.rotation.T

    def _some_states(
        self,
        positions: FloatArray,
        rotations: FloatArray,
        values: FloatArray,
        like: FloatArray | None,
        room: FloatArray,
    ) -> States:
        axes, arm = values[:, : self.carried], self.arm
        points, rotations = self.seen(positions, rotations, values)
        tips = points - rotations @ arm.tool_in_tip.translation
        assert self.form is not None  # noqa: S101 - asked for before
        candidates = self.form(tips, rotations)
        rows, which = np.nonzero(np.isfinite(candidates).all(axis=2))
        found = candidates[rows, which]
        fewest, most = self.turns(found, room[rows])
        inside = (fewest <= most).all(axis=1)
        rows, found = rows[inside], found[inside]
        towards = arm.middle if like is None else like[rows, self.carried :]
        found = found + TURN * np.clip(np.round((towards - found) / TURN), fewest[inside], most[inside])
        if like is not None:
            sides, own = sides_of(arm, found), sides_of(arm, towards)
            same = (np.isnan(sides) | (sides * own >= 0.0)).all(axis=1)
            rows, found = rows[same], found[same]
        points, turns = screws_of(arm).poses(found, np.zeros(3))
        near = np.abs(points - tips[rows]).max(axis=1) <= CANDIDATE_MISS
        near &= np.abs(turns - rotations[rows]).max(axis=(1, 2)) <= CANDIDATE_MISS
        return States(rows[near], np.hstack([axes[rows[near]], found[near]]))

    def turns(self, positions: FloatArray, room: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the fewest and most whole turns that keep positions within the limits, and off these by `room` (N,).

        Args:
            positions: (N, joints) of the arm, or (N, all joints).
            room: The share of its range that each joint keeps off its limits.

        Returns:
            (N, joints) each; fewest is more than most for a joint that is outside.
        """
        joints = slice(self.robot.dof - positions.shape[1], None)
        lower, upper = self.robot.limit("lower")[joints], self.robot.limit("upper")[joints]
        span = np.where(np.isfinite(upper - lower), upper - lower, 0.0)
        off = np.maximum(room[:, None] * span - ROUNDING, -ROUNDING)
        low, high = lower + off - positions, upper - off - positions
        is_angle = self.robot.is_angle[joints]
        fewest = np.where(is_angle, np.ceil(low / TURN), np.where(low > 0.0, 1.0, 0.0))
        most = np.where(is_angle, np.floor(high / TURN), np.where(high < 0.0, -1.0, 0.0))
        return fewest, most
