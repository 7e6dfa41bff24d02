"""The jobs: correct statements, plans within their promises, and refusals with a true reason."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from benchmarks.corpus import features
from benchmarks.corpus.arms import INSTALLED, places
from benchmarks.corpus.checks import is_in_its_region, keeps_promises, takes_no_longer_than_known
from benchmarks.corpus.corpus import BACK_ENDS, FROM_PACKAGE, VARIANTS, back_ends_of, job, names, plan_job, suite
from benchmarks.corpus.infeasible import farthest
from benchmarks.corpus.tracing import tool_at
from planner.errors import PlanningError
from planner.problems.problem import JointWaypoint, PoseWaypoint
from planner.robots import Robot
from tests.jobs.known_failures import KNOWN_FAILURES
from tests.sizes import NAME, SIZE

SUITE = suite()

PAIRS = (("cubic", "ruckig"), ("trapezoidal", "toppra"), ("quintic", "toppra_jerk_limited"), ("cubic", "auto"))
"""Back ends of a job, in turn. Jobs that need more than motions and limits also use `min_effort`.

A soak uses all back ends, though `min_effort` only for every fourth job."""

LONG = (
    "palletising",
    "pick_and_place",
    "gluing",
    "bin_picking",
    "screwdriving",
    "seam_weave",
    "seam_multi_pass",
    "deburring",
    "spraying",
)
"""Families with long lists: but for a soak one of the fastest back ends."""


def back_ends(k: int) -> tuple[str, ...]:
    """Return the back ends of a job of the suite."""
    kinds = back_ends_of(SUITE[k])
    if kinds != BACK_ENDS:
        return kinds if NAME == "soak" else kinds[k % 2 :: 2]
    if NAME == "soak":
        return BACK_ENDS if k % 4 == 0 else tuple(kind for kind in BACK_ENDS if kind != "min_effort")
    if SUITE[k].split("-")[0] in LONG:
        return ("trapezoidal",) if k % 2 else ("toppra",)
    return (*PAIRS[k % 4], "min_effort") if SUITE[k].split("-")[0] in features.FAMILIES else PAIRS[k % 4]


def cases() -> list[object]:
    causes = {entry: cause for cause, entries in KNOWN_FAILURES.items() for entry in entries}
    made = []
    for k in range(0, len(SUITE), SIZE.one_in):
        name = SUITE[k]
        for kind in back_ends(k):
            cause = causes.get(name) or causes.get(f"{name} {kind}")
            marks = [pytest.mark.xfail(reason=cause, strict=True)] if cause else []
            made.append(pytest.param(name, kind, marks=marks, id=f"{name}-{kind}"))
    return made


ONCE_REFUSED = [("fixed_axis-07-panda", "toppra"), ("fixed_axis-13-panda", "toppra_jerk_limited")]
"""Jobs outside of the suite that were refused: lines of a redundant arm of which one joint cannot move."""

ONCE_UNEXPLAINED = [("infeasible-07-date_sorting_arm", "ruckig"), ("infeasible-07-kuka_kr16_l6_2", "cubic")]
"""Jobs outside of the suite whose refusal, of a limit that is met on the way out of reach, was not looked into."""

ONCE_CRASHED = [("along_a_rail-02-ngv_refuelling_arm", "min_effort")]
"""Jobs outside of the suite that ended in an error: only massless bodies move, without any effort to minimise."""

ONCE = ONCE_REFUSED + ONCE_UNEXPLAINED + ONCE_CRASHED
FURTHER = [(name, kind) for name, kind in ONCE if name.rpartition("-")[2] in INSTALLED]


@pytest.mark.sized
@pytest.mark.parametrize(("name", "kind"), [*cases(), *FURTHER])
def test_job(name: str, kind: str) -> None:
    """A job is planned within its promises and the known duration, or refused for the known reason."""
    asked = job(name)
    if asked.infeasible is not None:
        with pytest.raises(PlanningError) as refusal:
            plan_job(asked, kind)
        assert refusal.value.code in asked.codes, f"{refusal.value.code}, though {asked.infeasible}"
        meets_its_limit_on_the_way(refusal.value, asked.problem.robot)
        return
    plan = plan_job(asked, kind)
    keeps_promises(plan, kind)
    takes_no_longer_than_known(plan, asked, kind)


def meets_its_limit_on_the_way(refusal: PlanningError, robot: Robot) -> None:
    """Check that a joint reported outside its limits is at its limit, and the tool at the reported pose."""
    there = refusal.path_point
    if refusal.code != "joint_position_limit" or there is None:
        return
    joint = [joint.name for joint in robot.joints].index(str(refusal.joint))
    assert there.position[joint] == pytest.approx(refusal.limit)
    assert tool_at(robot, there.position).position == pytest.approx(there.pose.position, abs=1e-6)


def test_every_known_failure_is_in_the_suite() -> None:
    """A job removed from the corpus is removed from the table; arms from the package of robots may be missing."""
    entries = [entry for listed in KNOWN_FAILURES.values() for entry in listed]
    assert len(entries) == len(set(entries))
    unknown = {entry.split(" ")[0] for entry in entries} - set(SUITE)
    assert not [name for name in unknown if name.rpartition("-")[2] not in FROM_PACKAGE]


@pytest.mark.long_table
@pytest.mark.parametrize("name", SUITE)
def test_truth(name: str) -> None:
    """The reference positions of a job are within limits and reach its poses; an infeasible job states its reason."""
    asked = job(name)
    if asked.infeasible is not None:
        assert asked.codes
        return
    robot = asked.problem.robot
    assert asked.positions is not None
    assert len(asked.positions) == len(asked.problem.waypoints)
    assert (asked.positions >= robot.limit("lower") - 1e-12).all()
    assert (asked.positions <= robot.limit("upper") + 1e-12).all()
    own = asked.problem.robots
    for robot, waypoint, q in zip(own, asked.problem.waypoints, asked.positions, strict=True):
        if isinstance(waypoint, JointWaypoint):
            assert np.abs(q - waypoint.position).max() <= 2e-6  # a start outside of a limit
        elif isinstance(waypoint, PoseWaypoint) and waypoint.free is not None:
            is_in_its_region(waypoint, tool_at(robot, q))
        elif isinstance(waypoint, PoseWaypoint):
            tool = tool_at(robot, q)
            assert np.linalg.norm(tool.position - waypoint.pose.position) <= 1e-9
            if waypoint.pose.rotation is not None:
                assert np.linalg.norm(pin.log3(tool.rotation @ waypoint.pose.rotation.T)) <= 1e-9


@pytest.mark.parametrize("arm", INSTALLED)
def test_no_joint_position_reaches_further_than_all_links_end_to_end(arm: str) -> None:
    """The infeasible jobs rely on this bound of the reach."""
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
