"""The certificate of samples of any origin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.certificate.limits import certificate_of
from planner.errors import InvalidProblem
from planner.guarantees import QUANTITIES, Guarantee
from planner.limits import Limits, segment_limits
from planner.polynomials import quintic_hermite
from planner.problem_check import limit_faults, refuse_unknown_torques
from planner.trajectory import Trajectory

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from planner.certificate.checks import Certificate
    from planner.fields import FieldPath
    from planner.robots import Robot
    from planner.spatial import FloatArray


def certify_samples(
    robot: Robot,
    time: ArrayLike,
    position: ArrayLike,
    velocity: ArrayLike | None = None,
    acceleration: ArrayLike | None = None,
    limits: Limits = Limits(),
) -> Certificate:
    """Check samples of any origin against the limits of a robot, as a controller would run them.

    Between samples a controller interpolates (as ROS 2's joint trajectory controller does): by straight lines
    from positions alone, by cubics from positions and velocities, by quintics with accelerations too. That
    interpolation is checked exactly, up to the quantity that it makes continuous: from positions alone
    position and velocity are enforced, with velocities acceleration too, with accelerations jerk too.

    Args:
        robot: With its tool and payload; its limits hold, narrowed by `limits`.
        time: (N,), s, strictly increasing, N >= 2.
        position: (N, joints), rad or m.
        velocity: (N, joints), rad/s or m/s.
        acceleration: (N, joints), rad/s^2 or m/s^2; only with velocities.
        limits: Limits that are asked besides, no wider than the robot's.

    Raises:
        MissingDynamics: Torque limits are asked of a robot without inertias.
        InvalidProblem: Shapes that do not fit, numbers that are none, times that do not increase, limits wider than
            the robot's.
    """
    times, q = np.asarray(time, dtype=np.float64), np.asarray(position, dtype=np.float64)
    v, a = (None if rates is None else np.asarray(rates, dtype=np.float64) for rates in (velocity, acceleration))
    faults = [*limit_faults(robot, limits, ("limits",)), *_sample_faults(robot, times, q, v, a)]
    if faults:
        raise InvalidProblem(faults)
    refuse_unknown_torques(robot, (limits,))
    lengths = np.diff(times)
    trajectory = Trajectory(
        lengths=lengths,
        coefficients=_hermite(lengths, q, v, a),
        segments=np.zeros(len(lengths), dtype=int),
        arrivals=times - times[0],
        departures=times - times[0],
    )
    given = 1 + (velocity is not None) + (acceleration is not None)
    reported = ("acceleration", "jerk")[given - 1 :]
    guarantees = {q: Guarantee.REPORTED if q in reported else Guarantee.HARD for q in QUANTITIES}
    return certificate_of(trajectory, robot, segment_limits(robot, limits, (None,)), guarantees, q)


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
        faults.append((("samples", "time"), "not all of them are numbers"))
    backwards = np.flatnonzero(np.diff(time) <= 0.0)
    if len(backwards):
        faults.append((("samples", "time", int(backwards[0]) + 1), "time must increase strictly"))
    for name, values in (("position", position), ("velocity", velocity), ("acceleration", acceleration)):
        if values is not None and values.shape != (len(time), robot.dof):
            shape = " x ".join(map(str, values.shape))
            message = f"{shape} values for {len(time)} times and the {robot.dof} joints of {robot.id}"
            faults.append((("samples", name), message))
        elif values is not None and not np.isfinite(values).all():
            faults.append((("samples", name), "not all of them are numbers"))
    if acceleration is not None and velocity is None:
        faults.append((("samples", "acceleration"), "accelerations need velocities beside them"))
    return faults


def _hermite(
    lengths: FloatArray, position: FloatArray, velocity: FloatArray | None, acceleration: FloatArray | None
) -> FloatArray:
    """Coefficients (pieces, joints, order) of polynomials that meet the derivatives given at the ends of each piece."""
    h = lengths[:, None]
    p0, step = position[:-1], np.diff(position, axis=0)
    if velocity is None:
        return np.stack([p0, step / h], axis=2)
    v0, v1 = velocity[:-1], velocity[1:]
    if acceleration is None:
        c2 = (3.0 * step / h - 2.0 * v0 - v1) / h
        c3 = (-2.0 * step / h + v0 + v1) / h**2
        return np.stack([p0, v0, c2, c3], axis=2)
    starts = position[:-1], velocity[:-1], acceleration[:-1]
    return quintic_hermite(lengths, starts, (position[1:], velocity[1:], acceleration[1:]))
