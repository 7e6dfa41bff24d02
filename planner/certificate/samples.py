"""The certificate of samples of any origin, as a controller would run them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Literal, get_args

import numpy as np
from numpy.typing import ArrayLike

from planner.certificate.checks import Certificate
from planner.certificate.limits import certificate_of
from planner.errors import InvalidProblem
from planner.fields import FieldPath
from planner.guarantees import JERKS, QUANTITIES, TCP_ORDERS, EndStates, Guarantee
from planner.limits import Limits, limit_faults, segment_limits
from planner.problems.check import refuse_unknown_torques
from planner.robots import Robot
from planner.spatial import FloatArray
from planner.trajectories.polynomials import quintic_hermite
from planner.trajectories.trajectory import Trajectory

Interpolation = Literal["linear", "cubic", "quintic"]
"""The interpolation of a controller between samples: `linear` in position, `cubic` with velocities, `quintic` with
accelerations.

ROS 2's joint_trajectory_controller chooses it by the columns that it receives.
"""

LEAST_SAMPLE_PERIOD = 1e-20
"""The shortest time between two samples, s: times near 1 s differ by ten thousand times as much. The derivatives over
much shorter steps overflow."""

INTERPOLATIONS: tuple[Interpolation, ...] = get_args(Interpolation)
"""Every interpolation; each meets one column more than the one before."""

COLUMNS_OF: Mapping[Interpolation, int] = {
    interpolation: order for order, interpolation in enumerate(INTERPOLATIONS, 1)
}
"""The number of columns that each interpolation meets."""

REPORTED_OF: Mapping[Interpolation, frozenset[str]] = {
    "linear": frozenset({"acceleration", "jerk", "torque", *(name for name, order in TCP_ORDERS.items() if order > 1)}),
    "cubic": JERKS,
    "quintic": frozenset(),
}
"""The quantities with impulses where samples meet, so that no limit can be enforced.

Straight lines are continuous in position only, cubics also in velocity, quintics also in acceleration.
"""


def certify_samples(
    robot: Robot,
    time: ArrayLike,
    position: ArrayLike,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    limits: Limits = Limits(),
    *,
    interpolation: Interpolation | None = None,
    ends: EndStates | None = None,
) -> Certificate:
    """Check samples of any origin against the limits of a robot, as a controller would run them.

    The interpolation between samples is checked exactly, and enforced up to the quantity that it bounds. Straight lines
    must keep the limits of position and velocity, cubics also of acceleration and torque, quintics also of jerk. Speeds
    of the tool are always enforced.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        time: (N,), s, strictly increasing, N >= 2.
        position: (N, joints), rad or m.
        velocity: (N, joints), rad/s or m/s.
        acceleration: (N, joints), rad/s^2 or m/s^2; only with velocities.
        limits: Additional limits, no wider than the robot's.
        interpolation: The controller's interpolation; None: by the given columns, like ROS 2's
            joint_trajectory_controller.
        ends: The motion before the first sample and after the last; None: rest.

    Raises:
        MissingDynamics: The limits include torques, and the robot has no inertias.
        InvalidProblem: Shapes that do not fit, numbers that are not finite, times that do not increase, or limits wider
            than the robot's. Or the interpolation needs missing columns.
    """
    faults = list(limit_faults(robot, limits, ("limits",)))
    try:
        trajectory = interpolated(robot, time, position, velocity, acceleration, interpolation)
    except InvalidProblem as error:
        faults += error.faults
    if faults:
        raise InvalidProblem(faults)
    chosen = interpolation or interpolation_of(velocity is not None, acceleration is not None)
    return certify_interpolation(robot, trajectory, chosen, limits, ends)


def certify_interpolation(
    robot: Robot, trajectory: Trajectory, interpolation: Interpolation, limits: Limits, ends: EndStates | None = None
) -> Certificate:
    """Check `interpolated` samples; see `certify_samples`.

    Raises:
        InvalidProblem: The limits are wider than the robot's.
        MissingDynamics: The limits include torques, and the robot has no inertias.
    """
    if faults := list(limit_faults(robot, limits, ("limits",))):
        raise InvalidProblem(faults)
    refuse_unknown_torques(robot, (limits,))
    at_samples = replace(trajectory, arrivals=trajectory.breakpoints, departures=trajectory.breakpoints)
    met = trajectory.evaluate(trajectory.breakpoints, [0])[0]
    return certificate_of(
        at_samples, robot, segment_limits(robot, limits, (None,)), guarantees_of(interpolation), met, ends=ends
    )


def interpolated(
    robot: Robot,
    time: ArrayLike,
    position: ArrayLike,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    interpolation: Interpolation | None = None,
) -> Trajectory:
    """Convert samples of any origin to the trajectory of a controller through them, which begins at 0 s.

    Args:
        robot: The robot whose joints they are of.
        time: (N,), s, strictly increasing, N >= 2.
        position: (N, joints), rad or m.
        velocity: (N, joints), rad/s or m/s.
        acceleration: (N, joints), rad/s^2 or m/s^2; only with velocities.
        interpolation: The controller's interpolation; None: by the given columns, like ROS 2's
            joint_trajectory_controller.

    Raises:
        InvalidProblem: Shapes that do not fit, numbers that are none, times that do not increase, an interpolation that
            needs columns which are missing.
    """
    times, q = np.asarray(time, dtype=np.float64), np.asarray(position, dtype=np.float64)
    v, a = (None if rates is None else np.asarray(rates, dtype=np.float64) for rates in (velocity, acceleration))
    chosen = interpolation or interpolation_of(velocity is not None, acceleration is not None)
    columns = {"position": q, "velocity": v, "acceleration": a}
    missing = [name for name, values in [*columns.items()][: COLUMNS_OF[chosen]] if values is None]
    faults = _sample_faults(robot, times, q, v, a)
    faults += [(("interpolation",), f"{chosen} needs the column {name}") for name in missing]
    if faults:
        raise InvalidProblem(faults)
    lengths = np.diff(times)
    derivatives = [rates for rates in columns.values() if rates is not None]
    ends = np.array([0.0, lengths.sum()])
    return Trajectory(
        lengths=lengths,
        coefficients=interpolant(chosen, lengths, derivatives),
        segments=np.zeros(len(lengths), dtype=int),
        arrivals=ends,
        departures=ends,
    )


def interpolation_of(has_velocity: bool, has_acceleration: bool) -> Interpolation:
    """Return what ROS 2's joint_trajectory_controller runs from samples with these columns beside positions."""
    return INTERPOLATIONS[has_velocity + (has_velocity and has_acceleration)]


def guarantees_of(interpolation: Interpolation) -> dict[str, Guarantee]:
    """Return what an interpolation has to keep."""
    reported = REPORTED_OF[interpolation]
    return {q: Guarantee.REPORTED if q in reported else Guarantee.HARD for q in QUANTITIES}


def _sample_faults(
    robot: Robot,
    time: FloatArray,
    position: FloatArray,
    velocity: FloatArray | None,
    acceleration: FloatArray | None,
) -> list[tuple[FieldPath, str]]:
    faults: list[tuple[FieldPath, str]] = []
    if time.ndim != 1 or len(time) < 2:
        return [(("samples", "time"), "at least two samples are needed")]
    if not np.isfinite(time).all():
        faults.append((("samples", "time"), "must be finite numbers"))
    backwards = np.flatnonzero(np.diff(time) < LEAST_SAMPLE_PERIOD)
    if len(backwards):
        message = f"time must increase strictly, by {LEAST_SAMPLE_PERIOD:g} s at least"
        faults.append((("samples", "time", int(backwards[0]) + 1), message))
    for name, values in (("position", position), ("velocity", velocity), ("acceleration", acceleration)):
        if values is not None and values.shape != (len(time), robot.dof):
            shape = " x ".join(map(str, values.shape))
            message = f"{shape} values for {len(time)} times and the {robot.dof} joints of {robot.id}"
            faults.append((("samples", name), message))
        elif values is not None and not np.isfinite(values).all():
            faults.append((("samples", name), "must be finite numbers"))
    if acceleration is not None and velocity is None:
        faults.append((("samples", "acceleration"), "accelerations need velocities beside them"))
    return faults


def interpolant(interpolation: Interpolation, lengths: FloatArray, derivatives: Sequence[FloatArray]) -> FloatArray:
    """Return a controller's polynomials between samples: coefficients (N - 1, joints, order).

    Args:
        interpolation: The interpolation.
        lengths: (N - 1,), s.
        derivatives: The positions, velocities and accelerations at the samples, as many of them as the interpolation
            meets or more; each (N, joints).
    """
    h = lengths[:, None]
    starts = [values[:-1] for values in derivatives]
    ends = [values[1:] for values in derivatives]
    mean = (ends[0] - starts[0]) / h
    match interpolation:
        case "linear":
            return np.stack([starts[0], mean], axis=2)
        case "cubic":
            (p0, v0), v1 = starts[:2], ends[1]
            return np.stack([p0, v0, (3.0 * mean - 2.0 * v0 - v1) / h, (v0 + v1 - 2.0 * mean) / h**2], axis=2)
        case "quintic":
            return quintic_hermite(lengths, tuple(starts), tuple(ends))
