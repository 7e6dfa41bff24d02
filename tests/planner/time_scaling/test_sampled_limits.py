"""Durations under limits of torque and tool speed, against 2,000 samples of every piece."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.backends import BACKENDS
from planner.backends.shared.assembly import sampled
from planner.dynamics import inverse_dynamics
from planner.errors import LimitsUnsatisfiable
from planner.kinematics import tool_speeds
from planner.limits import Limits
from planner.paths import JointPath, solve_path
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import ThroughTransition
from planner.robots import load_robot
from planner.time_scaling.uniform import time_scalings
from planner.trajectories.polynomials import SegmentedPolynomial, quintic_hermite
from tests.planner.problems_of_tests import problem_of, random_position

SAMPLES = 2_000


def use_on_each_segment(path: JointPath, pieces: SegmentedPolynomial) -> dict[int, float]:
    """Return the largest used share of torque or tool speed limits on each segment."""
    q, v, a, _ = sampled(pieces, SAMPLES)
    owners = np.repeat(pieces.segments, SAMPLES)
    linear, angular = tool_speeds(path.robot, q, v)
    most = [path.limits.magnitudes(name)[owners, 0] for name in ("tcp_linear_velocity", "tcp_angular_velocity")]
    use = np.maximum(linear / most[0], angular / most[1])
    if path.robot.has_dynamics:
        use = np.maximum(
            use, (np.abs(inverse_dynamics(path.robot, q, v, a)) / path.limits.torque.narrower[owners]).max(axis=1)
        )
    return {int(segment): float(use[owners == segment].max()) for segment in np.unique(owners)}


@settings(max_examples=settings.default.max_examples // 3)
@given(
    robot_id=st.sampled_from(["kuka_kr16_l6_2", "date_sorting_arm", "ngv_refuelling_arm"]),
    seed=st.integers(0, 2**32),
    spread=st.floats(-3.0, 0.0),
)
def test_motions_stretched_as_demanded_use_all_of_a_limit_and_no_more(robot_id: str, seed: int, spread: float) -> None:
    rng, robot = np.random.default_rng(seed), load_robot(robot_id)
    limits = Limits(tcp_linear_velocity=0.1 * 10.0 ** rng.normal(), tcp_angular_velocity=10.0 ** rng.normal())
    path = solve_path(replace(problem_of(robot_id, seed, 4), limits=limits))
    count, home = 9, np.array(random_position(robot, rng))
    lengths = 10.0 ** rng.uniform(-2.0, 1.0, count)
    # Wild quintics, whose speeds and accelerations turn within a piece.
    start, end = (
        tuple(10.0**spread * rng.uniform(-1.0, 1.0, (count, robot.dof)) / lengths[:, None] ** k for k in range(3))
        for _ in range(2)
    )
    coefficients = quintic_hermite(lengths, start, end)
    coefficients[..., 0] += home
    pieces = SegmentedPolynomial(lengths, coefficients, np.arange(count) // 3)
    try:
        needed = time_scalings(path, pieces, frozenset())
    except LimitsUnsatisfiable:  # gravity alone is too much there
        return
    factors = np.array([needed[segment].factor for segment in range(3)])
    for use in use_on_each_segment(path, pieces.stretched(factors[pieces.segments])).values():
        assert 0.998 <= use <= 1.0


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["auto", "ruckig", "toppra", "quintic"])
def test_a_peak_of_the_tools_speed_at_the_beginning_of_a_long_piece(kind: str) -> None:
    """Between two of the even samples, the speed rose by 0.24 %: the plan was refused."""
    robot = load_robot("date_sorting_arm")
    positions = [
        (-1.8224101455145625, 0.1578836773, 0.3554460628, 0.3613675084, -1.3388365996, -0.2941230785),
        (-1.8810164343677755, 0.2096859834, 0.3795653038, 0.7255747940, -1.4430265675, -0.5025460872),
        (-1.8410222169406216, 0.1033749704, 0.3082867748, -0.0610582305, -0.9901118050, -0.3072926549),
    ]
    waypoints = [JointWaypoint(position=q) for q in positions]
    waypoints[1] = replace(waypoints[1], transition=ThroughTransition())
    limits = Limits(tcp_linear_velocity=0.05)
    result = plan(PlanningProblem(robot, tuple(waypoints), limits=limits), BACKENDS[kind]())
    q, dq = result.trajectory.evaluate(np.linspace(0.0, result.trajectory.duration, 100_001), [0, 1])
    assert 0.995 <= tool_speeds(robot, q, dq)[0].max() / 0.05 <= 1.0
