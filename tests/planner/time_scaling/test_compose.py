"""Time scalings along curves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.paths import solve_path
from planner.robots import load_robot
from planner.time_scaling.compose import follow_curve
from planner.trajectories.polynomials import SegmentedPolynomial

ARM = load_robot("three_dof_arm")


def blended(turns: float) -> planner.PlanningProblem:
    """Return a rounded corner, with a large travel of one joint to it."""
    waypoints = [
        planner.JointWaypoint([0.1, 1.0, 0.5]),
        planner.JointWaypoint([0.1, 1.0, turns], transition=planner.BlendTransition(1e-3)),
        planner.JointWaypoint([0.1, 1.0, 0.5]),
        planner.JointWaypoint([0.0, 1.0, 0.5]),
    ]
    return planner.PlanningProblem(ARM, waypoints)


@pytest.mark.parametrize("turns", [1e2, 1e4, 1e6])
@pytest.mark.parametrize("backend", [planner.Cubic(), planner.Quintic()], ids=lambda backend: backend.kind)
def test_a_corner_that_is_far_away_is_rounded_or_refused(backend: planner.BackEnd, turns: float) -> None:
    """A blend of a millimetre a million radians away: rounding exceeds the tolerance, and the service failed."""
    try:
        plan = planner.plan(blended(turns), backend)
    except planner.LimitsUnsatisfiable:
        assert turns > 1e5  # its acceleration is continuous but for rounding
    else:
        (positions,) = plan.trajectory.evaluate(plan.trajectory.arrivals[[2, 3]], [0])
        assert positions == pytest.approx(np.array([[0.1, 1.0, 0.5], [0.0, 1.0, 0.5]]), abs=1e-12 * turns + 1e-9)


def test_a_curve_that_cannot_be_followed_more_closely_is_followed_as_closely_as_can_be() -> None:
    """With zero tolerance, rounding is too large: the finest parts give the motion."""
    path = solve_path(blended(2.0))
    group = replace(path.every_group[0], tolerance=0.0)
    length = group.curve.breakpoints[-1]
    scaling = SegmentedPolynomial(
        np.ones(1), np.array([[[0.0, 0.0, 0.0, 10.0, -15.0, 6.0]]]) * length, np.zeros(1, dtype=int)
    )
    motion = follow_curve(group, scaling)
    assert motion.coefficients.shape == (len(motion.lengths), 3, 6)
    assert motion.breakpoints[-1] == pytest.approx(1.0)
    times = np.linspace(0.0, 1.0, 500)
    exact = group.curve.evaluate(np.clip(scaling.evaluate(times, [0])[0][:, 0], 0.0, length), [0])[0]
    assert motion.evaluate(times, [0])[0] == pytest.approx(exact, abs=1e-12)
