"""The limits that bind in a certificate: the segment, and the fields of request and robot that would relax them."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from planner.certificate.checks import Certificate, Check
from planner.fields import FieldPath, field_name, moved_path
from planner.guarantees import TCP_ORDERS
from planner.limits import JOINT_QUANTITIES, Limits
from planner.problems.any_of import requested_paths
from planner.problems.problem import PlanningProblem
from planner.robots.description import RANGED_QUANTITIES
from planner.trajectories.trajectory import Trajectory

BINDING = 0.99
"""Least used share of a limit that binds."""

AGREES = 1e-6
"""Relative amount by which a limit of a check may differ from the limit that a field sets."""

RATES_AT_SPEED = ("acceleration_at_speed", "jerk_at_speed")
"""Quantities whose limits the payload table sets by the speeds of joints."""

BY_MASS = ("torque", "torque_at_speed", "power", "total_power", "rms_torque", *RATES_AT_SPEED)
"""Quantities that are smaller with a lighter payload."""

OF_ROBOT = {
    "position": ("position",),
    "velocity_at_position": ("velocity_curves",),
    "torque_at_speed": ("torque_curve",),
    "rms_torque": ("rms_torque",),
    **dict.fromkeys(RATES_AT_SPEED, ("payload_table",)),
}
"""Fields of a robot that alone set limits of quantities."""


def with_binding_limits(certificate: Certificate, problem: PlanningProblem, trajectory: Trajectory) -> Certificate:
    """Return a certificate whose binding checks have their segment and the fields that would relax the limit."""
    checks = tuple(_with_fields(check, problem, trajectory) for check in certificate.checks)
    return replace(certificate, checks=checks)


def _with_fields(check: Check, problem: PlanningProblem, trajectory: Trajectory) -> Check:
    """Return a check with its segment and fields if it binds."""
    if check.ratio is None or check.limit is None or check.ratio < BINDING or len(problem.waypoints) < 2:
        return check
    margin = AGREES * trajectory.duration
    times = np.clip(check.time + np.array([0.0, -margin, margin]), 0.0, trajectory.duration)
    segments = dict.fromkeys(trajectory.segments[trajectory.locate(times)[0]].tolist())
    for segment in segments:  # a peak where two segments meet belongs to the one with this limit
        fields = tuple(dict.fromkeys(_fields(check, problem, segment)))
        if fields:
            paths = requested_paths(problem)
            names = tuple(field_name(moved_path(field, paths)) for field in fields)
            return replace(check, segment=int(paths[segment + 1][1]) - 1, relaxed_by=names)
    return check


def _fields(check: Check, problem: PlanningProblem, segment: int) -> Iterator[FieldPath]:
    """Yield the fields that set the limit of a check on a segment; none if they set another one."""
    robot, quantity = problem.robot, check.quantity.removesuffix("_with_tolerances")
    limit = check.limit or 0.0
    joint = None if check.joint is None else robot.joint_names.index(check.joint)
    requested = [
        (("limits",), problem.limits),
        (("waypoints", segment + 1, "limits"), problem.waypoints[segment + 1].limits),
    ]
    given: list[tuple[FieldPath, Limits]] = [(field, own) for field, own in requested if own is not None]
    found: list[FieldPath] = []
    if quantity in JOINT_QUANTITIES and joint is not None:
        for side in (0, 1):
            found = found or list(_of_joint(problem, given, segment, quantity, joint, side, limit))
    elif quantity in OF_ROBOT:
        found = [("robot", *OF_ROBOT[quantity])]
        if quantity == "velocity_at_position":
            found += [(*field, "velocity_scale") for field, own in given if own.velocity_scale < 1.0]
        if quantity in ("torque_at_speed", "acceleration_at_speed"):
            scale = f"{quantity.removesuffix('_at_speed')}_scale"
            found += [(*field, scale) for field, own in given if getattr(own, scale) < 1.0]
    if quantity in (*TCP_ORDERS, "power", "total_power", "rms_torque"):
        for field, own in given:
            value = getattr(own, quantity)
            if value is not None and abs((value[joint] if joint is not None else value) - limit) <= AGREES * limit:
                found = [*(found if quantity != "rms_torque" else []), (*field, quantity)]
        if quantity == "rms_torque":
            found.append(("limits", "cycle_time"))
    if found and quantity in BY_MASS:
        found += _payload_of(problem, segment)
    yield from found


def _of_joint(
    problem: PlanningProblem,
    given: list[tuple[FieldPath, Limits]],
    segment: int,
    quantity: str,
    joint: int,
    side: int,
    limit: float,
) -> Iterator[FieldPath]:
    """Yield the fields that set the limit of a joint in a direction; none if they set another one."""
    robot, table, carried = problem.robot, problem.robot.payload_table, problem.payloads[segment]
    mass = robot.payload_mass + (0.0 if carried is None else carried.largest_mass)
    factor = 1.0 if table is None else table.factor(quantity, mass)
    own = robot.bounds(quantity)[side, joint]
    values: dict[FieldPath, float] = {("robot", quantity): abs(float(own)) * factor}
    scale, scales = 1.0, list[FieldPath]()
    for field, limits in given:
        alike, by_direction = getattr(limits, quantity), getattr(limits, f"{quantity}_range", None)
        if alike is not None:
            values[*field, quantity] = alike[joint]
        if by_direction is not None and quantity in RANGED_QUANTITIES:
            values[*field, f"{quantity}_range"] = abs(by_direction[joint][side])
        if (own_scale := getattr(limits, f"{quantity}_scale", 1.0)) < 1.0:
            scale, scales = scale * own_scale, [*scales, (*field, f"{quantity}_scale")]
    least = min(values.values())
    if not abs(least * scale - limit) <= AGREES * limit:
        return
    setting = [field for field, value in values.items() if value <= least * (1.0 + AGREES)]
    yield from setting
    yield from scales
    if factor < 1.0 and ("robot", quantity) in setting:
        yield "robot", "payload_table"
        yield from _payload_of(problem, segment)


def _payload_of(problem: PlanningProblem, segment: int) -> list[FieldPath]:
    """Return the field of the payload on a segment, if there is one."""
    carried = problem.payloads[segment]
    if carried is None:
        return []
    for waypoint in range(segment, -1, -1):
        if problem.waypoints[waypoint].payload is carried:
            return [("waypoints", waypoint, "payload", "mass")]
    return [("payload", "mass")]
