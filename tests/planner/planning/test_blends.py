"""Blends that would collide: the largest free ones, checked against dense samples of the arm's shapes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.errors import Collision
from planner.paths import solve_path
from planner.planning.variants import FINENESS, LEAST_RADII
from planner.problems.blend_radii import blend_radii, with_blend_radii
from planner.scene import CONTACT_TOLERANCE, Scene, SceneObject
from planner.shapes import Sphere
from planner.spatial import Pose
from tests.planner.planning.blend_cases import (
    ASKED,
    BESIDE_A_JOINT_MOTION,
    BESIDE_A_LINE,
    KUKA,
    along_a_rectangle,
    ball_at,
)
from tests.planner.problems_of_tests import certified_plan
from tests.planner.scene.brute_force import distances_over_time

SAMPLES = 150
"""Number of samples of the hand near a corner."""


def blend_warnings(plan: planner.Plan) -> list[planner.PlanWarning]:
    """Return the warnings of a plan, without the one about its estimated shapes."""
    return [warning for warning in plan.warnings if warning.code != "estimated_shapes"]


def room(scene: Scene, trajectory: planner.Trajectory, corner: int) -> float:
    """Return the least clearance of the hand from the ball near a corner beyond the margin, by dense samples, m."""
    hand = [shape.link for shape in KUKA.collision_shapes].index("link_6")
    times = trajectory.arrivals[corner] + np.linspace(-0.3, 0.3, SAMPLES)
    return float(distances_over_time(KUKA, scene, times, trajectory)[:, hand].min()) - scene.margin


@pytest.fixture(scope="module")
def problem() -> planner.PlanningProblem:
    """The hand meets a ball at waypoint 1."""
    return along_a_rectangle(ball_at(*BESIDE_A_LINE), planner.LinearMotion())


@pytest.fixture(scope="module")
def plan(problem: planner.PlanningProblem) -> planner.Plan:
    return planner.plan(problem)


def is_largest_that_is_free(plan: planner.Plan, corner: int) -> None:
    """Assert that only this corner's blend is reduced, is free at dense samples, and larger ones are not."""
    scene, radii = plan.problem.scene, blend_radii(plan.problem)
    assert scene is not None
    taken = radii.pop(corner)
    assert list(radii.values()) == [ASKED]
    assert LEAST_RADII * ASKED < taken < ASKED
    assert room(scene, plan.trajectory, corner) > -CONTACT_TOLERANCE
    blind = replace(plan.problem, scene=None)
    for radius in np.linspace(taken * (1.0 + FINENESS), ASKED, 3):
        larger = planner.plan(with_blend_radii(blind, {corner: float(radius)}))
        assert room(scene, larger.trajectory, corner) < 0.0, f"{radius} m would do"
    (warning,) = blend_warnings(plan)
    assert warning.code == "blend_reduced"
    assert warning.message.startswith(f"waypoint {corner} is blended within {taken:.6g} m in place of {ASKED:g} m")
    assert "link_6" in warning.message
    assert "ball" in warning.message


def test_a_blend_shrinks_to_the_largest_that_is_free(plan: planner.Plan) -> None:
    is_largest_that_is_free(plan, 1)


@pytest.mark.parametrize(
    ("motion", "place", "corner"),
    [
        (planner.JointMotion(), BESIDE_A_JOINT_MOTION, 2),
        pytest.param(planner.JointMotion(), BESIDE_A_JOINT_MOTION, 1, marks=pytest.mark.large_only),
        pytest.param(planner.LinearMotion(), BESIDE_A_LINE, 2, marks=pytest.mark.large_only),
    ],
)
def test_only_the_blend_that_collides_shrinks(
    motion: planner.JointMotion | planner.LinearMotion, place: tuple[float, float, float], corner: int
) -> None:
    """At waypoint 2 the robot collides on the motion between both blends: the blend at waypoint 1 ends as requested."""
    x, y, z = place
    scene = ball_at(x, y if corner == 1 else -y, z)
    is_largest_that_is_free(planner.plan(along_a_rectangle(scene, motion)), corner)


@pytest.mark.large_only
def test_both_blends_shrink_where_both_collide(problem: planner.PlanningProblem) -> None:
    """A copy of the ball is on the other side: by symmetry both blends end at nearly the same radius."""
    x, y, z = BESIDE_A_LINE
    ball = ball_at(x, y, z)
    other = SceneObject("other", [Sphere(0.03)], Pose([x, -y, z]))
    pairs = [(link, name) for link, _ in ball.allowed_pairs for name in ("ball", "other")]
    both = replace(ball, objects=[*ball.objects, other], allowed_pairs=pairs)
    plan = planner.plan(replace(problem, scene=both))
    first, second = blend_radii(plan.problem).values()
    assert first == pytest.approx(second, rel=2.0 * FINENESS)
    assert first < ASKED
    assert [warning.code for warning in blend_warnings(plan)] == ["blend_reduced"] * 2
    assert room(both, plan.trajectory, 1) > -CONTACT_TOLERANCE
    assert room(both, plan.trajectory, 2) > -CONTACT_TOLERANCE


def test_free_blends_stay_as_they_are(problem: planner.PlanningProblem) -> None:
    free = replace(problem, scene=ball_at(1.1, 0.0, 0.7))
    plan, blind = planner.plan(free), planner.plan(replace(problem, scene=None))
    assert plan.problem is free
    assert blend_warnings(plan) == []
    np.testing.assert_array_equal(plan.trajectory.coefficients, blind.trajectory.coefficients)


@pytest.mark.parametrize("place", [(1.3, -0.5, 0.7), (0.9, -0.5, 0.7)])
def test_what_no_smaller_blend_helps_is_refused(
    problem: planner.PlanningProblem, place: tuple[float, float, float]
) -> None:
    """The corner itself collides, or the start: the refusal is that of the request."""
    problem = replace(problem, scene=ball_at(*place))
    with pytest.raises(Collision) as refusal:
        planner.plan(problem)
    with pytest.raises(Collision) as requested:
        certified_plan(problem, planner.Cubic(), solve_path(problem))
    assert type(refusal.value) is type(requested.value)
    assert refusal.value.message == requested.value.message
    assert refusal.value.time == requested.value.time


@pytest.mark.large_only
def test_each_compared_plan_has_the_radius_taken(problem: planner.PlanningProblem, plan: planner.Plan) -> None:
    (compared,) = planner.compare(problem, [planner.Trapezoidal()])
    assert compared.plan is not None
    assert blend_radii(compared.plan.problem)[1] == pytest.approx(blend_radii(plan.problem)[1], rel=2.0 * FINENESS)
    assert [warning.code for warning in blend_warnings(compared.plan)] == ["blend_reduced"]
