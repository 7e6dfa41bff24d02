"""Straight joint motions: checked quickly first, and proved collision-free where a path needs them."""

from __future__ import annotations

from functools import lru_cache
from math import inf
from time import monotonic

import numpy as np

from planner.constraints.kept_poses import KeptPoses
from planner.scene import CONTACT_TOLERANCE, Budget, CollisionChecker, clearances
from planner.spatial import FloatArray
from planner.trajectories.polynomials import PiecewisePolynomial

MOST_LOOKED_AT = 400
"""The largest number of joint positions, and of distances, checked on a motion before it counts as not free.

It is ten times the usual number, and takes some 20 ms. A motion so close to an object is unsuitable anyway.
"""

LOOK_EVERY = 0.1
"""The distance of the joint positions, rad or m, of the first check of a motion.

Few colliding motions pass it, and it takes a hundredth of the time of the proof.
"""

FINEST_LOOK = 0.0125
"""The distance, rad or m, below which the check is not refined when a proof fails: some 10 mm for an arm of 1 m."""

LEAST_APPROACH = 0.01
"""Smallest relative decrease of the distance to a target by a projected step; otherwise the step is not taken."""

LONGEST_PROJECTED_STEP = 2.0
"""The longest step after its projection, relative to the longest one before; otherwise the step is not taken."""

MOST_COUNTS_KEPT = 64
"""Number of counts of joint positions on a motion of which a process keeps the order."""


def _straight(positions: FloatArray) -> PiecewisePolynomial:
    """Return the straight motions between joint positions (motions + 1, joints), 1 s each."""
    count = len(positions) - 1
    return PiecewisePolynomial(np.ones(count), np.stack([positions[:-1], np.diff(positions, axis=0)], axis=-1))


class FreeEdges:
    """Checks of straight joint motions, with a count, and proofs of the motions of a path.

    Attributes:
        checked: Number of motions checked so far.
        most: Largest number of checked motions; may be infinite.
        until: Deadline of the checks, s on the monotonic clock; may be infinite.
        kept: The constraints that all motions keep; None: there are none.
    """

    def __init__(self, checker: CollisionChecker, most: float, kept: KeptPoses | None = None) -> None:
        """Prepare for a robot with its surroundings, a number of motions, and constraints on the tool."""
        self._checker = checker
        self.kept = kept
        self._kept_step = inf if kept is None else kept.longest_step
        self._room = 0.0
        self._look_every = LOOK_EVERY
        self.checked = 0
        self.most: float = most
        self.until = inf

    @property
    def has_budget(self) -> bool:
        """Whether the budget permits more checks."""
        return self.checked < self.most and monotonic() < self.until

    def keep_room(self, room: float, most: float) -> None:
        """Require an additional clearance, m, of the following motions, until a total number of checks."""
        self._room, self.most = room, most

    def has_room(self, positions: FloatArray) -> bool:
        """Tell whether any of the joint positions (positions, joints) seems to keep the clearance."""
        return any(not self._sees_collision(position[None]) for position in positions)

    def levers(self, positions: FloatArray) -> FloatArray:
        """Measure the largest distance (N, joints) of the moved bodies from each joint's axis, m.

        It is 1 where a joint slides something, and 0 where it moves nothing.
        """
        return np.asarray(self._checker.bodies.at(positions).levers.max(axis=1, initial=0.0), dtype=np.float64)

    def seems_free(self, start: FloatArray, end: FloatArray) -> bool:
        """Tell whether the straight motion between two joint positions (joints,) shows no collision."""
        self.checked += 1
        shares = _shares(float(np.linalg.norm(end - start)), self._look_every)
        if self._sees_collision(start + shares[:, None] * (end - start)):
            return False
        return self.kept is None or self.kept.hold_along(_straight(np.stack([start, end])))  # takes longer

    def step(self, start: FloatArray, target: FloatArray, longest: float) -> FloatArray | None:
        """Go from a joint position towards a target, both (joints,), and onto the constraints on the tool.

        Args:
            start: (joints,), rad or m; it keeps the constraints.
            target: (joints,), rad or m.
            longest: The longest step without constraints, rad or m.

        Returns:
            The end of the step (joints,); None: it shows a collision, or the constraints lead elsewhere.
        """
        distance = float(np.linalg.norm(target - start))
        longest = longest if self.kept is None else self._kept_step
        end = target if distance <= longest else start + (target - start) * (longest / distance)
        if self.kept is not None:
            projected = self.kept.projected(end)
            if projected is None or not self.kept.is_within_limits(projected):
                return None
            is_astray = np.linalg.norm(projected - start) > LONGEST_PROJECTED_STEP * longest
            if is_astray or np.linalg.norm(target - projected) >= (1.0 - LEAST_APPROACH) * distance:
                return None
            end = projected
        return end if self.seems_free(start, end) else None

    def path_between(self, start: FloatArray, end: FloatArray, most: float) -> FloatArray | None:
        """Return a short path (positions, joints) that seems free, straight or along the constraints on the tool.

        Args:
            start: (joints,), rad or m.
            end: (joints,), rad or m.
            most: The largest length of the path, rad or m.

        Returns:
            The path; None: it is longer, or not free.
        """
        if np.linalg.norm(end - start) > most:
            return None
        if self.seems_free(start, end):
            return np.stack([start, end])
        path, length = [start], 0.0
        while self.kept is not None and self.has_budget:
            position = self.step(path[-1], end, inf)
            if position is None or (length := length + float(np.linalg.norm(position - path[-1]))) > most:
                return None
            path.append(position)
            if (position == end).all():
                return np.array(path)
        return None

    def _sees_collision(self, positions: FloatArray) -> bool:
        """Tell whether any of the positions (N, joints) seems to violate its margins or the additional clearance."""
        return self._checker.distances.first_collision(positions, CONTACT_TOLERANCE - self._room) is not None

    def first_unproved(self, positions: FloatArray) -> int | None:
        """Prove that the straight motions between joint positions (motions + 1, joints) keep all margins.

        After an unproved motion, all motions are checked more finely.

        Returns:
            Number of a motion without a proof; None: all are proved.
        """
        count = len(positions) - 1
        if self.kept is not None:
            legs = range(count)
            broken = next((k for k in legs if not self.kept.hold_along(_straight(positions[k : k + 2]))), None)
            if broken is not None:
                return broken
        motion = _straight(positions)
        found = clearances(self._checker, motion, budget=Budget(MOST_LOOKED_AT * count, MOST_LOOKED_AT * count))
        failed = found.hit or found.undecided
        if failed is None:
            return None
        self._look_every = max(FINEST_LOOK, self._look_every / 2.0)
        return min(int(failed.time), count - 1)

    def is_free(self, start: FloatArray, end: FloatArray) -> bool:
        """Tell whether the straight motion between two joint positions (joints,) provably keeps all margins."""
        return self.seems_free(start, end) and self.first_unproved(np.stack([start, end])) is None


def _shares(length: float, every: float) -> FloatArray:
    """Return fractions (n,) of a motion to check: its end first, then those far from all before."""
    return _spread(max(1, int(np.ceil(length / every))))


@lru_cache(maxsize=MOST_COUNTS_KEPT)
def _spread(count: int) -> FloatArray:
    """Return the shares (count,) of equal steps, the last one first, then the ones far from all before."""
    bits = count.bit_length()
    order = sorted(range(1, count + 1), key=lambda k: (k != count, int(format(k, f"0{bits}b")[::-1], 2)))
    shares = np.array(order, dtype=np.float64) / count
    shares.flags.writeable = False
    return shares
