"""The fastest stop of a trajectory on its own path: the tool keeps to where the trajectory would have taken it.

The stop is at q(s(t)), where q is the given trajectory and s its own time, which runs slower and slower: s' goes from 1
to 0. With sigma = s' a joint has

    velocity      q' sigma
    acceleration  q'' sigma^2 + q' sigma'
    jerk          q''' sigma^3 + 3 q'' sigma sigma' + q' sigma''
    torque        M(q) q' sigma' + h(q, q', q'') sigma^2 + gravity(q)

The highest derivative of sigma that may jump is constant on each of some intervals of time, and everything before it is
linear in these constants. For a given duration the limits are linearised about the law before and a linear program
finds the constants that break them least; what it finds is held against the limits themselves. The least duration for
which they are kept is found by bisection.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.backends.shared.time_laws import follow_curve
from planner.certificate import certify
from planner.dynamics import path_dynamics
from planner.errors import InvalidProblem, LimitsUnsatisfiable
from planner.guarantees import EndStates
from planner.kinematics.forward import tool_speeds
from planner.limits import Limits, segment_limits
from planner.operations.certified import (
    CertifiedTrajectory,
    bounded_quantities,
    certified,
    refuse_other_joints,
)
from planner.operations.editing import slice_trajectory
from planner.paths.runs import JOINT_TOLERANCE, Run
from planner.polynomials import PiecewisePolynomial
from planner.tolerances import LIMIT_TOLERANCE
from planner.trajectory import PlanWarning, Trajectory

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from planner.limits import SegmentLimits
    from planner.robots import Robot
    from planner.spatial import FloatArray

INTERVALS = 20
"""Number of intervals of time on which the highest derivative is constant: on a straight line the stop is slower than
the fastest by 1 % or so."""

PROBES = np.array([0.0, 0.5, 1.0])
"""Shares of each interval at which limits are held."""

LINEARISATIONS = 6
"""Number of linear programs for one duration, at most."""

BISECTIONS = 6
"""Steps of bisection for the duration: it is the least but for 1 %."""

TRUST = 0.5
"""Change of sigma that the first linear program may make; each after it half as much."""

MOST_DOUBLINGS = 8
"""Number of times that a first guess of the duration is doubled, at most."""

MARGINS = (1e-3, 1e-2, 5e-2)
"""Shares of the limits that are left for what happens between the probes, tried in turn until the certificate agrees.
What the trajectory itself uses at a place is allowed there, first all of it, later all but half of this share: it may
use all of a limit when the stop begins."""

FREE = 0.25
"""Share of the duration over which this half grows from nothing."""

TOLERANCE = 1e-3 * JOINT_TOLERANCE
"""Distance of a joint from its path, rad or m, that timing may leave: its third derivative is to be exact, too."""

GROWTH = np.minimum((np.arange(INTERVALS)[:, None] + PROBES).reshape(-1, 1) / INTERVALS / FREE, 1.0)
"""This growth at all probes (points, 1)."""


def stop_on_path(
    robot: Robot,
    trajectory: Trajectory,
    time: float,
    *,
    limits: Limits = Limits(),
    enforced: Collection[str] | None = None,
) -> CertifiedTrajectory:
    """Stop a trajectory on its own path, as fast as the limits let it.

    The answer begins in the trajectory's state at that time. Where no faster one is found, the stop is that at the end
    of the trajectory, and the warning `stops_at_the_end` says so: where one joint after the other uses all of its jerk
    limit, as in time-optimal motions with a law for each joint, there is hardly room to brake on the path.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        trajectory: A trajectory of any origin.
        time: When the stop begins, s.
        limits: Limits that are asked besides, no wider than the robot's.
        enforced: The quantities of `QUANTITIES` whose limits are to be kept; None: those that the trajectory bounds.

    Raises:
        InvalidProblem: The time is not within the trajectory; or as for `reverse_trajectory`.
        LimitsUnsatisfiable: No stop within the limits is found before the end of the trajectory.
    """
    refuse_other_joints(robot, [trajectory])
    if not 0.0 <= time < trajectory.duration:
        message = f"{time:g} s is not within the trajectory, which takes {trajectory.duration:g} s"
        raise InvalidProblem([(("time",), message)])
    kept = bounded_quantities([trajectory]) if enforced is None else frozenset(enforced)
    rest = slice_trajectory(robot, trajectory, time, limits=limits, enforced=()).trajectory
    own = segment_limits(robot, limits, (None,))
    v, a = rest.evaluate(0.0, [1, 2])
    ends = EndStates(v, a, np.zeros(robot.dof))
    for margin in MARGINS:
        stop = _fastest(robot, rest, own, kept, margin)
        if stop is None:
            break
        if certify(robot, stop, limits=limits, enforced=kept, ends=ends).satisfied:
            return certified(robot, stop, limits, kept, ends=ends)
    if certify(robot, rest, limits=limits, enforced=kept, ends=ends).continuity in ("none", "C0"):
        message = "no stop on the path within the limits is found before the trajectory ends in motion"
        raise LimitsUnsatisfiable(message, time=time)
    done = certified(robot, rest, limits, kept, ends=ends)
    warning = PlanWarning(
        "stops_at_the_end", f"no faster stop is found than that after {rest.duration:.6g} s, at the end"
    )
    return replace(done, warnings=(*done.warnings, warning))


class Term(NamedTuple):
    """Values that are limited at the probes.

    Attributes:
        kind: `velocity`, `acceleration` or `jerk`: how they go with sigma and its derivatives.
        coefficients: Of sigma^k and so on, each (points, values).
        offset: What is there at rest, (points, values).
        limit: (points, values).
    """

    kind: str
    coefficients: tuple[FloatArray, ...]
    offset: FloatArray
    limit: FloatArray


@dataclass(frozen=True, eq=False)
class _Law:
    """How s and its derivatives depend on the constants (INTERVALS,), in units of the duration.

    Attributes:
        order: The derivative of sigma that is constant on each interval.
        maps: (order + 2, points, INTERVALS): s, sigma and its derivatives at the probes, less what they are without.
    """

    order: int
    maps: FloatArray

    @classmethod
    def of_order(cls, order: int) -> _Law:
        """The maps by integration from interval to interval."""
        h, count = 1.0 / INTERVALS, order + 2
        state = np.zeros((count, INTERVALS))  # from s on, at the start of an interval
        maps = np.zeros((count, INTERVALS, len(PROBES), INTERVALS))
        for k in range(INTERVALS):
            state[-1] = np.eye(INTERVALS)[k]
            for probe, share in enumerate(PROBES.tolist()):
                maps[:, k, probe] = _integrated(state, share * h)
            state = _integrated(state, h)
        return cls(order, maps.reshape(count, -1, INTERVALS))


def _integrated(state: FloatArray, time: float) -> FloatArray:
    """A state and its derivatives, the last of which is constant, after a time: Taylor's formula."""
    result = np.zeros_like(state)
    for k in range(len(state)):
        factor = 1.0
        for n in range(k, len(state)):
            result[k] += factor * state[n]
            factor *= time / (n - k + 1)
    return result


def _fastest(
    robot: Robot, rest: Trajectory, limits: SegmentLimits, kept: frozenset[str], margin: float
) -> Trajectory | None:
    """The fastest stop found; None: none that is over before the trajectory is."""
    order = 2 if "jerk" in kept and np.isfinite(limits.jerk).all() else 1
    law, bounds = _Law.of_order(order), _Bounds(robot, rest, limits, kept, margin)
    least, found = 0.0, None
    longest = (1.0 if bounds.ends_at_rest else 2.0) * rest.duration
    duration = min(rest.duration, bounds.guess)
    for _ in range(MOST_DOUBLINGS):
        found = _constants(law, bounds, duration, None)
        if found is not None or duration >= longest:
            break
        least, duration = duration, min(2.0 * duration, longest)
    if found is None:
        return None
    most = duration
    for _ in range(BISECTIONS):
        middle = (least + most) / 2.0
        better = _constants(law, bounds, middle, found)
        if better is None:
            least = middle
        else:
            most, found = middle, better
    if most >= rest.duration and bounds.ends_at_rest:
        return None
    return _along(rest, law, found, most)


def _constants(law: _Law, bounds: _Bounds, duration: float, start: FloatArray | None) -> FloatArray | None:
    """The constants (INTERVALS,), in units of the duration, of a law within all limits; None: none is found."""
    from scipy.optimize import linprog  # loaded by the first stop on a path: importing the library stays quick

    middles = (np.arange(INTERVALS) + 0.5) / INTERVALS
    smooth = (
        12.0 * middles - 6.0 if law.order == 2 else np.full(INTERVALS, -1.0)
    )  # sigma is 1 - 3 u^2 + 2 u^3, or 1 - u
    own, excess = smooth if start is None else start, np.inf
    for number in range(LINEARISATIONS):
        s, states = _states(law, own, duration)
        if number and bounds.broken(s, states) <= 0.0:
            return own
        rows, rhs = bounds.linearised(law, s, states, duration)
        # Unknowns: the constants, and by how much of its limit the worst is exceeded.
        sigma_end = law.maps[1:, -1] if law.order == 2 else law.maps[1:2, -1]
        sigma_end = sigma_end[: law.order]
        equal = np.hstack([sigma_end, np.zeros((law.order, 1))])
        to = np.zeros(law.order)
        to[0] = -1.0
        forwards = np.hstack([-law.maps[1], np.zeros((len(law.maps[1]), 1))])
        within = np.append(law.maps[0, -1], 0.0)[None]
        trust = np.hstack([law.maps[1], np.zeros((len(law.maps[1]), 1))])
        near, there = TRUST * 0.5**number, law.maps[1] @ own
        program = linprog(
            np.append(np.zeros(INTERVALS), 1.0),
            A_ub=np.vstack([rows, forwards, within, trust, -trust]),
            b_ub=np.concatenate(
                [rhs, np.ones(len(forwards)), [bounds.length / duration - 1.0], near + there, near - there]
            ),
            A_eq=equal,
            b_eq=to,
            bounds=[(None, None)] * INTERVALS + [(-1.0, None)],
            method="highs",
        )
        if program.status != 0 or (number > 1 and program.x[-1] > 0.5 * excess):
            return None
        own, excess = program.x[:-1], max(float(program.x[-1]), 0.0)
    s, states = _states(law, own, duration)
    return own if bounds.broken(s, states) <= 0.0 else None


def _states(law: _Law, constants: FloatArray, duration: float) -> tuple[FloatArray, FloatArray]:
    """The path positions (points,) and sigma with its two derivatives (3, points) of a law."""
    units = law.maps @ constants
    time = (np.arange(INTERVALS)[:, None] + PROBES).ravel() / INTERVALS
    s = duration * (time + units[0])
    states = np.zeros((3, len(s)))
    states[0] = 1.0 + units[1]
    for k in range(1, law.order + 1):
        states[k] = units[1 + k] / duration**k
    return s, states


class _Bounds:
    """The limits of a stop along a path.

    Attributes:
        length: The path position at which the path ends, s of the given trajectory.
        guess: A first guess of the duration, s.
        ends_at_rest: Whether the trajectory is at rest at its end.
    """

    def __init__(
        self, robot: Robot, path: Trajectory, limits: SegmentLimits, kept: frozenset[str], margin: float
    ) -> None:
        self.robot, self.path, self.kept = robot, path, kept
        self.margin = margin
        self.limits = limits
        self.length = path.duration
        (v0, v1) = path.evaluate(np.array([0.0, self.length]), [1])[0]
        self.ends_at_rest = bool(np.abs(v1).max() <= 1e-9 * max(np.abs(v0).max(), 1e-300))
        with np.errstate(divide="ignore", invalid="ignore"):
            times = np.abs(v0) / limits.acceleration[0] + limits.acceleration[0] / limits.jerk[0]
            times = np.where(np.isfinite(times), times, 0.0)
        self.guess = max(float(times.max()), 1e-3 * self.length)
        self.torques = "torque" in kept and robot.has_dynamics and bool(np.isfinite(limits.torque).any())
        tool = [limits.tcp_linear_velocity[0], limits.tcp_angular_velocity[0]]
        self.tool = [
            (k, limit)
            for k, limit in enumerate(tool)
            if np.isfinite(limit) and ("tcp_linear_velocity", "tcp_angular_velocity")[k] in kept
        ]

    def _terms(self, s: FloatArray) -> Iterator[Term]:
        """Yield what is limited: its kind, its coefficients, its offset and its bound, each (points, values)."""
        for kind, coefficients, offset, limit in self._limited(s):
            own = np.abs(coefficients[0] + offset) * (1.0 - 0.5 * self.margin * GROWTH)  # of the trajectory itself
            yield Term(kind, coefficients, offset, np.minimum(limit, np.maximum((1.0 - self.margin) * limit, own)))

    def _limited(self, s: FloatArray) -> list[Term]:
        """What is limited: its kind, its coefficients, its offset and its limit, each (points, values)."""
        q, first, second, third = self.path.evaluate(np.clip(s, 0.0, self.length), range(4))
        zero = np.zeros_like(first)
        terms: list[Term] = []
        for quantity, coefficients in (
            ("velocity", (first,)),
            ("acceleration", (second, first)),
            ("jerk", (third, second, first)),
        ):
            limit = getattr(self.limits, quantity)[0]
            if quantity in self.kept and np.isfinite(limit).any():
                terms.append(Term(quantity, coefficients, zero, np.tile(limit, (len(s), 1))))
        if self.torques:
            inertia, centripetal, gravity = path_dynamics(self.robot, q, first, second)
            limit = np.tile(self.limits.torque[0], (len(s), 1))
            terms.append(Term("acceleration", (centripetal, inertia), gravity, limit))
        speeds = tool_speeds(self.robot, q, first) if self.tool else ()
        for k, limit in self.tool:
            speed = speeds[k][:, None]
            terms.append(Term("velocity", (speed,), np.zeros_like(speed), np.full_like(speed, limit)))
        return terms

    def broken(self, s: FloatArray, states: FloatArray) -> float:
        """Find by how much of its limit the worst is exceeded, first probe aside; no more than 0: all are kept."""
        sigma, d1, d2 = (values[:, None] for values in states)
        worst = -np.inf
        if (s < -LIMIT_TOLERANCE).any() or (s > self.length * (1.0 + LIMIT_TOLERANCE)).any():
            return np.inf
        for kind, coefficients, offset, limit in self._terms(s):
            match kind:
                case "velocity":
                    value = coefficients[0] * sigma
                case "acceleration":
                    value = coefficients[0] * sigma**2 + coefficients[1] * d1
                case _:
                    value = coefficients[0] * sigma**3 + 3.0 * coefficients[1] * sigma * d1 + coefficients[2] * d2
            worst = max(worst, float((np.abs(value + offset) / limit)[1:].max()) - 1.0)
        return worst - LIMIT_TOLERANCE

    def linearised(
        self, law: _Law, s: FloatArray, states: FloatArray, duration: float
    ) -> tuple[FloatArray, FloatArray]:
        """All limits as rows A x <= b of the constants and the excess, about a law."""
        sigma, d1, _ = (values[:, None] for values in states)
        maps = [law.maps[1 + k] / duration**k if k <= law.order else np.zeros_like(law.maps[1]) for k in range(3)]
        rows, rhs = [], []
        for kind, coefficients, offset, limit in self._terms(s):
            match kind:
                case "velocity":
                    by, constant = [coefficients[0]], coefficients[0]
                case "acceleration":
                    by = [2.0 * coefficients[0] * sigma, coefficients[1]]
                    constant = coefficients[0] * (2.0 * sigma - sigma**2)
                case _:
                    q3, q2, q1 = coefficients
                    by = [3.0 * q3 * sigma**2 + 3.0 * q2 * d1, 3.0 * q2 * sigma, q1]
                    # sigma is 1 plus what the constants make of it
                    constant = q3 * (3.0 * sigma**2 - 2.0 * sigma**3) + 3.0 * q2 * (d1 - sigma * d1)
            there = np.isfinite(limit)
            there[0] = False  # that is given
            value = sum(c[:, :, None] * m[:, None, :] for c, m in zip(by, maps[: len(by)], strict=True))
            value = (value / limit[..., None])[there]
            given = ((constant + offset) / limit)[there]
            for sign in (1.0, -1.0):
                rows.append(np.hstack([sign * value, -np.ones((len(value), 1))]))
                rhs.append(1.0 - sign * given)
        return np.vstack(rows), np.concatenate(rhs)


def _along(rest: Trajectory, law: _Law, constants: FloatArray, duration: float) -> Trajectory:
    """The motion along the path, in quintics that keep to it within the tolerance of timing."""
    h = duration / INTERVALS
    starts = law.maps[:, :: len(PROBES)] @ constants  # at the first probe of each interval
    time = np.arange(INTERVALS) * h
    coefficients = np.zeros((INTERVALS, 1, law.order + 2))
    coefficients[:, 0, 0] = time + duration * starts[0]
    factorial = 1.0
    for k in range(1, law.order + 2):
        factorial *= k
        coefficients[:, 0, k] = ((k == 1) + starts[k] / duration ** (k - 1)) / factorial
    end = float(duration * (1.0 + law.maps[0, -1] @ constants))
    part = rest.between(0.0, min(end, rest.duration))
    curve = part.of_segments(np.zeros(len(part.lengths), dtype=int))
    run = Run(
        segments=np.array([0]),
        curve=curve,
        waypoint_knots=np.array([0, len(curve.lengths)]),
        blend_knots=np.array([], dtype=int),
        is_spline=False,
        tolerance=TOLERANCE,
    )
    times = PiecewisePolynomial(np.full(INTERVALS, h), coefficients).of_segments(np.zeros(INTERVALS, dtype=int))
    pieces = follow_curve(run, times)
    ends = np.array([0.0, float(pieces.lengths.sum())])
    return Trajectory(pieces.lengths, pieces.coefficients, pieces.segments, ends, ends)
