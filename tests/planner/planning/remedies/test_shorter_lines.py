"""Remedies for straight lines whose ends are out of reach: a nearer end on the same line."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import planner
from planner import LinearMotion, Pose
from planner.planning.remedies.shorter_lines import nearer_ends
from tests.sizes import diagonal

STARTS = {
    "kuka_kr16_2": (0.2, -1.2, 1.4, 0.3, 0.8, 0.1),
    "ur5e": (0.2, -1.4, 1.6, -1.5, -1.4, 0.1),
    "fr3": (0.1, -0.3, 0.2, -1.9, 0.2, 1.7, 0.5),
}
FRAMES = {"base": None, "table": Pose.from_rpy([0.4, -0.2, 0.1], [0.1, -0.3, 1.0])}


def refusal_of(problem: planner.PlanningProblem) -> planner.PlanningError:
    with pytest.raises((planner.UnreachableWaypoint, planner.JointPositionLimit)) as refused:
        planner.plan(problem, "toppra")
    return refused.value


@pytest.mark.long_table
@pytest.mark.parametrize(("name", "start", "frame"), diagonal(STARTS, ["joint", "pose"], FRAMES))
def test_a_line_out_of_reach_has_a_nearer_end_on_the_same_line(name: str, start: str, frame: str) -> None:
    robot = planner.load_robot(name)
    here = planner.forward_kinematics(robot, STARTS[name])
    turn = Rotation.from_rotvec([0.0, 0.2, 0.3])
    far = Pose(here.position * (4.0 / np.linalg.norm(here.position)), here.rotation @ turn.as_matrix())
    own = FRAMES[frame]
    goal = planner.PoseWaypoint(far if own is None else far.to_frame(own), frame=own, motion=LinearMotion())
    first = planner.JointWaypoint(STARTS[name]) if start == "joint" else planner.PoseWaypoint(here)
    problem = planner.PlanningProblem(robot, [first, goal])
    (offered,) = refusal_of(problem).remedies
    assert planner.plan(offered.applied_to(problem), "toppra").certificate.satisfied
    assert name != "ur5e" or "of the line" in offered.explanation  # no line leads to its nearest pose
    way, shares = far.position - here.position, []
    for (remedy,) in nearer_ends(problem, 1):
        assert remedy.field == ("waypoints", 1, "pose")
        end = remedy.value if own is None else remedy.value.from_frame(own)
        share = float((end.position - here.position) @ way / (way @ way))
        assert end.position == pytest.approx(here.position + share * way, abs=1e-9)
        expected = Rotation.from_matrix(here.rotation) * Rotation.from_rotvec(share * turn.as_rotvec())
        assert (expected.inv() * Rotation.from_matrix(end.rotation)).magnitude() < 1e-6
        assert planner.inverse_kinematics(robot, end).status == "solved"
        shares.append(share)
    assert 0.9 > shares[0] > shares[1] > shares[2] > 0.01


def test_other_motions_have_no_nearer_end() -> None:
    robot = planner.load_robot("ur5e")
    far = planner.PoseWaypoint(Pose([4.0, 0.0, 0.0], np.eye(3)))
    for waypoints in ([far], [planner.JointWaypoint(STARTS["ur5e"]), far]):
        assert not list(nearer_ends(planner.PlanningProblem(robot, waypoints), len(waypoints) - 1))
