"""Deviations from straight joint motions, against searches for the nearest point at dense samples."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import minimize_scalar

from planner import JointWaypoint, forward_kinematics, load_robot
from planner.backends import MinEffort
from planner.certificate.joint_motions import TOOL_DEVIATION, certify_joint_motions, farthest_joint
from planner.certificate.path_bounds import DEVIATION_KNOWN_TO
from planner.certificate.path_parts import PARTS_KNOWN_TO
from planner.dynamics import SegmentDynamics
from planner.trajectories.polynomials import PiecewisePolynomial
from planner.trajectories.trajectory import Trajectory
from tests.planner.tool_motions.dense_paths import StraightPositions, tool_positions
from tests.sizes import NAME

SEEDS = range({"quick": 12, "large": 120, "soak": 1200}[NAME])
"""Seeds of random motions."""

GRID = np.linspace(0.0, 1.0, 1001)
"""Fractions of a straight motion among which the search for the nearest point starts."""

TIMES = {"quick": 60, "large": 200, "soak": 1000}[NAME]
"""Times at which a motion is compared with its bound."""

ROUNDING = 1e-10
"""Accuracy of the ternary search, rad or m."""


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.sized
def test_the_deviation_of_joints_is_the_largest_of_dense_samples(seed: int) -> None:
    """Motions leave the line aside, before its start and beyond its end; some joints rest, and some hardly move."""
    rng = np.random.default_rng(seed)
    joints, pieces = int(rng.integers(1, 8)), int(rng.integers(1, 5))
    start, way = rng.normal(size=(2, joints))
    way *= rng.choice([0.0, 1e-6, 1.0, 3.0], size=joints)
    way[rng.integers(joints)] = 1.0
    off = 10.0 ** rng.uniform(-6.0, 0.5)
    corners = rng.uniform(-0.3 * off, 1.0 + 0.3 * off, (1, 1, 6)) * way[:, None]
    coefficients = start[:, None] * np.eye(1, 6) + corners + off * rng.normal(size=(1, joints, 6))
    motion = PiecewisePolynomial(rng.uniform(0.2, 1.5, 1), coefficients).split(np.array([pieces]))
    line = StraightPositions(np.array([start, start + way]))
    found, time, joint = farthest_joint(motion, start, start + way)
    (there,) = motion.evaluate(np.array([time]), [0])
    assert line.distances(there)[0] == pytest.approx(found, rel=1e-9, abs=ROUNDING)
    times = np.linspace(0.0, motion.breakpoints[-1], 4_001)
    (positions,) = motion.evaluate(times, [0])
    largest = line.distances(positions).max()
    assert found >= largest * (1.0 - 1e-9) - ROUNDING
    assert found <= largest * (1.0 + 1e-2) + ROUNDING
    shares = np.linspace(0.0, 1.0, 100_001)[:, None]
    away = np.abs(there[0] - start - shares * way)
    nearest = away[away.max(axis=1).argmin()]
    assert nearest[joint] == pytest.approx(found, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize("name", ["ur5e", "kuka_kr16_2", "fr3"])
@pytest.mark.parametrize("seed", SEEDS[:4])
@pytest.mark.sized
def test_the_deviation_of_the_tool_is_bounded_by_little_more_than_dense_samples(seed: int, name: str) -> None:
    """Motions of random size leave the straight one by a micrometre up to half a metre, one segment after another."""
    robot, rng = load_robot(name), np.random.default_rng(seed)
    low, high = robot.limit("lower"), robot.limit("upper")
    corners = np.clip(rng.uniform(-2.5, 2.5, (3, robot.dof)), low, high)
    if seed % 4 == 3:
        corners[1:, : robot.dof - 1] = corners[0, : robot.dof - 1]  # only the last joint turns
    law, bump = np.array([0.0, 0.0, 0.0, 10.0, -15.0, 6.0]), 64.0 * np.array([0.0, 0.0, 0.0, 1.0, -2.0, 1.0])
    bulge = 10.0 ** rng.uniform(-6.0, -0.3) * rng.normal(size=(2, robot.dof))
    coefficients = np.diff(corners, axis=0)[..., None] * law + bulge[..., None] * bump
    coefficients[..., 0] += corners[:-1]
    lengths = rng.uniform(0.5, 1.5, 2)
    coefficients /= lengths[:, None, None] ** np.arange(6)
    times = np.concatenate([[0.0], np.cumsum(lengths)])
    trajectory = Trajectory(lengths, coefficients, np.arange(2), times, times)
    waypoints = [JointWaypoint(corner) for corner in corners]
    limit = 0.1 if seed % 2 else None
    found = certify_joint_motions(
        trajectory, SegmentDynamics.of_robots([robot] * 2), waypoints, corners, MinEffort(max_deviation=limit)
    )
    (check,) = (each for each in found if each.quantity == TOOL_DEVIATION)
    assert check.method == "bounded"
    assert check.lower is not None
    grids = [tool_positions(robot, a + GRID[:, None] * (b - a)) for a, b in pairwise(corners)]

    def distance(time: float) -> float:
        """Return the distance of the tool at a time from the straight motion of its segment, m."""
        segment = int(time > times[1])
        a, b = corners[segment : segment + 2]
        tool = forward_kinematics(robot, trajectory.evaluate(time, [0])[0]).position
        best = GRID[np.linalg.norm(grids[segment] - tool, axis=1).argmin()]
        bounds = max(best - GRID[1], 0.0), min(best + GRID[1], 1.0)
        found = minimize_scalar(
            lambda u: np.linalg.norm(forward_kinematics(robot, a + u * (b - a)).position - tool),
            bounds=bounds,
            method="bounded",
            options={"xatol": 1e-12},
        )
        return float(found.fun)

    floor = 4.0 * PARTS_KNOWN_TO
    assert check.lower - floor <= distance(check.time) <= check.peak + floor
    assert check.peak <= check.lower * (1.0 + DEVIATION_KNOWN_TO) + floor
    assert max(map(distance, rng.uniform(0.0, times[-1], TIMES))) <= check.peak + 1e-9


def test_a_motion_on_the_line_has_no_deviation() -> None:
    start, end = np.array([0.1, -0.2, 0.3]), np.array([1.1, 0.8, 0.3])
    law = np.array([0.0, 0.0, 3.0, -2.0])
    coefficients = start[:, None] * np.eye(1, 4) + (end - start)[:, None] * law
    assert farthest_joint(PiecewisePolynomial(np.ones(1), coefficients[None]), start, end)[0] <= ROUNDING


def test_a_motion_beyond_the_end_is_as_far_off_as_it_overshoots() -> None:
    coefficients = np.array([[[0.0, 1.5, 0.0], [0.0, 0.0, 0.0]]])
    found, time, joint = farthest_joint(
        PiecewisePolynomial(np.ones(1), coefficients), np.zeros(2), np.array([1.0, 0.0])
    )
    assert (found, time, joint) == pytest.approx((0.5, 1.0, 0))
