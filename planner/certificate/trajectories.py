"""The certificate of a trajectory of any origin."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike

from planner.certificate.checks import Certificate
from planner.certificate.limits import certificate_of, unless_missed
from planner.errors import InvalidProblem
from planner.guarantees import JERKS, QUANTITIES, EndStates, Guarantee
from planner.limits import Limits, limit_faults, segment_limits
from planner.problems.check import refuse_unknown_torques
from planner.robots import Robot
from planner.trajectories.trajectory import Trajectory


def certify(
    robot: Robot,
    trajectory: Trajectory,
    *,
    limits: Limits = Limits(),
    enforced: Collection[str] = QUANTITIES,
    positions: ArrayLike | None = None,
    ends: EndStates | None = None,
) -> Certificate:
    """Check a trajectory against the limits of a robot.

    A quantity that jumps has no bounded derivative. The jerk of a cubic cannot keep a limit, because its acceleration
    jumps at the ends, next to rest. Leave such a quantity out of `enforced`.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        trajectory: A trajectory from a plan, scaled, or made in any other way.
        limits: Additional limits, no wider than the robot's.
        enforced: The quantities of `QUANTITIES` whose limits decide whether the certificate is satisfied.
        positions: (waypoints, joints), required positions at the `arrivals`; None: not checked.
        ends: The motion before the trajectory and after it; None: rest.

    Raises:
        InvalidProblem: Another number of joints than the robot's, or limits wider than the robot's.
        MissingDynamics: The limits include torques of a robot whose torques are unknown.
        ValueError: An unknown quantity, positions of another shape, or coefficients that are no numbers.
    """
    if unknown := set(enforced) - set(QUANTITIES):
        raise ValueError(f"{', '.join(sorted(unknown))}: the quantities are {', '.join(QUANTITIES)}")
    if not (np.isfinite(trajectory.coefficients).all() and (trajectory.lengths > 0.0).all()):
        raise ValueError("the trajectory cannot be checked: not all of its coefficients are numbers, or a length is 0")
    faults = list(limit_faults(robot, limits, ("limits",)))
    joints = trajectory.coefficients.shape[1]
    if joints != robot.dof:
        faults.append((("trajectory",), f"{joints} joints, but {robot.id} has {robot.dof}"))
    if faults:
        raise InvalidProblem(faults)
    refuse_unknown_torques(robot, (limits,))
    met = trajectory.at_arrivals
    wanted = met if positions is None else np.asarray(positions, dtype=np.float64)
    if wanted.shape != met.shape:
        raise ValueError(f"positions of shape {wanted.shape}: {met.shape} are met at the arrivals")
    every_segment = segment_limits(robot, limits, (None,) * (int(trajectory.segments.max()) + 1))
    guarantees = {q: Guarantee.HARD if q in enforced else Guarantee.REPORTED for q in QUANTITIES}
    return unless_missed(certificate_of(trajectory, robot, every_segment, guarantees, wanted, ends=ends))


def certify_polynomials(
    robot: Robot, trajectory: Trajectory, *, limits: Limits = Limits(), ends: EndStates | None = None
) -> Certificate:
    """Check a trajectory of unknown origin against all limits; of jerk, if accelerations never jump.

    Args:
        robot: The robot, with its tool and payload; its limits hold, narrowed by `limits`.
        trajectory: Made in any way.
        limits: Additional limits, no wider than the robot's.
        ends: The motion before the trajectory and after it; None: rest.

    Raises:
        InvalidProblem: Another number of joints than the robot's, or limits wider than the robot's.
        MissingDynamics: The limits include torques of a robot whose torques are unknown.
        ValueError: Coefficients that are no numbers.
    """
    certificate = certify(robot, trajectory, limits=limits, ends=ends)
    checks = tuple(
        replace(check, enforced=False) if check.quantity in JERKS and not check.bounded else check
        for check in certificate.checks
    )
    satisfied = all(check.satisfied for check in checks if check.enforced)
    return replace(certificate, checks=checks, satisfied=satisfied)
