"""The distance of one motion's tool or joints from another's path, against nearest neighbours of dense samples."""

from __future__ import annotations

import numpy as np
import pytest

from planner.robots import load_robot
from planner.tool_motions.path_distances import CHORDS, farthest_from_path, joints_farthest_from_path
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.problems_of_tests import ARMS, random_position
from tests.planner.tool_motions.dense_paths import StraightPositions, StraightWay


@pytest.mark.long_table
@pytest.mark.parametrize("robot_id", ARMS)
@pytest.mark.parametrize("seed", range(4))
def test_it_is_the_largest_distance_or_a_little_more(robot_id: str, seed: int) -> None:
    """Quintics deviate from the straight motion by a tenth of a millimetre up to half a radian."""
    robot, rng = load_robot(robot_id), np.random.default_rng(seed)
    ends = np.array([random_position(robot, rng) for _ in range(2)])
    bulge = 10.0 ** rng.uniform(-4.0, -0.3) * rng.normal(size=(2, robot.dof))
    law, bump = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0]), np.array([0.0, 0.0, 1.0, -2.0, 1.0, 0.0])
    wave = np.array([0.0, 0.0, 1.0, -3.0, 2.0, 0.0])
    coefficients = np.outer(ends[1] - ends[0], law) + 16.0 * (np.outer(bulge[0], bump) + np.outer(bulge[1], wave))
    coefficients[:, 0] += ends[0]
    whole = PiecewisePolynomial(np.ones(1), coefficients[None])
    way = StraightWay(robot, ends)
    true = way.farthest(whole)
    for motion in (whole, whole.split(np.array([7])), whole.stretched(1e3)):
        last = float(motion.breakpoints[-1])
        found, time = farthest_from_path(robot, motion, 0.0, last, np.linspace(*ends, CHORDS + 1))
        assert true - 1e-6 <= found <= true * 1.005 + 2e-4
        there = motion.evaluate(np.array([time]), [0])[0]
        assert way.distances(there)[0] >= 0.98 * true - 2e-4
    straight = StraightPositions(ends)
    true = straight.farthest(whole)
    found, time = joints_farthest_from_path(whole, 0.0, 1.0, np.linspace(*ends, CHORDS + 1))
    assert true - 1e-9 <= found <= true * 1.005 + 1e-4
    assert straight.distances(whole.evaluate(np.array([time]), [0])[0])[0] >= 0.98 * true - 1e-4


def test_a_straight_motion_is_hardly_off_itself() -> None:
    robot = load_robot("kuka_kr16_l6_2")
    ends = np.array([[0.0, -1.4, 1.5, 0.0, 0.6, 0.0], [2.0, -0.4, 0.9, 1.0, 0.4, 0.3]])
    coefficients = np.stack([ends[0], np.zeros(6), 3.0 * (ends[1] - ends[0]), -2.0 * (ends[1] - ends[0])], axis=-1)
    motion = PiecewisePolynomial(np.ones(1), coefficients[None])
    assert farthest_from_path(robot, motion, 0.0, 1.0, np.linspace(*ends, CHORDS + 1))[0] < 2e-4
