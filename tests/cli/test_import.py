"""`planner import`: requests from path files, which `planner plan` takes."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner, Result

from api.work.conversion.problems import to_planning_problem
from cli import app
from cli.work.local_plan import read_request
from planner import CircularMotion, Pose, PoseWaypoint, load_robot, read_path, rotation_from_rpy
from tests.locations import ROOT

PLATE = ROOT / "examples" / "paths" / "plate.ngc"


def planner(*arguments: str | Path) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


@pytest.mark.parametrize("blend", [None, 0.002])
def test_the_request_has_the_waypoints_of_the_library_in_its_frame(tmp_path: Path, blend: float | None) -> None:
    made = tmp_path / "plate.json"
    options = [
        "--position",
        "0.9",
        "0.1",
        "0.6",
        "--rpy",
        "0",
        "0",
        "0.2",
        "--frame",
        "table",
        "--tool-axis",
        "0,0.1,-1",
    ]
    options += [] if blend is None else ["--blend", str(blend)]
    result = planner("import", PLATE, "-o", made, "--robot", "kuka_kr16_2", *options)
    assert result.exit_code == 0, result.stderr
    assert "note: line 5: no waypoint" in result.stdout
    request = read_request(made.read_bytes())
    problem = to_planning_problem(request, load_robot("kuka_kr16_2"))
    frame = Pose([0.9, 0.1, 0.6], rotation_from_rpy(0.0, 0.0, 0.2))
    expected = read_path(PLATE, frame=frame, blend=blend, tool_axis=(0.0, 0.1, -1.0)).waypoints
    assert len(problem.waypoints) == len(expected)
    for got, wanted in zip(problem.waypoints, expected, strict=True):
        assert isinstance(got, PoseWaypoint)
        assert isinstance(wanted, PoseWaypoint)
        for one, other in ((got.pose_in_base, wanted.pose_in_base), *_middles(got, wanted)):
            np.testing.assert_allclose(one.position, other.position, atol=1e-9)
        np.testing.assert_allclose(got.pose_in_base.rotation, wanted.pose_in_base.rotation, atol=1e-9)
        assert type(got.motion) is type(wanted.motion)
        assert got.transition == wanted.transition
        limits = [None if each.limits is None else each.limits.tcp_linear_velocity for each in (got, wanted)]
        assert limits[0] == limits[1]
    planned = planner("plan", made, "-o", tmp_path / "plan.json")
    assert planned.exit_code == 0, planned.stderr
    assert json.loads((tmp_path / "plan.json").read_text())["certificate"]["satisfied"]


def _middles(one: PoseWaypoint, other: PoseWaypoint) -> list[tuple[Pose, Pose]]:
    if isinstance(one.motion, CircularMotion) and isinstance(other.motion, CircularMotion):
        return [(one.motion.via, other.motion.via)]
    return []


def test_joint_rows_become_joint_waypoints(tmp_path: Path) -> None:
    table, made = tmp_path / "rows.csv", tmp_path / "rows.json"
    table.write_text(",".join(load_robot("three_dof_arm").joint_names) + "\n0,10,20\n5,30,20\n")
    result = planner("import", table, "-o", made, "--robot", "three_dof_arm", "--angle", "deg", "--speed", "0.2")
    assert result.exit_code == 0, result.stderr
    request = json.loads(made.read_text())
    assert request["limits"] == {"tcp_linear_velocity": 0.2}
    assert request["waypoints"][1]["position"] == pytest.approx(np.radians([5.0, 30.0, 20.0]).tolist())
    assert "frames" not in request


def test_a_bad_file_is_a_problem_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "path.ngc"
    file.write_text("G0 X0 Y0 Z0\nG2 X10 R1\n")
    result = planner("import", file, "-o", tmp_path / "made.json", "--robot", "kuka_kr16_2")
    assert result.exit_code == 1
    assert "line 2:" in result.stderr
    assert not (tmp_path / "made.json").exists()
    assert planner("import", PLATE, "-o", tmp_path / "x", "--robot", "ur5e", "--tool-axis", "up").exit_code == 2
