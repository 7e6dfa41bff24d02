"""The command line in process: its output, its files, and its exit status."""

from __future__ import annotations

import csv
import json
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import orjson
import pinocchio as pin
import pytest
from rich.console import Console
from typer.testing import CliRunner, Result

from cli import app, commands
from cli.options import robot_ids
from cli.work.local_plan import plan_request, read_request
from cli.work.runs.simulated import contact_lines
from cli.work.terminal import plan_summary
from planner.backends import BACKENDS
from planner.kinematics import forward_kinematics
from planner.plans.optimisation import Optimisation
from planner.robots import load_robot
from planner.simulation import Contact
from tests.api.conftest import RunningService
from tests.locations import ROOT

EXAMPLES = ROOT / "examples"
SHORT = {
    "robot": "three_dof_arm",
    "waypoints": [
        {"kind": "joint", "name": "low", "position": [0.0, 0.5, 0.5]},
        {"kind": "joint", "name": "high", "position": [0.5, 1.0, 1.0], "duration": 2.0},
    ],
    "sample_period": 0.5,
}


def planner(*arguments: str | Path, stdin: str | None = None) -> Result:
    return CliRunner().invoke(app, [str(argument) for argument in arguments], input=stdin)


@pytest.fixture
def request_file(tmp_path: Path) -> Path:
    path = tmp_path / "request.json"
    path.write_text(json.dumps(SHORT))
    return path


def test_help_loads_nothing_heavy() -> None:
    code = "import sys, cli; print([m for m in ('numpy', 'pydantic', 'pinocchio', 'fastapi') if m in sys.modules])"
    ran = subprocess.run([sys.executable, "-c", code], cwd=ROOT, check=True, capture_output=True, text=True)
    assert ran.stdout.strip() == "[]"


def test_plan_shows_waypoints_and_certificate(request_file: Path) -> None:
    result = planner("plan", request_file)
    assert result.exit_code == 0
    lines = result.stdout.splitlines()
    assert max(map(len, lines)) <= 100
    assert lines[1].startswith("three_dof_arm   cubic   2 s")
    (high,) = (line for line in lines if line.startswith("high"))
    assert high.split() == ["high", "2.000", "0.5000", "1.0000", "1.0000"]
    (velocity,) = (line for line in lines if line.startswith("velocity"))
    # The cubic's peak is 1.5 times the mean: 1.5 * 0.5 rad / 2 s, of 180 degrees a second.
    assert velocity.split()[2:7] == ["0.375", "3.142", "rad/s", "11.9", "%"]


def test_plan_shows_the_gain_of_a_requested_optimisation(request_file: Path) -> None:
    request = json.loads(request_file.read_text())
    del request["waypoints"][1]["duration"]
    request_file.write_text(json.dumps(request | {"optimise": "duration"}))
    lines = planner("plan", request_file).stdout.splitlines()
    assert "optimised  no shorter trajectory found (0 tried)" in lines
    plan = plan_request(read_request(request_file.read_bytes()))
    gained = replace(plan, optimisation=Optimisation(2.0, 1.75, 30, {1: np.zeros(3), 2: np.zeros(3)}, {3: 0.01}))
    console = Console(width=100)
    with console.capture() as shown:
        console.print(plan_summary(gained, 0.0))
    expected = "optimised  2 s before, 1.75 s now: 12.5 % shorter (30 tried, 2 waypoints moved, 1 blend changed)"
    assert expected in shown.get().splitlines()


@pytest.mark.large_only
def test_order_shows_the_order_and_writes_a_request_with_the_same_plan(tmp_path: Path) -> None:
    result = planner("order", EXAMPLES / "tasks/drill_and_deburr.json", "-o", tmp_path / "ordered.json")
    assert result.exit_code == 0, result.stderr
    lines = result.stdout.splitlines()
    rows = [
        line.split() for line in lines[next(k for k, line in enumerate(lines) if line.split()[:1] == ["Order"]) + 1 :]
    ]
    assert sorted(row[1] for row in rows[:5]) == ["0", "1", "2", "3", "4"]
    duration = lines[1].split()[2]
    planned = planner("plan", tmp_path / "ordered.json")
    assert planned.exit_code == 0
    assert planned.stdout.splitlines()[1].split()[2] == duration


def test_order_shows_the_fault_of_a_task_at_its_place() -> None:
    request = json.loads((EXAMPLES / "tasks/drill_and_deburr.json").read_text())
    request["tasks"][1]["after"] = ["nothing"]
    result = planner("order", "-", stdin=json.dumps(request))
    assert result.exit_code == 1
    assert "/tasks/1/after/0" in result.stderr
    del request["start"]
    assert "/start" in planner("order", "-", stdin=json.dumps(request)).stderr
    request["start"] = {"kind": "named", "name": "home"}
    assert planner("order", "-", "--time-budget", "0", stdin=json.dumps(request)).exit_code == 2


def test_plan_reads_stdin() -> None:
    assert planner("plan", "-", stdin=json.dumps(SHORT)).exit_code == 0


def test_plan_takes_another_back_end(request_file: Path) -> None:
    result = planner("plan", request_file, "--backend", "trapezoidal")
    assert result.exit_code == 0
    assert "three_dof_arm   trapezoidal   2 s" in result.stdout


def test_plan_writes_json(request_file: Path, tmp_path: Path) -> None:
    assert planner("plan", request_file, "-o", tmp_path / "out.json").exit_code == 0
    answer = json.loads((tmp_path / "out.json").read_text())
    assert answer["samples"]["time"] == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert answer["samples"]["position"][2] == pytest.approx([0.25, 0.75, 0.75])


def test_plan_writes_what_the_service_answers(service: RunningService, tmp_path: Path) -> None:
    request = EXAMPLES / "three_joint_arm_first.json"
    assert planner("plan", request, "-o", tmp_path / "out.json").exit_code == 0
    answer = service.client.post("/v1/trajectories", json=json.loads(request.read_bytes())).raise_for_status()
    written = orjson.loads((tmp_path / "out.json").read_bytes())
    assert written.pop("polynomials")  # a plan in a file is one that can be validated
    assert orjson.dumps(written) == answer.content


def test_plan_writes_csv(request_file: Path, tmp_path: Path) -> None:
    assert planner("plan", request_file, "-o", tmp_path / "out.csv").exit_code == 0
    with (tmp_path / "out.csv").open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["time"]) for row in rows] == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert float(rows[2]["position.joint_1"]) == pytest.approx(0.25)


def test_plan_writes_ros2(request_file: Path, tmp_path: Path) -> None:
    assert planner("plan", request_file, "-o", tmp_path / "out.ros2.json").exit_code == 0
    points = json.loads((tmp_path / "out.ros2.json").read_text())["points"]
    assert points[1]["time_from_start"] == {"sec": 0, "nanosec": 500_000_000}
    assert points[2]["positions"] == pytest.approx([0.25, 0.75, 0.75])


@pytest.mark.parametrize(
    ("suffix", "begins"),
    [
        ("src", b"DEF planned_trajectory()"),
        ("mod", b"MODULE PlannedTrajectory"),
        ("ls", b"/PROG  PLANNED"),
        ("script", b"# kuka_kr16_l6_2, quintic"),
        ("moves.script", b"# ur5e, quintic"),  # a program for the pendant names the arm's maker
        ("mcap", b"\x89MCAP0"),
    ],
)
def test_the_suffix_chooses_the_program(tmp_path: Path, suffix: str, begins: bytes) -> None:
    ends = ([0.0, -1.0, 1.0, 0.0, 0.5, 0.0], [0.5, -1.0, 1.0, 0.0, 0.5, 0.3])
    waypoints = [{"kind": "joint", "position": position} for position in ends]
    robot = "ur5e" if suffix == "moves.script" else "kuka_kr16_l6_2"
    request = {"robot": robot, "waypoints": waypoints, "backend": {"kind": "quintic"}}
    file = tmp_path / f"out.{suffix}"
    assert planner("plan", "-", "-o", file, stdin=json.dumps(request)).exit_code == 0
    content = file.read_bytes()
    assert content.startswith(begins)
    assert (b"servoj" in content) == (suffix == "script")


def test_what_a_form_cannot_carry_is_a_problem(request_file: Path, tmp_path: Path) -> None:
    result = planner("plan", request_file, "-o", tmp_path / "out.src")
    assert result.exit_code == 1
    assert "unsupported_format" in result.stderr
    assert not (tmp_path / "out.src").exists()


def test_a_problem_comes_with_its_remedies() -> None:
    hasty = json.dumps(SHORT).replace('"duration": 2.0', '"duration": 0.01')
    result = planner("plan", "-", stdin=hasty)
    assert result.exit_code == 1
    assert result.stdout == ""
    assert "infeasible_duration" in result.stderr
    assert "/waypoints/1/duration →" in result.stderr


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("{", "not JSON"),
        ("[]", "/"),
        ('{"robot": "three_dof_arm", "waypoints": []}', "/waypoints"),
        (json.dumps(SHORT | {"speed": 1}), "/speed"),
        (json.dumps(SHORT | {"robot": "nobody"}), "unknown_robot"),
    ],
)
def test_a_bad_request_is_a_problem_too(text: str, said: str) -> None:
    result = planner("plan", "-", stdin=text)
    assert result.exit_code == 1
    assert said in result.stderr


@pytest.mark.parametrize(
    "arguments",
    [
        ["plan"],
        ["plan", "no-such-file.json"],
        ["plan", str(EXAMPLES / "welding.json"), "-o", "out.xlsx"],
        ["plan", str(EXAMPLES / "welding.json"), "--backend", "magic"],
        ["plan", str(EXAMPLES / "welding.json"), "--format", "xlsx"],
        ["plan", str(EXAMPLES / "welding.json"), "--plot", "out.doc"],
        ["plan", str(EXAMPLES / "welding.json"), "--srdf", "no-such-file.srdf"],
        ["ik", "kuka_kr16_2"],
        ["serve", "--port", "70000"],
        ["dance"],
    ],
)
def test_wrong_usage_ends_with_2(arguments: list[str]) -> None:
    assert planner(*arguments).exit_code == 2


def test_a_bad_environment_ends_with_2_and_says_which(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PLANNER_QUEUE_SIZE", "many")
    result = planner("serve")
    assert result.exit_code == 2
    assert "PLANNER_QUEUE_SIZE" in result.stderr


def test_robots_are_listed() -> None:
    result = planner("robots")
    assert result.exit_code == 0
    assert "ngv_refuelling_arm_published" in result.stdout


def test_a_robot_is_shown_with_the_provenance_of_its_limits() -> None:
    result = planner("robots", "date_sorting_arm")
    assert result.exit_code == 0
    lines = [line.split() for line in result.stdout.splitlines()]
    assert ["l1", "prismatic", "0", "..", "0.5", "m"] in [line[:6] for line in lines]
    assert ["l1", "published"] in [line[:2] for line in lines]


def test_a_robot_is_shown_with_its_notes() -> None:
    shown = " ".join(planner("robots", "three_dof_arm").stdout.split())
    assert "The arm hangs from its foot: the z axis of its base points downwards" in shown


def test_an_unknown_robot_is_a_problem() -> None:
    result = planner("robots", "nobody")
    assert result.exit_code == 1
    assert "unknown_robot" in result.stderr


def test_a_plan_is_written_to_stdout(request_file: Path) -> None:
    result = planner("plan", request_file, "-o", "-", "--format", "csv")
    assert result.exit_code == 0
    rows = list(csv.DictReader(result.stdout.splitlines()))
    assert [float(row["time"]) for row in rows] == [0.0, 0.5, 1.0, 1.5, 2.0]
    assert "every enforced limit is kept" in result.stderr


def test_the_clearance_is_told_that_was_proved() -> None:
    result = planner("plan", EXAMPLES / "welding_on_the_table.json", "-o", "-", "--format", "json")
    assert result.exit_code == 0
    proved = json.loads(result.stdout)["certificate"]["clearance"]["scene"]
    [told] = re.findall(r"clear by ([\d.]+) mm at all times between (\S+) and (\S+), nearest", result.stderr)
    assert 0.0 <= proved["lower"] - float(told[0]) * 1e-3 < 1.1e-4
    assert list(told[1:]) == proved["pair"]


@pytest.mark.parametrize("margin", [0.0, 0.2])
def test_the_clearance_of_estimated_shapes_is_told_as_an_estimate(tmp_path: Path, margin: float) -> None:
    """The margin that the command line advises is the uncertainty of the certificate."""
    ball = {"id": "ball", "shape": {"kind": "sphere", "radius": 0.05}, "pose": {"position": [1.5, 1.5, 0.0]}}
    request = {
        "robot": "ur5e",
        "waypoints": [
            {"kind": "joint", "position": [0.0, -1.5, 1.5, -1.5, -1.5, 0.0]},
            {"kind": "joint", "position": [0.3, -1.5, 1.5, -1.5, -1.5, 0.0]},
        ],
        "self_collision": False,
        "scene": {"objects": [ball], "margin": margin},
    }
    path = tmp_path / "request.json"
    path.write_text(json.dumps(request))
    result = planner("plan", path, "-o", "-", "--format", "json")
    assert result.exit_code == 0, result.stderr
    proved = json.loads(result.stdout)["certificate"]["clearance"]["scene"]
    assert proved["shapes"] == "estimate"
    is_covered = proved["lower"] >= proved["uncertainty"]
    words = "estimate: this covers the" if is_covered else "margin of at least"
    [told] = re.findall(rf"{words} ([\d.]+) mm", " ".join(result.stderr.split()))
    assert 0.0 <= float(told) * 1e-3 - proved["uncertainty"] < 1.1e-4


@pytest.mark.large_only
def test_the_speeds_near_objects_are_told_that_were_proved() -> None:
    result = planner("plan", EXAMPLES / "slow_beside_a_walkway.json", "-o", "-", "--format", "json")
    assert result.exit_code == 0
    proved = json.loads(result.stdout)["certificate"]["speed_zones"]
    told = re.findall(r"nearer than ([\d.]+) m to walkway no faster than ([\d.]+) of ([\d.]+) m/s", result.stderr)
    assert len(told) == len(proved) == 2
    for (clearance, peak, limit), zone in zip(told, proved, strict=True):
        assert (float(clearance), float(limit)) == (zone["clearance"], zone["limit"])
        assert 0.0 <= float(peak) - zone["peak"] <= 1.1e-3


def test_a_robot_of_a_file_is_planned_for(tmp_path: Path) -> None:
    """The catalogue's KUKA is a URDF file with limits of its own: the plan takes the same time with either."""
    urdf = tmp_path / "my arm (left).urdf"
    urdf.write_text((ROOT / "planner/robots/data/kuka_kr16_2.urdf").read_text())
    ends = ([0.0, -1.0, 1.0, 0.0, 0.5, 0.0], [0.5, -1.0, 1.0, 0.0, 0.5, 0.3])
    request = {"robot": "x", "waypoints": [{"kind": "joint", "position": position} for position in ends]}
    limits = {"limits": {"velocity": [1.0] * 6, "acceleration": [3.0] * 6, "jerk": [20.0] * 6}}
    answers = []
    for robot in (urdf, "kuka_kr16_2"):
        result = planner("plan", "-", "--robot", robot, "-o", tmp_path / "out.json", stdin=json.dumps(request | limits))
        assert result.exit_code == 0, result.stderr
        answers.append(json.loads((tmp_path / "out.json").read_text()))
    assert answers[0]["robot"] == "my_arm_left_"
    assert answers[0]["duration"] == pytest.approx(answers[1]["duration"], rel=1e-12)
    assert answers[0]["request_hash"] != answers[1]["request_hash"]


XACRO = """
<robot name="arm" xmlns:xacro="http://www.ros.org/wiki/xacro">
  <xacro:arg name="reach" default="0.4"/>
  <link name="base"/>
  <joint name="turn" type="revolute"><parent link="base"/><child link="tip"/><axis xyz="0 0 1"/>
    <limit lower="-1.5" upper="1.5" velocity="2" effort="30"/></joint>
  <link name="tip"><collision><geometry><mesh filename="package://arm/wedge.obj" scale="$(arg reach) 1 1"/></geometry>
  </collision></link>
</robot>
"""


@pytest.mark.large_only
def test_a_xacro_file_becomes_a_request_with_its_meshes(tmp_path: Path, service: RunningService) -> None:
    """Its shape is as long as the argument says; a plan with the request is slower than one with the file alone."""
    (tmp_path / "arm").mkdir()
    (tmp_path / "arm/arm.xacro").write_text(XACRO)
    (tmp_path / "arm/wedge.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 2 4\nf 1 3 4\nf 2 3 4\n")
    (tmp_path / "limits.yaml").write_text("joint_limits: {turn: {max_velocity: !degrees 60}}")
    made, options = tmp_path / "arm.json", ("--argument", "reach:=0.7", "--joint-limits", tmp_path / "limits.yaml")
    result = planner("robots", tmp_path / "arm/arm.xacro", *options, "-o", made)
    assert result.exit_code == 0, result.stderr
    assert "1.047 rad/s" in result.stdout
    added = service.post("/v1/robots", json.loads(made.read_text()))
    assert added.status_code == 201, added.text
    assert added.json()["joints"][0]["velocity"] == pytest.approx(np.pi / 3)
    (shape,) = service.client.get("/v1/robots/arm/geometry").json()["shapes"]
    service.client.delete("/v1/robots/arm").raise_for_status()
    assert np.max(shape["shape"]["vertices"], axis=0)[0] == pytest.approx(0.7)
    request = {"robot": "x", "waypoints": [{"kind": "joint", "position": [end]} for end in (0.0, 1.0)]}
    plans = [
        planner("plan", "-", "--robot", robot, "--format", "json", "-o", "-", stdin=json.dumps(request))
        for robot in (made, tmp_path / "arm/arm.xacro")
    ]
    durations = [json.loads(plan.stdout)["duration"] for plan in plans]
    assert durations[0] > durations[1] > 0.5


def test_findings_that_differ_only_in_the_joint_are_one_line(tmp_path: Path) -> None:
    file = tmp_path / "arm.urdf"
    joints = "".join(
        f'<joint name="j{k}" type="{kind}"><parent link="l{k}"/><child link="l{k + 1}"/><axis xyz="0 0 1"/>'
        '<limit lower="-1" upper="1" effort="5"/></joint>'
        for k, kind in enumerate(["revolute", "revolute", "prismatic", "revolute"])
    )
    links = "".join(f'<link name="l{k}"/>' for k in range(5))
    file.write_text(f'<robot name="arm">{links}{joints}</robot>')
    shown = " ".join(planner("robots", file).stdout.split())
    assert "limits of j0 by the default rule, in SI units: velocity 3.14159" in shown
    assert "(likewise j1, j3)" in shown
    assert "limits of j2 by the default rule, in SI units: velocity 1" in shown


def test_an_option_of_a_file_without_a_file_is_a_problem(tmp_path: Path) -> None:
    (tmp_path / "limits.yaml").write_text("joint_limits: {turn: {max_velocity: 1}}")
    result = planner("robots", "ur5e", "--joint-limits", tmp_path / "limits.yaml")
    assert result.exit_code == 1
    assert "got ur5e" in result.stderr
    assert planner("robots", "ur5e", "--argument", "x=1").exit_code == 2
    assert planner("robots", "ur5e", "-o", tmp_path / "out.json").exit_code == 2


def test_a_robot_that_is_derived_in_a_file_is_planned_for(tmp_path: Path) -> None:
    rail = EXAMPLES / "robots" / "ur5e_on_rail.json"
    result = planner("plan", EXAMPLES / "along_a_rail.json", "--robot", rail, "-o", tmp_path / "out.json")
    assert result.exit_code == 0, result.stderr
    answer = json.loads((tmp_path / "out.json").read_text())
    assert answer["robot"] == "ur5e_on_rail"
    assert answer["joint_names"][0] == "rail"


@pytest.mark.parametrize(
    ("text", "said"), [("{", "not JSON"), ("[]", "invalid_request"), ('{"kind": "dh", "joints": []}', "/convention")]
)
def test_a_file_that_describes_no_robot_is_a_problem(tmp_path: Path, text: str, said: str) -> None:
    file = tmp_path / "robot.json"
    file.write_text(text)
    result = planner("robots", file)
    assert result.exit_code == 1
    assert said in result.stderr


def test_a_srdf_names_the_tip(tmp_path: Path) -> None:
    urdf, srdf = tmp_path / "arm.urdf", tmp_path / "arm.srdf"
    text = (ROOT / "planner/robots/data/kuka_kr16_2.urdf").read_text()
    links = re.findall(r'<link name="([^"]+)"', text)
    urdf.write_text(text)
    chain = f'<group name="arm"><chain base_link="{links[0]}" tip_link="{links[3]}"/></group>'
    srdf.write_text(f'<robot name="r">{chain}</robot>')
    assert f"tip frame {links[3]}" in planner("robots", urdf, "--srdf", srdf).stdout
    assert f"tip frame {links[2]}" in planner("robots", urdf, "--tip", links[2]).stdout


@pytest.mark.parametrize("suffix", ["png", "svg", "html"])
def test_a_plan_is_drawn(request_file: Path, tmp_path: Path, suffix: str) -> None:
    drawn = tmp_path / f"out.{suffix}"
    assert planner("plan", request_file, "--plot", drawn).exit_code == 0
    content = drawn.read_bytes()
    assert len(content) > 20_000
    if suffix == "png":
        assert content.startswith(b"\x89PNG")
        return
    assert b"<svg" in content
    if suffix == "html":
        assert b"every enforced limit is kept" in content
        assert not re.search(rb'(src|href)="https?:', content)


def test_ik_lists_joint_positions_that_reach_the_pose() -> None:
    """Forward kinematics of the printed joint positions gives the pose."""
    robot = load_robot("kuka_kr16_2")
    result = planner("ik", "kuka_kr16_2", "--position", "1.2", "0.1", "0.8", "--rpy", "3.0", "-0.2", "0.1")
    assert result.exit_code == 0
    found = [line.split()[1:7] for line in result.stdout.splitlines() if re.match(r"\s*\d+ ", line)]
    assert len(found) >= 2
    positions = np.array(found, dtype=float)
    for pose in forward_kinematics(robot, positions):
        assert np.linalg.norm(pose.position - [1.2, 0.1, 0.8]) <= 1e-4
        assert pose.rotation is not None
        assert np.abs(pin.rpy.matrixToRpy(pose.rotation) - [3.0, -0.2, 0.1]).max() <= 1e-4
    assert len(np.unique(positions.round(3), axis=0)) == len(positions)


def test_ik_says_why_there_is_no_solution() -> None:
    result = planner("ik", "three_dof_arm", "--position", "9", "0", "0")
    assert result.exit_code == 1
    assert "unreachable_waypoint" in result.stderr
    assert "nearest" in result.stderr


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS.keys() - {"min_effort"}))
def test_a_plan_that_is_piped_into_validate_keeps_its_limits(kind: str) -> None:
    """The samples of a quintic alone break its limit of jerk where two of its pieces meet between them."""
    written = planner("plan", EXAMPLES / "welding.json", "--backend", kind, "-o", "-")
    assert written.exit_code == 0, written.stderr
    result = planner("validate", "-", stdin=written.stdout)
    assert result.exit_code == 0, result.stdout + result.stderr
    assert "interpolation: polynomials" in result.stdout


@pytest.mark.parametrize("suffix", ["csv", "json"])
def test_a_plan_is_validated(request_file: Path, tmp_path: Path, suffix: str) -> None:
    """A cubic of 0.5 rad in 2 s has its peak of velocity, 0.375 rad/s, in the middle, between two samples."""
    file = tmp_path / f"out.{suffix}"
    assert planner("plan", request_file, "-o", file).exit_code == 0
    result = planner("validate", file, "--interpolation", "cubic", "--robot", "three_dof_arm")
    assert result.exit_code == 0, result.stdout + result.stderr
    (velocity,) = (line for line in result.stdout.splitlines() if line.startswith("velocity"))
    assert velocity.split()[2] == "0.375"


def test_a_request_that_breaks_a_limit_ends_with_1(tmp_path: Path) -> None:
    """Straight lines of 0.25 rad in 0.5 s: 0.5 rad/s where 0.3 are allowed."""
    file = tmp_path / "asked.json"
    samples = {"time": [0.0, 0.5], "position": [[0.0, 0.0, 0.0], [0.25, 0.0, 0.0]]}
    file.write_text(json.dumps({"robot": "three_dof_arm", "samples": samples, "limits": {"velocity": [0.3] * 3}}))
    result = planner("validate", file)
    assert result.exit_code == 1
    (velocity,) = (line for line in result.stdout.splitlines() if line.startswith("velocity"))
    assert velocity.split()[1:6] == ["joint_1", "0.5", "0.3", "rad/s", "166.7"]


@pytest.mark.parametrize(
    ("height", "speed", "shown", "code"),
    [(9.0, 1.0, "clear by", 0), (0.0, 1.0, "ball", 1), (9.0, 1e-3, "0.001 m/s", 1)],
    ids=["free", "collision", "speed zone"],
)
def test_the_scene_and_the_speed_zones_of_a_request_are_validated(
    tmp_path: Path, height: float, speed: float, shown: str, code: int
) -> None:
    """They were not looked at, and a trajectory through an object was valid."""
    samples = {"time": [0.0, 5.0], "position": [[0.0, 0.0, 0.0], [0.5, 0.0, 0.0]]}
    ball = {"id": "ball", "shape": {"kind": "sphere", "radius": 0.1}, "pose": {"position": [0.0, 0.0, height]}}
    zone = {"clearance": 9.0, "speed": speed}
    file = tmp_path / "asked.json"
    request = {"robot": "three_dof_arm", "samples": samples, "scene": {"objects": [ball]}, "speed_zones": [zone]}
    file.write_text(json.dumps(request))
    result = planner("validate", file)
    assert result.exit_code == code, result.stdout + result.stderr
    assert shown in result.stdout
    assert "warning" in result.stdout
    file.write_text(json.dumps(request | {"scene": "stored"}))
    assert "only a service stores scenes" in " ".join(planner("validate", file).stderr.split())


@pytest.mark.parametrize(
    "text", ["", "time\n", "a,b\n1,2\n", "time,position.a\n0,x\n", "[]", "{}", "time,position.a\n0\n"]
)
def test_what_is_no_trajectory_is_a_problem(text: str) -> None:
    result = planner("validate", "-", "--robot", "three_dof_arm", stdin=text)
    assert result.exit_code == 1
    assert "invalid_request" in result.stderr


def test_a_file_that_cannot_be_written_ends_with_2(request_file: Path, tmp_path: Path) -> None:
    result = planner("plan", request_file, "-o", tmp_path / "no-such-folder/out.csv")
    assert result.exit_code == 2
    assert "No such file or directory" in result.stderr


def test_the_version_is_shown() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+\S*\n", planner("--version").stdout)


def test_robots_are_completed() -> None:
    assert [*robot_ids("kuka")] == ["kuka_kr16_2", "kuka_kr16_l6_2"]


def test_a_fault_of_the_command_line_is_one_line(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def fail() -> None:
        raise ZeroDivisionError("secret")

    monkeypatch.setattr(commands, "app", fail)
    with pytest.raises(SystemExit) as ended:
        commands.main()
    assert ended.value.code == 70
    told = capfd.readouterr().err
    assert "ZeroDivisionError" in told
    assert "secret" not in told
    assert told.count("\n") == 1


@pytest.mark.large_only
def test_a_proof_is_written_and_checked(request_file: Path, tmp_path: Path) -> None:
    file = tmp_path / "proof.json"
    assert planner("plan", request_file, "--proof", file).exit_code == 0
    result = planner("check", file)
    assert result.exit_code == 0, result.stderr
    assert result.stdout.startswith("accepted: continuity, waypoints, velocity")
    proof = json.loads(file.read_text())
    assert planner("check", "-", stdin=json.dumps({"proof": proof})).exit_code == 0
    assert planner("check", file, "--statement", proof["digests"]["statement"]).exit_code == 0
    assert planner("check", file, "--trajectory", proof["digests"]["statement"]).exit_code == 1
    proof["trajectory"]["coefficients"][0][0][0] += 0.01
    result = planner("check", "-", stdin=json.dumps(proof))
    assert (result.exit_code, result.stderr) == (1, "rejected: a digest does not match\n")
    assert planner("check", "-", stdin="{").exit_code == 1


@pytest.mark.large_only
def test_a_plan_is_simulated(tmp_path: Path) -> None:
    """The table and the file have the same largest following error and torque of each joint."""
    request = EXAMPLES / "past_a_switch.json"
    file, picture = tmp_path / "run.csv", tmp_path / "run.svg"
    result = planner("simulate", request, "--mass-error", "0.1", "-o", file, "--plot", picture)
    assert result.exit_code == 0, result.stderr
    with file.open(newline="") as opened:
        rows = list(csv.DictReader(opened))
    for name in load_robot("ur5e").joint_names:
        (line,) = (line.split() for line in result.stdout.splitlines() if line.startswith(name))
        error, torque = (
            max(
                abs(float(row[f"{kind}.{name}"]) - float(row.get(f"planned_{kind}.{name}", 0.0)) * is_error)
                for row in rows
            )
            for kind, is_error in (("position", 1), ("torque", 0))
        )
        assert float(line[1]) == pytest.approx(np.degrees(error), abs=1e-4)
        assert float(line[8]) == pytest.approx(torque, rel=1e-3)
    assert picture.read_bytes().startswith(b"<?xml")
    assert "no contacts" in result.stdout


def test_contacts_of_a_run_are_told_with_time_and_depth() -> None:
    run = SimpleNamespace(contacts=(Contact(("hand", "table"), 0.12, 0.00312, 0.4),))
    [line] = contact_lines(run)  # type: ignore[arg-type]
    assert line == "contact of hand and table from 0.12 s, at most 3.12 mm deep at 0.4 s"


@pytest.mark.parametrize(
    ("options", "status", "said"),
    [
        (("--feed-forward", "everything"), 2, "torque, gravity, none"),
        (("-o", "run.json"), 2, ".csv"),
        (("--plot", "run.html"), 2, ".png or .svg"),
        (("--frequency", "500"), 1, "`frequency` must be at most 50 Hz"),
    ],
)
def test_a_simulation_that_cannot_be_is_refused(options: tuple[str, ...], status: int, said: str) -> None:
    result = planner("simulate", EXAMPLES / "past_a_switch.json", *options)
    assert result.exit_code == status
    assert said in " ".join(result.stderr.replace("│", " ").split())


def test_a_robot_without_masses_cannot_be_simulated() -> None:
    result = planner("simulate", EXAMPLES / "date_sorting_point_5.json")
    assert result.exit_code == 1
    assert "missing_dynamics" in result.stderr
