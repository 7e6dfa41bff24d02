"""The fastest stop from a moving state, each joint by itself."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from typing import NamedTuple

import numpy as np

from planner.certificate import certify
from planner.errors import InvalidProblem, JointPositionLimit, LimitsUnsatisfiable, distinct
from planner.guarantees import QUANTITIES, EndStates
from planner.limits import Limits, SegmentLimits, limit_faults, segment_limits
from planner.operations.certified import CertifiedTrajectory, JointState, certified
from planner.paths.joint_path import SHORTEST_REST
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.tolerances import BISECTIONS, LIMIT_TOLERANCE, NEGLIGIBLE_SHARE
from planner.trajectories.trajectory import Trajectory

GENTLEST = 2.0**-8
"""Least share of the limits of acceleration and jerk with which a stop within torques and tool speeds is tried."""

GENTLENESS_STEPS = 8
"""Steps of bisection for this share: the stop is the fastest but for 0.4 % of its accelerations."""


class Phase(NamedTuple):
    """A part of the motion of one joint with constant jerk.

    Attributes:
        duration: s.
        position: At its start, rad or m.
        velocity: At its start, rad/s or m/s.
        acceleration: At its start, rad/s^2 or m/s^2.
        jerk: rad/s^3 or m/s^3.
    """

    duration: float
    position: float
    velocity: float
    acceleration: float
    jerk: float

    def at(self, time: float) -> tuple[float, float, float]:
        """Return position, velocity and acceleration after a time, s."""
        q, v, a, j = self[1:]
        return q + time * (v + time * (a / 2.0 + time * j / 6.0)), v + time * (a + time * j / 2.0), a + time * j


class Braking(NamedTuple):
    """How hard one joint may brake.

    Attributes:
        acceleration: Its limit, rad/s^2 or m/s^2.
        jerk: Its limit, rad/s^3 or m/s^3; infinite: accelerations may jump.
    """

    acceleration: float
    jerk: float


def stop_joints(
    robot: Robot, state: JointState, *, limits: Limits = Limits(), enforced: Collection[str] | None = None
) -> CertifiedTrajectory:
    """Stop each joint by itself, as fast as its limits allow.

    A joint that would exceed a position limit makes the fastest stop within the limit: it brakes longer and returns. If
    that breaks limits of torque or of the tool's speed, all joints brake more gently. They then use the same fraction
    of their limits of acceleration and jerk. A payload above the robot's rating is a warning, since the robot already
    moves.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        state: The state of the joints at the start of the stop.
        limits: Additional limits, no wider than the robot's.
        enforced: The quantities of `QUANTITIES` whose limits are to be kept; None: all, that of jerk where each joint
            has one. Without the jerk accelerations may jump, from that of the state on.

    Raises:
        InvalidProblem: Other numbers of joints than the robot's, or limits wider than the robot's.
        JointPositionLimit: No stop is short enough to stay within a position limit.
        LimitsUnsatisfiable: The state breaks a limit, no stop keeps it, or nothing limits how fast a joint stops.
    """
    _check_state(robot, state, limits)
    own = segment_limits(robot, limits, (None,))
    _refuse_broken_state(robot, state, own)
    unlimited = set() if np.isfinite(own.jerk.upper).all() else {"jerk"}
    kept = frozenset(QUANTITIES) - unlimited if enforced is None else frozenset(enforced)
    if "jerk" not in kept:
        own = own.without(["jerk"])
    still = np.zeros(robot.dof)
    ends = EndStates(state.velocity, state.acceleration, still)

    def is_satisfied(share: float) -> bool:
        try:
            stop = _stop(robot, state, own, share)
        except JointPositionLimit:
            if share == 1.0:
                raise
            return False
        return certify(robot, stop, limits=limits, enforced=kept, ends=ends).satisfied

    stop = _stop(robot, state, own, _gentleness(is_satisfied))
    return certified(robot, stop, limits, kept, ends=ends, is_stop=True)


def _check_state(robot: Robot, state: JointState, limits: Limits) -> None:
    faults = list(limit_faults(robot, limits, ("limits",)))
    for name, values in vars(state).items():
        if np.shape(values) != (robot.dof,):
            faults.append((("state", name), f"{np.size(values)} values for {robot.dof} joints"))
        elif not np.isfinite(values).all():
            faults.append((("state", name), "must be finite numbers"))
    if faults:
        raise InvalidProblem(faults)


def _refuse_broken_state(robot: Robot, state: JointState, limits: SegmentLimits) -> None:
    """Refuse what breaks a limit before the stop begins: there is nothing to be done about it."""
    lower, upper = limits.position
    beyond = np.maximum(lower - state.position, state.position - upper)
    if (joint := int(beyond.argmax())) >= 0 and beyond[joint] > LIMIT_TOLERANCE:
        limit = lower[joint] if state.position[joint] < lower[joint] else upper[joint]
        raise _position_error(robot, joint, float(state.position[joint]), float(limit), "is at {} when the stop begins")
    for quantity in ("velocity", "acceleration"):
        values, most = np.abs(getattr(state, quantity)), limits.magnitudes(quantity)[0]
        joint = int((values / most).argmax())
        if values[joint] > most[joint] * (1.0 + LIMIT_TOLERANCE):
            value, limit = distinct(float(values[joint]), float(most[joint]))
            message = (
                f"the {quantity} of {robot.joint_names[joint]} is {value} when the stop begins, its limit is {limit}"
            )
            raise LimitsUnsatisfiable(
                message,
                joint=robot.joint_names[joint],
                value=float(values[joint]),
                limit=float(most[joint]),
                time=0.0,
            )


def _gentleness(is_satisfied: Callable[[float], bool]) -> float:
    """Give the largest share of acceleration and jerk limits found with which a stop keeps all limits; 1: none does."""
    best, share = 0.0, 1.0
    while share >= GENTLEST:
        if is_satisfied(share):
            best = share
            break
        share /= 2.0
    if best in (0.0, 1.0):
        return 1.0
    low, high = best, 2.0 * best
    for _ in range(GENTLENESS_STEPS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if is_satisfied(middle) else (low, middle)
    return low


def _stop(robot: Robot, state: JointState, limits: SegmentLimits, share: float) -> Trajectory:
    """Return the stop of all joints at a fraction of their limits of acceleration and jerk."""
    motions, (lower, upper) = [], limits.position
    acceleration, jerk = share * limits.acceleration.narrower[0], share * limits.jerk.narrower[0]
    for joint, (q, v, a) in enumerate(zip(state.position, state.velocity, state.acceleration, strict=True)):
        moves = v != 0.0 or a != 0.0
        most = Braking(float(acceleration[joint]), float(jerk[joint]))
        if moves and not np.isfinite(most.acceleration):
            name = robot.joint_names[joint]
            raise LimitsUnsatisfiable(
                f"nothing limits how fast {name} stops: ask for an acceleration limit", joint=name
            )
        bounds = float(lower[joint]), float(upper[joint])
        motions.append(_within(robot, joint, (float(q), float(v), float(a)), most, bounds) if moves else [])
    return joined_phases(state.position, motions)


def _within(
    robot: Robot, joint: int, state: tuple[float, float, float], most: Braking, bounds: tuple[float, float]
) -> list[Phase]:
    """Return the fastest stop of one joint that stays within its position limits.

    It brakes for so long that the farthest place is the limit, and comes back from there.
    """
    stop = fastest_stop(state, most)
    lower, upper = bounds
    lowest, highest = _range(stop)
    if lowest >= lower - LIMIT_TOLERANCE and highest <= upper + LIMIT_TOLERANCE:
        return stop
    side = 1.0 if highest > upper + LIMIT_TOLERANCE else -1.0
    bound = side * (upper if side > 0.0 else lower)

    def after(time: float) -> list[Phase]:
        """Return the stop that brakes for a time first, away from the limit; in the direction of it positions count."""
        braking = _braking(mirrored, most, time)
        return [*braking, *fastest_stop(braking[-1].at(braking[-1].duration), most)]

    mirrored = side * state[0], side * state[1], side * state[2]
    low, high = 0.0, _time_to_turn(mirrored, most)
    nearest = _range(after(high))[1]
    if nearest > bound + LIMIT_TOLERANCE:
        text = f"moves at {state[1]:.6g} towards its limit and cannot stop before {{}}"
        raise _position_error(robot, joint, side * nearest, side * bound, text)
    for _ in range(BISECTIONS):
        middle = (low + high) / 2.0
        low, high = (low, middle) if _range(after(middle))[1] <= bound else (middle, high)
    return [
        phase._replace(**{name: side * getattr(phase, name) for name in Phase._fields[1:]}) for phase in after(high)
    ]


def fastest_stop(state: tuple[float, float, float], most: Braking) -> list[Phase]:
    """Return the fastest way to velocity and acceleration 0: acceleration to a peak, constant, and back to 0."""
    _, v, a = state
    peak_limit = max(most.acceleration, abs(a))
    if np.isinf(most.jerk):
        return _phases(state, [(abs(v) / most.acceleration, -np.copysign(most.acceleration, v), 0.0)])
    rest = v + a * abs(a) / (2.0 * most.jerk)  # the velocity if the acceleration went to 0 at once
    down = 1.0 if rest > 0.0 else -1.0
    v, a = down * v, down * a
    peak = np.sqrt(max(most.jerk * v + a * a / 2.0, 0.0))
    hold = 0.0
    if peak > peak_limit:
        peak = peak_limit
        hold = (v + a * a / (2.0 * most.jerk) - peak * peak / most.jerk) / peak
    j = down * most.jerk
    to_peak = max((a + peak) / most.jerk, 0.0)
    return _phases(state, [(to_peak, None, -j), (hold, -down * peak, 0.0), (peak / most.jerk, -down * peak, j)])


def _braking(state: tuple[float, float, float], most: Braking, time: float) -> list[Phase]:
    """Return the phases of full braking of a joint that moves upwards, for a time, s."""
    _, _, a = state
    if np.isinf(most.jerk):
        return _phases(state, [(time, -most.acceleration, 0.0)], keep_all=True)
    deepest = max(most.acceleration, -a)
    ramp = min(time, (a + deepest) / most.jerk)
    return _phases(state, [(ramp, None, -most.jerk), (time - ramp, a - ramp * most.jerk, 0.0)], keep_all=True)


def _time_to_turn(state: tuple[float, float, float], most: Braking) -> float:
    """Return the time, s, until full braking has stopped a joint that moves upwards or is about to."""
    _, v, a = state
    if np.isinf(most.jerk):
        return max(v, 0.0) / most.acceleration
    deepest = max(most.acceleration, -a)
    ramp = (a + deepest) / most.jerk
    at_end = v + ramp * (a - ramp * most.jerk / 2.0)
    if at_end > 0.0:
        return ramp + at_end / deepest
    # v + a t - J t^2 / 2 = 0, the later root: before it the joint may still be about to move upwards.
    return float((a + np.sqrt(max(a * a + 2.0 * most.jerk * v, 0.0))) / most.jerk)


def _phases(
    state: tuple[float, float, float], parts: Sequence[tuple[float, float | None, float]], *, keep_all: bool = False
) -> list[Phase]:
    """Return consecutive phases, each with duration, initial acceleration (None: unchanged) and jerk."""
    phases = []
    q, v, a = state
    for duration, acceleration, jerk in parts:
        phase = Phase(float(duration), q, v, a if acceleration is None else float(acceleration), float(jerk))
        if duration > 0.0 or keep_all:
            phases.append(phase)
            q, v, a = phase.at(phase.duration)
    return phases


def _range(phases: Sequence[Phase]) -> tuple[float, float]:
    """Return the lowest and the highest position on the way: at ends of phases, or where the velocity vanishes."""
    found = []
    for phase in phases:
        _, v, a, j = phase[1:]
        turns = np.roots([j / 2.0, a, v]) if j else np.roots([a, v]) if a else np.zeros(0)
        inside = [t.real for t in turns if abs(t.imag) == 0.0 and 0.0 < t.real < phase.duration]
        found += [phase.at(t)[0] for t in (0.0, *inside, phase.duration)]
    return (min(found), max(found)) if found else (np.inf, -np.inf)


def joined_phases(position: FloatArray, motions: Sequence[list[Phase]]) -> Trajectory:
    """Return the motions of all joints on common breakpoints; a joint that has stopped rests."""
    starts = [np.cumsum([0.0, *(phase.duration for phase in phases)]) for phases in motions]
    end = max(float(times[-1]) for times in starts)
    if end == 0.0:
        end = SHORTEST_REST
    times = np.unique(np.concatenate([[0.0, end], *starts]))
    shortest = min([end, *map(_ramp, motions)])
    apart = np.diff(times, prepend=-np.inf) > max(NEGLIGIBLE_SHARE * shortest, np.finfo(float).eps * end)
    times = times[apart]
    times[-1] = end
    coefficients = np.zeros((len(times) - 1, len(motions), 4))
    for joint, (phases, own) in enumerate(zip(motions, starts, strict=True)):
        at_rest = phases[-1].at(phases[-1].duration)[0] if phases else float(position[joint])
        coefficients[:, joint, 0] = at_rest
        middles = (times[:-1] + times[1:]) / 2.0
        of = np.searchsorted(own, middles, side="right") - 1
        for piece, k in enumerate(of.tolist()):
            if k < len(phases):
                q, v, a = phases[k].at(float(times[piece] - own[k]))
                coefficients[piece, joint] = q, v, a / 2.0, phases[k].jerk / 6.0
    ends = np.array([0.0, end])
    return Trajectory(np.diff(times), coefficients, np.zeros(len(times) - 1, dtype=int), ends, ends)


def _ramp(phases: Sequence[Phase]) -> float:
    """Return the time, s, in which the jerk of a joint reaches its acceleration; infinite: it has no jerk."""
    steepest = max((abs(phase.jerk) for phase in phases), default=0.0)
    largest = max((abs(phase.at(t)[2]) for phase in phases for t in (0.0, phase.duration)), default=0.0)
    return largest / steepest if steepest > 0.0 else np.inf


def _position_error(robot: Robot, joint: int, value: float, limit: float, text: str) -> JointPositionLimit:
    reached, most = distinct(value, limit)
    name = robot.joint_names[joint]
    return JointPositionLimit(
        f"{name} {text.format(reached)}; its position limit is {most}", joint=name, value=value, limit=limit
    )
