"""Binding checks name the fields that relax them: without these fields a limit is wider, without others the same."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from planner import (
    JointWaypoint,
    Limits,
    PayloadTable,
    PlanningProblem,
    Robot,
    VelocityCurves,
    VelocityTable,
    load_robot,
    plan,
)
from planner.fields import FieldPath, field_name
from planner.guarantees import TCP_ORDERS
from planner.limits import JOINT_QUANTITIES
from planner.robots.payload import Payload

TABLE = PayloadTable((1.0, 4.0), (0.9, 0.4), (0.8, 0.3))
"""A table that narrows limits of acceleration and jerk."""

NOT_COMPARED = ("further", "rms_torque", "cycle_time")
"""Fields of limits that do not affect any limit of a segment."""


def random_limits(rng: np.random.Generator, robot: Robot) -> Limits:
    """Return limits of random quantities, for all joints and by direction, and of the tool."""
    chosen: dict[str, Any] = {}
    for quantity in JOINT_QUANTITIES:
        share = rng.uniform(0.6, 1.0)
        own = robot.limit(quantity)
        if rng.random() < 0.3:
            chosen[quantity] = tuple((share * own).tolist())
        if quantity != "jerk" and rng.random() < 0.2:
            chosen[f"{quantity}_range"] = tuple((-0.8 * x, share * x) for x in own.tolist())
    if rng.random() < 0.3:
        chosen["velocity_scale"] = float(rng.uniform(0.4, 1.0))
    if rng.random() < 0.3:
        chosen["acceleration_scale"] = float(rng.uniform(0.4, 1.0))
    if rng.random() < 0.3:
        chosen["tcp_linear_velocity"] = float(rng.uniform(0.2, 0.8))
    if rng.random() < 0.2:
        chosen["total_power"] = float(rng.uniform(30.0, 90.0))
    return Limits(**chosen)


def random_problem(seed: int) -> PlanningProblem:
    """Return three motions of a UR5 with a payload, and limits of the whole and of waypoints."""
    rng, robot = np.random.default_rng(seed), load_robot("ur5e").derived(payload_table=TABLE)
    positions = rng.uniform(-1.2, 1.2, (4, 6))
    own = [random_limits(rng, robot) if i and rng.random() < 0.5 else None for i in range(4)]
    payloads = [Payload(float(rng.uniform(1.0, 3.0))) if i == 1 and rng.random() < 0.5 else None for i in range(4)]
    waypoints = [
        JointWaypoint(tuple(q.tolist()), limits=limits, payload=payload)
        for q, limits, payload in zip(positions, own, payloads, strict=True)
    ]
    return PlanningProblem(robot, waypoints, limits=random_limits(rng, robot), payload=Payload(2.0))


def without(limits: Limits | None, path: FieldPath, names: set[str], *, named: bool) -> Limits | None:
    """Return limits without the named fields, or without all others."""
    if limits is None:
        return None
    dropped = {
        field.name: field.default
        for field in fields(Limits)
        if field.name not in NOT_COMPARED and (field_name((*path, field.name)) in names) is named
    }
    return replace(limits, **dropped)


def changed(problem: PlanningProblem, names: set[str], *, named: bool) -> PlanningProblem:
    """Return the problem without the named fields, or without all others."""
    waypoints = [
        replace(w, limits=without(w.limits, ("waypoints", i, "limits"), names, named=named))
        for i, w in enumerate(problem.waypoints)
    ]
    robot = problem.robot
    if named:
        wider = {name: 10.0 for name in JOINT_QUANTITIES if f"robot.{name}" in names}
        robot = replace(
            robot,
            joints=tuple(
                replace(joint, **{name: by * getattr(joint, name) for name, by in wider.items()})
                for joint in robot.joints
            ),
        )
    if ("robot.payload_table" in names) is named:
        robot = replace(robot, payload_table=None)
    limits = without(problem.limits, ("limits",), names, named=named)
    return replace(problem, robot=robot, waypoints=waypoints, limits=limits)


def limit_of(problem: PlanningProblem, quantity: str, segment: int, joint: str | None, *, upper: bool) -> float:
    """Return the limit in force on a segment, in a direction."""
    limits = problem.segment_limits()
    if quantity == "total_power":
        return min((float(x[segment]) for own, x in limits.further.items() if own.name == quantity), default=np.inf)
    if quantity in TCP_ORDERS:
        return float(limits.magnitudes(quantity)[segment, 0])
    bounds = limits.bounds(quantity)
    side = bounds.upper if upper else -bounds.lower
    return float(side[segment, problem.robot.joint_names.index(joint or "")])


@pytest.mark.parametrize("seed", range(25))
def test_the_named_fields_and_no_others_set_the_limit(seed: int) -> None:
    problem = random_problem(seed)
    made = plan(problem, "ruckig" if seed % 2 else "toppra")
    binding = [check for check in made.certificate.checks if check.ratio is not None and check.ratio >= 0.99]
    assert binding
    for check in binding:
        if check.quantity == "position":
            continue
        assert check.segment is not None and check.relaxed_by and check.limit is not None
        names = set(check.relaxed_by)
        sides = [
            upper
            for upper in (True, False)
            if limit_of(problem, check.quantity, check.segment, check.joint, upper=upper)
            == pytest.approx(check.limit, rel=1e-6)
        ]
        assert sides, "the limit is the one in force on that segment"
        relaxed, same = changed(problem, names, named=True), changed(problem, names, named=False)
        where = check.quantity, check.segment, check.joint
        assert any(limit_of(relaxed, *where, upper=upper) > check.limit * 1.0001 for upper in sides)
        assert any(limit_of(same, *where, upper=upper) == pytest.approx(check.limit, rel=1e-6) for upper in sides)


def test_limits_by_position_of_the_robot_and_payloads_are_named() -> None:
    table = VelocityTable((0.0, 1.0), (0.5, 0.4))
    curves = {"shoulder_pan_joint": {"velocity_curves": VelocityCurves(upper=(table,))}}
    robot = load_robot("ur5e").derived(limits=curves, payload_table=TABLE)
    waypoints = [JointWaypoint((0.0,) * 6, payload=Payload(3.0)), JointWaypoint((1.0, 0.0, 0.0, 0.0, 0.0, 0.0))]
    made = plan(PlanningProblem(robot, waypoints, limits=Limits(velocity_scale=0.9)), "toppra")
    relaxed = {check.quantity: set(check.relaxed_by) for check in made.certificate.checks if check.relaxed_by}
    assert relaxed["velocity_at_position"] == {"robot.velocity_curves", "limits.velocity_scale"}
    assert relaxed["acceleration"] == {"robot.acceleration", "robot.payload_table", "waypoints[0].payload.mass"}


def test_checks_that_do_not_bind_name_nothing() -> None:
    made = plan(PlanningProblem(load_robot("ur5e"), [(0.0,) * 6, (0.1,) * 6], duration=9.0), "quintic")
    assert all(check.segment is None and not check.relaxed_by for check in made.certificate.checks)
    assert all("segment" not in check and "relaxed_by" not in check for check in made.certificate.as_dict()["checks"])
