"""The limits of torque and of the tool, which are no polynomials: the durations that they need, found on samples."""

from __future__ import annotations

from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from planner.backends.shared.refusals import BindingLimit, refuse_what_gravity_exceeds
from planner.errors import InvalidProblem
from planner.guarantees import TCP_ORDERS
from planner.kinematics.forward import CENTRIPETAL, OF_BENDS, bend_bounds, tool_rates_on
from planner.trajectories.extrema import derivatives_on_unit_time
from planner.trajectories.sampled_peaks import DERIVATIVES, EASY_TRAVEL, MOST_TRAVEL, parts_of, sampled_peaks

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.dynamics import SegmentDynamics
    from planner.limits import SegmentLimits
    from planner.paths import JointPath
    from planner.spatial import FloatArray
    from planner.trajectories.polynomials import SegmentedPolynomial

TOO_OFTEN = (
    "joint {joint} travels {own:.6g} rad or m on the way here, but limits of torque and of the tool "
    "can be checked on up to {most:g}, of all such segments together; ask for fewer turns, or for none of these limits"
)
"""What is said of a joint that turns too often."""

SAMPLED_MARGIN = 1.0002
"""Factor on durations that torque or tool speed set, for what lies between samples: twice what they leave open."""


def refuse_what_turns_too_often(path: JointPath) -> None:
    """Refuse a path that is too long for limits that are sampled: at once, as back ends search before they sample.

    Raises:
        InvalidProblem: Joints travel further than `MOST_TRAVEL` on segments with limits of torque or of the tool.
    """
    limited = SampledLimits(path.dynamics, path.limits).limited
    travels = np.abs(np.diff(path.positions, axis=0))
    beyond = np.where(limited, np.maximum(travels.max(axis=1) - EASY_TRAVEL, 0.0), 0.0)
    too_far = np.flatnonzero(np.cumsum(beyond) > MOST_TRAVEL)
    if len(too_far):
        segment = int(too_far[0])
        joint = int(travels[segment].argmax())
        own, name = float(travels[segment, joint]), path.robot.joint_names[joint]
        message = TOO_OFTEN.format(joint=name, own=own, most=MOST_TRAVEL)
        raise InvalidProblem([(("waypoints", segment + 1), message)])


class SampledLimits:
    """The limits of torque and of the tool's motion, whose use is found on samples.

    Attributes:
        middle: The middle (segments, joints) between the lower and the upper torque limits, N m or N.
        torque: The distance (segments, joints) of both from there.
        limited: Whether (segments,) a segment has such a limit.
        tool: The limits (segments,) of the tool that there are, by quantity.
        each: The limits there are, the torques of the joints and those of the tool.
    """

    def __init__(self, dynamics: SegmentDynamics, limits: SegmentLimits) -> None:
        self.dynamics, self.robot = dynamics, dynamics.robots[0]
        self.tool = limits.of_tool
        self.middle, self.torque = limits.torque.centred
        if not dynamics.has_dynamics:
            self.torque = np.full_like(self.torque, np.inf)
        self.limited: np.ndarray = np.isfinite(np.stack([*self.tool.values(), *self.torque.T])).any(axis=0)
        self.each: list[BindingLimit] = [
            *(BindingLimit("torque", name) for name in self.robot.joint_names),
            *map(BindingLimit, self.tool),
        ]

    def stretch(
        self,
        pieces: SegmentedPolynomial,
        rows: np.ndarray,
        groups: np.ndarray,
        above: FloatArray | float = 0.0,
    ) -> tuple[FloatArray, np.ndarray]:
        """Find the factors on time with which groups of pieces just keep these limits.

        Args:
            pieces: The motion, in pieces of positive length.
            rows: Row (pieces,) of the limits that each piece has to keep.
            groups: Group (pieces,) of each piece, from 0 on without gaps.
            above: Factors up to this, one for all or (groups,), do not matter: what is found may be less.

        Returns:
            The factors (groups,), less than 1 where a group could be faster, and the index (groups,) in `each` of the
            limit that sets each.

        Raises:
            LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
        """

        def needed(at: np.ndarray, q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
            """Return the factors (N, limits) that samples of pieces `at` (N,) need."""
            torque = partial(self._stretch_for_torque, rows=rows[at], segments=pieces.segments[at], q=q, v=v, a=a)
            values = self._of_samples(rows[at], pieces.segments[at], (q, v, a, j), torque, pieces.lengths[at])
            for column, quantity in enumerate(self.tool, self.robot.dof):
                values[:, column] **= 1.0 / TCP_ORDERS[quantity]
            return values

        return self._peaks(needed, pieces, groups, above, power=1.0 / TCP_ORDERS[CENTRIPETAL])

    def use(self, pieces: SegmentedPolynomial, rows: np.ndarray) -> FloatArray:
        """Return the largest share (pieces,) of one of these limits that each piece uses.

        Args:
            pieces: The motion, in pieces of positive length.
            rows: Row (pieces,) of the limits that each piece has to keep.
        """

        def shares(at: np.ndarray, q: FloatArray, v: FloatArray, a: FloatArray, j: FloatArray) -> FloatArray:
            """Return the shares (N, limits) that samples of pieces `at` (N,) use."""
            torques = partial(self.dynamics.torques, pieces.segments[at], q, v, a)
            segments, middle = pieces.segments[at], self.middle[rows[at]]

            def of_torque(limit: FloatArray) -> FloatArray:
                return np.asarray(np.abs(torques() - middle) / limit)

            return self._of_samples(rows[at], segments, (q, v, a, j), of_torque, pieces.lengths[at])

        return self._peaks(shares, pieces, np.arange(len(rows)))[0]

    def _of_samples(
        self,
        rows: np.ndarray,
        segments: np.ndarray,
        states: tuple[FloatArray, ...],
        of_torque: Callable[[FloatArray], FloatArray],
        lengths: FloatArray,
    ) -> FloatArray:
        """Join the shares of the limits of the tool and what `of_torque` makes of those of torque: (N, limits).

        Where the centripetal acceleration is limited, what bounds it between samples follows.
        """
        torque, dof = self.torque[rows], self.robot.dof
        values = np.zeros((len(rows), len(self.each)))
        bends = np.empty((len(rows), 0))
        if self.tool:
            rated = dict.fromkeys([*self.tool, *(OF_BENDS if CENTRIPETAL in self.tool else ())])
            rates = tool_rates_on(self.dynamics, segments, rated, *states)
            for column, (quantity, limit) in enumerate(self.tool.items(), dof):
                values[:, column] = rates[quantity] / limit[rows]
            if CENTRIPETAL in self.tool:
                bends = bend_bounds(rates, self.tool[CENTRIPETAL][rows], lengths)
        if np.isfinite(torque).any():
            values[:, :dof] = of_torque(torque)
        return np.hstack([values, bends])

    def _peaks(
        self,
        of_samples: Callable[[np.ndarray, FloatArray, FloatArray, FloatArray, FloatArray], FloatArray],
        motion: SegmentedPolynomial,
        groups: np.ndarray,
        above: FloatArray | float = 0.0,
        power: float = 1.0,
    ) -> tuple[FloatArray, np.ndarray]:
        """Find the largest values (groups,) over the pieces of each group, with the margin, and the column of each.

        Args:
            of_samples: Values of piece (N,), position, velocity, acceleration and jerk (N, joints).
            motion: The motion, in pieces of positive length.
            groups: Group (pieces,) of each piece, from 0 on without gaps.
            above: Values up to this, one for all or (groups,), do not matter: what is found may be less.
            power: That of its use which stands for the centripetal acceleration.
        """
        derivatives = derivatives_on_unit_time(motion, DERIVATIVES)
        states = derivatives[:4]

        def values(pieces: np.ndarray, units: FloatArray) -> FloatArray:
            """Return the values (N, columns) at unit times (N,) of pieces (N,)."""
            return of_samples(pieces, *states.evaluate(pieces, units))

        parts, one = parts_of(derivatives, motion.lengths), np.zeros(len(self.each), dtype=int)
        bend = None
        if CENTRIPETAL in self.tool:
            bend = self.robot.dof + list(self.tool).index(CENTRIPETAL), power
        peaks = sampled_peaks(values, parts, one, groups, above=above / SAMPLED_MARGIN, bend=bend)
        return peaks.use[:, 0] * SAMPLED_MARGIN, peaks.columns[:, 0]

    def _stretch_for_torque(
        self,
        limit: FloatArray,
        rows: np.ndarray,
        segments: np.ndarray,
        q: FloatArray,
        v: FloatArray,
        a: FloatArray,
    ) -> FloatArray:
        """Return factors (N, joints) on time T: the torque of q(t / T) is g + b / T^2, b that of T = 1 less gravity.

        Torques count from the middle between their limits.
        """
        still = np.zeros_like(q)
        states = ([q, q], [still, v], [still, a])
        gravity, torque = self.dynamics.torques(segments, *map(np.array, states))
        middle = self.middle[rows]
        refuse_what_gravity_exceeds(self.robot, segments, gravity, middle, limit)
        inertial = torque - gravity
        headroom = limit - np.sign(inertial) * (gravity - middle)
        factors: FloatArray = np.sqrt(np.abs(inertial) / headroom)
        return factors
