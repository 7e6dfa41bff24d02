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
from planner.trajectory import Trajectory, cumulative_times, differentiate, horner

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

SAMPLES_PER_RADIAN, FEWEST_SAMPLES, MOST_SAMPLES = 100, 48, 512
"""Samples on one piece, by the travel of its busiest joint (rad, or m)."""


@dataclass(frozen=True, eq=False)
class UnitLaw:
    """The law of one segment on unit time: s(tau) from 0 to 1 in pieces, each in its local time.

    Attributes:
        lengths: (pieces,), summing to 1.
        coefficients: (pieces, order), ascending powers of local time.
    """

    lengths: FloatArray
    coefficients: FloatArray

    def sample(self, count: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """S and its first two derivatives at `count` points on each piece, both ends included; each (N, 1)."""
        tau = np.linspace(0.0, 1.0, count) * self.lengths[:, None]
        values = (horner(differentiate(self.coefficients, k)[:, None, :], tau) for k in range(3))
        s, ds, dds = (value.reshape(-1, 1) for value in values)
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
        law = UnitLaw(np.ones(1), np.array([self.coefficients]))
        return parametrize_rest_to_rest(path, bounds, lambda _segment, _duration: law)


def parametrize_rest_to_rest(
    path: JointPath, bounds: dict[str, FloatArray], law_of: Callable[[int, float], UnitLaw]
) -> Trajectory:
    """Choose the durations and put the laws on the path.

    Args:
        path: With asked durations, NaN where the shortest is wanted.
        bounds: Shortest durations (segments, joints), s, that keep each joint limit of closed form.
        law_of: The law of a segment at a duration.

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
    sampled = _SampledLimits(path)
    if sampled.any:
        for i in range(len(shortest)):
            target = shortest[i] if free[i] else max(shortest[i], asked[i])
            needed = sampled.shortest_duration(i, target, law_of)
            if needed > target:
                shortest[i] = needed
    short = np.flatnonzero(asked < shortest * (1.0 - DURATION_TOLERANCE))
    if len(short):
        raise _infeasible(path, bounds, shortest, short)
    durations = np.where(free, shortest, asked)
    return assemble(path, [law_of(i, duration) for i, duration in enumerate(durations)], durations)


def assemble(path: JointPath, laws: list[UnitLaw], durations: FloatArray) -> Trajectory:
    """The trajectory that follows `laws` on the segments of `path`, with its dwells.

    Args:
        path: Straight joint motions.
        laws: One a segment.
        durations: (segments,), s.
    """
    starts, travels = path.positions[:-1], path.travels
    order = max(law.coefficients.shape[1] for law in laws)
    lengths, coefficients, segments, arrival_pieces = [], [], [], [0]
    pieces = 0

    def add(segment: int, piece_lengths: FloatArray, piece_coefficients: FloatArray) -> None:
        nonlocal pieces
        lengths.append(piece_lengths)
        coefficients.append(piece_coefficients)
        segments.append(np.full(len(piece_lengths), segment))
        pieces += len(piece_lengths)

    def rest(segment: int, dwell: float, position: FloatArray) -> None:
        if dwell > 0.0:
            still = np.zeros((1, len(position), order))
            still[0, :, 0] = position
            add(segment, np.array([dwell]), still)

    rest(0, path.dwells[0], starts[0])
    departure_pieces = [pieces]
    powers = np.arange(order)
    for i, (law, duration) in enumerate(zip(laws, durations, strict=True)):
        scaled = np.zeros((len(law.lengths), order))
        scaled[:, : law.coefficients.shape[1]] = law.coefficients
        scaled /= duration**powers
        moving = scaled[:, None, :] * travels[i][None, :, None]
        moving[:, :, 0] += starts[i]
        add(i, _piece_lengths(law, duration), moving)
        arrival_pieces.append(pieces)
        rest(i, path.dwells[i + 1], path.positions[i + 1])
        departure_pieces.append(pieces)
    all_lengths = np.concatenate(lengths)
    times = cumulative_times(all_lengths)
    return Trajectory(
        lengths=all_lengths,
        coefficients=np.concatenate(coefficients),
        segments=np.concatenate(segments),
        arrivals=times[arrival_pieces],
        departures=times[departure_pieces],
    )


def _piece_lengths(law: UnitLaw, duration: float) -> FloatArray:
    """(pieces,), s, that sum to `duration` exactly.

    Adding and subtracting the duration puts the breakpoints on its grid of floating-point numbers, where
    differences and their sums are exact.
    """
    breakpoints = (np.cumsum(law.lengths) * duration + duration) - duration
    breakpoints[-1] = duration
    return np.diff(breakpoints, prepend=0.0)


class _SampledLimits:
    """Limits without a closed form: torque and tool speed, found on samples of the law."""

    def __init__(self, path: JointPath) -> None:
        self.path = path
        self.linear = path.limits.tcp_linear_velocity
        self.angular = path.limits.tcp_angular_velocity
        self.torque = path.limits.torque if path.robot.has_dynamics else np.full_like(path.limits.torque, np.inf)

    @property
    def any(self) -> bool:
        """Whether there are any."""
        return bool(np.isfinite(self.linear).any() or np.isfinite(self.angular).any() or np.isfinite(self.torque).any())

    def shortest_duration(self, segment: int, target: float, law_of: Callable[[int, float], UnitLaw]) -> float:
        """The shortest duration from `target` on, s, that keeps the sampled limits of the segment.

        A law whose shape depends on the duration (a trapezoid with its own times) is looked at again at
        each longer duration, until nothing changes.

        Raises:
            LimitsUnsatisfiable: Gravity alone exceeds a torque limit.
        """
        duration = target
        for _ in range(50):
            needed = self._needed(segment, law_of(segment, duration))
            if needed <= duration * (1.0 + DURATION_TOLERANCE):
                break
            duration = needed
        return duration

    def _needed(self, segment: int, law: UnitLaw) -> float:
        path, travel = self.path, self.path.travels[segment]
        count = int(np.clip(SAMPLES_PER_RADIAN * np.abs(travel).max(), FEWEST_SAMPLES, MOST_SAMPLES))
        s, ds, dds = law.sample(count)
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
