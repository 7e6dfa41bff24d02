"""Torques by the kernel against Pinocchio's, one state at a time."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from planner.kernels.serial_chain import LINK_NUMBERS, NO_FORCE, SerialChain, inverse_dynamics, path_dynamics
from planner.robots import Robot
from tests.planner.kernels.arms import random_states, robots

LARGEST_REDUCED = 1e5
"""Limit of joint positions, rad, below which the kernel uses its own sine and cosine."""


def by_pinocchio(robot: Robot, states: np.ndarray) -> np.ndarray:
    return np.array([pin.rnea(robot.model, robot.data, *state).copy() for state in states.transpose(1, 0, 2)])


@pytest.mark.parametrize("name", robots())
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 64])
def test_torques_are_those_of_pinocchio(name: str, count: int) -> None:
    robot = robots()[name]
    states = random_states(robot, count)
    expected = by_pinocchio(robot, states)
    assert inverse_dynamics(robot.chain, *states) == pytest.approx(expected, abs=1e-12 * (1.0 + np.abs(expected).max()))


@pytest.mark.parametrize("turns", [10.0, 0.999 * LARGEST_REDUCED, 1e7, 1e12])
def test_torques_at_positions_of_many_turns(turns: float) -> None:
    robot = robots()["loaded"]
    states = random_states(robot, 9)
    states[0] *= turns / 3.0
    expected = by_pinocchio(robot, states)
    assert inverse_dynamics(robot.chain, *states) == pytest.approx(expected, abs=1e-9 * np.abs(expected).max())


def test_each_state_has_the_same_bytes_alone_and_among_others() -> None:
    robot = robots()["kuka"]
    states = random_states(robot, 37)
    states[0, 5, 2] = 3e6  # beyond the reduction: its neighbours are not changed by it
    together = inverse_dynamics(robot.chain, *states)
    alone = [inverse_dynamics(robot.chain, *states[:, [row]])[0] for row in range(37)]
    assert together.tobytes() == np.array(alone).tobytes()
    assert together.tobytes() == inverse_dynamics(robot.chain, *states).tobytes()


@pytest.mark.parametrize("name", robots())
def test_path_dynamics_are_torques_without_the_other_terms(name: str) -> None:
    robot = robots()[name]
    q, first, second = random_states(robot, 21)
    still = np.zeros_like(q)
    gravity = by_pinocchio(robot, np.array([q, still, still]))
    inertia = by_pinocchio(robot, np.array([q, still, first])) - gravity
    centripetal = by_pinocchio(robot, np.array([q, first, second])) - gravity
    expected = np.array([inertia, centripetal, gravity])
    assert path_dynamics(robot.chain, q, first, second) == pytest.approx(expected, abs=1e-12 * np.abs(expected).max())


def test_what_is_no_number_stays_none() -> None:
    robot = robots()["kuka"]
    states = random_states(robot, 6)
    states[0, 2, 1] = np.nan
    torques = inverse_dynamics(robot.chain, *states)
    assert np.isnan(torques[2, :2]).all()
    assert np.isfinite(np.delete(torques, 2, axis=0)).all()


def test_no_states_and_wrong_shapes() -> None:
    robot = robots()["kuka"]
    assert inverse_dynamics(robot.chain, *np.empty((3, 0, robot.dof))).shape == (0, robot.dof)
    with pytest.raises(ValueError, match="shape"):
        inverse_dynamics(robot.chain, *np.zeros((3, 4, robot.dof + 1)))
    with pytest.raises(ValueError, match="shape"):
        path_dynamics(robot.chain, np.zeros((4, robot.dof)), np.zeros((4, robot.dof)), np.zeros((3, robot.dof)))
    with pytest.raises(ValueError, match="shape"):
        inverse_dynamics(robot.chain._replace(links=robot.chain.links[:, :-1]), *np.zeros((3, 4, robot.dof)))


def test_any_number_of_joints() -> None:
    """A chain of 200 equal links hangs at rest: each joint carries the moments of all links behind it."""
    link = np.zeros(LINK_NUMBERS)
    link[[0, 4, 8]], link[9], link[12], link[13], link[25] = 1.0, 0.1, 2.0, 0.05, 1.0
    chain = SerialChain(np.tile(link, (200, 1)), np.array([0.0, -9.81, 0.0, *NO_FORCE, 0.0]))
    torques = inverse_dynamics(chain, *np.zeros((3, 1, 200)))[0]
    behind = np.arange(200, 0, -1)
    levers = np.array([0.05 * n + 0.1 * n * (n - 1) / 2 for n in behind])
    assert torques == pytest.approx(2.0 * 9.81 * levers, rel=1e-12)
