"""Several threads may work with one robot at once: each gets the results of working alone."""

from __future__ import annotations

import sys
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

import planner
from planner.dynamics import inverse_dynamics
from planner.last_used import LastUsed
from planner.scene.separations import Placed, separation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.spatial import FloatArray

ROBOT = planner.load_robot("ur5e")
POSITIONS = np.random.default_rng(0).uniform(-3.0, 3.0, (400, ROBOT.dof))
STILL = np.zeros(ROBOT.dof)
BOXES = planner.Box([0.2, 0.3, 0.4]), planner.Box([0.1, 0.5, 0.2])

WORK: dict[str, Callable[[FloatArray], Any]] = {
    "tool_pose": lambda q: planner.tool_pose(ROBOT, q).position,
    "jacobian": lambda q: planner.jacobian(ROBOT, q),
    "inverse_dynamics": lambda q: inverse_dynamics(ROBOT, q, STILL, STILL),
    "separation": lambda q: (
        separation(
            *(Placed(box, np.eye(3), offset) for box, offset in zip(BOXES, (q[:3], q[3:] + 3.0), strict=True))
        ).distance
    ),
}


@pytest.fixture
def often_switched() -> Iterator[None]:
    """Let Python switch between threads as often as possible."""
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    yield
    sys.setswitchinterval(before)


@pytest.mark.parametrize("work", WORK.values(), ids=list(WORK))
@pytest.mark.usefixtures("often_switched")
def test_two_threads_with_one_robot_get_what_one_gets(work: Callable[[FloatArray], Any]) -> None:
    alone = [np.array(work(q)) for q in POSITIONS]

    def rows(order: list[int]) -> list[FloatArray]:
        return [np.array(work(POSITIONS[row])) for row in order]

    forwards = list(range(len(POSITIONS)))
    with ThreadPoolExecutor(2) as threads:
        found = list(threads.map(rows, (forwards, forwards[::-1])))
    for one, two, three in zip(alone, found[0], found[1][::-1], strict=True):
        assert (one == two).all()
        assert (one == three).all()


def test_each_thread_has_scratch_space_of_its_own() -> None:
    with ThreadPoolExecutor(1) as other:
        assert other.submit(lambda: ROBOT.data).result() is not ROBOT.data
    assert ROBOT.data is ROBOT.data


@pytest.mark.usefixtures("often_switched")
def test_two_threads_plan_what_one_plans() -> None:
    problems = [
        planner.PlanningProblem(
            ROBOT,
            [
                planner.JointWaypoint(POSITIONS[row]),
                planner.PoseWaypoint(planner.tool_pose(ROBOT, POSITIONS[row] + 0.1), motion=planner.LinearMotion()),
            ],
            inverse_kinematics=planner.InverseKinematicsOptions(reference=tuple(POSITIONS[row])),
        )
        for row in range(6)
    ]

    def ends(order: list[int]) -> list[float | str]:
        def end(row: int) -> float | str:
            try:
                return planner.plan(problems[row]).trajectory.duration
            except planner.PlanningError as refusal:
                return str(refusal)

        return [end(row) for row in order]

    alone = ends([0, 1, 2, 3, 4, 5])
    with ThreadPoolExecutor(2) as threads:
        one, two = threads.map(ends, ([0, 1, 2, 3, 4, 5], [5, 4, 3, 2, 1, 0]))
    assert one == alone
    assert two[::-1] == alone


@pytest.mark.usefixtures("often_switched")
def test_a_cache_that_threads_share_keeps_its_bound() -> None:
    cache: LastUsed[bytes] = LastUsed(1000, len)

    def use(seed: int) -> None:
        for key in np.random.default_rng(seed).integers(0, 50, 3000).tolist():
            assert cache.get(key, lambda key=key: bytes(key)) == bytes(key)

    with ThreadPoolExecutor(4) as threads:
        list(threads.map(use, range(4)))
    assert sum(size for _, size in cache.kept.values()) <= 1000
