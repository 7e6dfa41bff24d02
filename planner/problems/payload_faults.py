"""Faults of payloads and of their tolerances, and the refusal of payloads that exceed the rating of the robot."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import numpy as np

from planner.errors import PayloadExceeded, Remedy, distinct
from planner.fields import FieldPath
from planner.kinematics.forward import CENTRIPETAL
from planner.limits import SMALLEST, TOO_SMALL, Limits
from planner.problems.problem import PlanningProblem
from planner.robots import Robot
from planner.robots.payload import Payload
from planner.tolerances import LIMIT_TOLERANCE

ALONE = "must be left out with {sets}: they do not count in it"
"""The message of a fault where a limit would hold for the given values alone."""

GIVEN_TORQUES = ("power", "total_power", "rms_torque")
"""The limits of quantities that count the given payload, friction and positions alone."""


def payload_faults(payload: Payload, field: FieldPath) -> Iterator[tuple[FieldPath, str]]:
    """Find a mass that is too small, and tolerances with which the payload would be no body."""
    if not payload.mass >= SMALLEST:
        yield (*field, "mass"), TOO_SMALL
    if not 0.0 <= payload.mass_tolerance <= payload.mass:
        text = f"must be from 0 to the mass, {payload.mass:g} kg; got {payload.mass_tolerance:g}"
        yield (*field, "mass_tolerance"), text
    for i, reach in enumerate(payload.center_of_mass_tolerance):
        if not 0.0 <= reach < np.inf:
            yield (*field, "center_of_mass_tolerance", i), f"must be finite and not negative; got {reach:g}"
    if not 0.0 <= payload.inertia_tolerance <= 1.0:
        yield (*field, "inertia_tolerance"), f"must be from 0 to 1; got {payload.inertia_tolerance:g}"


def tolerance_faults(problem: PlanningProblem) -> Iterator[tuple[FieldPath, str]]:
    """Find limits beside tolerances and following errors that would hold for the given values alone."""
    robot = problem.robot
    carried = any(payload.has_tolerances for payload in (problem.payload, *problem.payloads) if payload is not None)
    sets = ["payload tolerances"] * bool(carried or robot.uncertain_payloads)
    sets += ["friction tolerances"] * (robot.friction_tolerance is not None)
    sets += ["following errors"] * (robot.following_errors is not None)
    if not sets:
        return
    named = " and ".join(sets)
    given = (*GIVEN_TORQUES, *([CENTRIPETAL] if robot.following_errors is not None else ()))
    at_waypoints = ((("waypoints", i, "limits"), waypoint.limits) for i, waypoint in enumerate(problem.waypoints))
    requested: list[tuple[FieldPath, Limits | None]] = [(("limits",), problem.limits), *at_waypoints]
    for field, limits in requested:
        limited = [name for name in given if getattr(limits, name, None) is not None]
        yield from (((*field, name), ALONE.format(sets=named)) for name in limited)
    if robot.torque_curves is not None or np.isfinite(robot.limit("rms_torque")).any():
        text = f"must have no torque curves and no RMS torque limits with {named}: they do not count there"
        yield ("robot",), f"{text}; got {robot.id}"


def refuse_payload_above_rating(robot: Robot, mass: float, waypoint: int = 0, remedies: Iterable[Remedy] = ()) -> None:
    """Refuse a payload that exceeds the rated payload of its robot.

    Args:
        robot: The robot; one without a known rating carries any payload.
        mass: Mass of everything that the robot carries, kg.
        waypoint: Index of the waypoint where the robot takes the payload.
        remedies: Lighter payloads.

    Raises:
        PayloadExceeded: With the mass and the rated mass, kg.
    """
    rated = robot.rated_payload
    if rated is None or mass <= rated * (1.0 + LIMIT_TOLERANCE):
        return
    carried, allowed = distinct(mass, rated)
    since = " from waypoint {waypoint} on" if waypoint else ""
    source = robot.rated_payload_source
    raise PayloadExceeded(
        f"the payload of {carried} kg{since} exceeds the rated {allowed} kg of {robot.id} ({source})",
        waypoint=waypoint or None,
        value=mass,
        limit=rated,
        remedies=remedies,
    )
