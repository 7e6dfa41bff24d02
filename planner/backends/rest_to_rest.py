"""Time laws that start and end each segment at rest: one scalar law s(t) moves all joints along the segment.

Joint j follows q_j(t) = q_j(0) + travel_j s(t / T) with s from 0 to 1, so every derivative of order k scales
with 1 / T^k, and the shortest duration that keeps a limit has a closed form.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.dynamics import inverse_dynamics
from planner.errors import InfeasibleDuration, LimitsUnsatisfiable, Remedy
from planner.kinematics.forward import tool_speeds
from planner.polynomials import cumulative_sums, differentiate, horner
from planner.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.kinematics.poses import FloatArray
    from planner.paths import JointPath

DURATION_TOLERANCE = 1e-10
"""Relative shortfall of an asked duration that is taken for rounding."""

RAMPS = "ramps"
"""Key of the bound on the duration that comes from asked ramp times instead of a limit."""

SAMPLED_MARGIN = 1.002
"""Durations set by sampled quantities (torque, tool speed) are longer by this, for what lies between samples."""

MOST_STRETCHES = 50
"""Times that a segment is lengthened for its sampled limits, each time by less."""

SAMPLES_PER_RADIAN, FEWEST_SAMPLES, MOST_SAMPLES = 100, 48, 512
"""Samples on one piece, by the travel of its busiest joint (rad, or m)."""


@dataclass(frozen=True, eq=False)
class UnitLaws:
    """The law of each segment on unit time: s(tau) from 0 to 1 in pieces, each in its local time.

    Attributes:
        lengths: (segments, pieces), each row summing to 1; a piece of length 0 is not there.
        coefficients: (segments, pieces, order), ascending powers of local time.
    """

    lengths: FloatArray
    coefficients: FloatArray

    def sample(self, segment: int, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The law s and its first two derivatives at `count` points on each piece, both ends included; each (N, 1)."""
        tau = np.linspace(0.0, 1.0, count) * self.lengths[segment, :, None]
        pieces = self.coefficients[segment, :, None, :]
        s, ds, dds = (horner(differentiate(pieces, k), tau).reshape(-1, 1) for k in range(3))
        return s, ds, dds


@dataclass(frozen=True)
class PolynomialLaw:
    """A law of one polynomial, the same for every segment.

    Attributes:
        coefficients: Of s(tau) on [0, 1], ascending.
        velocity: Peak of |s'|.
        acceleration: Peak of |s''|.
        jerk: Peak of |s'''|, its limits kept; None: jerk is not limited.
    """

    coefficients: tuple[float, ...]
    velocity: float
    acceleration: float
    jerk: float | None = None

    def parametrize(self, path: JointPath) -> Trajectory:
        """The trajectory along `path` under this law, at the asked durations or the shortest."""
        travels, limits = np.abs(path.travels), path.limits
        bounds = {
            "velocity": self.velocity * travels / limits.velocity,
            "acceleration": np.sqrt(self.acceleration * travels / limits.acceleration),
        }
        if self.jerk is not None:
            bounds["jerk"] = np.cbrt(self.jerk * travels / limits.jerk)
        count = len(travels)
        laws = UnitLaws(np.ones((count, 1)), np.tile(self.coefficients, (count, 1, 1)))
        return parametrize_rest_to_rest(path, bounds, lambda _durations: laws)


def parametrize_rest_to_rest(
    path: JointPath, bounds: dict[str, FloatArray], laws_of: Callable[[FloatArray], UnitLaws]
) -> Trajectory:
    """Choose the durations and put the laws on the path.

    Args:
        path: With asked durations, NaN where the shortest is wanted.
        bounds: Shortest durations (segments, joints), s, that keep each joint limit of closed form.
        laws_of: The laws of the segments at their durations (segments,).

    Raises:
        InfeasibleDuration: An asked duration is shorter than the shortest feasible one.
        LimitsUnsatisfiable: Gravity alone exceeds a torque limit, or nothing limits a segment's duration.
    """
    shortest = np.max([bound.max(axis=1) for bound in bounds.values()], axis=0)
    asked = path.durations
    free = np.isnan(asked)
    unlimited = np.flatnonzero(free & (shortest <= 0.0))
    if len(unlimited):
        i = int(unlimited[0])
        raise LimitsUnsatisfiable(
            f"segment {i} has neither a duration nor a velocity or acceleration limit that would set one",
            segment=i,
            remedies=[Remedy(f"/waypoints/{i + 1}/duration", 1.0, "any duration will do")],
        )
    start = np.where(free, shortest, np.maximum(shortest, asked))
    stretched = _SampledLimits(path).stretch(start, laws_of)
    shortest = np.where(stretched > start, stretched, shortest)
    short = np.flatnonzero(asked < shortest * (1.0 - DURATION_TOLERANCE))
    if len(short):
        raise _infeasible(path, bounds, shortest, short)
    durations = np.where(free, shortest, asked)
    return assemble(path, laws_of(durations), durations)


def assemble(path: JointPath, laws: UnitLaws, durations: FloatArray) -> Trajectory:
    """The trajectory that follows `laws` on the segments of `path`, with its dwells.

    Each segment is its law's pieces and then the dwell at its end; the dwell at the first waypoint stands
    before them all. Pieces without length are left out at last.

    Args:
        path: Straight joint motions.
        laws: Of each segment.
        durations: (segments,), s.
    """
    segments, pieces, order = laws.coefficients.shape
    joints = path.travels.shape[1]
    scaled = laws.coefficients / durations[:, None, None] ** np.arange(order)
    coefficients = np.zeros((segments, pieces + 1, joints, order))
    coefficients[:, :pieces] = scaled[:, :, None, :] * path.travels[:, None, :, None]
    coefficients[:, :pieces, :, 0] += path.positions[:-1, None]
    coefficients[:, pieces, :, 0] = path.positions[1:]
    first = np.zeros((1, joints, order))
    first[0, :, 0] = path.positions[0]

    lengths = np.column_stack([_piece_lengths(laws, durations), path.dwells[1:]])
    all_lengths = np.concatenate([path.dwells[:1], lengths.ravel()])
    times = cumulative_sums(all_lengths)
    owners = np.concatenate([[0], np.repeat(np.arange(segments), pieces + 1)])
    there = all_lengths > 0.0
    return Trajectory(
        lengths=all_lengths[there],
        coefficients=np.concatenate([first, coefficients.reshape(-1, joints, order)])[there],
        segments=owners[there],
        arrivals=np.concatenate([times[:1], times[pieces + 1 :: pieces + 1]]),
        departures=times[1 :: pieces + 1],
    )


def _piece_lengths(laws: UnitLaws, durations: FloatArray) -> FloatArray:
    """(segments, pieces), s, that sum to the durations exactly.

    Adding and subtracting the duration puts the breakpoints on its grid of floating-point numbers, where
    differences and their sums are exact.
    """
    column = durations[:, None]
    breakpoints = np.zeros((len(durations), laws.lengths.shape[1] + 1))
    breakpoints[:, 1:] = (np.cumsum(laws.lengths, axis=1) * column + column) - column
    breakpoints[:, -1] = durations
    return breakpoints[:, 1:] - breakpoints[:, :-1]


class _SampledLimits:
    """Limits without a closed form: torque and tool speed, found on samples of the law."""

    def __init__(self, path: JointPath) -> None:
        self.path = path
        self.linear = path.limits.tcp_linear_velocity
        self.angular = path.limits.tcp_angular_velocity
        self.torque = path.limits.torque if path.robot.has_dynamics else np.full_like(path.limits.torque, np.inf)

    def stretch(self, durations: FloatArray, laws_of: Callable[[FloatArray], UnitLaws]) -> FloatArray:
        """The shortest durations (segments,), s, from `durations` on, that keep the sampled limits.

        What a law needs does not depend on the duration. Laws whose shape does (a trapezoid with its own times)
        are looked at again at each longer duration, until nothing changes.

        Raises:
            LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
        """
        limited = np.isfinite(self.linear) | np.isfinite(self.angular) | np.isfinite(self.torque).any(axis=1)
        laws = None
        for _ in range(MOST_STRETCHES):
            before, laws = laws, laws_of(durations)
            if laws is before or not limited.any():
                break
            needed = np.zeros(len(durations))
            for segment in np.flatnonzero(limited).tolist():
                needed[segment] = self._needed(segment, laws)
            limited = needed > durations * (1.0 + DURATION_TOLERANCE)
            durations = np.where(limited, needed, durations)
        return durations

    def _needed(self, segment: int, laws: UnitLaws) -> float:
        path, travel = self.path, self.path.travels[segment]
        count = int(np.clip(SAMPLES_PER_RADIAN * np.abs(travel).max(), FEWEST_SAMPLES, MOST_SAMPLES))
        s, ds, dds = laws.sample(segment, count)
        positions = path.positions[segment] + s * travel
        velocities, accelerations = ds * travel, dds * travel
        needed = [0.0]
        if np.isfinite(self.linear[segment]) or np.isfinite(self.angular[segment]):
            linear, angular = tool_speeds(path.robot, positions, velocities)
            needed += [linear.max() / self.linear[segment], angular.max() / self.angular[segment]]
        if np.isfinite(self.torque[segment]).any():
            needed.append(self._needed_for_torque(segment, positions, velocities, accelerations))
        return float(max(needed)) * SAMPLED_MARGIN

    def _needed_for_torque(
        self, segment: int, positions: FloatArray, velocities: FloatArray, accelerations: FloatArray
    ) -> float:
        """With q(t / T) the torque is g(q) + b / T^2, b being the torque of unit time without gravity."""
        robot, limit = self.path.robot, self.torque[segment]
        still = np.zeros_like(positions)
        gravity = inverse_dynamics(robot, positions, still, still)
        worst = np.unravel_index(np.argmax(np.abs(gravity) / limit), gravity.shape)
        if abs(gravity[worst]) >= limit[worst[1]]:
            raise LimitsUnsatisfiable(
                f"gravity alone asks {abs(gravity[worst]):.6g} of {robot.joint_names[worst[1]]} on segment {segment}, "
                f"its torque limit is {limit[worst[1]]:.6g}",
                segment=segment,
                joint=robot.joint_names[worst[1]],
                value=float(abs(gravity[worst])),
                limit=float(limit[worst[1]]),
            )
        inertial = inverse_dynamics(robot, positions, velocities, accelerations) - gravity
        headroom = limit - np.sign(inertial) * gravity
        return float(np.sqrt((np.abs(inertial) / headroom).max()))


def _infeasible(
    path: JointPath, bounds: dict[str, FloatArray], shortest: FloatArray, short: np.ndarray
) -> InfeasibleDuration:
    """The refusal, with a remedy for every segment whose duration is too short; apply them together."""
    i = int(short[0])
    by_joint = {quantity: float(bound[i].max()) for quantity, bound in bounds.items()}
    quantity = max(by_joint, key=by_joint.__getitem__)
    joint = None
    if by_joint[quantity] < shortest[i]:
        cause = "the torque or tool speed limits ask"
    elif quantity == RAMPS:
        cause = "the acceleration and deceleration times ask"
    else:
        joint = path.robot.joint_names[int(np.argmax(bounds[quantity][i]))]
        cause = f"the {quantity} limit of {joint} asks"
    return InfeasibleDuration(
        f"segment {i} cannot be done in {path.durations[i]:g} s: {cause} for {shortest[i]:.6g} s",
        waypoint=i + 1,
        segment=i,
        joint=joint,
        value=float(path.durations[i]),
        limit=float(shortest[i]),
        remedies=[
            Remedy(
                f"/waypoints/{k + 1}/duration",
                float(shortest[k]),
                "the shortest duration of this segment that keeps the limits",
            )
            for k in short
        ],
    )
