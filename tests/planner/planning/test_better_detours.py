"""Better paths: near the best on a dense grid, never worse, within their budget, and reproducible."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from math import gcd
from time import monotonic

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import dijkstra

import planner
from planner.comparison import figures
from planner.planning import better_detours
from planner.problems.motion_around import Objective
from planner.robots import Robot
from planner.spatial import FloatArray
from tests.planner.every_bit import every_bit
from tests.planner.free_motion.cases import ARM, LEFT, RIGHT, WALL
from tests.planner.scene.brute_force import least_distance

OBJECTIVES: tuple[Objective, ...] = ("duration", "effort", "path_length")
CELLS = 120
"""Number of cells of the grid along each joint."""

RADIUS = 0.05
"""Of the balls that the links are made of, m."""

WITHIN = 0.05
"""Allowed excess of a path over the path through the grid, whose steps in 32 directions make it 1 % too long."""


def joints(first: str, second: str, balls: dict[str, list[float]]) -> Robot:
    """Return a robot with two joints whose links are balls on a line along x."""
    links = "".join(
        f"<link name='{name}'>"
        + "".join(
            f"<collision><origin xyz='{x} 0 0'/><geometry><sphere radius='{RADIUS}'/></geometry></collision>"
            for x in places
        )
        + "</link>"
        for name, places in balls.items()
    )
    return Robot.from_urdf(f"<robot name='two'><link name='base'/>{links}{first}{second}</robot>", id="two")


def joint(number: int, kind: str, parent: str, axis: str, x: float = 0.0) -> str:
    return (
        f"<joint name='j{number}' type='{kind}'><parent link='{parent}'/><child link='l{number}'/>"
        f"<origin xyz='{x} 0 0'/><axis xyz='{axis}'/>"
        "<limit lower='-2' upper='2' velocity='1' effort='100'/></joint>"
    )


PLANE = joints(joint(1, "prismatic", "base", "1 0 0"), joint(2, "prismatic", "l1", "0 1 0"), {"l1": [], "l2": [0.0]})
"""A ball in a plane."""

ARM_LINKS = {"l1": [0.2, 0.3, 0.4], "l2": [0.1, 0.2, 0.3, 0.4, 0.5]}
ELBOW = joints(joint(1, "revolute", "base", "0 0 1"), joint(2, "revolute", "l1", "0 0 1", 0.5), ARM_LINKS)
"""An arm in a plane."""


def ball_at(position: FloatArray) -> FloatArray:
    return position[..., None, :]


def arm_at(position: FloatArray) -> FloatArray:
    """Return the centers (..., balls, 2) of the arm's balls."""
    first, both = position[..., 0, None], position.sum(axis=-1)[..., None]
    near, far = np.array(ARM_LINKS["l1"]), np.array(ARM_LINKS["l2"])
    inner = np.stack([near * np.cos(first), near * np.sin(first)], axis=-1)
    elbow = 0.5 * np.stack([np.cos(first), np.sin(first)], axis=-1)
    return np.concatenate([inner, elbow + np.stack([far * np.cos(both), far * np.sin(both)], axis=-1)], axis=-2)


def block(name: str, low: tuple[float, float], high: tuple[float, float]) -> planner.SceneObject:
    size, middle = np.subtract(high, low), np.add(low, high) / 2.0
    return planner.SceneObject(name, [planner.Box([*size, 1.0])], planner.Pose([*middle, 0.0]))


def is_clear(centers: FloatArray, blocks: list[planner.SceneObject]) -> np.ndarray:
    """Tell whether balls (..., balls, 2) keep clear of boxes that stand along the axes."""
    clear = np.ones(centers.shape[:-2], dtype=bool)
    for thing in blocks:
        half = np.asarray(thing.shapes[0].size)[:2] / 2.0  # type: ignore[attr-defined]
        beyond = np.maximum(np.abs(centers - thing.pose.position[:2]) - half, 0.0)
        clear &= (np.linalg.norm(beyond, axis=-1) >= RADIUS).all(axis=-1)
    return clear


def shortest(
    start: FloatArray, goal: FloatArray, at: Callable[[FloatArray], FloatArray], blocks: list[planner.SceneObject]
) -> float:
    """Compute the length of the shortest path on a grid (Dijkstra), by steps to cells up to three away."""
    axis = np.linspace(-2.0, 2.0, CELLS + 1)
    grid = np.stack(np.meshgrid(axis, axis, indexing="ij"), axis=-1)
    free = is_clear(at(grid), blocks)
    numbers = np.arange(free.size).reshape(free.shape)
    steps = [(i, j) for i, j in product(range(-3, 4), repeat=2) if (i, j) > (0, 0) and gcd(i, j) == 1]
    rows, columns, costs = [], [], []
    for i, j in steps:
        here = free[: len(axis) - i, max(0, -j) : len(axis) - max(0, j)]
        there = free[i:, max(0, j) : len(axis) + min(0, j)]
        first = numbers[: len(axis) - i, max(0, -j) : len(axis) - max(0, j)][here & there]
        second = numbers[i:, max(0, j) : len(axis) + min(0, j)][here & there]
        rows.append(first)
        columns.append(second)
        costs.append(np.full(len(first), float(np.hypot(i, j)) * (axis[1] - axis[0])))
    graph = coo_array((np.concatenate(costs), (np.concatenate(rows), np.concatenate(columns))), (free.size,) * 2)
    begin, end = (int(numbers[tuple(np.rint((q + 2.0) * CELLS / 4.0).astype(int))]) for q in (start, goal))
    return float(dijkstra(graph.tocsr(), directed=False, indices=begin)[end])


def planned(
    robot: Robot, scene: planner.Scene, start: FloatArray, goal: FloatArray, motion: planner.FreeMotion, seed: int = 0
) -> planner.Plan:
    waypoints = [planner.JointWaypoint(start.tolist()), planner.JointWaypoint(goal.tolist(), motion=motion)]
    options = planner.InverseKinematicsOptions(seed=seed)
    return planner.plan(
        planner.PlanningProblem(robot, waypoints, scene=scene, inverse_kinematics=options), planner.Toppra()
    )


def length(robot: Robot, blocks: list[planner.SceneObject], start: FloatArray, goal: FloatArray, seed: int) -> float:
    motion = planner.FreeMotion(optimise="path_length", optimise_checks=3000)
    plan = planned(robot, planner.Scene(blocks), start, goal, motion, seed)
    times = np.linspace(0.0, plan.trajectory.duration, 4000)
    return float(np.linalg.norm(np.diff(plan.trajectory.evaluate(times, [0])[0], axis=0), axis=1).sum())


NEAR_AND_FAR_GAP = [
    block("left", (-3.0, -0.1), (-1.5, 0.1)),
    block("middle", (-1.2, -0.1), (0.7, 0.1)),
    block("right", (1.0, -0.1), (3.0, 0.1)),
]


@pytest.mark.parametrize("seed", [0, *(pytest.param(k, marks=pytest.mark.large_only) for k in range(1, 5))])
def test_through_the_near_gap_of_two(seed: int) -> None:
    """A ball goes through a wall with gaps at -1.35 and 0.85: the path through the near one is shorter."""
    start, goal = np.array([0.0, -0.5]), np.array([0.0, 0.5])
    best = shortest(start, goal, ball_at, NEAR_AND_FAR_GAP)
    through_far = shortest(start, goal, ball_at, [*NEAR_AND_FAR_GAP, block("plug", (0.6, -0.1), (1.1, 0.1))])
    assert through_far > 1.3 * best
    found = length(PLANE, NEAR_AND_FAR_GAP, start, goal, seed)
    assert (1.0 - WITHIN) * best < found < (1.0 + WITHIN) * best


ELBOW_CASES = {
    "a post": ([block("post", (0.65, -0.05), (0.75, 0.05))], [-0.8, 0.3], [0.8, -0.3]),
    "a post nearby and one outside": (
        [block("inner", (0.55, 0.45), (0.62, 0.52)), block("outer", (0.6, -0.6), (0.7, -0.5))],
        [-1.2, 0.4],
        [1.6, 0.2],
    ),
    "the elbow turned over": ([block("post", (0.85, -0.05), (0.95, 0.05))], [0.2, -1.2], [-0.2, 1.2]),
}


@pytest.mark.parametrize(
    "name", ["a post", *(pytest.param(name, marks=pytest.mark.large_only) for name in list(ELBOW_CASES)[1:])]
)
def test_as_short_as_on_a_dense_grid(name: str) -> None:
    blocks, *ends = ELBOW_CASES[name]
    start, goal = map(np.array, ends)
    best = shortest(start, goal, arm_at, blocks)
    assert np.linalg.norm(goal - start) < 0.99 * best < np.inf
    found = length(ELBOW, blocks, start, goal, 0)
    assert (1.0 - WITHIN) * best < found < (1.0 + WITHIN) * best


SCENE = planner.Scene([WALL], margin=0.01)


def around_the_wall(**options: object) -> planner.Plan:
    return planned(ARM, SCENE, LEFT, RIGHT, planner.FreeMotion(**options))  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def plain() -> planner.Plan:
    """A plan along the first path: the budget ends before another one is tried."""
    return around_the_wall(optimise="duration", optimise_checks=1)


def test_without_an_objective_one_change_makes_the_first_way_quicker(plain: planner.Plan) -> None:
    quicker = around_the_wall()
    assert quicker.detours[0].gain is None
    assert quicker.trajectory.duration < 0.97 * plain.trajectory.duration
    assert least_distance(ARM, SCENE, quicker.trajectory) > 0.01 - 2e-5
    assert every_bit(quicker) == every_bit(around_the_wall())


@pytest.mark.parametrize(
    "objective", ["duration", *(pytest.param(name, marks=pytest.mark.large_only) for name in OBJECTIVES[1:])]
)
def test_better_than_the_first_way_and_as_free(objective: Objective, plain: planner.Plan) -> None:
    better = around_the_wall(optimise=objective, optimise_checks=1500)
    assert least_distance(ARM, SCENE, better.trajectory) > 0.01 - 2e-5
    assert better.certificate.satisfied
    assert better.certificate.clearance is not None
    gain = better.detours[0].gain
    assert gain is not None
    assert gain.objective == objective
    assert gain.candidates > 0
    for value, plan in ((gain.first, plain), (gain.last, better)):
        times = np.linspace(0.0, plan.trajectory.duration, 5001)
        positions = plan.trajectory.evaluate(times, [0])[0]
        known = {
            "duration": plan.trajectory.duration,
            "effort": figures(plan).effort,
            "path_length": np.linalg.norm(np.diff(positions, axis=0), axis=1).sum(),
        }[objective]
        assert value == pytest.approx(known, rel=1e-3)
    assert gain.last < (0.95 if objective != "effort" else 1.0) * gain.first


@pytest.mark.large_only
def test_equal_requests_have_equal_plans_and_other_seeds_other_ones() -> None:
    motion = planner.FreeMotion(optimise="duration", optimise_checks=600)
    first, again, other = (planned(ARM, SCENE, LEFT, RIGHT, motion, seed) for seed in (1, 1, 2))
    assert every_bit(first) == every_bit(again)
    assert first.trajectory.coefficients.tobytes() != other.trajectory.coefficients.tobytes()


@pytest.mark.parametrize("objective", OBJECTIVES)
def test_a_straight_way_stays_as_it_is(objective: Objective) -> None:
    nothing = planner.Scene([planner.SceneObject("far", [planner.Sphere(0.1)], planner.Pose([9.0, 0.0, 0.0]))])
    plans = [
        planned(ARM, nothing, LEFT, RIGHT, motion)
        for motion in (planner.FreeMotion(), planner.FreeMotion(optimise=objective, time_budget=60.0))
    ]
    assert plans[0].trajectory.coefficients.tobytes() == plans[1].trajectory.coefficients.tobytes()
    gain = plans[1].detours[0].gain
    assert gain is not None
    assert gain.first == gain.last
    assert gain.candidates == gain.checks == 0


def test_the_budget_is_kept(plain: planner.Plan, monkeypatch: pytest.MonkeyPatch) -> None:
    """The clock advances by a millisecond at each reading, whatever the machine's load."""
    reads = [0]

    def clock() -> float:
        reads[0] += 1
        return 1e-3 * reads[0]

    monkeypatch.setattr(better_detours, "monotonic", clock)
    monkeypatch.setattr("planner.free_motion.edges.monotonic", clock)
    around_the_wall()
    first_way = reads[0]
    for budget in (0.001, 0.3, 0.6):
        reads[0] = 0
        made = around_the_wall(optimise="duration", time_budget=budget)
        assert reads[0] < max(1e3 * budget, first_way) + 20
        gain = made.detours[0].gain
        assert gain is not None
        assert gain.last <= gain.first == plain.trajectory.duration
        if budget == 0.001:
            assert gain.candidates == 0
            assert made.trajectory.coefficients.tobytes() == plain.trajectory.coefficients.tobytes()


@pytest.mark.large_only
def test_the_budget_is_kept_by_the_real_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    """After the end of the budget, only unfinished work still reads the clock."""
    reads: list[float] = []

    def clock() -> float:
        reads.append(monotonic())
        return reads[-1]

    monkeypatch.setattr(better_detours, "monotonic", clock)
    monkeypatch.setattr("planner.free_motion.edges.monotonic", clock)
    made = around_the_wall(optimise="duration", time_budget=3.0)
    assert sum(read > reads[0] + 3.0 for read in reads) < 20
    assert made.detours[0].gain is not None


@pytest.mark.large_only
def test_two_ways_each_in_its_turn() -> None:
    """There and back: the second path begins where the first one ends, and each has its own budget."""
    waypoints = [
        planner.JointWaypoint(LEFT),
        planner.PoseWaypoint(
            planner.tool_pose(ARM, RIGHT), motion=planner.FreeMotion(optimise="duration", optimise_checks=400)
        ),
        planner.JointWaypoint(LEFT, motion=planner.FreeMotion(optimise="path_length", optimise_checks=400)),
    ]
    problem = planner.PlanningProblem(ARM, waypoints, scene=SCENE)
    made = planner.plan(problem, planner.Toppra())
    there, back = made.detours
    assert there.gain is not None
    assert back.gain is not None
    assert (there.gain.objective, back.gain.objective) == ("duration", "path_length")
    assert (there.positions[-1] == back.positions[0]).all()
    assert least_distance(ARM, SCENE, made.trajectory) > 0.01 - 2e-5


@pytest.mark.large_only
def test_of_the_configurations_of_a_pose_any_may_be_taken() -> None:
    goal = planner.PoseWaypoint(
        planner.tool_pose(ARM, RIGHT), motion=planner.FreeMotion(optimise="duration", optimise_checks=1500)
    )
    after = planner.JointWaypoint(RIGHT)
    problem = planner.PlanningProblem(ARM, [planner.JointWaypoint(LEFT), goal, after], scene=SCENE)
    made = planner.plan(problem, planner.Toppra())
    assert least_distance(ARM, SCENE, made.trajectory) > 0.01 - 2e-5
    reached = planner.tool_pose(ARM, made.detours[0].positions[-1])
    assert np.abs(reached.position - planner.tool_pose(ARM, RIGHT).position).max() < 1e-5


@pytest.mark.parametrize(
    ("options", "field"),
    [
        ({"time_budget": 1.0}, "time_budget"),
        ({"optimise_checks": 10}, "optimise_checks"),
        ({"optimise": "duration", "time_budget": float("nan")}, "time_budget"),
        ({"optimise": "duration", "optimise_checks": 0}, "optimise_checks"),
    ],
)
def test_budgets_that_make_no_sense(options: dict[str, object], field: str) -> None:
    with pytest.raises(planner.InvalidProblem) as refused:
        around_the_wall(**options)
    assert [fault.field for fault in refused.value.faults] == [("waypoints", 1, "motion", field)]
