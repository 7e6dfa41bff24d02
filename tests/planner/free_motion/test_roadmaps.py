"""Roadmaps have no blocked motion at dense samples, prove only changed surroundings again, and give certified plans."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import planner
from planner.errors import InvalidProblem
from planner.free_motion import find_free_path
from planner.roadmap import MOST_ROADMAP_POSITIONS, MOST_ROADMAP_SAMPLES
from planner.scene import CONTACT_TOLERANCE, Scene, SceneObject
from planner.shapes import Cylinder, HalfSpace, Sphere
from planner.spatial import FloatArray, Pose
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.free_motion.cases import ARM, LEFT, RIGHT, WALL
from tests.planner.scene.brute_force import distances_over_time

SHARES = np.linspace(0.0, 1.0, 8)
"""Shares of a motion at which it is looked at."""

POST = SceneObject("post", [Cylinder(0.08, 1.2)], Pose([0.2, 1.1, 0.6]))
FLOOR = SceneObject("floor", [HalfSpace([0.0, 0.0, 1.0])], Pose([0.0, 0.0, -0.5]))


def built(things: list[SceneObject], earlier: planner.Roadmap | None = None, samples: int = 25) -> planner.Roadmap:
    ends = [LEFT, RIGHT]
    return planner.build_roadmap(ARM, Scene(things, margin=0.01), samples=samples, positions=ends, earlier=earlier)


def least_distances(roadmap: planner.Roadmap, things: list[SceneObject]) -> FloatArray:
    """Return the least distance (edges,) of the arm from objects along each edge, m, by dense samples of capsules."""
    ends = roadmap.positions[roadmap.edges]
    rows = (ends[:, None, 0] + SHARES[:, None] * (ends[:, None, 1] - ends[:, None, 0])).reshape(-1, ARM.dof)
    times = np.arange(len(rows), dtype=np.float64)
    straight = PiecewisePolynomial(np.ones(len(rows) - 1), np.stack([rows[:-1], np.diff(rows, axis=0)], axis=-1))
    found = distances_over_time(ARM, Scene(things), times, straight)  # type: ignore[arg-type]
    least: FloatArray = np.nanmin(found.reshape(len(ends), -1), axis=1)
    return least


def motions_of(roadmap: planner.Roadmap) -> set[bytes]:
    return {roadmap.positions[ends].tobytes() for ends in roadmap.edges}


def is_same(first: planner.Roadmap, second: planner.Roadmap) -> bool:
    return first.to_bytes() == second.to_bytes()


@pytest.mark.large_only
def test_every_edge_is_free_at_dense_samples_and_the_scene_blocks_others() -> None:
    roadmap, without = built([WALL, FLOOR]), built([], samples=12)
    assert least_distances(roadmap, [WALL, FLOOR]).min() > 0.01 - CONTACT_TOLERANCE
    assert len(roadmap.edges) > 20
    assert (least_distances(without, [WALL, FLOOR]) < 0.01).any()


@pytest.mark.parametrize(
    ("before", "after"),
    [
        ([WALL], [WALL, POST]),
        ([WALL, POST], [WALL]),
        ([WALL, POST], [WALL, replace(POST, pose=Pose([0.9, 0.9, 0.6]))]),
        ([WALL, POST], [WALL, replace(POST, margin=0.1)]),
        ([WALL, FLOOR], []),
        ([], [FLOOR, WALL, POST]),
    ],
)
def test_after_a_change_it_has_the_edges_of_a_roadmap_built_anew(
    before: list[SceneObject], after: list[SceneObject]
) -> None:
    earlier = planner.build_roadmap(ARM, Scene(before, margin=0.01), samples=25)
    anew = planner.build_roadmap(ARM, Scene(after, margin=0.01), samples=25)
    changed = planner.build_roadmap(ARM, Scene(after, margin=0.01), samples=25, earlier=earlier)
    assert is_same(changed, anew)


def test_an_unchanged_scene_proves_nothing_again() -> None:
    roadmap = built([WALL, POST])
    again = built([POST, WALL], roadmap)
    assert is_same(again, roadmap)
    assert again.checked == 0


def test_an_added_object_leaves_no_blocked_edge_and_no_blocked_way() -> None:
    roadmap = built([WALL])
    (way,) = (roadmap.positions[list(nodes)] for nodes in roadmap.ways)
    middle = way[len(way) // 2]
    ball = SceneObject("ball", [Sphere(0.1)], Pose(planner.tool_pose(ARM, middle).position))
    changed = built([WALL, ball], roadmap)
    assert least_distances(changed, [WALL, ball]).min() > 0.01 - CONTACT_TOLERANCE
    assert changed.checked < built([WALL, ball]).checked
    kept = motions_of(changed) & motions_of(roadmap)
    assert len(kept) > len(roadmap.edges) / 3


@pytest.mark.large_only
def test_equal_histories_give_equal_bytes_and_equal_plans() -> None:
    def history() -> planner.Roadmap:
        roadmap = built([WALL])
        for things in ([WALL, POST], [WALL, POST, FLOOR], [WALL, FLOOR]):
            roadmap = planner.Roadmap.from_bytes(built(things, roadmap).to_bytes())
        return roadmap

    first, second = history(), history()
    assert is_same(first, second)
    plans = [planner.plan(problem([WALL, FLOOR], roadmap), planner.Ruckig()) for roadmap in (first, second)]
    assert [plan.trajectory.duration for plan in plans] == [plans[0].trajectory.duration] * 2


def problem(things: list[SceneObject], roadmap: planner.Roadmap | None) -> planner.PlanningProblem:
    goal = planner.JointWaypoint(RIGHT.tolist(), motion=planner.FreeMotion())
    return planner.PlanningProblem(
        ARM, [planner.JointWaypoint(LEFT.tolist()), goal], scene=Scene(things, margin=0.01), roadmap=roadmap
    )


def test_more_samples_extend_it_with_the_same_nodes() -> None:
    roadmap = built([WALL], samples=15)
    more = built([WALL], roadmap)
    assert is_same(more, built([WALL]))
    assert {row.tobytes() for row in roadmap.positions} <= {row.tobytes() for row in more.positions}


def test_a_plan_takes_the_short_path_of_the_roadmap_and_checks_few_motions() -> None:
    asked = problem([WALL], built([WALL]))
    with_it, without = (
        planner.plan(asked, planner.Ruckig()),
        planner.plan(replace(asked, roadmap=None), planner.Ruckig()),
    )
    assert with_it.certificate.satisfied
    assert with_it.trajectory.duration < 1.3 * without.trajectory.duration
    times = np.linspace(0.0, with_it.trajectory.duration, 500)
    assert np.nanmin(distances_over_time(ARM, Scene([WALL]), times, with_it.trajectory)) > 0.01 - CONTACT_TOLERANCE


@pytest.mark.parametrize("things", [[WALL, POST], [replace(WALL, pose=Pose([1.0, 0.0, 0.8]))], []])
def test_a_roadmap_of_another_scene_gives_a_certified_plan_all_the_same(things: list[SceneObject]) -> None:
    plan = planner.plan(problem(things, built([WALL])), planner.Ruckig())
    times = np.linspace(0.0, plan.trajectory.duration, 500)
    least = np.nanmin(distances_over_time(ARM, Scene(things), times, plan.trajectory)) if things else 1.0
    assert least > 0.01 - CONTACT_TOLERANCE


def test_an_empty_roadmap_and_one_of_other_ends_change_nothing() -> None:
    empty = planner.build_roadmap(ARM, Scene([WALL]), samples=0)
    assert len(empty.positions) == len(empty.edges) == 0
    with_it, without = (planner.plan(problem([WALL], one), planner.Ruckig()) for one in (empty, None))
    assert with_it.trajectory.duration == without.trajectory.duration


@pytest.mark.parametrize(
    ("arguments", "field"),
    [
        ({"samples": MOST_ROADMAP_SAMPLES + 1}, "samples"),
        ({"samples": -1}, "samples"),
        ({"positions": [[0.0, 1.0]]}, "positions"),
        ({"positions": [[float("nan")] * 6]}, "positions"),
        ({"positions": np.zeros((MOST_ROADMAP_POSITIONS + 1, 6))}, "positions"),
        ({"positions": [[1e3, 0.0, 0.0, 0.0, 0.0, 0.0]]}, "positions"),
    ],
)
def test_invalid_arguments_are_refused(arguments: dict[str, object], field: str) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        planner.build_roadmap(ARM, Scene([WALL]), **{"samples": 5, **arguments})  # type: ignore[arg-type]
    assert refusal.value.faults[0].field[0] == field


def test_a_roadmap_of_a_robot_with_other_joints_is_refused() -> None:
    other = planner.build_roadmap(planner.load_robot("three_dof_arm"), Scene([]), samples=5)
    with pytest.raises(InvalidProblem) as refusal:
        planner.plan(problem([WALL], other))
    assert [fault.field for fault in refusal.value.faults] == [("roadmap",)]


def test_the_positions_of_the_caller_stay_writable_and_its_own_are_not() -> None:
    ends = np.array([LEFT, RIGHT])
    roadmap = planner.build_roadmap(ARM, Scene([]), samples=5, positions=ends)
    ends[0, 0] = 0.0
    assert roadmap.given[0, 0] == LEFT[0]
    with pytest.raises(ValueError, match="read-only"):
        roadmap.positions[0, 0] = 1.0


@pytest.mark.parametrize(("start", "goal"), [(LEFT, RIGHT), (LEFT + 0.02, RIGHT - 0.02), (RIGHT, LEFT)])
def test_a_path_over_a_roadmap_checks_fewer_motions_than_a_search(start: FloatArray, goal: FloatArray) -> None:
    checker = planner.CollisionChecker(ARM, Scene([WALL], margin=0.01))
    with_it, without = (find_free_path(ARM, checker, start, goal[None], roadmap=one) for one in (built([WALL]), None))
    assert (with_it.status, without.status) == ("found", "found")
    assert (with_it.positions[[0, -1]] == [start, goal]).all()
    assert with_it.checks < without.checks


def test_bytes_that_are_no_roadmap_are_refused() -> None:
    content = built([WALL], samples=12).to_bytes()
    for wrong in (
        b"",
        content[:-4],
        content + b"0",
        content[8:],
        b"\xff" * 40,
        content.replace(b'"edges"', b'"sedge"'),
    ):
        with pytest.raises(InvalidProblem):
            planner.Roadmap.from_bytes(wrong)
