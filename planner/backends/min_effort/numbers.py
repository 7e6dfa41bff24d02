"""The layout of a program of least cost, and the numbers of one search: known without its solver."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.backends.min_effort.cost import Objective
from planner.backends.min_effort.reference_path import ReferencePath
from planner.spatial import FloatArray

TOOL_SHARES = (0.25, 0.5, 0.75)
"""Shares of an interval at which the tool's speed and its deviation are limited."""

DENSE_ENOUGH = 16
"""Number of intervals on a segment from which breakpoints alone limit the deviation.

Between them it exceeds a limit by about 1 / intervals^2. The first margin covers 0.3 % (`optimum.py`); another search
covers more.
"""


class Layout(NamedTuple):
    """The layout that a program is built for; motions of the same layout differ in numbers only.

    Attributes:
        segments: Number of segments that are passed without stopping.
        intervals: Number of intervals of the spline on each segment.
        objective: The cost that is minimised.
        watches_tool: Whether the tool's speed is limited.
        holds_tool: Whether the tool's deviation from a path is limited.
        holds_joints: Whether the joints' deviations from a path are limited.
        half_spaces: Number of half-spaces that contain the joints at each instant.
        adds_jerk: Whether the jerk is part of the cost beside the objective.
    """

    segments: int
    intervals: int
    objective: Objective
    watches_tool: bool
    holds_tool: bool = False
    holds_joints: bool = False
    half_spaces: int = 0
    adds_jerk: bool = False

    @property
    def instants(self) -> int:
        """The number of instants at which torques and costs are computed: the inner breakpoints."""
        return self.segments * self.intervals - 1

    @property
    def dense_instants(self) -> int:
        """The number of the inner breakpoints, then the shares of every interval."""
        return self.instants + len(TOOL_SHARES) * (self.instants + 1)

    @property
    def dense_shares(self) -> tuple[np.ndarray, FloatArray]:
        """The segments (dense instants,) of these, and the shares (dense instants,) of their time."""
        ends = np.arange(1, self.instants + 1)
        between = (np.arange(self.instants + 1) + np.array(TOOL_SHARES)[:, None]).ravel()
        intervals = np.concatenate([ends, between])
        segments = np.concatenate([ends, np.tile(np.arange(self.instants + 1), len(TOOL_SHARES))]) // self.intervals
        return segments, intervals / self.intervals - segments

    @property
    def tool_instants(self) -> int:
        """The number of instants at which the tool's speed is limited: the dense ones, or none."""
        return self.dense_instants if self.watches_tool else 0

    @property
    def path_instants(self) -> int:
        """The number of instants with a limited deviation: the breakpoints, or the dense ones if these are few."""
        if not (self.holds_tool or self.holds_joints):
            return 0
        return self.instants if self.intervals >= DENSE_ENOUGH else self.dense_instants


class Numbers(NamedTuple):
    """A motion to be found.

    Attributes:
        positions: (segments + 1, joints), rad or m.
        lower: (joints,), position limits.
        upper: (joints,).
        reference: The way to stay near to; None: it may go anywhere.
        near: (rows,), limits of the rows of how near.
        half_spaces: (rows (joints + 1), dense instants), normals and offsets of the half-spaces to stay in.
        rates: (3, 2, segments, joints): magnitudes of the lower and upper limits of velocity, acceleration and jerk,
            infinite: none.
        torque: (2, pieces, joints), magnitudes of the lower and upper limits, infinite: none.
        tool: (pieces, 2), limits of the squares of the tool's speed and angular speed.
        units: (3, joints): what torque, power and jerk are measured by in the cost.
        durations: (segments,), s: those requested or, where free, a first guess.
        free: (segments,), whether a duration is to be found.
        total: s, of the free durations together; None: to be found, too.
        time_weight: Cost of a second.
        cost: The cost of the first guess, to scale by.
        resting: Cost of a second at rest at the start, and at the end.
    """

    positions: FloatArray
    lower: FloatArray
    upper: FloatArray
    reference: ReferencePath | None
    near: FloatArray
    half_spaces: FloatArray
    rates: FloatArray
    torque: FloatArray
    tool: FloatArray
    units: FloatArray
    durations: FloatArray
    free: np.ndarray
    total: float | None
    time_weight: float
    cost: float
    resting: FloatArray
