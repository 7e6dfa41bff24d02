"""Plans written to files and read again: all of the plan to the last bit, and one error for each other file."""

from __future__ import annotations

import json
import pickle
from dataclasses import dataclass, replace
from hashlib import sha256
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import planner
from planner.plans.saved import FORMAT
from planner.plans.values import decode, encode
from tests.planner.every_bit import every_bit

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

ARM = planner.load_robot("three_dof_arm")
KUKA = planner.load_robot("kuka_kr16_2")
HOME = planner.JointWaypoint([0.0, -1.5, 1.5, 0.0, 0.5, 0.0], name="home")
PICK = planner.JointWaypoint([1.0, -1.2, 1.2, 0.0, 0.5, 0.5])
UP = planner.RelativeWaypoint(
    planner.CartesianMove((0.0, 0.0, 0.1)),
    "base",
    motion=planner.LinearMotion(),
    transition=planner.BlendTransition(0.02),
)
DOWN = replace(UP, move=planner.CartesianMove((0.1, 0.0, -0.1)), transition=planner.StopTransition())
TABLE = planner.SceneObject("table", [planner.Box([1.0, 1.0, 0.1])], planner.Pose([1.2, 0.0, 0.2]))
FLAT = planner.SceneObject("sheet", [planner.ConvexHull([[0, 0, 3], [1, 0, 3], [0, 1, 3], [1, 1, 3]])])
POINTS = planner.SceneObject("points", [planner.PointCloud([[0.0, 3.0, 1.0], [0.2, 3.0, 1.0]], 0.02)])
PART = planner.AttachedObject("part", [planner.Sphere(0.02)], planner.Pose([0.0, 0.0, 0.05]))
GOALS: list[Any] = [HOME, planner.AnyOf((PICK, HOME))]
ONE_MOTION = planner.PlanningProblem(KUKA, [HOME, PICK])
PROBLEMS: dict[str, tuple[planner.PlanningProblem, planner.BackEnd]] = {
    "quintic": (ONE_MOTION, planner.Quintic()),
    "blended lines": (planner.PlanningProblem(KUKA, [HOME, UP, DOWN]), planner.Ruckig()),
    "in a scene": (
        planner.PlanningProblem(
            KUKA,
            [HOME, replace(PICK, motion=planner.FreeMotion())],
            scene=planner.Scene([TABLE, FLAT, POINTS], [PART], margin=0.01),
            speed_zones=[planner.SpeedZone(0.5, 0.3, ["table"])],
        ),
        planner.Trapezoidal(),
    ),
    "tools, payloads and tolerances": (
        planner.PlanningProblem(
            KUKA.derived(limits={"joint_a1": {"following_error": 0.001}}).with_tool(planner.Pose([0.0, 0.0, 0.1])),
            [
                HOME,
                replace(PICK, payload=planner.Payload(2.0, mass_tolerance=0.2)),
                replace(HOME, tool=planner.Pose([0.0, 0.1, 0.2]), put_down=True),
            ],
            limits=planner.Limits(tcp_linear_velocity=0.5),
            actions=[planner.SetOutput(planner.AtWaypoint(1), "gripper", True)],
        ),
        planner.Toppra(),
    ),
    "goal set": (replace(ONE_MOTION, waypoints=GOALS), planner.Cubic()),
}


def small_plan() -> planner.Plan:
    return planner.plan(planner.PlanningProblem(ARM, [planner.JointWaypoint([x] * 3) for x in (0.0, 0.1)]))


def saved_and_loaded(plan: planner.Plan, folder: Path) -> planner.Plan:
    plan.save(folder / "file.plan")
    return planner.load(folder / "file.plan")


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_loaded_plan_is_the_saved_one_to_the_last_bit(name: str, tmp_path: Path) -> None:
    """Its samples and its files are equal, too."""
    plan = planner.plan(*PROBLEMS[name])
    loaded = saved_and_loaded(plan, tmp_path)
    assert every_bit(loaded) == every_bit(plan)
    assert encode(loaded) == encode(plan)
    assert (loaded.samples().position == plan.samples().position).all()
    assert planner.render(loaded, "npz") == planner.render(plan, "npz")


def test_a_loaded_plan_is_proved_and_planned_again(tmp_path: Path) -> None:
    plan = small_plan()
    loaded = saved_and_loaded(plan, tmp_path)
    assert loaded.path.dynamics.robots[0] is loaded.problem.robot
    assert planner.write_proof(loaded) == planner.write_proof(plan)
    assert every_bit(planner.plan(loaded.problem, loaded.backend)) == every_bit(plan)


@pytest.mark.parametrize("id", ["three_dof_arm", "fr3", "kuka_kr16_2", "ur5e"])
def test_the_models_of_the_catalogue_are_read_to_the_last_bit(id: str) -> None:
    robot = planner.load_robot(id)
    loaded: planner.Robot = decode(json.loads(json.dumps(encode(robot), allow_nan=False)))
    ours, theirs = (own.model for own in (robot, loaded))
    assert theirs.gravity == ours.gravity
    for part in ("names", "parents", "jointPlacements", "inertias", "frames"):
        assert getattr(theirs, part).tolist() == getattr(ours, part).tolist()
    assert loaded.joints == robot.joints
    assert loaded.kinematic_content == robot.kinematic_content
    assert (loaded.chain.links == robot.chain.links).all()
    assert [shape.shape for shape in loaded.collision_shapes] == [shape.shape for shape in robot.collision_shapes]


@dataclass(frozen=True)
class OwnBackEnd(planner.Quintic):
    """A back end outside of the library."""


@dataclass(frozen=True)
class OwnWaypoint(planner.JointWaypoint):
    """A waypoint outside of the library."""


def test_values_that_are_not_of_the_library_are_refused_by_name(tmp_path: Path) -> None:
    with_own = replace(ONE_MOTION, waypoints=[HOME, OwnWaypoint(PICK.position)])
    for name, plan in {
        "OwnBackEnd": planner.plan(ONE_MOTION, OwnBackEnd()),
        "OwnWaypoint": planner.plan(with_own),
    }.items():
        with pytest.raises(TypeError, match=rf"^the plan cannot be saved: {__name__}\.{name} is no type of planner$"):
            plan.save(tmp_path / "file.plan")
        assert not list(tmp_path.iterdir())


def content_of(entries: Any, kind: str = FORMAT) -> bytes:
    """Return a file with these entries and a digest that matches."""
    content = json.dumps(entries).encode()
    return f"{kind} {sha256(content).hexdigest()}\n".encode() + content


def entry(name: str) -> bytes:
    return content_of([{"type": name, "parts": {}}])


OTHER_FILES: dict[str, tuple[Callable[[bytes], bytes], str]] = {
    "empty": (lambda _: b"", "is no plan that"),
    "a request": (lambda _: b'{"robot": "ur5e"}', "is no plan that"),
    "a pickle": (lambda _: pickle.dumps(PICK), "is no plan that"),
    "of a later version": (lambda file: file.replace(FORMAT.encode(), b"planner-plan/2", 1), "this version reads"),
    "truncated": (lambda file: file[: len(file) // 2], "is damaged"),
    "only a header": (lambda file: file.partition(b"\n")[0], "is damaged"),
    "with another digit": (lambda file: file[:-9] + b"7" + file[-8:], "is damaged"),
    "without entries": (lambda _: content_of([]), "cannot be read"),
    "another value": (lambda _: content_of(encode(PICK)), "has a JointWaypoint, no plan"),
    "a function": (lambda _: entry("os.system"), "os.system is no type of this version of planner"),
    "a module of another": (lambda _: entry("planner.spatial.np.ndarray"), "is no type of this version of planner"),
    "a function of the library": (lambda _: entry("planner.plans.saved.load"), "is no type of this version"),
    "a type that is no value": (lambda _: entry("planner.errors.PlanningError"), "is no type of this version"),
    "a field of a later version": (
        lambda _: content_of([{"type": "planner.spatial.Pose", "parts": {"scale": 2}}]),
        "planner.spatial.Pose has no scale",
    ),
    "arrays of objects": (lambda _: content_of([{"array": ["|O", [1], "AAAAAAAAAAA="]}]), "are not read"),
    "an entry before its parts": (lambda _: content_of([[{"entry": 1}], 1]), "entry 0"),
    "a joint before its parent": (
        lambda _: content_of([{"model": ["arm", 0, [["JointModelRZ", 3, 0, "a", 0]] * 2, []]}]),
        "entry 0",
    ),
}


@pytest.mark.parametrize("name", OTHER_FILES)
def test_another_file_is_refused_in_one_sentence(name: str, tmp_path: Path) -> None:
    change, sentence = OTHER_FILES[name]
    file = tmp_path / "file.plan"
    small_plan().save(file)
    file.write_bytes(change(file.read_bytes()))
    with pytest.raises(ValueError, match=sentence) as refused:
        planner.load(file)
    assert str(file) in str(refused.value)


def test_no_changed_content_ends_in_another_error(tmp_path: Path) -> None:
    """Values exchanged, left out or of another type: read as they are, or refused with a `ValueError`."""
    rng, file = np.random.default_rng(7), tmp_path / "file.plan"
    text = json.dumps(encode(small_plan()))
    refused = 0
    for _ in range(20):
        entries = json.loads(text)
        own: Any = entries[int(rng.integers(len(entries)))]
        while isinstance(own, dict | list) and own:
            keys = list(own) if isinstance(own, dict) else range(len(own))
            holder, key = own, keys[int(rng.integers(len(keys)))]
            own = own[key]
        holder[key] = [None, -1, "x", [], {}, {"entry": 0}, 1e308][int(rng.integers(7))]
        file.write_bytes(content_of(entries))
        try:
            planner.load(file)
        except ValueError:
            refused += 1
    assert refused > 2
