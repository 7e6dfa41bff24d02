"""The protocol of a limited quantity."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from planner.kinematics.forward import JointStates
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.trajectories.extrema import UnitPolynomials
from planner.trajectories.sampled_peaks import Peaks


class Rows(NamedTuple):
    """Values by_u s'' + by_x s'^2 + rest on a path q(s), all within the limits; each (N, rows).

    A quantity has as many rows for each of its columns.
    """

    by_u: FloatArray
    by_x: FloatArray
    rest: FloatArray


class Constraint(Protocol):
    """A limited quantity that is no polynomial of time: what certificate and back ends know of it.

    A class that limits one more quantity inherits from this one and has a `name`, a `unit`, an `order` and `values`.

    Attributes:
        name: Its name, that of its check in the certificate.
        unit: Its unit.
        order: Its power of the pace: in T times the time, what motion adds to its value is 1 / T^order of that.
        of_joints: Whether it has a column for each joint, or one in all.
        counts_at_rest: Whether it has a value where the robot rests.
        follows_path_speed: Whether it depends on path and path velocity alone.
        has_rows: Whether it has `rows`. Back ends scale all others in time as a whole.
        is_exact: Whether it has `peaks`; the peaks of all others are found on samples.
        kept_with: The quantity with whose guarantee a back end keeps it; empty: it always does.
        of_shares: Whether its values are shares of limits that depend on the state; `shown` returns both.
    """

    name: str
    unit: str
    order: int
    of_joints: bool = False
    counts_at_rest: bool = False
    follows_path_speed: bool = True
    has_rows: bool = False
    is_exact: bool = False
    of_shares: bool = False
    kept_with: str = ""

    def is_known(self, robot: Robot) -> bool:
        """Return whether the values can be computed for a robot; where they cannot, they are taken for zero."""
        del robot
        return True

    def values(self, states: JointStates) -> FloatArray:
        """Return the values (N, columns) in states of the joints."""
        ...

    def overestimates(self, states: JointStates) -> FloatArray:
        """Return the amounts (N, columns) by which the values may exceed the largest magnitudes that are reached."""
        return np.zeros((len(states.q), states.robot.dof if self.of_joints else 1))

    def rows(self, path: JointStates) -> Rows:
        """Return the rows at points of a path, whose states have s' = 1 and s'' = 0."""
        del path
        raise NotImplementedError

    def peaks(
        self,
        robot: Robot,
        motion: UnitPolynomials,
        limits: FloatArray,
        groups: np.ndarray,
        above: FloatArray | float = 0.0,
    ) -> Peaks:
        """Find the largest share of its limits that a motion uses in each group of pieces.

        Args:
            robot: The robot.
            motion: Positions and their derivatives by time, stacked, on unit time.
            limits: The limits (pieces, columns).
            groups: The group (pieces,) of each piece, from 0 on without gaps.
            above: Shares, one for all or (groups,), below which a result may be too low.
        """
        del robot, motion, limits, groups, above
        raise NotImplementedError

    def has_factors(self, robot: Robot) -> bool:
        """Return whether it has `factors`; the factors of all others follow from the value at rest and `order`."""
        del robot
        return False

    def factors(self, states: JointStates, limits: FloatArray, middle: FloatArray) -> FloatArray:
        """Return the factors (N, columns) on time above which all slower motions keep their limits.

        Args:
            states: The states at N times.
            limits: The distance (N, columns) of the limits from their middle.
            middle: The middle (N, columns) between the lower and the upper limits.
        """
        del states, limits, middle
        raise NotImplementedError

    def shown(self, states: JointStates, column: int, limit: float) -> tuple[float, float]:
        """Return the value of a column in one state, and its limit there, as people are shown them."""
        return float(self.values(states)[0, column]), limit
