"""Document 004, the date-sorting arm (R P P R R R): kinematics, statics and the trapezoid; errata E26 to E33."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from api.work.answers.plans import AnswerOptions, as_dict
from cli.work.local_plan import plan_request, read_request
from planner.backends import Trapezoidal
from planner.dynamics import inverse_dynamics
from planner.kinematics import (
    FloatArray,
    Pose,
    all_solutions,
    forward_kinematics,
    inverse_kinematics,
    jacobian,
    workspace,
)
from planner.kinematics.options import InverseKinematicsOptions
from planner.planning import plan
from planner.plans.result import Plan
from planner.plans.tool_reports import line_polynomials
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots import Robot, load_robot
from planner.robots.payload import Payload
from tests.documents.published import angle_between, document, gantry, homogeneous, matrix
from tests.locations import ROOT

DOCUMENT = document("date_sorting")
POINTS = DOCUMENT["test_points"]["points"]
STATICS = DOCUMENT["statics"]
TRAPEZOID = DOCUMENT["trapezoid"]
TRANSITIONS = DOCUMENT["transitions"]

DEGREES, MILLIMETRES = 180.0 / np.pi, 1000.0
RANGES = {
    "theta1_deg": DEGREES,
    "l1_mm": MILLIMETRES,
    "l2_mm": MILLIMETRES,
    "theta2_deg": DEGREES,
    "theta3_deg": DEGREES,
    "theta4_deg": DEGREES,
}
"""The document's joints, in order, and what makes its units of ours."""

IDS = [f"point-{point['point']}" for point in POINTS]
every_point = pytest.mark.parametrize("point", POINTS, ids=IDS)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("date_sorting_arm")


def joints_of(point: dict[str, Any]) -> FloatArray:
    """Return (6,) in the order of the chain: theta1, l1, l2, theta2, theta3, theta4; rad and m."""
    theta1, theta2, theta3, theta4 = (np.radians(point[f"theta{i}_deg"]) for i in range(1, 5))
    return np.array([theta1, point["l1_mm"] / 1000.0, point["l2_mm"] / 1000.0, theta2, theta3, theta4])


def chain(q: FloatArray) -> FloatArray:
    """Return (4, 4): the product of the document's transforms, 2A3 with l2 in the y row (E26)."""
    theta1, l1, l2, theta2, theta3, theta4 = q
    return (
        homogeneous("z", theta1, (0, 0, 0.8))
        @ homogeneous(shift=(0, 0, l1))
        @ homogeneous(shift=(0, l2, 0))
        @ homogeneous("y", theta2, (0, 0.15, 0))
        @ homogeneous("z", theta3)
        @ homogeneous(shift=(0, 0.15, 0))
        @ homogeneous("y", theta4)
    )


def document_jacobian(q: FloatArray) -> FloatArray:
    """Return (6, 6) of Section 5.5, m, with element (2, 5) of E27 and the columns of E28 corrected."""
    (s1, s2, s3), (c1, c2, c3) = np.sin(q[[0, 3, 4]]), np.cos(q[[0, 3, 4]])
    l2, b = q[2], 0.15
    reach = b + b * c3 + l2
    return np.array(
        [
            [-c1 * reach + b * s1 * c2 * s3, 0, -s1, b * c1 * s2 * s3, b * (s1 * s3 - c1 * c2 * c3), 0],
            [-s1 * reach - b * c1 * c2 * s3, 0, c1, b * s1 * s2 * s3, -b * (c1 * s3 + s1 * c2 * c3), 0],
            [0, 1, 0, b * c2 * s3, b * s2 * c3, 0],
            [0, 0, 0, -s1, c1 * s2, -c1 * c2 * s3 - s1 * c3],
            [0, 0, 0, c1, s1 * s2, -s1 * c2 * s3 + c1 * c3],
            [1, 0, 0, 0, c2, s2 * s3],
        ]
    )


@every_point
def test_table_2_forward_kinematics(robot: Robot, point: dict[str, Any]) -> None:
    q = joints_of(point)
    pose = forward_kinematics(robot, q[None])[0]
    assert pose.position == pytest.approx(point["position_m"], abs=1e-12)
    assert matrix(pose) == pytest.approx(chain(q), abs=1e-12)


@every_point
def test_table_3_inverse_needs_the_orientation_too(robot: Robot, point: dict[str, Any]) -> None:
    """E29: position alone does not give the joints back; position and orientation give the pose back."""
    T = chain(joints_of(point))
    result = inverse_kinematics(robot, Pose(T[:3, 3], T[:3, :3]), InverseKinematicsOptions())
    assert result.status == "solved"
    reached = chain(result.position)
    assert np.linalg.norm(reached[:3, 3] - T[:3, 3]) < 1e-6
    assert angle_between(reached[:3, :3], T[:3, :3]) < 1e-6
    assert (result.position >= robot.limit("lower")).all()
    assert (result.position <= robot.limit("upper")).all()


@pytest.mark.parametrize("point", [POINTS[0], POINTS[1]], ids=IDS[:2])
def test_e30_two_solutions_within_the_limits_not_four(robot: Robot, point: dict[str, Any]) -> None:
    q = joints_of(point) + np.array([0.1, 0.0, 0.1, 0.2, 0.1, 0.3])  # away from the ends of the limits
    T = chain(q)
    solutions = all_solutions(robot, Pose(T[:3, 3], T[:3, :3]), InverseKinematicsOptions(), q)
    assert len(solutions) == 2
    assert solutions[0] == pytest.approx(q, abs=1e-6)


@every_point
def test_jacobian_with_e27_and_e28_corrected(robot: Robot, point: dict[str, Any]) -> None:
    q = joints_of(point)
    assert jacobian(robot, q) == pytest.approx(document_jacobian(q), abs=1e-12)


@pytest.mark.long_table
@pytest.mark.parametrize(
    ("figure", "key", "axes"),
    [
        ("minimum_radius", "min_radius_mm", [0, 1]),
        ("maximum_radius", "max_radius_mm", [0, 1]),
        ("minimum_height", "min_height_mm", [2]),
        ("maximum_height", "max_height_mm", [2]),
        ("radius_at_maximum_height", "radius_at_max_height_mm", [0, 1]),
    ],
)
def test_section_4_workspace(robot: Robot, figure: str, key: str, axes: list[int]) -> None:
    """43.93 (printed as 44), 800, 1450 and 650 mm."""
    extreme = getattr(workspace(robot, 1), figure)
    assert 1000.0 * extreme.value == pytest.approx(DOCUMENT["workspace"]["computed"][key], abs=1e-6)
    assert extreme.value == pytest.approx(np.linalg.norm(chain(extreme.position)[axes, 3]), abs=1e-12)


@every_point
def test_static_torques_equal_the_transposed_jacobian(robot: Robot, point: dict[str, Any]) -> None:
    """Holding 1 kg at the end effector; no link masses are published. E31: the formulas are right, the text is not."""
    q, still = joints_of(point), np.zeros((1, 6))
    torques = inverse_dynamics(robot.with_payload(Payload(STATICS["payload_kg"])), q[None], still, still)[0]
    force = np.array([0.0, 0.0, STATICS["force_N"], 0.0, 0.0, 0.0])
    assert torques == pytest.approx(document_jacobian(q).T @ force, abs=1e-12)
    expected = next(row for row in STATICS["computed_at_test_points"] if row["point"] == point["point"])
    l1, theta2, theta3 = expected["F_l1_N"], expected["T_theta2_Nm"], expected["T_theta3_Nm"]
    assert torques == pytest.approx([0.0, l1, 0.0, theta2, theta3, 0.0], abs=1e-12)


def test_e31_largest_static_torque_is_on_theta_2_then_on_theta_3(robot: Robot) -> None:
    """1.4715 N m: on theta2 at theta2 = 0, theta3 = 90, and on theta3 at 90, 0: the text has them swapped."""
    loaded = robot.with_payload(Payload(1.0))
    q = np.array([[0.0, 0.2, 0.2, 0.0, np.pi / 2.0, 0.0], [0.0, 0.2, 0.2, np.pi / 2.0, 0.0, 0.0]])
    torques = inverse_dynamics(loaded, q, np.zeros_like(q), np.zeros_like(q))
    assert torques[:, 3:5] == pytest.approx(np.array([[1.4715, 0.0], [0.0, 1.4715]]), abs=1e-12)


def transition(i: int, backend: Trapezoidal | None = None, duration: float = 30.0) -> Plan:
    """Return transition i as a straight Cartesian line of 30 s, with 10 s acceleration and 10 s braking."""
    start, end = (tuple(x / 1000.0 for x in TRANSITIONS[i][key]) for key in ("start_mm", "end_mm"))
    waypoints = (JointWaypoint(position=start), JointWaypoint(position=end, duration=duration))
    return plan(PlanningProblem(gantry(), waypoints), backend or Trapezoidal(acceleration_time=10.0))


@pytest.mark.parametrize("ramp", [0.1, 2.0, 7.3, 10.0, 14.9, 15.0])
def test_trapezoid_lasts_exactly_as_long_as_asked(ramp: float) -> None:
    """Ten thirds of a second and ten more once made 30.000000000000004 s."""
    result = transition(0, Trapezoidal(acceleration_time=ramp))
    assert result.trajectory.duration == 30.0
    assert result.trajectory.arrivals.tolist() == [0.0, 30.0]


@pytest.mark.parametrize("row", TRAPEZOID["computed"]["samples"]["rows"], ids=lambda row: f"t={row[0]}")
def test_trapezoid_samples(row: list[float]) -> None:
    """s = 0.25, 0.75, 1 at 10, 20, 30 s; at a corner the table has the acceleration before it."""
    result = transition(0)
    start, end = result.path.positions
    time = np.array([row[0]]) if row[0] in (0, 30) else np.nextafter([float(row[0])], 0.0)
    position, velocity, acceleration = result.trajectory.evaluate(time)
    s, ds, dds = (position - start) / (end - start), velocity / (end - start), acceleration / (end - start)
    for value, expected in zip((s, ds, dds), row[1:], strict=True):
        assert value[0] == pytest.approx(expected, abs=1e-12)


def test_trapezoid_peaks_with_a_of_0_005() -> None:
    result = transition(0)
    travel = np.diff(result.path.positions, axis=0)[0]
    assert result.trajectory.breakpoints == pytest.approx([0.0, 10.0, 20.0, 30.0], abs=1e-12)
    peaks = 2.0 * result.trajectory.coefficients[:, :, 2] / travel
    assert peaks == pytest.approx(np.outer([0.005, 0.0, -0.005], np.ones(3)), abs=1e-15)


@pytest.mark.parametrize("i", [0, 1], ids=["transition-1", "transition-2"])
def test_transition_peak_velocities(i: int) -> None:
    result = transition(i)
    assert result.trajectory.duration == 30.0
    assert result.certificate.satisfied
    cruising = result.trajectory.evaluate(np.linspace(10.0, 20.0, 11), [1])[0]
    for velocity in 1000.0 * cruising:
        assert velocity == pytest.approx(TRANSITIONS[i]["computed_peak_velocity_mm_s"], abs=1e-9)


def test_e33_unequal_ramps_still_end_at_rest_at_the_goal() -> None:
    """With T = 10, t1 = 2, t2 = 9 the document's formula ends at s = 1 with 0.057 1/s."""
    T, t1, t2 = 10.0, 2.0, 9.0
    a = 1.0 / (0.5 * t1**2 + t1 * (t2 - t1) + 0.5 * (2.0 * t1 - (T - t2)) * (T - t2))
    assert a * t1 - a * (T - t2) == pytest.approx(0.057, abs=5e-4)
    result = transition(0, Trapezoidal(acceleration_time=t1, deceleration_time=T - t2), T)
    position, velocity = result.trajectory.evaluate(np.array([T]), [0, 1])
    assert position[0] == pytest.approx(result.path.positions[1], abs=1e-12)
    assert velocity[0] == pytest.approx(np.zeros(3), abs=1e-15)
    assert result.trajectory.breakpoints == pytest.approx([0.0, t1, t2, T], abs=1e-12)


def test_transition_1_on_the_arm_itself(robot: Robot) -> None:
    """Test points 1 and 2 as poses, 30 s: ends where the document says, on its branch (theta3 = 90 at both)."""
    points = [chain(joints_of(point)) for point in POINTS[:2]]
    start, end = (Pose(T[:3, 3], T[:3, :3]) for T in points)
    waypoints = (PoseWaypoint(pose=start), PoseWaypoint(pose=end, duration=30.0))
    options = InverseKinematicsOptions(reference=tuple(joints_of(POINTS[0]).tolist()))
    result = plan(PlanningProblem(robot, waypoints, inverse_kinematics=options), Trapezoidal(acceleration_time=10.0))
    assert result.trajectory.duration == 30.0
    assert result.path.positions == pytest.approx(np.array([joints_of(point) for point in POINTS[:2]]), abs=1e-6)
    peak = result.trajectory.evaluate(np.array([15.0]), [1])[0][0]
    assert peak == pytest.approx(0.05 * (joints_of(POINTS[1]) - joints_of(POINTS[0])), abs=1e-7)


def test_transition_1_as_a_linear_motion_under_the_trapezoid(robot: Robot) -> None:
    """Straight in position, about one axis in orientation; the joints' ranges are those computed from the document."""
    points = [chain(joints_of(point)) for point in POINTS[:2]]
    goal = PoseWaypoint(pose=Pose(points[1][:3, 3], points[1][:3, :3]), duration=30.0, motion=LinearMotion())
    waypoints = (JointWaypoint(position=tuple(joints_of(POINTS[0]).tolist())), goal)
    result = plan(PlanningProblem(robot, waypoints), Trapezoidal(acceleration_time=10.0))
    times = np.linspace(0.0, 30.0, 3001)
    positions = result.trajectory.evaluate(times, [0])[0]
    ranges = TRANSITIONS[0]["computed_path_joint_ranges"]
    for j, (key, unit) in enumerate(RANGES.items()):
        low, high = (unit * float(extreme) for extreme in (positions[:, j].min(), positions[:, j].max()))
        assert low == pytest.approx(ranges[key][0], abs=1e-3)
        assert high == pytest.approx(ranges[key][1], abs=1e-3)
    start, way = points[0][:3, 3], points[1][:3, 3] - points[0][:3, 3]
    for t, q in zip(times[::30], positions[::30], strict=True):
        # s of Section 7 with a = 0.005 1/s^2
        s = 0.0025 * t**2 if t < 10.0 else 0.25 + 0.05 * (t - 10.0) if t < 20.0 else 1.0 - 0.0025 * (30.0 - t) ** 2
        T = chain(q)
        assert T[:3, 3] == pytest.approx(start + s * way, abs=1e-4)
        assert angle_between(points[0][:3, :3], T[:3, :3]) == pytest.approx(s * np.pi / 2.0, abs=1e-3)


def test_figures_21_to_29_of_transition_1_as_columns_of_the_samples(robot: Robot) -> None:
    """Roll, pitch and yaw, and velocity by time: ds/dt (d_g - d_s), and the turn about one axis, n ds/dt pi/2."""
    points = [chain(joints_of(point)) for point in POINTS[:2]]
    goal = PoseWaypoint(pose=Pose(points[1][:3, 3], points[1][:3, :3]), duration=30.0, motion=LinearMotion())
    waypoints = (JointWaypoint(position=tuple(joints_of(POINTS[0]).tolist())), goal)
    result = plan(PlanningProblem(robot, waypoints), Trapezoidal(acceleration_time=10.0))
    included = frozenset({"tcp_rpy", "tcp_velocity", "tcp_acceleration", "tcp_polynomials"})
    answer = as_dict(result, AnswerOptions(sample_period=0.5, include=included))
    samples = answer["samples"]
    t = np.array(samples["time"])
    ds = np.interp(t, [0.0, 10.0, 20.0, 30.0], [0.0, 0.05, 0.05, 0.0])
    velocity, acceleration = (
        {kind: np.array(rows) for kind, rows in samples[name].items()} for name in ("tcp_velocity", "tcp_acceleration")
    )
    way = points[1][:3, 3] - points[0][:3, 3]
    turn = Rotation.from_matrix(points[1][:3, :3] @ points[0][:3, :3].T).as_rotvec()
    assert velocity["linear"] == pytest.approx(np.outer(ds, way), abs=2e-5)
    assert velocity["angular"] == pytest.approx(np.outer(ds, turn), abs=2e-4)
    assert 1000.0 * velocity["linear"][30] == pytest.approx(
        np.array(TRANSITIONS[0]["computed_peak_velocity_mm_s"]), abs=0.02
    )
    phase = np.clip(t // 10.0, 0.0, 2.0).astype(int)
    dds = np.array([0.005, 0.0, -0.005])[phase]
    assert acceleration["linear"] == pytest.approx(np.outer(dds, way), abs=1e-4)
    s = np.where(phase == 0, 0.0025 * t**2, np.where(phase == 1, 0.05 * t - 0.25, 1.0 - 0.0025 * (30.0 - t) ** 2))
    rotations = Rotation.from_rotvec(np.outer(s, turn)) * Rotation.from_matrix(points[0][:3, :3])
    for row, expected in zip(samples["tcp_rpy"], rotations.as_matrix(), strict=True):
        assert angle_between(Rotation.from_euler("xyz", row).as_matrix(), expected) < 1e-3
    assert np.abs(np.diff(samples["tcp_rpy"], axis=0)).max() < 0.1
    (line,) = answer["tcp_polynomials"]
    assert line["breakpoints"] == pytest.approx([0.0, 10.0, 20.0, 30.0], abs=1e-12)
    assert np.array(line["path_parameter"]) == pytest.approx(
        np.array([[0.0, 0.0, 0.0025], [0.25, 0.05, 0.0], [0.75, 0.05, -0.0025]]), abs=1e-10
    )


def test_transition_2_on_the_arm_itself_by_position(robot: Robot) -> None:
    """Its orientation is not published (E33)."""
    ends = [np.array(TRANSITIONS[1][key]) / 1000.0 for key in ("start_mm", "end_mm")]
    waypoints = (PoseWaypoint(pose=Pose(ends[0])), PoseWaypoint(pose=Pose(ends[1]), duration=30.0))
    result = plan(PlanningProblem(robot, waypoints), Trapezoidal(acceleration_time=10.0))
    assert result.trajectory.duration == 30.0
    for waypoint, end in zip(result.path.waypoints, ends, strict=True):
        assert np.linalg.norm(chain(waypoint.position)[:3, 3] - end) < 1e-6


def test_transition_2_of_the_examples_is_the_documents_straight_line() -> None:
    """The arm's own tool, by position: the published velocity while it cruises from 10 to 20 s."""
    planned = plan_request(read_request((ROOT / "examples/date_sorting_transition_2.json").read_bytes()))
    (line,) = line_polynomials(planned)
    assert line.breakpoints == pytest.approx([0.0, 10.0, 20.0, 30.0], abs=1e-12)
    start, end = (np.array(TRANSITIONS[1][key]) for key in ("start_mm", "end_mm"))
    assert 1000.0 * line.position[0, :, 0] == pytest.approx(start, abs=1e-6)
    assert 1000.0 * line.position[1, :, 1] == pytest.approx(TRANSITIONS[1]["computed_peak_velocity_mm_s"], abs=1e-6)
    times = np.linspace(0.0, 30.0, 61)
    for t, q in zip(times, planned.trajectory.evaluate(times, [0])[0], strict=True):
        s = 0.0025 * t**2 if t < 10.0 else 0.25 + 0.05 * (t - 10.0) if t < 20.0 else 1.0 - 0.0025 * (30.0 - t) ** 2
        assert 1000.0 * chain(q)[:3, 3] == pytest.approx(start + s * (end - start), abs=0.01)
