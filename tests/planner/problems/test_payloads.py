"""Payloads that are picked up and put down on the path, against Pinocchio with the body added to its model."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

from planner.backends import BACKENDS, Quintic
from planner.comparison import figures
from planner.errors import InvalidProblem, LimitsUnsatisfiable, MissingDynamics, PlanningError
from planner.kinematics import FloatArray
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.problems.moves import CartesianMove
from planner.problems.problem import AnyWaypoint, JointWaypoint, LinearMotion, PlanningProblem, RelativeWaypoint
from planner.problems.transitions import BlendTransition, ThroughTransition
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload
from tests.planner.problems_of_tests import ARMS_OF, backend_of

ROBOT = replace(load_robot("kuka_kr16_l6_2"), rated_payload=None)
HOME, ABOVE = (0.0, -1.4, 1.5, 0.0, 0.6, 0.0), (0.8, -0.9, 1.3, 0.2, 0.5, 0.3)
LIGHT, HEAVY = Payload(2.0, (0.0, 0.02, 0.05), (0.01, 0.01, 0.02)), Payload(9.0, (0.05, 0.0, 0.12), (0.08, 0.07, 0.05))
BACK_ENDS = list(BACKENDS)
SHOULDER = 1


def move(z: float, **more: object) -> RelativeWaypoint:
    step = CartesianMove((0.0, 0.0, z))
    return RelativeWaypoint(move=step, frame="base", motion=LinearMotion(), **more)  # type: ignore[arg-type]


def pick_and_place() -> tuple[AnyWaypoint, ...]:
    """Return waypoints that pick a part up, blend over to its place and put it down; payloads as in `CARRIED`."""
    return (
        JointWaypoint(HOME),
        JointWaypoint(ABOVE, transition=BlendTransition(0.03)),
        move(-0.15, payload=HEAVY, dwell=0.3),
        move(0.15, transition=BlendTransition(0.03)),
        JointWaypoint(HOME, transition=ThroughTransition()),
        JointWaypoint((-0.7, -1.0, 1.4, 0.1, 0.5, 0.0), payload=LIGHT),
        JointWaypoint((-0.7, -1.2, 1.4, 0.1, 0.5, 0.0), put_down=True),
        JointWaypoint(HOME),
    )


CARRIED = (None, None, HEAVY, HEAVY, HEAVY, LIGHT, None)
"""The payload on each segment of `pick_and_place`."""


def loaded_model(robot: Robot, payload: Payload | None) -> pin.Model:
    """Return the model with a payload fixed to its flange, as Pinocchio's examples do."""
    model = robot.model.copy()
    if payload is not None:
        flange = model.frames[model.getFrameId(robot.tip_frame)]
        rotational = np.diag(payload.inertia)
        body = pin.Inertia(payload.mass, np.array(payload.center_of_mass), rotational)
        model.appendBodyToJoint(flange.parentJoint, body, flange.placement)
    return model


def torques(plan: Plan, carried: tuple[Payload | None, ...], count: int) -> tuple[FloatArray, FloatArray, np.ndarray]:
    """Compute times (N,), torques (N, joints) by `pin.rnea` and segment numbers (N,).

    The times lie evenly on each segment, its ends just inside.
    """
    rows: list[FloatArray] = []
    times: list[FloatArray] = []
    segments: list[int] = []
    trajectory = plan.trajectory
    for segment, payload in enumerate(carried):
        model = loaded_model(plan.problem.robot, payload)
        data = model.createData()
        own = np.linspace(trajectory.departures[segment] + 1e-9, trajectory.arrivals[segment + 1] - 1e-9, count)
        states = trajectory.evaluate(own)
        rows += [pin.rnea(model, data, *state) for state in zip(*states, strict=True)]
        times.append(own)
        segments += [segment] * count
    return np.concatenate(times), np.array(rows), np.array(segments)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", BACK_ENDS)
def test_torque_limits_are_kept_with_what_is_carried(kind: str) -> None:
    """The limits bind with the heavy part, and would be broken if the part were forgotten."""
    limit = np.array(ROBOT.limit("torque"))
    limit[1:3] *= 0.22
    problem = PlanningProblem(ROBOT, pick_and_place(), Limits(torque=tuple(limit.tolist())))
    planned = plan(problem, backend_of(kind))
    _, used, segments = torques(planned, CARRIED, 400)
    share = np.abs(used) / limit
    assert share.max() <= 1.0 + 1e-6
    (check,) = (check for check in planned.certificate.checks if check.quantity == "torque")
    assert check.ratio == pytest.approx(share.max(), rel=2e-3)
    empty = replace(
        problem, waypoints=[replace(waypoint, payload=None, put_down=False) for waypoint in problem.waypoints]
    )
    forgotten = plan(empty, backend_of(kind))
    broken = np.abs(torques(forgotten, CARRIED, 400)[1]) / limit
    assert broken[(segments >= 2) & (segments <= 4)].max() > 1.0
    assert planned.trajectory.duration > forgotten.trajectory.duration


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["cubic", "ruckig", "toppra", "min_effort"])
def test_the_torques_of_the_samples_are_those_of_what_is_carried(kind: str) -> None:
    planned = plan(PlanningProblem(ROBOT, pick_and_place(), payload=LIGHT), backend_of(kind))
    rows = planned.samples(0.01, ["torque"])
    assert rows.torque is not None
    carried = (LIGHT, LIGHT, *CARRIED[2:])
    for segment, payload in enumerate(carried):
        model = loaded_model(ROBOT, payload)
        data = model.createData()
        for i in np.flatnonzero(rows.segment == segment):
            expected = pin.rnea(model, data, rows.position[i], rows.velocity[i], rows.acceleration[i])
            assert rows.torque[i] == pytest.approx(expected, abs=1e-9)


def test_the_effort_is_that_of_what_is_carried() -> None:
    planned = plan(PlanningProblem(ROBOT, pick_and_place()))
    times, used, segments = torques(planned, CARRIED, 2001)
    effort = sum(
        np.trapezoid(((used / ROBOT.limit("torque")) ** 2).sum(axis=1)[segments == k], times[segments == k])
        for k in range(len(CARRIED))
    )
    rest = loaded_model(ROBOT, None)  # in the dwell the gripper closes at its end, as samples have it
    held = pin.rnea(rest, rest.createData(), planned.path.positions[2], np.zeros(6), np.zeros(6))
    effort += 0.3 * ((held / ROBOT.limit("torque")) ** 2).sum()
    assert figures(planned).effort == pytest.approx(effort, rel=1e-3)


@pytest.mark.large_only
def test_least_effort_is_found_for_each_payload() -> None:
    """Of two equal moves, the one with the part is the same as in a problem of its own."""
    there = JointWaypoint(ABOVE)
    back_and_forth = (JointWaypoint(HOME), there, JointWaypoint(HOME, payload=HEAVY), replace(there, duration=None))
    planned = plan(PlanningProblem(ROBOT, back_and_forth), backend_of("min_effort"))
    loaded = plan(PlanningProblem(ROBOT, back_and_forth[2:]), backend_of("min_effort"))
    own = planned.trajectory.segments == 2
    assert planned.trajectory.lengths[own] == pytest.approx(loaded.trajectory.lengths, rel=1e-6)
    assert planned.trajectory.coefficients[own] == pytest.approx(loaded.trajectory.coefficients, rel=1e-4, abs=1e-4)


@pytest.mark.long_table
@pytest.mark.parametrize("kind", BACK_ENDS)
def test_one_payload_from_the_first_waypoint_on_is_that_of_the_problem(kind: str) -> None:
    waypoints = (JointWaypoint(HOME), JointWaypoint(ABOVE), JointWaypoint(HOME))
    of_problem = plan(PlanningProblem(ROBOT, waypoints, payload=HEAVY), backend_of(kind))
    for changed in (
        PlanningProblem(ROBOT, (replace(waypoints[0], payload=HEAVY), *waypoints[1:])),
        PlanningProblem(ROBOT, (replace(waypoints[0], payload=HEAVY), *waypoints[1:]), payload=LIGHT),
    ):
        found = plan(changed, backend_of(kind))
        assert found.trajectory.coefficients.tobytes() == of_problem.trajectory.coefficients.tobytes()
        unnamed = ([replace(check, relaxed_by=()) for check in made.certificate.checks] for made in (found, of_problem))
        assert next(unnamed) == next(unnamed)


def test_what_is_carried_is_held_in_the_dwell_by_both() -> None:
    """The arm reaches out without a part, and cannot hold the part that it picks there at any speed."""
    out = (0.0, -0.2, 0.3, 0.0, 0.2, 0.0)
    gravity = [
        abs(pin.computeGeneralizedGravity(model, model.createData(), np.array(out))[SHOULDER])
        for model in (loaded_model(ROBOT, None), loaded_model(ROBOT, HEAVY))
    ]
    limit = list(ROBOT.limit("torque"))
    limit[SHOULDER] = 0.5 * sum(gravity)
    assert gravity[0] < limit[SHOULDER] < gravity[1]
    limits = Limits(torque=tuple(limit), acceleration_scale=0.01)
    free = (JointWaypoint(HOME), JointWaypoint(out))
    assert plan(PlanningProblem(ROBOT, free, limits)).certificate.satisfied
    for waypoints in (
        (free[0], replace(free[1], payload=HEAVY)),  # at the last waypoint no motion comes after it
        (free[0], replace(free[1], payload=HEAVY, dwell=1.0), JointWaypoint(HOME)),
        (replace(free[1], payload=HEAVY), replace(free[0], put_down=True)),
    ):
        for kind in ("cubic", "toppra", "ruckig"):
            with pytest.raises(LimitsUnsatisfiable) as refusal:
                plan(PlanningProblem(ROBOT, waypoints, limits), backend_of(kind))
            assert refusal.value.joint == ROBOT.joint_names[SHOULDER]


def test_a_lighter_part_is_a_remedy_at_its_waypoint() -> None:
    out = (0.0, -0.2, 0.3, 0.0, 0.2, 0.0)
    gravity = [
        abs(pin.computeGeneralizedGravity(model, model.createData(), np.array(out))[SHOULDER])
        for model in (loaded_model(ROBOT, None), loaded_model(ROBOT, HEAVY))
    ]
    limit = list(ROBOT.limit("torque"))
    limit[SHOULDER] = 0.5 * sum(gravity)
    waypoints = (JointWaypoint(HOME), JointWaypoint(ABOVE, payload=HEAVY), JointWaypoint(out))
    problem = PlanningProblem(ROBOT, waypoints, Limits(torque=tuple(limit)), payload=LIGHT)
    with pytest.raises(LimitsUnsatisfiable) as refusal:
        plan(problem, Quintic())
    lighter = [remedy for remedy in refusal.value.remedies if remedy.field == ("waypoints", 1, "payload", "mass")]
    assert len(lighter) == 1
    assert 0.3 * HEAVY.mass < lighter[0].value < 0.5 * HEAVY.mass
    assert plan(lighter[0].applied_to(problem), Quintic()).certificate.satisfied


@pytest.mark.parametrize("transition", [ThroughTransition(), BlendTransition(0.05)])
def test_a_payload_changes_only_where_the_robot_stops(transition: ThroughTransition | BlendTransition) -> None:
    waypoints = (JointWaypoint(HOME), JointWaypoint(ABOVE, transition=transition, payload=HEAVY), JointWaypoint(HOME))
    with pytest.raises(InvalidProblem, match="stops") as refusal:
        plan(PlanningProblem(ROBOT, waypoints))
    assert refusal.value.faults[0].field == ("waypoints", 1, "transition")
    assert plan(PlanningProblem(ROBOT, waypoints, payload=HEAVY)).certificate.satisfied  # it is carried already


def test_a_part_is_either_taken_or_put_down() -> None:
    waypoints = (JointWaypoint(HOME), JointWaypoint(ABOVE, payload=HEAVY, put_down=True))
    with pytest.raises(InvalidProblem, match="cannot be combined with put_down"):
        plan(PlanningProblem(ROBOT, waypoints))


def test_payloads_that_weigh_nothing_are_refused() -> None:
    for mass in (0.0, -1.0, 1e-12, float("nan")):
        waypoints = (JointWaypoint(HOME), JointWaypoint(ABOVE, payload=Payload(mass)))
        with pytest.raises(InvalidProblem) as refusal:
            plan(PlanningProblem(ROBOT, waypoints))
        assert ("waypoints", 1, "payload", "mass") in [fault.field for fault in refusal.value.faults]


@pytest.mark.parametrize("kind", [kind for kind in BACK_ENDS if kind not in ARMS_OF])
def test_an_arm_without_inertias_has_the_torques_of_what_it_carries(kind: str) -> None:
    """It carries nothing: no torque. It carries 1 kg: the document's M g = 9.81 N on the prismatic joint."""
    robot = load_robot("date_sorting_arm")
    start, end = (0.0, 0.1, 0.1, 0.3, 1.2, 0.0), (0.5, 0.3, 0.2, 0.6, 1.0, 0.2)
    waypoints = (JointWaypoint(start), JointWaypoint(end, payload=Payload(1.0)), JointWaypoint(start))
    planned = plan(PlanningProblem(robot, waypoints), backend_of(kind))
    assert "payload_only" in [warning.code for warning in planned.warnings]
    rows = planned.samples(0.01, ["torque"])
    assert rows.torque is not None
    assert not rows.torque[rows.segment == 0].any()
    assert rows.torque[rows.segment == 1][:, 1].mean() == pytest.approx(9.81, rel=0.2)


def test_least_effort_of_nothing_is_unknown() -> None:
    robot = load_robot("date_sorting_arm")
    waypoints = (
        JointWaypoint((0.0, 0.1, 0.1, 0.3, 1.2, 0.0)),
        JointWaypoint((0.5, 0.3, 0.2, 0.6, 1.0, 0.2), payload=Payload(1.0)),
        JointWaypoint((0.0, 0.1, 0.1, 0.3, 1.2, 0.0)),
    )
    with pytest.raises(MissingDynamics):
        plan(PlanningProblem(robot, waypoints), backend_of("min_effort"))


@pytest.mark.long_table
@pytest.mark.parametrize("seed", range(12))
@pytest.mark.parametrize("kind", [kind for kind in BACK_ENDS if kind != "min_effort"])
def test_random_lists_keep_their_limits_with_random_payloads(kind: str, seed: int) -> None:
    """Lists have stops, repeated waypoints and dwells; parts are picked, exchanged and put down under narrow limits."""
    rng = np.random.default_rng(seed)
    limit = np.array(ROBOT.limit("torque")) * rng.uniform(0.25, 1.0)
    waypoints: list[JointWaypoint] = []
    payload: Payload | None = None
    carried: list[Payload | None] = []
    q = np.array(HOME)
    for k in range(7):
        q = q if rng.random() < 0.15 else np.array(HOME) + rng.uniform(-0.5, 0.5, 6)
        requested = [None, None, LIGHT, HEAVY, replace(LIGHT, mass=float(rng.uniform(0.1, 8.0)))][rng.integers(5)]
        put_down = requested is None and rng.random() < 0.5
        payload = None if put_down else payload if requested is None else requested
        carried.append(payload)
        dwell = float(rng.choice([0.0, 0.2]))
        waypoints.append(JointWaypoint(q, payload=requested, put_down=put_down, dwell=dwell if k else 0.0))
    problem = PlanningProblem(ROBOT, waypoints, Limits(torque=tuple(limit.tolist())))
    try:
        planned = plan(problem, backend_of(kind))
    except PlanningError as refusal:
        assert isinstance(refusal, LimitsUnsatisfiable)
        models = [loaded_model(ROBOT, payload) for payload in carried]
        held = [
            np.abs(pin.computeGeneralizedGravity(model, model.createData(), q)) / limit
            for (model, before), after in zip(zip(models, models[:1] + models, strict=False), waypoints, strict=True)
            for model in (model, before)
            for q in np.linspace(after.position, after.position, 2)
        ]
        assert np.max(held) > 0.6
        return
    used = torques(planned, tuple(carried[:-1]), 60)[1]
    assert (np.abs(used) <= limit * (1.0 + 1e-6)).all()
