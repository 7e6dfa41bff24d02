"""Report of the tool's speed: where it keeps the requested speed, where it is slower, and which limit slows it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planner.guarantees import Guarantee
from planner.kinematics.forward import JointStates, tool_speeds
from planner.limits import JOINT_QUANTITIES
from planner.plans.result import Plan
from planner.spatial import FloatArray
from planner.trajectories.polynomials import differentiate, horner

HELD = 0.99
"""Fraction of the speed limit above which the speed counts as kept.

A weld seam or a bead of glue shows no difference of 1 %.
"""

TOOL_SAMPLES = 17
"""Number of samples of each piece of a trajectory, both ends included."""

SLOWEST_PART = 0.1
"""Fraction of the missing speed that defines the slowest samples of a part.

The limit that binds at these samples explains the part; elsewhere the limits of acceleration and deceleration bind.
"""

BINDS = 0.9
"""Fraction of a limit above which the limit counts as binding; back ends leave some reserve."""

DURATION = "duration"
"""The reason for a low speed if the segment has a requested duration and no limit binds."""

TIME_LAW = "time_law"
"""The reason for a low speed otherwise: the form of the back end's time scaling, such as a single cubic."""


@dataclass(frozen=True)
class SlowPart:
    """A part of a motion on which the tool goes slower than its speed limit.

    Attributes:
        start_time: Start of the part, s from the start of the trajectory.
        end_time: End of the part, s.
        start_distance: Distance travelled by the tool from the start of the motion to the start of the part, m.
        end_distance: The same to the end of the part, m.
        lowest_speed: The lowest speed of the part, m/s.
        quantity: The limit that binds where the tool is slowest: `velocity`, `acceleration`, `jerk`, `torque`,
            `tcp_angular_velocity`, or an acceleration or a jerk of the tool. `duration`: no limit binds and the request
            has a duration. `time_law`: neither; the form of the back end's time scaling.
        joint: Name of the joint that the limit belongs to; None: the limit is not one of a joint.
        use: The largest ratio to that limit; for `duration` and `time_law`, the largest ratio to any limit.
    """

    start_time: float
    end_time: float
    start_distance: float
    end_distance: float
    lowest_speed: float
    quantity: str
    joint: str | None
    use: float


@dataclass(frozen=True)
class ToolSpeedReport:
    """The speed of one tool motion, compared with its limit.

    Attributes:
        segment: Index of the segment.
        limit: The limit of the tool's speed there, m/s.
        held: The fraction of the path with a speed within 1 % of the limit.
        slow: The parts with a lower speed, in order.
    """

    segment: int
    limit: float
    held: float
    slow: tuple[SlowPart, ...]


def tool_speed_reports(plan: Plan) -> list[ToolSpeedReport]:
    """Report the speed of every tool motion with a speed limit: its slow parts and their reasons."""
    limits = plan.path.limits.magnitudes("tcp_linear_velocity")[:, 0]
    segments = [k for k, path in enumerate(plan.path.tool_motions) if path is not None and np.isfinite(limits[k])]
    moving = set(plan.path.moving.tolist())
    return [_report(plan, segment, float(limits[segment])) for segment in segments if segment in moving]


class _Samples(NamedTuple):
    """A motion at N times: s, joint positions and their derivatives (N, joints), speeds (N,), and distances (N,)."""

    times: FloatArray
    q: FloatArray
    v: FloatArray
    a: FloatArray
    j: FloatArray
    speeds: FloatArray
    distances: FloatArray

    def of(self, rows: np.ndarray) -> _Samples:
        return _Samples(*(values[rows] for values in self))


def _report(plan: Plan, segment: int, limit: float) -> ToolSpeedReport:
    samples = _sampled(plan, segment)
    slow = samples.speeds < HELD * limit
    steps = np.diff(samples.distances)
    edges = np.flatnonzero(np.diff(np.concatenate([[False], slow, [False]])))
    parts = tuple(
        _slow_part(plan, segment, limit, samples, first, last) for first, last in edges.reshape(-1, 2).tolist()
    )
    slow_way = float(steps[slow[:-1] & slow[1:]].sum())
    return ToolSpeedReport(segment, limit, 1.0 - slow_way / max(float(steps.sum()), np.finfo(float).tiny), parts)


def _sampled(plan: Plan, segment: int) -> _Samples:
    """Sample the motion of a segment, without the rests at its ends."""
    trajectory = plan.trajectory
    begins, ends = trajectory.departures[segment], trajectory.arrivals[segment + 1]
    middles = trajectory.breakpoints[:-1] + trajectory.lengths / 2.0
    rows = np.flatnonzero((middles > begins) & (middles < ends))
    since = np.linspace(0.0, 1.0, TOOL_SAMPLES) * trajectory.lengths[rows, None]
    q, v, a, j = (
        horner(differentiate(trajectory.coefficients[rows], order)[:, None], since[..., None]).reshape(since.size, -1)
        for order in range(4)
    )
    times = (trajectory.breakpoints[rows, None] + since).ravel()
    speeds, _ = tool_speeds(plan.path.dynamics.robot_on(segment), q, v)
    steps = np.diff(times) * (speeds[1:] + speeds[:-1]) / 2.0
    return _Samples(times, q, v, a, j, speeds, np.concatenate([[0.0], np.cumsum(steps)]))


def _slow_part(plan: Plan, segment: int, limit: float, samples: _Samples, first: int, last: int) -> SlowPart:
    """Return what there is to say of samples `first` to before `last`."""
    speeds = samples.speeds[first:last]
    lowest = float(speeds.min())
    rows = first + np.flatnonzero(speeds <= lowest + SLOWEST_PART * (limit - lowest))
    shares = {(quantity, joint): use for quantity, joint, use in _uses(plan, segment, samples.of(rows))}
    binds = min(BINDS, max(float(use.max()) for use in shares.values()))
    # Of several limits that are used up, in braking and in cruising, it is the one that is for the longest time.
    periods = np.gradient(samples.times)[rows]
    quantity, joint = max(shares, key=lambda one: float(periods @ (shares[one] >= binds)))
    use = float(shares[quantity, joint].max())
    if use < BINDS:
        requested = not np.isnan(plan.path.durations[segment])
        quantity, joint = DURATION if requested else TIME_LAW, None
    ends = [first, last - 1]
    (start, end), (gone, reached) = samples.times[ends].tolist(), samples.distances[ends].tolist()
    return SlowPart(start, end, gone, reached, lowest, quantity, joint, use)


def _uses(plan: Plan, segment: int, samples: _Samples) -> Iterator[tuple[str, str | None, FloatArray]]:
    """Yield each limit that is kept: its quantity, its joint, and the shares (N,) of it that samples use."""
    limits, names, dynamics = plan.path.limits, plan.path.robot.joint_names, plan.path.dynamics
    states = JointStates(dynamics.robot_on(segment), samples.q, samples.v, samples.a, samples.j)
    for quantity, limit in limits.of_tool.items():
        if quantity != "tcp_linear_velocity":
            yield quantity, None, states.tool_rate(quantity) / limit[segment]
    values = {"velocity": samples.v, "acceleration": samples.a, "jerk": samples.j}
    if dynamics.has_dynamics and np.isfinite(limits.torque.upper[segment]).any():
        segments = np.full(len(samples.times), segment)
        values["torque"] = dynamics.torques(segments, samples.q, samples.v, samples.a)
    for quantity in JOINT_QUANTITIES:
        if quantity in values and plan.backend.guarantees[quantity] is Guarantee.HARD:
            uses = limits.bounds(quantity).used(np.full(len(samples.times), segment), values[quantity])
            yield from ((quantity, name, uses[:, joint]) for joint, name in enumerate(names))
