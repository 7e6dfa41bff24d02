"""Friction and rotor inertia in joint torques, against MuJoCo and finite differences."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.dynamics import path_dynamics
from planner.dynamics.inverse import torques_by_pace
from planner.dynamics.symbolic import symbolic_motion
from planner.simulation.plant import Plant
from planner.spatial import FloatArray

FAST = 0.3
"""Speed, rad/s, above which MuJoCo's friction, which is soft about rest, is all there."""


def with_drives(robot: planner.Robot, seed: int, size: float = 3.0) -> planner.Robot:
    """Return a robot with random friction and rotor inertia in each joint."""
    drives = np.random.default_rng(seed).uniform(0.1, size, (robot.dof, 3))
    joints = zip(robot.joints, drives.tolist(), strict=True)
    return replace(
        robot, joints=tuple(replace(own, friction=c, damping=d, rotor_inertia=r) for own, (c, d, r) in joints)
    )


def states(robot: planner.Robot, seed: int, count: int) -> FloatArray:
    """Return positions, velocities and accelerations (3, count, joints)."""
    found = np.random.default_rng(seed).uniform(-1.5, 1.5, (3, count, robot.dof))
    found[1] += np.copysign(FAST, found[1])
    return found


@pytest.mark.parametrize("name", ["plain", "loaded", "on a rail"])
def test_mujoco_accelerates_as_the_torques_say(name: str) -> None:
    arm = planner.load_robot("ur5e")
    if name == "on a rail":
        arm = arm.derived(
            external_axes=[planner.ExternalAxis("rail", "prismatic", (1, 0, 0), lower=-2, upper=2, mass=9)]
        )
    robot = with_drives(arm, 3)
    robot = robot.with_payload(planner.Payload(3.0, (0.0, 0.1, 0.05))) if name == "loaded" else robot
    plant = Plant(robot, 1e-3, 0.0)
    for q, v, a in states(robot, 4, 20).transpose(1, 0, 2):
        plant.set_state(q, v)
        plant.apply(planner.inverse_dynamics(robot, q, v, a))
        np.testing.assert_allclose(plant.acceleration(), a, atol=1e-9)


def test_torques_are_those_of_pinocchio_with_its_armature() -> None:
    robot = with_drives(planner.load_robot("kuka_kr16_2"), 5)
    friction = np.array([(joint.friction, joint.damping) for joint in robot.joints]).T
    model = robot.model.copy()
    model.armature = np.array([joint.rotor_inertia for joint in robot.joints])
    for q, v, a in states(robot, 6, 20).transpose(1, 0, 2):
        expected = pin.rnea(model, model.createData(), q, v, a) + friction[0] * np.sign(v) + friction[1] * v
        np.testing.assert_allclose(planner.inverse_dynamics(robot, q, v, a), expected, atol=1e-9)


def test_a_resting_joint_has_no_friction() -> None:
    arm = planner.load_robot("ur5e")
    q, _, a = states(arm, 7, 4)
    still = np.zeros_like(q)
    np.testing.assert_allclose(
        planner.inverse_dynamics(with_drives(arm, 7), q, still, still), planner.inverse_dynamics(arm, q, still, still)
    )
    rotors = [joint.rotor_inertia for joint in with_drives(arm, 7).joints]
    np.testing.assert_allclose(
        planner.inverse_dynamics(with_drives(arm, 7), q, still, a),
        planner.inverse_dynamics(arm, q, still, a) + rotors * a,
    )


def test_terms_by_pace_and_along_paths_are_those_of_scaled_motions() -> None:
    """The motion q(x t) has velocities x v and accelerations x^2 a; along q(s), q'' s'^2 + q' s''."""
    robot = with_drives(planner.load_robot("ur5e"), 8)
    q, v, a = states(robot, 9, 30)
    coefficients = torques_by_pace(robot, q, v, a)
    inertia, centripetal, gravity = path_dynamics(robot, q, v, a)
    assert robot.friction is not None
    for pace, gain in ((0.3, 0.7), (1.0, 0.0), (2.5, -1.2)):
        scaled = planner.inverse_dynamics(robot, q, pace * v, pace**2 * a)
        np.testing.assert_allclose(sum(c * pace**k for k, c in enumerate(coefficients)), scaled, atol=1e-9)
        on_path = planner.inverse_dynamics(robot, q, pace * v, pace**2 * a + gain * v)
        constant, linear = robot.friction.along(v, robot.dof)
        rows = inertia * gain + centripetal * pace**2 + gravity + constant + linear * pace
        np.testing.assert_allclose(rows, on_path, atol=1e-9)


def test_the_symbolic_torques_differ_only_about_rest() -> None:
    robot = with_drives(planner.load_robot("ur5e"), 10)
    z = [ca.SX.sym(name, robot.dof) for name in "qva"]
    function = ca.Function("torques", z, [symbolic_motion(robot, *z).torques])
    coulomb = np.array([joint.friction for joint in robot.joints])
    for q, v, a in states(robot, 11, 20).transpose(1, 0, 2):
        found = np.array(function(q, v, a)).ravel()
        expected = planner.inverse_dynamics(robot, q, v, a)
        assert (np.abs(found - expected) <= 0.01 * coulomb + 1e-9).all()
        assert (np.abs(np.array(function(q, 1e-3 * v, a)).ravel()) < np.inf).all()
