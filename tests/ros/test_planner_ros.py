"""`planner ros`, beside a double of rosbridge with a robot of known delay and error."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING

import numpy as np
import pytest
from typer.testing import CliRunner

from cli import app
from cli.work.runs.executed import compare
from cli.work.runs.rosbridge import JointState
from planner import JointWaypoint, PlanningProblem, load_robot, plan
from tests.ros.rosbridge_double import Robot, Rosbridge, rosbridge

if TYPE_CHECKING:
    from pathlib import Path

    from typer.testing import Result

JOINTS = ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"]
START = [0.0, -1.2, 1.2, -1.5, -1.5, 0.0]
REQUEST = {
    "robot": "ur5e",
    "waypoints": [
        {"kind": "joint", "position": START},
        {"kind": "joint", "position": [0.3, -1.0, 1.0, -1.4, -1.5, 0.4]},
    ],
    "backend": {"kind": "quintic"},
}


def run_plan(tmp_path: Path, bridge: Rosbridge, *arguments: str | Path) -> Result:
    path = tmp_path / "request.json"
    path.write_text(json.dumps(REQUEST))
    options = ["--bridge", f"127.0.0.1:{bridge.port}", *map(str, arguments)]
    return CliRunner().invoke(app, ["ros", str(path), *options])


@pytest.mark.large_only
def test_ros_runs_the_plan_and_finds_delay_and_error_of_the_robot(tmp_path: Path) -> None:
    robot = Robot(JOINTS[::-1], START[::-1], delay=0.08, bias=0.002)  # the order of the controller, not the planner's
    file = tmp_path / "run.csv"
    with rosbridge(robot) as bridge:
        result = run_plan(tmp_path, bridge, "--output", file)
    assert result.exit_code == 0, result.output
    (goal,) = robot.goals
    assert goal["args"]["trajectory"]["joint_names"] == JOINTS
    delay = float(result.stdout.split(" ms behind")[0].rsplit(" ", 1)[1]) / 1e3
    assert robot.delay - 0.01 < delay < robot.delay + 0.4  # with the time of the messages, which a busy machine delays
    rows = {line.split()[0]: line.split()[1:] for line in result.stdout.splitlines() if line.strip()}
    assert float(rows["wrist_3_joint"][0]) == pytest.approx(np.degrees(robot.bias), abs=0.15)
    assert float(rows["elbow_joint"][0]) < 0.15
    assert float(rows["elbow_joint"][4]) > 0.5  # its own feedback has the whole delay in it
    assert all(abs(float(rows[joint][2])) < 0.01 for joint in JOINTS)
    header, *lines = csv.reader(file.read_text().splitlines())
    assert header == ["time", *(f"{part}.{name}" for part in ("position", "planned_position") for name in JOINTS)]
    np.testing.assert_allclose(np.array(lines[-1][1:7], dtype=float), REQUEST["waypoints"][1]["position"], atol=1e-6)


@pytest.mark.large_only
def test_ros_takes_joint_states_between_messages_of_a_gripper(tmp_path: Path) -> None:
    robot = Robot(JOINTS, START, other_joints=["finger_joint"])
    with rosbridge(robot) as bridge:
        result = run_plan(tmp_path, bridge)
    assert result.exit_code == 0, result.output
    rows = {line.split()[0]: line.split()[1:] for line in result.stdout.splitlines() if line.strip()}
    assert all(abs(float(rows[joint][2])) < 0.01 for joint in JOINTS)


def test_ros_sends_nothing_to_an_arm_that_stands_elsewhere(tmp_path: Path) -> None:
    robot = Robot(JOINTS, [0.0, -1.2, 1.25, -1.5, -1.5, 0.0])
    with rosbridge(robot) as bridge:
        result = run_plan(tmp_path, bridge)
    assert result.exit_code == 1
    assert "elbow_joint is 2.8648 ° away from the start of the plan" in result.output
    assert robot.goals == []


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("robot", "message"),
    [
        (Robot(JOINTS, START, rejects=True), "follow_joint_trajectory: Action goal was rejected!"),
        (Robot(JOINTS, START, aborts_at=0.1), "aborted: PATH_TOLERANCE_VIOLATED: path tolerance of shoulder_pan_joint"),
        (Robot(JOINTS, START, breaks_at=0.1), "the connection to rosbridge broke, and the robot may still move"),
        (Robot(JOINTS[:5], START[:5]), "the joint states lack wrist_3_joint"),
    ],
)
def test_ros_reports_the_fault_of_the_robot(
    robot: Robot, message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("cli.work.runs.rosbridge.CONNECTION_SECONDS", 2.0)
    with rosbridge(robot) as bridge:
        result = run_plan(tmp_path, bridge)
    assert result.exit_code == 1
    assert message in " ".join(result.output.split())


def test_ros_names_a_silent_topic(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cli.work.runs.rosbridge.CONNECTION_SECONDS", 0.3)
    with rosbridge(Robot(JOINTS, START, publishes=False)) as bridge:
        result = run_plan(tmp_path, bridge, "--states", "/other/joint_states")
    assert result.exit_code == 1
    assert "no joint state came on /other/joint_states within 0.3 s" in " ".join(result.output.split())


@pytest.mark.large_only
def test_ros_cancels_a_goal_without_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cli.work.runs.executed.RESULT_SECONDS", 0.2)
    robot = Robot(JOINTS, START, delay=1.0)
    with rosbridge(robot) as bridge:
        result = run_plan(tmp_path, bridge)
        bridge.wait_for(lambda: robot.cancelled)
    assert result.exit_code == 1
    assert "sent no result within" in " ".join(result.output.split())
    assert robot.cancelled == [robot.goals[0]["id"]]


def test_ros_says_that_nothing_listens(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cli.work.runs.rosbridge.CONNECTION_SECONDS", 0.3)
    with rosbridge(Robot(JOINTS, START)) as bridge:
        pass
    result = run_plan(tmp_path, bridge)
    assert result.exit_code == 1
    assert f"no rosbridge accepts a connection at ws://127.0.0.1:{bridge.port}" in " ".join(result.output.split())


@pytest.mark.parametrize("bridge", ["9090", "somewhere", "somewhere:port"])
def test_ros_refuses_an_address_without_host_or_port(bridge: str, tmp_path: Path) -> None:
    path = tmp_path / "request.json"
    path.write_text(json.dumps(REQUEST))
    result = CliRunner().invoke(app, ["ros", str(path), "--bridge", bridge])
    assert result.exit_code == 2
    assert "must be HOST:PORT" in result.output


@pytest.mark.long_table
@pytest.mark.parametrize("delay", [0.0, 0.003, 0.0471, 0.4, 0.93])
def test_compare_finds_the_delay_of_noisy_states(delay: float) -> None:
    solved = plan(
        PlanningProblem(load_robot("ur5e"), [JointWaypoint(START), JointWaypoint([0.8, -1.0, 1.0, -1.4, -1.5, 0.4])])
    )
    rng = np.random.default_rng(3)
    clock = np.arange(0.0, solved.trajectory.duration + delay + 0.2, 0.008) + 1.7e9
    positions = solved.trajectory((clock - clock[0] - delay).clip(0.0, solved.trajectory.duration))
    positions = positions + rng.normal(scale=1e-4, size=positions.shape)
    names = solved.path.robot.joint_names
    states = [JointState(time, dict(zip(names, row, strict=True))) for time, row in zip(clock, positions, strict=True)]
    execution = compare(solved, states, clock[0])
    assert execution.delay == pytest.approx(delay, abs=2e-3)
    assert np.abs(execution.position - execution.planned).max() < 1e-3
