"""Half-spaces of joint positions that keep a search clear, against distances by closed forms and brute force."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.paths import solve_path
from planner.paths.half_spaces import HalfSpaces
from planner.planning import variants
from planner.planning.half_spaces import HALF_SPACE_TIMES, half_spaces_between
from planner.robots import Robot, load_robot
from planner.scene import CollisionChecker, Scene, SceneObject
from planner.shapes import Box, Sphere
from planner.spatial import Pose
from tests.planner.problems_of_tests import problem_of
from tests.planner.scene.around_a_ball import BALL, GOAL, KUKA, REST, effort
from tests.planner.scene.brute_force import distances_over_time, least_distance

SEARCHING = planner.MinEffort(knots=24)


def test_they_hold_what_is_free_and_cut_off_what_is_not() -> None:
    scene = Scene([BALL], margin=0.01)
    problem = planner.PlanningProblem(KUKA, [REST, GOAL])
    free, other = (planner.plan(problem, by).trajectory for by in (planner.Quintic(), SEARCHING))
    found = half_spaces_between([CollisionChecker(KUKA, scene)], free, other, 0.002)
    shares = np.linspace(0.0, 1.0, HALF_SPACE_TIMES)
    inside = []
    for motion in (free, other):
        (positions,) = motion.evaluate(shares * motion.duration, [0])
        inside.append(np.einsum("krj,kj->kr", found.normals[0], positions) - found.offsets[0])
    there = found.normals[0].any(axis=2)
    assert there.any()
    np.testing.assert_allclose(np.linalg.norm(found.normals[0][there], axis=1), 1.0)
    assert inside[0][there].min() >= -1e-9
    links = distances_over_time(KUKA, scene, shares * other.duration, other)[:, :, 0]
    too_near = np.nanmin(links, axis=1) < 0.0119
    assert too_near.sum() > 3
    assert (np.where(there, inside[1], np.inf).min(axis=1)[too_near] < 0.0).all()


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_a_search_keeps_to_them_at_their_share(sign: float) -> None:
    """In the middle of the second segment, a joint is bounded to at most, or at least, half its free deviation."""
    first, middle, last = problem_of("kuka_kr16_l6_2", 3, 3).waypoints
    passed = replace(middle, transition=planner.ThroughTransition())
    problem = planner.PlanningProblem(load_robot("kuka_kr16_l6_2"), [first, passed, last])
    path = solve_path(problem)

    def halfway(motion: planner.Trajectory) -> np.ndarray:
        return np.asarray(motion.evaluate(motion.arrivals[1:].mean(keepdims=True), [0])[0][0])

    blind, quintic = SEARCHING.parametrize(path), SEARCHING.without_search().parametrize(path)
    away = halfway(blind) - halfway(quintic)
    joint = int(np.argmax(np.abs(away)))
    assert abs(away[joint]) > 1e-3
    bound = halfway(quintic)[joint] + (0.5 if sign < 0.0 else -0.5) * away[joint]
    normals, offsets = np.zeros((2, HALF_SPACE_TIMES, 1, 6)), np.full((2, HALF_SPACE_TIMES, 1), -1.0)
    normals[1, HALF_SPACE_TIMES // 2, 0, joint] = side = -np.sign(away[joint])
    offsets[1, HALF_SPACE_TIMES // 2, 0] = side * bound
    held = SEARCHING.parametrize(replace(path, half_spaces=HalfSpaces(normals, offsets)))
    if sign < 0.0:
        assert side * halfway(held)[joint] >= side * bound - 1e-7
        assert side * halfway(blind)[joint] < side * bound
    else:  # the quintic is outside, too: a search may come from there
        assert side * halfway(quintic)[joint] < side * bound
        assert side * halfway(held)[joint] >= side * bound - 1e-7
    assert effort(problem.robot, blind) <= effort(problem.robot, held) * (1.0 + 1e-6)


def around_its_way(rng: np.random.Generator, robot: Robot) -> tuple[planner.PlanningProblem, planner.Trajectory] | None:
    """Draw a job and its motion of least effort, which collides where the quintic does not."""
    lower, upper = np.maximum(robot.limit("lower"), -2.5), np.minimum(robot.limit("upper"), 2.5)
    ends = [planner.JointWaypoint(position) for position in rng.uniform(lower, upper, (2, robot.dof))]
    problem = planner.PlanningProblem(robot, ends, self_collision=False)
    try:
        blind, quintic = (planner.plan(problem, by).trajectory for by in (SEARCHING, SEARCHING.without_search()))
    except planner.PlanningError:
        return None
    for _ in range(20):
        time = rng.uniform(0.2, 0.8) * blind.duration
        (position,) = blind.evaluate(np.array([time]), [0])[0]
        place = planner.tool_pose(robot, position).position + rng.normal(size=3) * 0.03
        shape = Sphere(rng.uniform(0.01, 0.05)) if rng.random() < 0.5 else Box(rng.uniform(0.02, 0.1, 3))
        scene = Scene([SceneObject("thing", [shape], Pose(place))], margin=float(rng.choice([0.0, 0.01])))
        if (
            least_distance(robot, scene, quintic)
            > scene.margin + 1e-3
            > scene.margin
            > least_distance(robot, scene, blind)
        ):
            return replace(problem, scene=scene), blind
    return None


@pytest.mark.large_only
def test_it_costs_little_to_keep_clear(monkeypatch: pytest.MonkeyPatch) -> None:
    """Most of the effort that the search saves without obstacles is saved beside them, more than near the quintic."""
    rng, shares = np.random.default_rng(5), []
    while len(shares) < 8:
        job = around_its_way(rng, KUKA)
        if job is None:
            continue
        problem, blind = job
        assert problem.scene is not None
        clear, quintic = (planner.plan(problem, by) for by in (SEARCHING, SEARCHING.without_search()))
        with monkeypatch.context() as patch:
            patch.setattr(variants, "EXTRA_MARGINS", ())
            near = planner.plan(problem, SEARCHING)
        assert least_distance(KUKA, problem.scene, clear.trajectory) >= problem.scene.margin - 2e-5
        costs = [effort(KUKA, motion) for motion in (blind, clear.trajectory, near.trajectory, quintic.trajectory)]
        assert costs[1] <= costs[2] * (1.0 + 1e-6)
        shares.append((costs[3] - costs[1]) / (costs[3] - costs[0]))
    assert np.median(shares) > 0.7
