"""Plans in MuJoCo: its arm is that of Pinocchio, and it follows the plans with their torques."""

from __future__ import annotations

import sys
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner import InvalidProblem, MissingDynamics, Servo
from planner.simulation.plant import Plant
from tests.planner.problems_of_tests import ALL_BACK_ENDS, BACK_END_NAMES

HOME = (0.0, -1.2, 1.8, -0.6, 1.6, 0.3)


def _problem(robot: planner.Robot, home: tuple[float, ...] = HOME, count: int = 4) -> planner.PlanningProblem:
    rng = np.random.default_rng(5)
    positions = np.array(home) + rng.uniform(-0.5, 0.5, (count, len(home)))
    return planner.PlanningProblem(robot, [planner.JointWaypoint(position) for position in positions])


def _robots() -> dict[str, planner.Robot]:
    arm = planner.load_robot("ur5e")
    carrying = arm.with_tool(planner.Pose([0.1, 0.0, 0.2])).with_payload(planner.Payload(3.0, (0.0, 0.1, 0.05)))
    rail = planner.ExternalAxis("rail", "prismatic", (1, 0, 0), lower=-1.0, upper=3.0, velocity=1.0, mass=60.0)
    axes = [
        planner.ExternalAxis("slide", "prismatic", (1, 2, 0), planner.Pose([1.0, 0.2, 0.4]), -1.0, 1.0, mass=40.0),
        planner.ExternalAxis("turn", "continuous", (0, 1, 1), mass=9.0, inertia=(1.0, 0.0, 0.1, 2.0, 0.0, 2.0)),
    ]
    part = planner.Pose.from_rpy([0.1, 0.0, 0.2], [0.3, 0.2, 0.1])
    welding = carrying.derived(id="cell", positioner=axes, workpiece=part)
    holding = arm.derived(
        id="held", mounting=planner.Pose.from_rpy([0.0, 0.0, 1.0], [0.1, 0.2, 0.3]), fixed_tool=part, workpiece=part
    ).with_payload(planner.Payload(3.0, (0.0, 0.1, 0.05)))
    force, moment = (5.0, 3.0, -10.0), (0.5, 1.0, 2.0)
    return {
        "on_a_positioner": welding,
        "welding": replace(welding, process_force=planner.ProcessForce(force, moment, frame="base")),
        "holding_a_part": holding,
        "grinding": replace(holding, process_force=planner.ProcessForce(force, moment)),
        "plain": arm,
        "carrying": carrying,
        "drilling": replace(carrying, process_force=planner.ProcessForce((5.0, 3.0, 40.0), (0.5, 1.0, 2.0))),
        "pressing": replace(arm, process_force=planner.ProcessForce((5.0, 3.0, -40.0), (0.5, 1.0, 2.0), frame="base")),
        "on_a_rail": arm.derived(id="railed", external_axes=[rail]),
        "hanging": arm.derived(id="hung", mounting=planner.Pose.from_rpy([0.0, 0.0, 2.0], [3.0, 0.2, 0.1])),
    }


@pytest.mark.parametrize("name", list(_robots()))
def test_the_arm_of_mujoco_accelerates_like_that_of_pinocchio(name: str) -> None:
    """The torques of the inverse dynamics give the accelerations that they were computed for."""
    robot = _robots()[name]
    plant, rng = Plant(robot, 1e-3, 0.0), np.random.default_rng(3)
    for _ in range(20):
        q, v, a = rng.uniform(-1.5, 1.5, (3, robot.dof))
        torques = planner.inverse_dynamics(robot, q, v, a)
        plant.set_state(q, v)
        plant.apply(torques)
        np.testing.assert_allclose(plant.acceleration(), a, atol=1e-8 * max(1.0, np.abs(torques).max()))


@pytest.mark.parametrize("name", ["welding", "grinding"])
def test_plans_run_where_the_workpiece_moves(name: str) -> None:
    robot = _robots()[name]
    home = (0.1, 0.4, *HOME) if name == "welding" else HOME[::-1]
    plan = planner.plan(_problem(robot, home, 3), planner.Quintic())
    run = planner.simulate(plan)
    assert run.following_error.max() < 2e-3
    assert run.end_error.max() < 1e-4
    np.testing.assert_allclose(run.torque_ratio, 1.0, atol=0.1)


def test_heavier_arms_have_larger_torques() -> None:
    robot = planner.load_robot("ur5e")
    q, v, a = np.random.default_rng(1).uniform(-1.0, 1.0, (3, 6))
    heavier = Plant(robot, 1e-3, 0.5)
    heavier.set_state(q, v)
    heavier.apply(1.5 * pin.rnea(robot.model, robot.model.createData(), q, v, a))
    np.testing.assert_allclose(heavier.acceleration(), a, atol=1e-9)


@pytest.mark.long_table
@pytest.mark.parametrize("backend", ALL_BACK_ENDS, ids=BACK_END_NAMES)
def test_the_arm_follows_a_plan_with_its_torques(backend: planner.BackEnd) -> None:
    """With known masses and fine cycles the servo has next to nothing to do."""
    plan = planner.plan(_problem(planner.load_robot("ur5e")), backend)
    run = planner.simulate(plan, Servo(cycle=5e-4))
    assert run.following_error.max() < 1e-4
    assert run.end_error.max() < 1e-5
    np.testing.assert_allclose(run.torque_ratio, 1.0, atol=0.03)
    assert not run.limited.any()


def test_finer_cycles_leave_smaller_errors() -> None:
    plan = planner.plan(_problem(planner.load_robot("ur5e")), planner.Quintic())
    coarse, fine = (planner.simulate(plan, Servo(cycle=cycle)).following_error for cycle in (4e-3, 1e-3))
    assert (fine < 0.5 * coarse).all()


@pytest.mark.large_only
def test_an_arm_that_is_heavier_than_known_lags_behind_and_needs_more_torque() -> None:
    plan = planner.plan(_problem(planner.load_robot("ur5e")), planner.Quintic())
    known, heavier = (planner.simulate(plan, Servo(mass_error=error)) for error in (0.0, 0.2))
    assert (heavier.following_error > 3.0 * known.following_error).all()
    np.testing.assert_allclose(heavier.torque_ratio, 1.2, atol=0.08)


@pytest.mark.large_only
def test_torques_are_cut_at_their_limits() -> None:
    robot = planner.load_robot("ur5e")
    held = np.abs(planner.inverse_dynamics(robot, HOME, np.zeros(6), np.zeros(6)))
    limits = {"shoulder_lift_joint": {"torque": 1.4 * float(held[1])}}
    weak = robot.derived(id="weak", limits=limits)
    plan = planner.plan(_problem(weak), planner.Toppra())
    run = planner.simulate(plan, Servo(mass_error=0.3))
    limit = weak.limit("torque")
    assert run.limited[:, 1].any()
    assert (np.abs(run.torque) <= limit).all()
    free = planner.simulate(plan)
    assert (np.abs(free.torque).max(axis=0) <= limit).all()


def test_a_payload_is_picked_up_on_the_way() -> None:
    robot, loads = planner.load_robot("ur5e"), planner.Payload(4.0, (0.0, 0.0, 0.1))
    first, second = HOME, tuple(np.array(HOME) + 0.3)
    waypoints = [
        planner.JointWaypoint(first),
        planner.JointWaypoint(second, payload=loads),
        planner.JointWaypoint(first),
    ]
    plan = planner.plan(planner.PlanningProblem(robot, waypoints), planner.Quintic())
    run = planner.simulate(plan)
    assert len(plan.path.dynamics.robots) == 2
    assert run.following_error.max() < 2e-3
    np.testing.assert_allclose(run.torque_ratio, 1.0, atol=0.05)
    unaware = planner.simulate(plan, Servo(feed_forward="none"))
    assert unaware.end_error[1] > 10.0 * run.end_error[1]


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"cycle": 0.0}, "cycle"),
        ({"cycle": float("nan")}, "cycle"),
        ({"frequency": -1.0}, "frequency"),
        ({"frequency": 200.0}, "frequency"),
        ({"mass_error": -1.0}, "mass_error"),
        ({"steps": 0}, "steps"),
    ],
)
def test_a_servo_that_cannot_be_is_refused(options: dict[str, float], field: str) -> None:
    with pytest.raises(InvalidProblem, match=f"`{field}` must be"):
        Servo(**options)  # type: ignore[arg-type]


def test_a_robot_without_masses_and_a_cycle_longer_than_the_trajectory_are_refused() -> None:
    arm = planner.load_robot("three_dof_arm")
    plan = planner.plan(planner.PlanningProblem(arm, [[0.0, 0.5, 0.5], [0.5, 1.0, 1.0]]))
    with pytest.raises(MissingDynamics, match="cannot be simulated"):
        planner.simulate(plan)
    short = planner.plan(planner.PlanningProblem(planner.load_robot("ur5e"), [HOME, tuple(np.array(HOME) + 1e-6)]))
    with pytest.raises(InvalidProblem, match="`cycle` must be shorter"):
        planner.simulate(short, Servo(cycle=0.09, frequency=0.5))


@pytest.mark.large_only
def test_pictures_show_all_joints_and_both_units() -> None:
    robot = _robots()["on_a_rail"]
    plan = planner.plan(_problem(robot, (0.5, *HOME), 2), planner.Quintic())
    svg = planner.simulate(plan).plot().svg().decode()
    for text in (*robot.joint_names, "following error (µm)", "following error (0.001°)", "force (N)", "torque (N m)"):
        assert text in svg


def test_the_package_that_is_missing_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = planner.plan(planner.PlanningProblem(planner.load_robot("ur5e"), [HOME, tuple(np.array(HOME) + 0.1)]))
    monkeypatch.setitem(sys.modules, "mujoco", None)
    monkeypatch.delitem(sys.modules, "planner.simulation.plant", raising=False)
    with pytest.raises(ModuleNotFoundError, match="mujoco"):
        planner.simulate(plan)
