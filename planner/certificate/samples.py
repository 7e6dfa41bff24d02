"""The certificate of samples of any origin."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.certificate.limits import certify
from planner.errors import InvalidProblem
from planner.guarantees import QUANTITIES, Guarantee
from planner.limits import segment_limits
from planner.polynomials import quintic_hermite
from planner.problem_check import limit_faults, refuse_unknown_torques
from planner.trajectory import Trajectory

if TYPE_CHECKING:
    from planner.certificate.checks import Certificate
    from planner.limits import Limits
    from planner.robots import Robot
    from planner.spatial import FloatArray


def certify_samples(
    robot: Robot,
    limits: Limits,
    time: FloatArray,
    position: FloatArray,
    velocity: FloatArray | None = None,
    acceleration: FloatArray | None = None,
) -> Certificate:
    """Check samples as a controller would run them.

    Between samples a controller interpolates (as ROS 2's joint trajectory controller does): by straight lines
    from positions alone, by cubics from positions and velocities, by quintics with accelerations too. That
    interpolation is checked exactly, up to the quantity that it makes continuous: from positions alone
    position and velocity are enforced, with velocities acceleration too, with accelerations jerk too.

    Args:
        robot: Its limits hold, narrowed by `limits`.
        limits: Asked by the caller.
        time: (N,), s, strictly increasing, N >= 2.
        position: (N, joints).
        velocity: (N, joints).
        acceleration: (N, joints); only with velocities.

    Raises:
        MissingDynamics: Torque limits are asked of a robot without inertias.
        InvalidProblem: Shapes that do not fit, times that do not increase, limits wider than the robot's.
    """
    faults = list(limit_faults(robot, limits, "/limits"))
    faults += _sample_faults(robot, time, position, velocity, acceleration)
    if faults:
        raise InvalidProblem(faults)
    refuse_unknown_torques(robot, (limits,))
    lengths = np.diff(time)
    coefficients = _hermite(lengths, position, velocity, acceleration)
    trajectory = Trajectory(
        lengths=lengths,
        coefficients=coefficients,
        segments=np.zeros(len(lengths), dtype=int),
        arrivals=time - time[0],
        departures=time - time[0],
    )
    given = 1 + (velocity is not None) + (acceleration is not None)
    reported = ("acceleration", "jerk")[given - 1 :]
    guarantees = {q: Guarantee.REPORTED if q in reported else Guarantee.HARD for q in QUANTITIES}
    return certify(trajectory, robot, segment_limits(robot, limits, (None,)), guarantees, position)


def _sample_faults(
    robot: Robot,
    time: FloatArray,
    position: FloatArray,
    velocity: FloatArray | None,
    acceleration: FloatArray | None,
) -> list[tuple[str, str]]:
    faults = []
    if len(time) < 2:
        faults.append(("/samples/time", "at least two samples are needed"))
    backwards = np.flatnonzero(np.diff(time) <= 0.0)
    if len(backwards):
        faults.append((f"/samples/time/{backwards[0] + 1}", "time must increase strictly"))
    for name, values in (("position", position), ("velocity", velocity), ("acceleration", acceleration)):
        if values is not None and values.shape != (len(time), robot.dof):
            shape = " x ".join(map(str, values.shape))
            message = f"{shape} values for {len(time)} times and the {robot.dof} joints of {robot.id}"
            faults.append((f"/samples/{name}", message))
    if acceleration is not None and velocity is None:
        faults.append(("/samples/acceleration", "accelerations need velocities beside them"))
    return faults


def _hermite(
    lengths: FloatArray, position: FloatArray, velocity: FloatArray | None, acceleration: FloatArray | None
) -> FloatArray:
    """(pieces, joints, order): the polynomials that meet the given derivatives at both ends of each piece."""
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
