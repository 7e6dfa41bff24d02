"""The path of the tool on a ride: it gets up to the speed of the object, moves along with it, and stops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np

from planner.spatial import FloatArray, Pose
from planner.tool_motions.pose_paths import Turn


@dataclass(frozen=True, eq=False)
class RidePath:
    """The poses of the tool on a ride, C2 in time.

    While the robot gets on, the tool is at its first pose relative to the object but for a shift against the motion.
    Its speed grows from 0 to that of the object as v (3 x^2 - 2 x^3), with x from 0 to 1. Getting off is the same
    backwards, at the last pose. Between poses the tool moves in a straight line relative to the object, with the share
    6 x^5 - 15 x^4 + 10 x^3 of the way.

    Attributes:
        poses: The poses on the object (waypoints,), in the base frame, at the arrival at the first one.
        velocity: (3,), m/s, of the object in the base frame.
        lead_in: Time for getting on, s.
        holds: (waypoints,), times of the rests relative to the object, s.
        moves: (waypoints - 1,), times of the motions from pose to pose, s.
        lead_out: Time for getting off, s.
    """

    poses: Sequence[Pose]
    velocity: FloatArray
    lead_in: float
    holds: FloatArray
    moves: FloatArray
    lead_out: float

    @cached_property
    def knots(self) -> FloatArray:
        """The times (2 waypoints + 2,), s: the start; of each waypoint its arrival and its departure; the end."""
        steps = [self.lead_in, self.holds[0]]
        for move, hold in zip(self.moves, self.holds[1:], strict=True):
            steps += [move, hold]
        return np.concatenate([[0.0], np.cumsum([*steps, self.lead_out])])

    @property
    def duration(self) -> float:
        """The time from start to end, s."""
        return float(self.knots[-1])

    @property
    def breakpoints(self) -> FloatArray:
        """The parameters from 0 to 1 between which the path is smooth."""
        return np.unique(self.knots) / self.duration

    @cached_property
    def _turns(self) -> list[Turn]:
        return [Turn.between(_rotation(start), _rotation(end)) for start, end in pairwise(self.poses)]

    def pose(self, u: float) -> Pose:
        """Return the pose at u."""
        time = u * self.duration
        k, share, _ = self._progress(time)
        shift = self._shift(time)[0] * self.velocity
        if share == 0.0:
            return Pose(self.poses[k].position + shift, _rotation(self.poses[k]))
        way = self.poses[k + 1].position - self.poses[k].position
        return Pose(self.poses[k].position + share * way + shift, self._turns[k].rotation(share))

    def twist(self, u: float) -> FloatArray:
        """Return the linear over the angular velocity (6,) by u, in the base's axes."""
        time = u * self.duration
        k, share, rate = self._progress(time)
        linear, angular = self._shift(time)[1] * self.velocity, np.zeros(3)
        if rate != 0.0:
            linear = linear + rate * (self.poses[k + 1].position - self.poses[k].position)
            angular = rate * self._turns[k].velocity(share)
        return self.duration * np.concatenate([linear, angular])

    def _progress(self, time: float) -> tuple[int, float, float]:
        """Return the last pose left or reached, the share of the way to the next one, and its rate, 1/s."""
        knots = self.knots
        for k, move in enumerate(self.moves.tolist()):
            departure = knots[2 * k + 2]
            if time <= departure:
                return k, 0.0, 0.0
            if time < departure + move:
                x = (time - departure) / move
                return k, x**3 * (10.0 + x * (6.0 * x - 15.0)), 30.0 * (x * (1.0 - x)) ** 2 / move
        return len(self.poses) - 1, 0.0, 0.0

    def _shift(self, time: float) -> tuple[float, float]:
        """Return the time, s from the first arrival, at which the object has the same shift; and its rate."""
        arrival, departure = self.knots[1], self.knots[-2]
        if time < arrival:
            x = time / self.lead_in
            return self.lead_in * (x**3 - 0.5 * x**4 - 0.5), x * x * (3.0 - 2.0 * x)
        if time > departure:
            x = (time - departure) / self.lead_out
            return departure - arrival + self.lead_out * (x - x**3 + 0.5 * x**4), 1.0 - x * x * (3.0 - 2.0 * x)
        return time - arrival, 1.0


def _rotation(pose: Pose) -> FloatArray:
    assert pose.rotation is not None  # noqa: S101 - the check of the problem refuses poses without one
    return pose.rotation
