"""The limits of torque and of the tool, which are no polynomials: the durations that they need, found on samples."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planner.constraints import Constraint
from planner.constraints.peaks import SampledConstraints
from planner.dynamics import SegmentDynamics
from planner.errors import InvalidProblem
from planner.kinematics.forward import JointStates
from planner.limits import SegmentLimits
from planner.paths import JointPath
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.time_scaling.refusals import BindingLimit, refuse_what_gravity_exceeds
from planner.trajectories.extrema import UnitPolynomials, derivatives_on_unit_time
from planner.trajectories.polynomials import SegmentedPolynomial
from planner.trajectories.reversals import cut_at_reversals, directions, towards
from planner.trajectories.sampled_peaks import DERIVATIVES, EASY_TRAVEL, MOST_TRAVEL

TOO_OFTEN = (
    "joint {joint} travels {own:.6g} rad or m on the way here, but limits of torque and of the tool "
    "can be checked on up to {most:g}, of all such segments together; ask for fewer turns, or for none of these limits"
)
"""The reason for the refusal of a joint that turns too often."""

SAMPLED_MARGIN = 1.0002
"""Factor on durations set by torque or tool speed, for excesses between samples: twice their size."""


def refuse_what_turns_too_often(path: JointPath) -> None:
    """Refuse a path that is too long for sampled limits, before any back end searches.

    Raises:
        InvalidProblem: Joints travel further than `MOST_TRAVEL` on segments with limits of torque or of the tool.
    """
    travels = np.abs(np.diff(path.positions, axis=0))
    if travels.max(initial=0.0) <= EASY_TRAVEL:
        return
    limited = SampledLimits(path.dynamics, path.limits).limited
    beyond = np.where(limited, np.maximum(travels.max(axis=1) - EASY_TRAVEL, 0.0), 0.0)
    too_far = np.flatnonzero(np.cumsum(beyond) > MOST_TRAVEL)
    if len(too_far):
        segment = int(too_far[0])
        joint = int(travels[segment].argmax())
        own, name = float(travels[segment, joint]), path.robot.joint_names[joint]
        message = TOO_OFTEN.format(joint=name, own=own, most=MOST_TRAVEL)
        raise InvalidProblem([(("waypoints", segment + 1), message)])


class SampledLimits(SampledConstraints):
    """The constraints in force on segments: the factors on time that keep them, found on samples.

    Attributes:
        limited: Whether (segments,) a segment has such a limit.
        each: The binding limit (columns,) of each column.
    """

    def __init__(self, dynamics: SegmentDynamics, limits: SegmentLimits) -> None:
        super().__init__(dynamics, limits.constraints, len(limits.torque.upper))
        all_limits = np.hstack([self.half, *(limit for _, limit in self.exact)])
        self.limited: np.ndarray = np.isfinite(all_limits).any(axis=1)
        names = [self.constraints[k].name for k in self.of_column]
        self.each = [BindingLimit(*column) for column in zip(names, self.joints, strict=True)]
        joints = dynamics.robots[0].joint_names
        for own, _ in self.exact:
            self.each += [BindingLimit(own.name, joint) for joint in (joints if own.of_joints else (None,))]

    def stretch(
        self,
        pieces: SegmentedPolynomial,
        rows: np.ndarray,
        groups: np.ndarray,
        above: FloatArray | float = 0.0,
        derivatives: UnitPolynomials | None = None,
    ) -> tuple[FloatArray, np.ndarray]:
        """Find the factors on time with which groups of pieces just keep these limits.

        The value of q(t / T) is r + m / T^order, m that of T = 1 less the value r at rest.

        Args:
            pieces: The motion, in pieces of positive length.
            rows: Row (pieces,) of the limits that each piece has to keep.
            groups: Group (pieces,) of each piece, from 0 on without gaps.
            above: Factors up to this, one for all or (groups,), do not matter: the result may be less.
            derivatives: The `DERIVATIVES` of the motion on unit time; None: they are computed.

        Returns:
            The factors (groups,), less than 1 where a group could be faster, and the index (groups,) in `each` of the
            limit that sets each.

        Raises:
            LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
        """
        whole = pieces
        pieces, of, moving = self._between_reversals(whole)
        rows, groups = rows[of], groups[of]

        def needed(at: np.ndarray, states: Sequence[FloatArray]) -> FloatArray:
            """Return the factors (N, columns) that samples of pieces `at` (N,) need."""
            states = moving(at, states)
            values, rates = self.values(pieces.segments[at], states)
            rest = self._at_rest(rows[at], pieces.segments[at], *states[:2])
            moved = values - rest
            room = self.half[rows[at]] - np.sign(moved) * (rest - self.middle[rows[at]])
            factors = np.abs(moved) / room
            for constraint, own in zip(self.constraints, self.columns, strict=True):
                if constraint.has_factors(self.dynamics.robots[0]):
                    bounds = self.half[rows[at], own], self.middle[rows[at], own]
                    factors[:, own] = self._own_factors(constraint, pieces.segments[at], states, *bounds)
                else:
                    factors[:, own] **= 1.0 / constraint.order
            return self.with_bends(factors, rates, rows[at], pieces.lengths[at])

        derivatives = derivatives if pieces is whole else None
        return self._largest(needed, pieces, rows, groups, above, derivatives, as_factors=True)

    def _own_factors(
        self,
        constraint: Constraint,
        segments: np.ndarray,
        states: Sequence[FloatArray],
        limits: FloatArray,
        middle: FloatArray,
    ) -> FloatArray:
        """Return the factors (N, columns) of a constraint that has `factors` of its own."""

        def of(robot: Robot, limits: FloatArray, middle: FloatArray, *own: FloatArray) -> tuple[FloatArray]:
            if not constraint.is_known(robot):
                return (np.zeros_like(limits),)
            return (constraint.factors(JointStates(robot, *own), limits, middle),)

        (factors,) = self.dynamics.by_robot(of, segments, limits, middle, *states)
        return factors

    def use(self, pieces: SegmentedPolynomial, rows: np.ndarray) -> FloatArray:
        """Return the largest share (pieces,) of one of these limits that each piece uses.

        Args:
            pieces: The motion, in pieces of positive length.
            rows: Row (pieces,) of the limits that each piece has to keep.
        """
        pieces, of, moving = self._between_reversals(pieces)
        rows = rows[of]

        def shares(at: np.ndarray, states: Sequence[FloatArray]) -> FloatArray:
            return self.shares(rows[at], pieces.segments[at], moving(at, states), pieces.lengths[at])

        return self._largest(shares, pieces, rows, of)[0]

    def _between_reversals(
        self, pieces: SegmentedPolynomial
    ) -> tuple[SegmentedPolynomial, np.ndarray, Callable[[np.ndarray, Sequence[FloatArray]], Sequence[FloatArray]]]:
        """Cut pieces where the Coulomb friction of a joint jumps.

        Returns:
            The pieces, and the indices of the pieces that they are parts of. Then a function of pieces and states on
            them: the states whose velocities are not zero at reversals, but have the direction on the piece.
        """
        friction = self.dynamics.robots[0].friction
        if friction is None:
            return pieces, np.arange(len(pieces.lengths)), lambda _, states: states
        cut, of = cut_at_reversals(pieces, friction.coulomb > 0.0)
        signs = directions(cut)

        def moving(at: np.ndarray, states: Sequence[FloatArray]) -> Sequence[FloatArray]:
            q, v, *others = states
            return q, towards(signs[at], v), *others

        return cut, of, moving

    def _largest(
        self,
        of_states: Callable[[np.ndarray, Sequence[FloatArray]], FloatArray],
        motion: SegmentedPolynomial,
        rows: np.ndarray,
        groups: np.ndarray,
        above: FloatArray | float = 0.0,
        derivatives: UnitPolynomials | None = None,
        *,
        as_factors: bool = False,
    ) -> tuple[FloatArray, np.ndarray]:
        """Return the largest values (groups,), samples with their margin, and the index (groups,) in `each`.

        They are shares of the limits, or factors on time.
        """
        if derivatives is None:
            derivatives = derivatives_on_unit_time(motion, DERIVATIVES)
        largest, at = np.zeros(int(groups.max()) + 1), np.zeros(int(groups.max()) + 1, dtype=int)
        if self.constraints:
            power, own = 0.5 if as_factors else 1.0, above / SAMPLED_MARGIN
            peaks = self.peaks(of_states, derivatives, motion.lengths, groups, together=True, power=power, above=own)
            largest, at = peaks.use[:, 0] * SAMPLED_MARGIN, peaks.columns[:, 0]
        first = len(self.of_column)
        for constraint, limit in self.exact:
            power = 1.0 / constraint.order if as_factors else 1.0
            of_interest = np.maximum(above, largest) ** (1.0 / power)
            peaks = constraint.peaks(self.dynamics.robots[0], derivatives, limit[rows], groups, of_interest)
            values = peaks.use[:, 0] ** power
            at = np.where(values > largest, first + peaks.columns[:, 0], at)
            largest, first = np.maximum(largest, values), first + limit.shape[1]
        return largest, at

    def _at_rest(self, rows: np.ndarray, segments: np.ndarray, q: FloatArray, v: FloatArray) -> FloatArray:
        """Return the values (N, columns) at rest, or hardly moving; refuse torques where gravity exceeds a limit."""
        values, still = np.zeros((len(q), len(self.of_column))), np.zeros_like(q)
        slow = still if self.dynamics.robots[0].friction is None else towards(np.sign(v), still)
        for constraint, own in zip(self.constraints, self.columns, strict=True):
            if constraint.counts_at_rest:
                values[:, own] = self.values(segments, (q, slow, still), [constraint])[0]
                limits = values[:, own], self.middle[rows, own], self.half[rows, own]
                refuse_what_gravity_exceeds(self.dynamics, segments, *limits)
        return values
