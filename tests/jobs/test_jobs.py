"""What is said of the jobs is true."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from planner.problem import JointWaypoint, PoseWaypoint
from tests.jobs.arms import INSTALLED, places
from tests.jobs.corpus import VARIANTS, job, names, suite
from tests.jobs.infeasible import farthest
from tests.jobs.tracing import tool_at

SUITE = suite()


@pytest.mark.parametrize("name", SUITE)
def test_truth(name: str) -> None:
    """The reference positions of a job are within limits and reach its poses; what is infeasible says why."""
    asked = job(name)
    if asked.infeasible is not None:
        assert asked.codes
        return
    robot = asked.problem.robot
    assert asked.positions is not None
    assert len(asked.positions) == len(asked.problem.waypoints)
    assert (asked.positions >= robot.limit("lower") - 1e-12).all()
    assert (asked.positions <= robot.limit("upper") + 1e-12).all()
    for waypoint, q in zip(asked.problem.waypoints, asked.positions, strict=True):
        if isinstance(waypoint, JointWaypoint):
            assert np.abs(q - waypoint.position).max() <= 2e-6  # a start outside of a limit
        elif isinstance(waypoint, PoseWaypoint):
            tool = tool_at(robot, q)
            assert np.linalg.norm(tool.position - waypoint.pose.position) <= 1e-9
            if waypoint.pose.rotation is not None:
                assert np.linalg.norm(pin.log3(tool.rotation @ waypoint.pose.rotation.T)) <= 1e-9


@pytest.mark.parametrize("arm", INSTALLED)
def test_no_posture_reaches_further_than_all_links_end_to_end(arm: str) -> None:
    """What the infeasible jobs rest on."""
    robot = places(arm)[0].robot
    rng = np.random.default_rng(0)
    lower, upper = np.maximum(robot.limit("lower"), -np.pi), np.minimum(robot.limit("upper"), np.pi)
    reached = max(float(np.linalg.norm(tool_at(robot, rng.uniform(lower, upper)).position)) for _ in range(2_000))
    assert 0.5 * farthest(robot) < reached <= farthest(robot)


def test_corpus_covers_families_and_arms() -> None:
    arms = {name.rpartition("-")[2] for name in SUITE}
    families = {name.split("-")[0] for name in SUITE}
    assert families == set(VARIANTS)
    assert len(set(SUITE)) >= 300
    assert len(names()) >= 400 * len(arms)
    assert len(names()) >= 2_000 or len(arms) < 6
