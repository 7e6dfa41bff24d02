"""The benchmark of detours around obstacles: its judge, its scenes, and its steps from problems to figures."""

from __future__ import annotations

import io
from contextlib import redirect_stdout

import numpy as np
import orjson
import pytest

from benchmarks.collisions import measure, report, upright
from benchmarks.collisions.models import Contacts
from benchmarks.collisions.scenes import KINDS, ROOM, problem
from planner.free_motion import find_free_path
from planner.robots import load_robot
from planner.scene import CollisionChecker, Scene, SceneObject, is_free
from planner.shapes import Box
from planner.spatial import Pose
from tests.planner.capsule_arm import capsule_arm

ARM = load_robot("kuka_kr16_2")


def test_ends_of_problems_have_room_and_are_always_the_same() -> None:
    for kind in list(KINDS)[2:4]:
        found, again = problem(ARM, kind, 1), problem(ARM, kind, 1)
        np.testing.assert_array_equal([found.start, found.goal], [again.start, again.goal])
        ends = np.stack([found.start, found.goal])
        assert is_free(CollisionChecker(ARM, Scene(found.scene.objects, margin=ROOM * 0.99)), ends).all()
        assert not any(Contacts(ARM, found.scene, true_meshes=True).touches(end) for end in ends)


@pytest.mark.parametrize("gap", [0.002, -0.002])
def test_the_judge_sees_what_an_arm_touches_on_its_way(gap: float) -> None:
    """The arm turns about its vertical first joint; a box stands on the circle of its farthest point."""
    arm = capsule_arm()  # whose furthest point is known in closed form
    start, end = np.zeros((2, arm.dof))
    start[0], end[0] = -0.5, 0.5
    bodies = CollisionChecker(arm).bodies
    placements = bodies.at(np.linspace(start, end, 101))
    ends = placements.spheres[..., [0, -1], :]
    far = (np.hypot(ends[..., 0], ends[..., 1]) + bodies.radii[:, None])[:, bodies.joints > 0].max()
    box = SceneObject("box", [Box([0.2, 0.2, 10.0])], Pose([far + gap + 0.1, 0.0, 0.0]))
    judge = Contacts(arm, Scene([box]), true_meshes=True)
    assert judge.touches_along(np.stack([start, end])) == (gap < 0.0)
    assert not judge.touches_along(start[None].repeat(2, axis=0))


@pytest.mark.large_only
def test_a_few_problems_become_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(measure, "PEERS", {name: peer for name, peer in measure.PEERS.items() if not peer.installed})
    monkeypatch.setattr(measure, "measure_proofs", lambda robot, count: {"nothing": _nothing(robot.dof * 0 + count)})
    figures = measure.measure(1, [ARM.id], ["box", "table_under"])
    row = figures["arms"][ARM.id]["solvers"][measure.OURS]
    assert (row["solvable"], row["solved"], row["wrong"], row["touching"]) == (2, 2, 0, 0.0)
    with redirect_stdout(io.StringIO()) as out:
        report.print_json(figures)
    assert orjson.loads(out.getvalue())["absent"] == figures["absent"]
    with redirect_stdout(io.StringIO()) as out:
        report.print_table(figures)
    assert "2/2" in out.getvalue()
    assert all(name.split(",")[0] in out.getvalue() for name in figures["absent"])


@pytest.mark.large_only
@pytest.mark.parametrize("seed", [0, 2, 3])
def test_out_of_a_shelf_that_the_search_once_did_not_leave(seed: int) -> None:
    """The wrist is folded between boards: one seed of ten led out while all joints weighed the same."""
    robot = load_robot("ur5")
    asked = problem(robot, "tall_bookshelf", 12)
    way = find_free_path(robot, CollisionChecker(robot, asked.scene), asked.start, [asked.goal], seed=seed)
    assert way.status == "found"
    np.testing.assert_array_equal(way.positions[[0, -1]], [asked.start, asked.goal])
    assert not Contacts(robot, asked.scene, true_meshes=True).touches_along(way.positions)


def _nothing(count: int) -> dict[str, object]:
    return {"free": 0, "of": count, "proof": None, "clearance": None}


@pytest.mark.large_only
def test_an_upright_cup_is_carried_out_of_a_box_without_a_tipped_sample() -> None:
    robot = load_robot("ur5e")
    answer = upright.ours(robot, problem(robot, "box", 0, is_upright=True), 30.0)
    assert answer["found"]
    assert answer["tipped"] == 0
    assert not answer["touches"]
