"""Torques along a path against Pinocchio: inverse dynamics in time, the mass matrix, and differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from planner.dynamics import path_dynamics
from planner.errors import MissingDynamics
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload

ROBOTS = ("kuka_kr16_l6_2", "ur5")


def loaded(robot_id: str) -> Robot:
    return load_robot(robot_id).with_payload(Payload(2.0, (0.02, 0.0, 0.1), (0.01, 0.02, 0.01)))


def path(s: np.ndarray, amplitudes: np.ndarray, waves: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a sine for each joint: q, q' and q'', each (gridpoints, joints)."""
    angle = s[:, None] * waves
    return amplitudes * np.sin(angle), amplitudes * waves * np.cos(angle), -amplitudes * waves**2 * np.sin(angle)


@pytest.mark.parametrize("robot_id", ROBOTS)
@pytest.mark.parametrize("speed", [0.0, 1e-6, 1.0, 30.0])
def test_torques_are_those_of_the_motion_in_time(robot_id: str, speed: float) -> None:
    """m s'' + h s'^2 + g agrees with Pinocchio at random gridpoints and states of the time scaling."""
    robot, rng = loaded(robot_id), np.random.default_rng(7)
    s = rng.uniform(0.0, 3.0, 20)
    q, first, second = path(s, rng.normal(size=robot.dof), rng.uniform(0.2, 2.0, robot.dof))
    inertia, centripetal, gravity = path_dynamics(robot, q, first, second)
    ds, dds = speed * rng.normal(size=(2, 20, 1))
    own = inertia * dds + centripetal * ds**2 + gravity
    states = zip(q, first * ds, second * ds**2 + first * dds, strict=True)
    peer = np.array([pin.rnea(robot.model, robot.data, *state) for state in states])
    assert own == pytest.approx(peer, rel=1e-9, abs=1e-9 * np.abs(peer).max())


@pytest.mark.parametrize("robot_id", ROBOTS)
def test_inertia_and_centripetal_torques_follow_from_the_kinetic_energy(robot_id: str) -> None:
    """Without gravity, the power is the rate of the energy E = s'^2 q'M q' / 2 by differences, at any s' and s''."""
    robot, rng = loaded(robot_id), np.random.default_rng(3)
    amplitudes, waves = rng.normal(size=robot.dof), rng.uniform(0.2, 2.0, robot.dof)
    s, step = rng.uniform(0.0, 3.0, 10), 1e-5

    def inertia_along(at: np.ndarray) -> np.ndarray:
        """Compute q'M q', (gridpoints,), by the composite rigid body algorithm."""
        q, first, _ = path(at, amplitudes, waves)
        masses = [pin.crba(robot.model, robot.data, row).copy() for row in q]
        full = [np.triu(mass) + np.triu(mass, 1).T for mass in masses]
        return np.array([dq @ mass @ dq for dq, mass in zip(first, full, strict=True)])

    q, first, second = path(s, amplitudes, waves)
    dynamics = path_dynamics(robot, q, first, second)
    along, slope = inertia_along(s), (inertia_along(s + step) - inertia_along(s - step)) / (2.0 * step)
    assert (dynamics.inertia * first).sum(axis=1) == pytest.approx(along, rel=1e-9)
    assert (dynamics.centripetal * first).sum(axis=1) == pytest.approx(slope / 2.0, abs=1e-6 * np.abs(slope).max())


def test_any_shape_is_computed_at_once() -> None:
    robot, rng = loaded("ur5"), np.random.default_rng(1)
    q, first, second = rng.normal(size=(3, 4, 5, robot.dof))
    at_once = path_dynamics(robot, q, first, second)
    for row in np.ndindex(4, 5):
        for part, own in zip(at_once, path_dynamics(robot, q[row], first[row], second[row]), strict=True):
            assert part[row] == pytest.approx(own, abs=1e-12 * np.abs(part).max())


def test_a_robot_without_inertias_has_no_path_dynamics() -> None:
    robot = load_robot("three_dof_arm")
    with pytest.raises(MissingDynamics):
        path_dynamics(robot, *np.zeros((3, 2, robot.dof)))
