"""The heaviest payload of a trajectory, against bisection by the certificate and dense torques by Pinocchio."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pinocchio as pin
import pytest

from planner.certificate import certify
from planner.errors import InvalidProblem, LimitsUnsatisfiable, MissingDynamics
from planner.limits import Limits
from planner.operations import MaxPayload, max_payload
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload, PayloadTable
from planner.robots.varying.torque_curves import TorqueCurve
from planner.trajectories.trajectory import Trajectory

RATED = load_robot("kuka_kr16_l6_2")
UNRATED = replace(RATED, rated_payload=None)
WAYPOINTS = [(0.0, -1.4, 1.5, 0.0, 0.6, 0.0), (0.6, -0.9, 1.2, 0.4, 0.9, 0.5), (0.2, -1.2, 1.4, 0.1, 0.5, 0.1)]
CENTER, TOLERANCE, INERTIA = (0.02, -0.03, 0.15), (0.04, 0.0, 0.06), (0.1, 0.2, 0.3)


def moved(backend: str, robot: Robot = UNRATED) -> Trajectory:
    return plan(PlanningProblem(robot, [JointWaypoint(q) for q in WAYPOINTS]), backend).trajectory


def torques(scale: float) -> Limits:
    return Limits(torque=tuple(scale * UNRATED.limit("torque")))


def carries(robot: Robot, trajectory: Trajectory, body: Payload, limits: Limits = Limits()) -> bool:
    checks = certify(robot.with_payload(body), trajectory, limits=limits, enforced=["torque"]).checks
    return next(check.satisfied for check in checks if check.quantity == "torque")


def by_bisection(robot: Robot, trajectory: Trajectory, bodies: list[Payload]) -> float:
    light, heavy = 0.0, 1e4
    while heavy - light > 1e-5 * heavy:
        middle = 0.5 * (light + heavy)
        if all(carries(robot, trajectory, replace(body, mass=middle)) for body in bodies):
            light = middle
        else:
            heavy = middle
    return light


def largest_share(robot: Robot, trajectory: Trajectory, body: Payload) -> float:
    """Return the largest share of a torque limit at dense samples, by Pinocchio's own algorithm."""
    model, joint = robot.model.copy(), robot.model.frames[robot.tip_frame_id]
    inertia = pin.Inertia(body.mass, np.array(body.center_of_mass), np.diag(body.inertia))
    model.appendBodyToJoint(joint.parentJoint, inertia, joint.placement)
    data, limit = model.createData(), robot.limit("torque")
    times = np.linspace(0.0, trajectory.duration, 3000)
    states = zip(*trajectory.evaluate(times, [0, 1, 2]), strict=True)
    return max(float((np.abs(pin.rnea(model, data, *state)) / limit).max()) for state in states)


@pytest.mark.parametrize("backend", ["quintic", "ruckig", "toppra", "trapezoidal"])
def test_the_mass_is_that_of_bisection_and_uses_the_whole_limit(backend: str) -> None:
    trajectory = moved(backend)
    found = max_payload(UNRATED, trajectory, center_of_mass=CENTER, inertia=INERTIA)
    assert found.mass is not None
    body = Payload(found.mass, CENTER, INERTIA)
    assert carries(UNRATED, trajectory, body)
    assert found.mass == pytest.approx(by_bisection(UNRATED, trajectory, [body]), rel=1e-3)
    assert largest_share(UNRATED, trajectory, body) == pytest.approx(1.0, abs=2e-3)
    assert found.limited_by == "torque"
    assert found.joint in UNRATED.joint_names
    assert found.time is not None
    assert 0.0 <= found.time <= trajectory.duration


def test_the_joint_that_holds_the_mass_still_is_named() -> None:
    """Far aside of the flange the wrist bears the mass, though without a payload the shoulder has the largest share."""
    count, position = np.zeros(1, dtype=int), np.array(WAYPOINTS[0])
    ends = np.array([0.0, 1.0])
    still = Trajectory(np.ones(1), position[None, :, None], count, ends, ends)
    found = max_payload(UNRATED, still, center_of_mass=(1.5, 0.0, 0.0))
    assert found.mass is not None
    robot = UNRATED.with_payload(Payload(found.mass, (1.5, 0.0, 0.0)))
    shares = [
        np.abs(pin.computeGeneralizedGravity(arm.model, arm.model.createData(), position)) / arm.limit("torque")
        for arm in (UNRATED, robot)
    ]
    without, held = (UNRATED.joint_names[int(share.argmax())] for share in shares)
    assert found.joint == held != without
    assert shares[1].max() == pytest.approx(1.0, abs=1e-6)


def test_any_center_of_mass_within_the_tolerance_is_carried() -> None:
    trajectory = moved("quintic")
    found = max_payload(UNRATED, trajectory, center_of_mass=CENTER, center_of_mass_tolerance=TOLERANCE)
    assert found.mass is not None
    corners = [tuple(np.array(CENTER) + signs * np.array(TOLERANCE)) for signs in product((-1, 1), repeat=3)]
    assert found.mass == pytest.approx(
        by_bisection(UNRATED, trajectory, [Payload(1.0, corner) for corner in corners]), rel=1e-3
    )
    inside = np.random.default_rng(1).uniform(-1.0, 1.0, (20, 3)) * TOLERANCE + CENTER
    assert all(carries(UNRATED, trajectory, Payload(found.mass, tuple(center))) for center in inside.tolist())
    exact = max_payload(UNRATED, trajectory, center_of_mass=CENTER).mass
    assert exact is not None
    assert found.mass < exact


@pytest.mark.large_only
def test_the_mass_is_carried_with_all_tolerances_and_is_that_of_bisection() -> None:
    trajectory = moved("quintic")
    whole = Payload(0.0, CENTER, INERTIA, 0.0, (0.04, 0.05, 0.06), 0.3)
    found = max_payload(
        UNRATED,
        trajectory,
        center_of_mass=CENTER,
        center_of_mass_tolerance=whole.center_of_mass_tolerance,
        inertia=INERTIA,
        inertia_tolerance=0.3,
    )
    assert found.mass is not None
    assert found.limited_by == "torque"

    def carries_all(mass: float) -> bool:
        checks = certify(UNRATED.with_payload(replace(whole, mass=mass)), trajectory, enforced=["torque"]).checks
        return next(check.satisfied for check in checks if check.quantity == "torque_with_tolerances")

    light, heavy = 0.0, 1e3
    while heavy - light > 1e-5 * heavy:
        middle = 0.5 * (light + heavy)
        light, heavy = (middle, heavy) if carries_all(middle) else (light, middle)
    assert found.mass == pytest.approx(light, rel=1e-3)
    rng, shares = np.random.default_rng(2), []
    for ends in [*product((-1.0, 1.0), repeat=3), *rng.uniform(-1.0, 1.0, (20, 3)).tolist()]:
        center = np.array(CENTER) + np.array(ends) * whole.center_of_mass_tolerance
        moments = np.array(INERTIA) * (1.0 + 0.3 * rng.choice((-1.0, 1.0), 3))
        body = Payload(found.mass, tuple(center.tolist()), tuple(moments.tolist()))
        shares.append(largest_share(UNRATED, trajectory, body))
    assert max(shares) <= 1.0 + 1e-6
    assert max(shares) == pytest.approx(1.0, abs=0.02)


def test_the_rating_limits_a_slow_motion() -> None:
    slow = moved("quintic", RATED).scaled(5.0)
    assert max_payload(RATED, slow) == MaxPayload(6.0, "rating")
    assert max_payload(RATED.with_payload(Payload(4.0)), slow) == MaxPayload(2.0, "rating")


def test_limits_of_the_request_narrow_those_of_the_robot() -> None:
    trajectory = moved("quintic").scaled(5.0)
    narrow = torques(0.6)
    found, wide = max_payload(UNRATED, trajectory, limits=narrow).mass, max_payload(UNRATED, trajectory).mass
    assert found is not None
    assert wide is not None
    assert found < wide
    assert carries(UNRATED, trajectory, Payload(found), narrow)
    assert not carries(UNRATED, trajectory, Payload(1.001 * found), narrow)


WEAKER = {joint.name: TorqueCurve((0.0, 2.0), (joint.torque, 0.45 * joint.torque)) for joint in UNRATED.joints}
GENTLER = PayloadTable((1.0, 20.0), (1.0, 0.2))
OTHER_LIMITS: dict[str, tuple[Robot, Limits]] = {
    "torque_at_speed": (UNRATED.derived(limits={k: {"torque_curve": curve} for k, curve in WEAKER.items()}), Limits()),
    "power": (UNRATED, Limits(power=(900.0,) * 6)),
    "total_power": (UNRATED, Limits(total_power=800.0)),
    "rms_torque": (UNRATED, Limits(rms_torque=tuple(0.45 * UNRATED.limit("torque")))),
    "acceleration": (UNRATED.derived(payload_table=GENTLER), Limits()),
}
"""Robots and limits by the quantity that limits the mass of a slow motion."""


@pytest.mark.parametrize("quantity", OTHER_LIMITS)
def test_other_limits_that_depend_on_the_payload_bound_the_mass(quantity: str) -> None:
    (robot, limits), trajectory = OTHER_LIMITS[quantity], moved("quintic").scaled(1.6)
    found = max_payload(robot, trajectory, limits=limits)
    assert found.limited_by == quantity and found.mass is not None
    assert found.mass < 0.99 * (max_payload(UNRATED, trajectory).mass or 0.0)

    def keeps(mass: float) -> bool:
        checks = certify(robot.with_payload(Payload(mass)), trajectory, limits=limits).checks
        return all(check.satisfied for check in checks if check.quantity == quantity)

    assert keeps(found.mass) and not keeps(1.001 * found.mass)


def test_a_trajectory_too_fast_without_a_payload_is_refused() -> None:
    with pytest.raises(LimitsUnsatisfiable, match="without a payload, beyond its limit"):
        max_payload(UNRATED, moved("quintic"), limits=torques(0.05))


def test_robots_without_inertias_or_torque_limits_are_refused() -> None:
    arm = load_robot("three_dof_arm")
    still = plan(PlanningProblem(arm, [JointWaypoint((0.1, 0.2, 0.3)), JointWaypoint((0.3, 0.1, 0.5))])).trajectory
    with pytest.raises(MissingDynamics):
        max_payload(arm, still)
    with pytest.raises(InvalidProblem, match="joints, but"):
        max_payload(UNRATED, still)
    unlimited = replace(UNRATED, joints=tuple(replace(joint, torque=np.inf) for joint in UNRATED.joints))
    with pytest.raises(InvalidProblem, match="has no torque limits"):
        max_payload(unlimited, moved("quintic"))
