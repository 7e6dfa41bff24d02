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

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.certificate import certify
from planner.errors import InvalidProblem, LimitsUnsatisfiable
from planner.guarantees import EndStates
from planner.limits import Limits, segment_limits
from planner.operations.certified import (
    CertifiedTrajectory,
    JointState,
    bounded_quantities,
    certified,
    refuse_other_joints,
)
from planner.operations.editing import slice_trajectory
from planner.operations.stop_limits import INTERVALS, PROBES, Law, StopLimits
from planner.operations.stopping_on_line import stop_on_line
from planner.paths.runs import JOINT_TOLERANCE, Run
from planner.time_scaling.compose import follow_curve
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import PlanWarning, Trajectory

if TYPE_CHECKING:
    from collections.abc import Collection

    from planner.limits import SegmentLimits
    from planner.robots import Robot
    from planner.spatial import FloatArray

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

TOLERANCE = 1e-3 * JOINT_TOLERANCE
"""Distance of a joint from its path, rad or m, that timing may leave: its third derivative is to be exact, too."""


def stop_on_path(
    robot: Robot,
    trajectory: Trajectory,
    time: float,
    *,
    limits: Limits = Limits(),
    enforced: Collection[str] | None = None,
) -> CertifiedTrajectory:
    """Stop a trajectory on its own path, as fast as the limits let it; where that bends, but for some percent.

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
        LimitsUnsatisfiable: No stop within the limits is found before the end of the trajectory, or nothing that is
            kept limits how fast it stops.
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
    state = JointState(*(values[0] for values in rest.evaluate(np.zeros(1), [0, 1, 2])))
    line = stop_on_line(state, rest, own, limits_jerk="jerk" in kept)
    if line is not None and certify(robot, line, limits=limits, enforced=kept, ends=ends).satisfied:
        return certified(robot, line, limits, kept, ends=ends)
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


def _fastest(
    robot: Robot, rest: Trajectory, limits: SegmentLimits, kept: frozenset[str], margin: float
) -> Trajectory | None:
    """Return the fastest stop found; None: none that is over before the trajectory is."""
    order = 2 if "jerk" in kept and np.isfinite(limits.jerk.upper).all() else 1
    law, bounds = Law.of_order(order), StopLimits(robot, rest, limits, kept, margin)
    if bounds.are_none:
        raise LimitsUnsatisfiable("nothing that is kept limits how fast it stops: ask for an acceleration limit")
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


def _constants(law: Law, bounds: StopLimits, duration: float, start: FloatArray | None) -> FloatArray | None:
    """Return the constants (INTERVALS,), in units of the duration, of a law within all limits; None: none is found."""
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


def _states(law: Law, constants: FloatArray, duration: float) -> tuple[FloatArray, FloatArray]:
    """Return the path positions (points,) and sigma with its two derivatives (3, points) of a law."""
    units = law.maps @ constants
    time = (np.arange(INTERVALS)[:, None] + PROBES).ravel() / INTERVALS
    s = duration * (time + units[0])
    states = np.zeros((3, len(s)))
    states[0] = 1.0 + units[1]
    for k in range(1, law.order + 1):
        states[k] = units[1 + k] / duration**k
    return s, states


def _along(rest: Trajectory, law: Law, constants: FloatArray, duration: float) -> Trajectory:
    """Return the motion along the path, in quintics that keep to it within the tolerance of timing."""
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
