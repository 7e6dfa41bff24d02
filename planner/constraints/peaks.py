"""Values and peaks of limited quantities that are no polynomials of time, on samples of a motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from itertools import accumulate, pairwise

import numpy as np

from planner.constraints.bounds import Bounds
from planner.constraints.constraint import Constraint
from planner.dynamics import SegmentDynamics
from planner.kinematics.forward import CENTRIPETAL, OF_BENDS, JointStates, bend_bounds
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.trajectories.extrema import UnitPolynomials
from planner.trajectories.sampled_peaks import Peaks, parts_of, sampled_peaks


class SampledConstraints:
    """Constraints on a motion, a column for each of their values.

    Attributes:
        exact: The constraints whose peaks are found without samples, and their limits (rows, columns).
        constraints: The others whose values can be computed; what follows is of them.
        of_column: The index (columns,) in `constraints` of the constraint of each column.
        columns: The columns of each of `constraints`.
        joints: The joint of each column; None: the column is not of a joint.
        middle: The middle (rows, columns) between lower and upper limits.
        half: Their distance (rows, columns) from there; infinite: none.
    """

    def __init__(self, dynamics: SegmentDynamics, limited: Sequence[tuple[Constraint, Bounds]], rows: int) -> None:
        self.dynamics, names = dynamics, dynamics.robots[0].joint_names
        known = [own for own in limited if any(map(own[0].is_known, dynamics.robots))]
        self.exact = [(own, bounds.narrower) for own, bounds in known if own.is_exact]
        known = [own for own in known if not own[0].is_exact]
        self.constraints = [constraint for constraint, _ in known]
        joints = [names if constraint.of_joints else (None,) for constraint in self.constraints]
        self.joints: list[str | None] = [name for own in joints for name in own]
        self.of_column = np.repeat(np.arange(len(joints)), [len(own) for own in joints])
        self.columns = [slice(*own) for own in pairwise(accumulate(map(len, joints), initial=0))]
        none = np.empty((rows, 0)), np.empty((rows, 0))
        self.middle, self.half = map(np.hstack, zip(none, *(bounds.centred for _, bounds in known), strict=True))
        quantities = [self.constraints[k].name for k in self.of_column]
        self.centripetal = quantities.index(CENTRIPETAL) if CENTRIPETAL in quantities else None

    def values(
        self, segments: np.ndarray, states: Sequence[FloatArray], only: Sequence[Constraint] = ()
    ) -> tuple[FloatArray, FloatArray]:
        """Return the values (N, columns) in states of the joints, each (N, joints), on segments (N,).

        Where the centripetal acceleration is limited, the rates (N, 2) of `OF_BENDS` follow. With `only`, the
        values belong to some constraints.
        """
        bends = OF_BENDS if self.centripetal is not None and not only else ()

        def of(robot: Robot, *own: FloatArray) -> tuple[FloatArray, ...]:
            at = JointStates(robot, *own)
            values = [values_of(constraint, at) for constraint in only or self.constraints]
            return np.hstack(values), np.array([at.tool_rate(quantity) for quantity in bends]).reshape(-1, len(at.q)).T

        values, rates = self.dynamics.by_robot(of, segments, *states)
        return values, rates

    def with_bends(self, shares: FloatArray, rates: FloatArray, rows: np.ndarray, lengths: FloatArray) -> FloatArray:
        """Return the shares (N, columns) with what bounds them between samples, as `sampled_peaks` asks.

        Args:
            shares: The shares of the limits in rows (N,) that samples use.
            rates: The rates (N, 2) of `OF_BENDS` there.
            rows: The rows (N,) of the limits.
            lengths: The lengths (N,) of the pieces of the samples, s.
        """
        if self.centripetal is None:
            return shares
        limit = self.half[rows, self.centripetal]
        return np.hstack([shares, bend_bounds(dict(zip(OF_BENDS, rates.T, strict=True)), limit, lengths)])

    def shares(
        self, rows: np.ndarray, segments: np.ndarray, states: Sequence[FloatArray], lengths: FloatArray
    ) -> FloatArray:
        """Return the signed shares (N, columns) of the limits in rows (N,) that states use; see `with_bends`."""
        values, rates = self.values(segments, states)
        return self.with_bends((values - self.middle[rows]) / self.half[rows], rates, rows, lengths)

    def peaks(
        self,
        of_states: Callable[[np.ndarray, Sequence[FloatArray]], FloatArray],
        derivatives: UnitPolynomials,
        lengths: FloatArray,
        groups: np.ndarray,
        *,
        together: bool = False,
        power: float = 1.0,
        decided_at: float = np.inf,
        above: FloatArray | float = 0.0,
    ) -> Peaks:
        """Find the largest values of each constraint over groups of pieces.

        Args:
            of_states: The values (N, columns) on pieces (N,) in states of the joints.
            derivatives: The `DERIVATIVES` of the motion on unit time.
            lengths: The lengths (pieces,) of its pieces, s.
            groups: The group (pieces,) of each piece, from 0 on without gaps.
            together: Whether one largest value of all constraints is found.
            power: The power of its share that stands for the centripetal acceleration.
            decided_at: See `sampled_peaks`.
            above: See `sampled_peaks`.
        """
        motion = derivatives[:4]

        def at(pieces: np.ndarray, units: FloatArray) -> FloatArray:
            return of_states(pieces, list(motion.evaluate(pieces, units)))

        parts = parts_of(derivatives, lengths)
        quantities = np.zeros_like(self.of_column) if together else self.of_column
        bend = None if self.centripetal is None else (self.centripetal, power)
        return sampled_peaks(at, parts, quantities, groups, decided_at=decided_at, above=above, bend=bend)


def values_of(constraint: Constraint, states: JointStates) -> FloatArray:
    """Return the values (N, columns) of a constraint; zero where they cannot be computed."""
    if constraint.is_known(states.robot):
        return constraint.values(states)
    return np.zeros((len(states.q), states.robot.dof if constraint.of_joints else 1))
