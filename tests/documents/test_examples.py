"""The examples run: every request file is planned, every script prints the document's figures beside ours."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from typing import TYPE_CHECKING

import pytest
from pydantic import TypeAdapter

from api.contract.robots import Changes, DerivedModel, RobotDefinition, UrdfModel
from api.contract.tasks import OrderRequest
from api.store.contents.mesh_archive import MeshArchive
from api.work.conversion.kept_meshes import keep_meshes
from api.work.conversion.problems import to_backend
from api.work.conversion.robots import to_robot
from api.work.conversion.task_orders import to_task_problem
from cli.work.local_plan import plan_request, read_request
from planner.errors import Collision
from planner.robots import load_robot
from planner.tasks import order_tasks
from tests.locations import ROOT

if TYPE_CHECKING:
    from planner.robots import Robot
    from tests.api.conftest import RunningService

EXAMPLES = ROOT / "examples"

REQUESTS = {  # waypoints, and the published duration, s; None: none is published
    "along_a_rail.json": (4, None),
    "any_of_grasps.json": (5, None),
    "anywhere_along_a_bar.json": (4, None),
    "around_a_wall.json": (2, None),
    "around_a_wall_faster.json": (2, None),
    "at_teach_speed.json": (4, None),
    "behind_a_crate_on_a_belt.json": (2, None),
    "blend_beside_a_post.json": (3, None),
    "blended_lines.json": (4, None),
    "brakes_gently.json": (3, None),
    "contours.json": (3, None),
    "date_sorting_alternative.json": (2, None),
    "date_sorting_over_trays.json": (2, 30.0),
    "date_sorting_point_5.json": (2, None),
    "date_sorting_points_1_2.json": (2, None),
    "date_sorting_points_3_4.json": (2, None),
    "date_sorting_transition_1.json": (2, 30.0),
    "date_sorting_transition_2.json": (2, 30.0),
    "elbow_room.json": (3, None),
    "elbow_saves_time.json": (3, None),
    "free_turn.json": (4, None),
    "from_belt_to_belt.json": (8, None),
    "full_cups.json": (3, None),
    "grinding_at_a_belt.json": (5, None),
    "gripper.json": (3, None),
    "in_a_cycle.json": (4, 6.0),
    "keeps_clear_as_it_follows.json": (3, None),
    "least_effort.json": (2, 6.0),
    "castings_of_several_weights.json": (3, None),
    "level_tray.json": (2, None),
    "lifts_within_its_power.json": (3, None),
    "named_configuration.json": (3, None),
    "on_a_pallet.json": (4, None),
    "past_a_singularity.json": (2, None),
    "past_a_switch.json": (3, None),
    "pick_and_place.json": (8, None),
    "pick_and_place_dates.json": (8, None),
    "pick_from_a_running_belt.json": (5, None),
    "refuelling_beside_the_car.json": (6, 25.29),
    "refuelling_case_1.json": (6, 25.29),
    "refuelling_case_1_poses.json": (6, 25.29),
    "refuelling_case_2.json": (5, 37.60),
    "round_torch.json": (4, None),
    "seam_on_a_positioner.json": (3, None),
    "slow_beside_a_walkway.json": (2, None),
    "still_after_each_motion.json": (3, None),
    "three_joint_arm_first.json": (3, 30.0),
    "three_joint_arm_second.json": (3, 30.0),
    "three_joint_arm_third.json": (3, 30.0),
    "two_tools.json": (4, None),
    "upright_cup.json": (2, None),
    "welding.json": (11, None),
    "welding_on_the_table.json": (11, None),
    "within_continuous_torque.json": (3, None),
}

IN_SCENES = ("refuelling_beside_the_car.json", "welding_on_the_table.json", "date_sorting_over_trays.json")
"""The documents' cases with their scenes."""


def run(script: str, *arguments: str) -> str:
    """Run a script and return its output."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "PYTHONWARNINGS": "error"}
    command = [sys.executable, str(EXAMPLES / script), *arguments]
    result = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=120, check=False)
    assert result.returncode == 0, result.stderr
    return result.stdout


def numbers(line: str) -> list[float]:
    return [float(text) for text in re.findall(r"-?\d+(?:\.\d+)?(?:e-?\d+)?", line)]


def line_of(output: str, start: str) -> str:
    """Return the line that starts with a text after its indent."""
    return next(line.strip() for line in output.splitlines() if line.strip().startswith(start))


def derived_robot(name: str) -> Robot:
    """Return the robot of `examples/robots` that is derived from a robot of the catalogue."""
    model = json.loads((EXAMPLES / "robots" / f"{name}.json").read_text())
    named = TypeAdapter(RobotDefinition).validate_python(model)
    changes = {field: getattr(named, field) for field in Changes.model_fields}
    return to_robot(DerivedModel(**changes | {"from": named.base, "definition": None}), named.id)


def test_every_request_file_is_known() -> None:
    assert sorted(path.name for path in EXAMPLES.glob("*.json")) == sorted(REQUESTS)


@pytest.mark.parametrize("name", IN_SCENES)
def test_cases_in_scenes_are_free_and_refused_without_room(name: str) -> None:
    """The same case with a margin beyond its clearance is refused, and planned with the margin that is offered."""
    request = json.loads((EXAMPLES / name).read_bytes())
    result = plan_request(read_request(json.dumps(request).encode()))
    clearance = result.certificate.clearance
    assert clearance is not None
    assert clearance.scene is not None
    assert clearance.scene.lower >= request["scene"]["margin"]
    request["scene"]["margin"] = clearance.scene.upper + 0.002
    with pytest.raises(Collision) as refusal:
        plan_request(read_request(json.dumps(request).encode()))
    (remedy,) = [remedy for remedy in refusal.value.remedies if remedy.field == ("scene", "margin")]
    assert request["scene"]["margin"] > remedy.value > clearance.scene.lower - 0.002
    request["scene"]["margin"] = remedy.value
    assert plan_request(read_request(json.dumps(request).encode())).certificate.satisfied


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if duration else pytest.mark.large_only) for name, (_, duration) in REQUESTS.items()],
)
def test_request_file_is_planned(name: str) -> None:
    waypoints, duration = REQUESTS[name]
    request = read_request((EXAMPLES / name).read_bytes())
    is_derived = (EXAMPLES / "robots" / f"{request.robot}.json").exists()
    result = plan_request(request, derived_robot(request.robot) if is_derived else None)
    assert result.certificate.satisfied
    assert sum(waypoint.choice != "detour" for waypoint in result.path.waypoints) == waypoints
    assert max(waypoint.position_error for waypoint in result.path.waypoints) < 1e-6
    if duration is not None:
        assert result.trajectory.duration == duration


@pytest.mark.large_only
@pytest.mark.parametrize(("name", "first"), [("drill_and_deburr", {0, 1, 2}), ("two_tools", {0, 1})])
def test_tasks_are_ordered_with_holes_before_edges(name: str, first: set[int]) -> None:
    request = OrderRequest.model_validate_json((EXAMPLES / "tasks" / f"{name}.json").read_bytes())
    problem, tasks, tools = to_task_problem(request, load_robot(request.robot))
    ordered = order_tasks(problem, tasks, to_backend(request.backend), tools=tools, mounted=request.mounted)
    assert set(ordered.order[: len(first)]) == first
    assert ordered.plan.certificate.satisfied
    assert 0.0 <= ordered.gap < 0.2


def test_refuelling_prints_the_durations_the_rounding_of_e13_and_the_distances_of_e2() -> None:
    output = run("refuelling.py")
    for case, total in (("case 1", 25.29), ("case 2", 37.60)):
        assert numbers(line_of(output, case))[1:3] == [total, total]
        assert line_of(output, case).endswith("satisfied")
    assert numbers(line_of(output, "2 "))[-1] == 1.53
    assert numbers(line_of(output, "6 "))[-1] == pytest.approx(0.605, abs=0.006)
    for point, distance in zip(range(1, 7), (24.7, 9.4, 46.1, 65.3, 39.1, 79.3), strict=True):
        *_, published, ours = numbers(line_of(output, f"P{point} "))
        assert published == distance
        assert ours == pytest.approx(distance, abs=0.1001)


def test_welding_prints_the_points_with_e14_and_e15_corrected() -> None:
    output = run("welding.py")
    corrected = {9: [-0.2040, 1.1279, 0.7502], 10: [-0.2283, 1.0653, 0.9597], 11: [-0.2150, 1.0994, 0.8455]}  # E16
    for point, position in corrected.items():
        assert numbers(line_of(output, f"{point} "))[4:7] == position
    for point in range(1, 6):
        assert numbers(line_of(output, f"{point} "))[7] <= 0.1  # mm from the printed point


def test_date_sorting_prints_the_points_the_torques_and_the_trapezoid() -> None:
    output = run("date_sorting.py")
    for point in range(1, 6):
        row = numbers(line_of(output, f"{point} "))
        assert row[1:4] == row[4:7]
        assert row[7] == 9.81
    assert numbers(line_of(output, "1 "))[8::2] == [1.4715]
    for time, s in ((10, 0.25), (20, 0.75), (30, 1.0)):
        assert numbers(line_of(output, f"{time} s  "))[1:3] == [s, s]
    assert "document 0.057 1/s   ours 0.000 1/s at s = 1" in output


def test_the_arm_on_a_lift_is_the_group() -> None:
    model = json.loads((EXAMPLES / "robots" / "arm_on_a_lift.json").read_text())
    robot = to_robot(TypeAdapter(RobotDefinition).validate_python(model), "arm_on_a_lift")
    assert robot.joint_names == ("turn", "bend")
    assert robot.named_positions == {"home": (0.0, -1.0)}


def test_the_meshes_of_an_arm_come_along() -> None:
    model = json.loads((EXAMPLES / "robots" / "arm_with_meshes.json").read_text())
    asked = TypeAdapter(RobotDefinition).validate_python(model)
    kept, findings = keep_meshes(
        UrdfModel(kind="urdf", urdf=asked.urdf), to_robot(asked, asked.id), MeshArchive(asked.meshes)
    )
    assert not findings
    shapes = to_robot(kept, asked.id).collision_shapes
    assert [shape.link for shape in shapes][:3] == ["base", "upper_arm", "upper_arm"]
    assert shapes[-1].link == "hand"
    assert {shape.source for shape in shapes} == {"model"}


def test_the_robot_of_an_owner_is_derived() -> None:
    robot = derived_robot("kuka_in_cell_4")
    assert robot.findings == ()
    assert robot.limit("acceleration")[[1, 2]].tolist() == [4.0, 4.0]
    assert robot.model.gravity.linear.tolist() == pytest.approx([0.0, 0.0, 9.81], abs=1e-12)


def test_three_joint_arm_asks_the_service(service: RunningService) -> None:
    output = run("three_joint_arm.py", service.url)
    assert numbers(line_of(output, "(30, 30, 30)"))[-3:] == [222.22, 128.30, -50.00]  # E21
    assert numbers(line_of(output, "(120, 120, 120)"))[-3:] == [-60.00, 103.92, -86.60]  # E21
    assert numbers(line_of(output, "(90, 90, -90)"))[-3:] == [45.00, 115.29, 115.43]  # E23
    for name in ("first", "second", "third"):
        assert numbers(line_of(output, f"{name} "))[:4] == [10.0, 15.0, 25.0, 30.0]
        assert line_of(output, f"{name} ").endswith("satisfied")


def test_three_joint_arm_without_a_service_says_how_to_call_it() -> None:
    command = [sys.executable, str(EXAMPLES / "three_joint_arm.py")]
    result = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert result.returncode == 1
    assert "SERVICE_URL" in result.stderr
