"""The heaviest payload with which a trajectory keeps the torque limits of its robot."""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from planner.certificate import Check, certify
from planner.constraints import TORQUE, TORQUE_WITH_TOLERANCES
from planner.dynamics import heaviest_mass, inverse_dynamics
from planner.dynamics.inverse import check_dynamics
from planner.errors import InvalidProblem, LimitsUnsatisfiable
from planner.limits import SMALLEST, Limits, segment_limits
from planner.operations.certified import refuse_other_joints
from planner.plans.binding import BY_MASS
from planner.robots import Robot
from planner.robots.payload import Payload
from planner.trajectories.trajectory import Trajectory

ACCURACY = 1e-4
"""The largest difference between the mass and the heaviest one, relative to the mass."""

HEAVIER = 10.0 ** np.arange(10)
"""Masses, kg, that are tried one after the other where no torque limit bounds the mass."""

SAMPLES_OF_PIECE = 8
"""The times in each piece of a trajectory whose torques bound the mass from above."""


@dataclass(frozen=True)
class MaxPayload:
    """The heaviest payload with which a trajectory keeps the torque limits of its robot.

    Attributes:
        mass: Mass of the payload, kg, besides the present payload; None: no joint feels it.
        limited_by: The quantity whose limit bounds the mass, such as `torque` or `rms_torque`; `rating`, the rated
            payload of the robot; or None: nothing does.
        joint: Name of the joint with that limit; None: the limit belongs to no joint.
        time: The time at which it does, s; None: no limit of the motion does.
    """

    mass: float | None
    limited_by: str | None
    joint: str | None = None
    time: float | None = None


def max_payload(
    robot: Robot,
    trajectory: Trajectory,
    *,
    center_of_mass: tuple[float, float, float] = (0.0, 0.0, 0.0),
    center_of_mass_tolerance: tuple[float, float, float] = (0.0, 0.0, 0.0),
    inertia: tuple[float, float, float] = (0.0, 0.0, 0.0),
    inertia_tolerance: float = 0.0,
    limits: Limits = Limits(),
) -> MaxPayload:
    """Find the heaviest payload with which a trajectory keeps its torque limits.

    Torques are affine in the mass for a given centre of mass. A linear program in the mass over the torques at samples
    gives an upper bound. Below it, the certificate's largest share of a limit, between samples too, is a convex
    function of the mass. Its root is the answer. Limits by speed, of RMS torque and of power count, too, for centers of
    mass at the corners of the box.

    Args:
        robot: The robot, with its tool and present payload.
        trajectory: A trajectory of the robot.
        center_of_mass: Center of mass of the payload in the tip frame, m.
        center_of_mass_tolerance: Half the sizes (x, y, z), m, of a box about the centre of mass. The mass is carried
            with any centre of mass in it.
        inertia: Principal moments (ixx, iyy, izz) of the payload about its centre of mass, kg m^2, whatever its mass.
        inertia_tolerance: Largest difference of each moment from `inertia`, as a share of it.
        limits: Limits besides the robot's; the limits of torque, RMS torque and power count.

    Returns:
        The mass, accurate to 0.01 %, for which the certificate of the trajectory finds the torque limits kept.

    Raises:
        InvalidProblem: The robot has no torque limits, or another number of joints than the trajectory.
        LimitsUnsatisfiable: The trajectory breaks a torque limit without a payload.
        MissingDynamics: The robot has neither inertias nor a payload.
    """
    refuse_other_joints(robot, [trajectory])
    check_dynamics(robot)
    center, tolerance = np.array(center_of_mass), np.array(center_of_mass_tolerance)
    corners = np.unique(center + tolerance * np.array(list(product((-1.0, 1.0), repeat=3))), axis=0)
    bodies = [Payload(0.0, (x, y, z), inertia) for x, y, z in corners.tolist()]
    whole = Payload(0.0, center_of_mass, inertia, 0.0, center_of_mass_tolerance, inertia_tolerance)

    def worst(mass: float) -> Check:
        tried = [replace(body, mass=mass) for body in ([*bodies, whole] if whole.has_tolerances else bodies)]
        checks = [_heaviest_check(robot.with_payload(body), trajectory, limits) for body in tried]
        return max(checks, key=lambda check: check.ratio or 0.0)

    light = worst(0.0)
    if not light.satisfied:
        name = light.quantity.replace("_", " ") + (f" of {light.joint}" if light.joint else "")
        raise LimitsUnsatisfiable(
            f"the {name} is {light.peak:.6g} without a payload, beyond its limit {light.limit:.6g}",
            joint=light.joint,
            value=light.peak,
            limit=light.limit,
            time=light.time,
        )
    rating = np.inf if robot.rated_payload is None else max(robot.rated_payload - robot.payload_mass, 0.0)
    most = min(rating, *(_most_at_samples(robot, body, trajectory, limits) for body in bodies))
    if most == np.inf:
        heavier = (mass for mass in HEAVIER if not worst(mass).satisfied)
        most = next(heavier, np.inf)
    if most == np.inf:
        return MaxPayload(None, None)
    mass, heaviest = most, worst(most)
    if heaviest.satisfied and most == rating:
        return MaxPayload(most, "rating")
    if not heaviest.satisfied:
        from scipy.optimize import brentq  # here: no other operation needs it

        mass = brentq(lambda mass: (worst(mass).ratio or 0.0) - 1.0, 0.0, most, xtol=SMALLEST, rtol=0.1 * ACCURACY)
    while not (heaviest := worst(mass)).satisfied:
        mass *= 1.0 - 0.5 * ACCURACY
    limited_by = TORQUE.name if heaviest.quantity == TORQUE_WITH_TOLERANCES.name else heaviest.quantity
    return MaxPayload(mass, limited_by, heaviest.joint, heaviest.time)


def _heaviest_check(robot: Robot, trajectory: Trajectory, limits: Limits) -> Check:
    """Return the check with the largest share of a limit that depends on the payload.

    Raises:
        InvalidProblem: There is no such limit.
    """
    quantities = {*BY_MASS, TORQUE_WITH_TOLERANCES.name}
    if robot.payload_table is not None:
        quantities |= {"acceleration", "jerk"}
    certificate = certify(robot, trajectory, limits=limits, enforced=("torque",))
    checks = [own for own in certificate.checks if own.quantity in quantities and own.ratio is not None]
    if not checks:
        raise InvalidProblem([(("robot",), f"{robot.id} has no torque limits, and no others that a payload uses")])
    return max(checks, key=lambda check: check.ratio or 0.0)


def _most_at_samples(robot: Robot, body: Payload, trajectory: Trajectory, limits: Limits) -> float:
    """Return the largest mass, kg, with which the torques at samples keep their limits; infinite: they all do."""
    shares = (np.arange(SAMPLES_OF_PIECE) + 0.5) / SAMPLES_OF_PIECE
    times = (trajectory.breakpoints[:-1, None] + trajectory.lengths[:, None] * shares).ravel()
    states = trajectory.evaluate(times, [0, 1, 2])
    without, with_unit = (
        inverse_dynamics(robot.with_payload(replace(body, mass=mass)), *states) for mass in (0.0, 1.0)
    )
    return heaviest_mass(without, with_unit - without, *segment_limits(robot, limits, (None,)).bounds("torque"))
