"""The robots of the catalogue, against the documents' equations and the manufacturers' figures."""

from __future__ import annotations

import json
import math
import subprocess
import sys

import numpy as np
import pinocchio as pin
import pytest

from planner.errors import UnknownRobot
from planner.robots import catalogue, catalogue_ids, load_robot
from planner.robots.payload import Payload
from tests.locations import DATA, ROOT
from tests.planner.robots.frames import frame_pose, numeric_jacobian, product, rot, trans
from tests.robots_extra import OF_EXTRA, OWN, is_extra_installed, lacks_extra

KUKAS = {"kuka_kr16_l6_2": (0.97, 0.115, 1.911), "kuka_kr16_2": (0.67, 0.158, 1.611)}
"""Forearm, wrist to flange and reach of KUKA's data sheets, m."""
FIGURES = {
    "kuka_kr16_l6_2": [156, 156, 156, 335, 355, 647],
    "ngv_refuelling_arm": [156, 156, 156, 335, 355, 647],
    "ngv_refuelling_arm_published": [156, 156, 156, 335, 355, 647],
    "kuka_kr16_2": [156, 156, 156, 330, 330, 615],
    "welding_arm": [156, 156, 156, 330, 330, 615],
}
"""KUKA's axis speeds, degrees/s."""


def reference(name: str) -> dict:
    return json.loads((DATA / f"{name}.json").read_text())


def random_positions(dof: int, count: int = 100) -> np.ndarray:
    return np.random.default_rng(1).uniform(-np.pi, np.pi, (count, dof))


def test_the_catalogue_names_its_robots() -> None:
    assert set(catalogue_ids()) == OWN | (OF_EXTRA if is_extra_installed() else set())
    assert list(catalogue_ids()) == sorted(catalogue_ids())
    assert load_robot("welding_arm") is load_robot("welding_arm")
    with pytest.raises(UnknownRobot, match=r"date_sorting_arm, .*welding_arm"):
        load_robot("../data/welding_arm")


def test_only_a_robot_of_the_extra_is_skipped_and_only_without_the_extra() -> None:
    """Every unknown robot was skipped, so a mistyped id or a robot lost from the catalogue went unnoticed."""

    def unknown(name: str) -> UnknownRobot:
        with pytest.raises(UnknownRobot) as raised, pytest.MonkeyPatch.context() as patch:
            patch.setattr(catalogue, "_files", dict)
            load_robot.__wrapped__(name)
        return raised.value

    assert lacks_extra(unknown("ur5"), is_installed=False)
    assert not lacks_extra(unknown("ur5"), is_installed=True)
    assert not any(lacks_extra(unknown(name), is_installed=False) for name in ("kuka_kr16_2", "ur5x", "kuka"))


@pytest.mark.parametrize("robot_id", sorted(OWN))
def test_every_limit_has_a_provenance_and_only_those(robot_id: str) -> None:
    robot = load_robot(robot_id)
    origins = {"published", "datasheet", "estimate", "default"}
    for joint in robot.joints:
        finite = {q for q in ("velocity", "acceleration", "jerk", "torque") if math.isfinite(getattr(joint, q))}
        finite |= {"position"} if math.isfinite(joint.lower) or math.isfinite(joint.upper) else set()
        assert set(joint.provenance) == finite
        assert set(joint.provenance.values()) <= origins
        assert {"velocity", "acceleration", "jerk"} <= finite
        assert joint.lower < joint.upper


@pytest.mark.parametrize("robot_id", sorted(FIGURES))
def test_speeds_are_kukas(robot_id: str) -> None:
    robot = load_robot(robot_id)
    np.testing.assert_allclose(np.degrees(robot.limit("velocity")), FIGURES[robot_id], rtol=1e-12)
    assert {joint.provenance["velocity"] for joint in robot.joints} == {"datasheet"}


def test_published_refuelling_arm_is_table_3_1_of_document_000() -> None:
    """Equation 3.3, with ox, oy, oz and ax corrected (E13), gives the truth."""
    robot = load_robot("ngv_refuelling_arm_published")
    a1, a2, d3 = 0.45, 0.68, 0.7
    for q in random_positions(6):
        (c1, c2, _, c4, c5, c6), (s1, s2, _, s4, s5, s6) = np.cos(q), np.sin(q)
        c23, s23 = np.cos(q[1] + q[2]), np.sin(q[1] + q[2])
        n, o = c4 * c5 * c6 - s4 * s6, -c4 * c5 * s6 - s4 * c6
        expected = [
            [
                c1 * (c23 * n - s23 * s5 * c6) + s1 * (s4 * c5 * c6 + c4 * s6),
                c1 * (c23 * o + s23 * s5 * s6) + s1 * (c4 * c6 - s4 * c5 * s6),
                c1 * (c23 * c4 * s5 + s23 * c5) + s1 * s4 * s5,
                c1 * (c2 * a2 + a1) + s1 * d3,
            ],
            [
                s1 * (c23 * n - s23 * s5 * c6) - c1 * (s4 * c5 * c6 + c4 * s6),
                s1 * (c23 * o + s23 * s5 * s6) - c1 * (c4 * c6 - s4 * c5 * s6),
                s1 * (c23 * c4 * s5 + s23 * c5) - c1 * s4 * s5,
                s1 * (c2 * a2 + a1) - c1 * d3,
            ],
            [s23 * n + c23 * s5 * c6, s23 * o - c23 * s5 * s6, s23 * c4 * s5 - c23 * c5, s2 * a2],
            [0, 0, 0, 1],
        ]
        np.testing.assert_allclose(frame_pose(robot, q), expected, atol=1e-12)


def test_published_refuelling_arm_has_rank_five_and_the_repaired_one_six() -> None:
    for robot_id, rank in (("ngv_refuelling_arm_published", 5), ("ngv_refuelling_arm", 6), ("welding_arm", 6)):
        robot = load_robot(robot_id)
        ranks = {np.linalg.matrix_rank(numeric_jacobian(robot, q), tol=1e-6) for q in random_positions(6, 20)}
        assert ranks == {rank}


@pytest.mark.parametrize(("robot_id", "base_height"), [("ngv_refuelling_arm", 0.0), ("welding_arm", 0.675)])
def test_repaired_arms_are_the_table_with_the_forearm_in_d4(robot_id: str, base_height: float) -> None:
    robot = load_robot(robot_id)
    for q in random_positions(6):
        expected = product(
            *(trans(z=base_height), rot("z", q[0]), trans(x=0.45), rot("x", np.pi / 2)),
            *(rot("z", q[1]), trans(x=0.68), rot("z", q[2]), rot("x", np.pi / 2)),
            *(rot("z", q[3]), trans(z=0.7), rot("x", -np.pi / 2), rot("z", q[4]), rot("x", np.pi / 2), rot("z", q[5])),
        )
        np.testing.assert_allclose(frame_pose(robot, q), expected, atol=1e-12)


def test_three_dof_arm_is_equation_1_6_of_document_002() -> None:
    """Equation 1.6 has cos(t2 - t3) in y (E19); Table 1.2 is recomputed (E21)."""
    robot = load_robot("three_dof_arm")
    for q in random_positions(3):
        (c1, c2, _), (s1, s2, _), u = np.cos(q), np.sin(q), q[1] - q[2]
        reach = 0.1 * c2 + 0.17 * np.cos(u)
        expected = [
            [c1 * np.cos(u), c1 * np.sin(u), s1, c1 * reach],
            [s1 * np.cos(u), s1 * np.sin(u), -c1, s1 * reach],
            [-np.sin(u), np.cos(u), 0, -0.1 * s2 - 0.17 * np.sin(u)],
            [0, 0, 0, 1],
        ]
        np.testing.assert_allclose(frame_pose(robot, q), expected, atol=1e-12)
    for row in reference("three_dof_arm")["forward_kinematics"]["table_1_2"]["rows"]:
        position = 1000.0 * frame_pose(robot, np.radians(row["q_deg"]))[:3, 3]
        np.testing.assert_allclose(position, row["computed_mm"], atol=1e-4)


def test_date_sorting_arm_is_section_3_of_document_004() -> None:
    robot = load_robot("date_sorting_arm")
    assert robot.joint_names == ("theta1", "l1", "l2", "theta2", "theta3", "theta4")
    assert [joint.kind for joint in robot.joints] == ["revolute", "prismatic", "prismatic", *["revolute"] * 3]
    for q in random_positions(6):
        t1, l1, l2, t2, t3, t4 = q
        (s1, s2, s3), (c1, c2, c3) = np.sin([t1, t2, t3]), np.cos([t1, t2, t3])
        expected = product(rot("z", t1), rot("y", t2), rot("z", t3), rot("y", t4))
        expected[:3, 3] = (
            -0.15 * s1 - 0.15 * c3 * s1 - l2 * s1 - 0.15 * c1 * c2 * s3,
            0.15 * c1 + 0.15 * c1 * c3 + l2 * c1 - 0.15 * s1 * c2 * s3,
            l1 + 0.15 * s2 * s3 + 0.8,
        )
        np.testing.assert_allclose(frame_pose(robot, q), expected, atol=1e-12)


def test_date_sorting_arm_passes_the_five_points_of_table_2() -> None:
    robot = load_robot("date_sorting_arm")
    points = reference("date_sorting")["test_points"]["points"]
    assert len(points) == 5
    for point in points:
        angles = {name: np.radians(point[f"{name}_deg"]) for name in ("theta1", "theta2", "theta3", "theta4")}
        lengths = {name: point[f"{name}_mm"] / 1000.0 for name in ("l1", "l2")}
        q = np.array([{**angles, **lengths}[name] for name in robot.joint_names])
        np.testing.assert_allclose(frame_pose(robot, q)[:3, 3], point["position_m"], atol=1e-12)


def test_date_sorting_limits_are_table_1() -> None:
    robot = load_robot("date_sorting_arm")
    table = reference("date_sorting")["robot"]["joint_limits"]
    for joint in robot.joints:
        if joint.is_angle:
            bounds = np.radians(table[f"{joint.name}_deg"])
        else:
            bounds = np.array(table[f"{joint.name}_mm"]) / 1000.0
        np.testing.assert_allclose([joint.lower, joint.upper], bounds, rtol=1e-12)
        assert joint.provenance["position"] == "published"


@pytest.mark.parametrize("robot_id", ["ngv_refuelling_arm", "welding_arm", "three_dof_arm", "date_sorting_arm"])
def test_the_documents_arms_weigh_nothing_but_carry_a_payload(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert robot.mass == 0.0
    assert not robot.has_dynamics
    assert not np.isfinite(robot.limit("torque")).any()
    assert robot.with_payload(Payload(1.0)).mass == 1.0


@pytest.mark.parametrize("robot_id", sorted(KUKAS))
def test_kuka_stands_as_its_axes_are_drawn(robot_id: str) -> None:
    forearm, flange, _ = KUKAS[robot_id]
    robot = load_robot(robot_id)
    for q in random_positions(6):
        expected = product(
            *(trans(z=0.675), rot("z", -q[0]), trans(x=0.26), rot("y", q[1]), trans(x=0.68), rot("y", q[2])),
            *(trans(x=forearm, z=-0.035), rot("x", -q[3]), rot("y", q[4]), rot("x", -q[5])),
            *(trans(x=flange), rot("y", np.pi / 2)),
        )
        np.testing.assert_allclose(frame_pose(robot, q), expected, atol=1e-12)


@pytest.mark.parametrize("robot_id", sorted(KUKAS))
def test_kuka_reaches_as_far_as_its_data_sheet_says(robot_id: str) -> None:
    """KUKA measures to the wrist, straight out: 260 + 680 + sqrt(forearm^2 + 35^2) mm from axis 1."""
    robot, (_, flange, reach) = load_robot(robot_id), KUKAS[robot_id]
    straight = np.zeros(6)
    straight[2] = -math.atan2(0.035, KUKAS[robot_id][0])
    wrist = product(frame_pose(robot, straight), trans(z=-flange))[:3, 3]
    assert np.linalg.norm(wrist[:2]) == pytest.approx(reach, abs=0.0006)
    assert wrist[2] == pytest.approx(0.675)
    rng = np.random.default_rng(2)
    for q in rng.uniform(robot.limit("lower"), robot.limit("upper"), (500, 6)):
        wrist = product(frame_pose(robot, q), trans(z=-flange))[:3, 3]
        assert np.linalg.norm(wrist[:2]) < reach + 0.0006


@pytest.mark.parametrize("robot_id", sorted(KUKAS))
def test_kuka_limits(robot_id: str) -> None:
    robot = load_robot(robot_id)
    np.testing.assert_allclose(np.degrees(robot.limit("lower")), [-185, -155, -130, -350, -130, -350])
    np.testing.assert_allclose(np.degrees(robot.limit("upper")), [185, 35, 154, 350, 130, 350])
    origins = {"position": "datasheet", "velocity": "datasheet"}
    origins |= dict.fromkeys(("acceleration", "jerk", "torque"), "estimate")
    assert all(joint.provenance == origins for joint in robot.joints)


@pytest.mark.parametrize(("robot_id", "load", "ahead"), [("kuka_kr16_l6_2", 6.0, 0.12), ("kuka_kr16_2", 16.0, 0.15)])
def test_kuka_masses_can_exist_and_its_motors_hold_them(robot_id: str, load: float, ahead: float) -> None:
    robot = load_robot(robot_id)
    base = robot.model.inertias[0].mass
    assert robot.mass + base == pytest.approx(235.0)
    loaded = robot.with_payload(Payload(load, (0.0, 0.0, ahead)))
    rng = np.random.default_rng(3)
    for q in rng.uniform(robot.limit("lower"), robot.limit("upper"), (200, 6)):
        assert np.linalg.eigvalsh(pin.crba(robot.model, robot.model.createData(), q)).min() > 0.0
        hold = pin.rnea(loaded.model, loaded.data, q, np.zeros(6), np.zeros(6))
        assert (np.abs(hold) < robot.limit("torque")).all()


def test_reading_robots_needs_no_heavy_library() -> None:
    code = (
        "import sys, planner.robots as r; [r.load_robot(i) for i in r.catalogue_ids()];"
        "print(*sorted({'scipy', 'casadi', 'toppra', 'matplotlib', 'pydantic', 'fastapi'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT)
    assert done.stdout.strip() == ""


@pytest.mark.parametrize("robot_id", [name for name in sorted(OWN) if load_robot(name).named_positions])
def test_a_home_position_is_one_to_work_from(robot_id: str) -> None:
    """It is away from limits and singularities, neither stretched nor folded; the tool points down."""
    robot = load_robot(robot_id)
    home = np.array(robot.named_positions["home"])
    lower, upper = robot.limit("lower"), robot.limit("upper")
    assert (lower + 0.1 < home).all()
    assert (home < upper - 0.1).all()
    pose = frame_pose(robot, home)
    longest = max(float(np.linalg.norm(frame_pose(robot, q)[:3, 3])) for q in random_positions(robot.dof, 2000))
    assert 0.25 * longest < np.hypot(*pose[:2, 3]) < 0.9 * longest
    assert 0.0 < pose[2, 3] < longest
    assert pose[2, 2] < 0.0
    singular_values = np.linalg.svd(numeric_jacobian(robot, home), compute_uv=False)
    assert singular_values[-1] > 0.1
