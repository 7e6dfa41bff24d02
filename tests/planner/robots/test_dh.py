"""Denavit-Hartenberg tables of both conventions against plain products of 4 x 4 matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.robots import DHJoint, Robot
from planner.spatial import Pose
from tests.planner.robots.frames import frame_pose, product, rot, trans

ANGLE = st.floats(-7.0, 7.0)
LENGTH = st.floats(-2.0, 2.0)
JOINT = st.builds(
    DHJoint,
    kind=st.sampled_from(["revolute", "continuous", "prismatic"]),
    theta=ANGLE,
    d=LENGTH,
    a=LENGTH,
    alpha=ANGLE,
)
TABLE = st.lists(st.tuples(JOINT, ANGLE), min_size=1, max_size=9)


def row_matrix(convention: str, row: DHJoint, q: float) -> np.ndarray:
    theta, d = (row.theta, row.d + q) if row.kind == "prismatic" else (row.theta + q, row.d)
    if convention == "standard":
        return product(rot("z", theta), trans(z=d), trans(x=row.a), rot("x", row.alpha))
    return product(rot("x", row.alpha), trans(x=row.a), rot("z", theta), trans(z=d))


@pytest.mark.parametrize("convention", ["standard", "modified"])
@given(table=TABLE)
def test_every_frame_of_a_random_table(convention: str, table: list[tuple[DHJoint, float]]) -> None:
    rows, q = tuple(row for row, _ in table), np.array([position for _, position in table])
    robot = Robot.from_dh(rows, convention=convention)
    assert robot.model.nq == robot.model.nv == robot.dof == len(rows)
    T = np.eye(4)
    for number, (row, position) in enumerate(table, 1):
        T = T @ row_matrix(convention, row, position)
        np.testing.assert_allclose(frame_pose(robot, q, f"link_{number}"), T, atol=1e-12)
    np.testing.assert_allclose(frame_pose(robot, q), T, atol=1e-12)


@pytest.mark.parametrize("convention", ["standard", "modified"])
@given(table=TABLE, placement=st.tuples(*[LENGTH] * 3, *[ANGLE] * 3))
def test_base_and_tip_stand_before_and_after_the_table(
    convention: str, table: list[tuple[DHJoint, float]], placement: tuple[float, ...]
) -> None:
    base = product(trans(*placement[:3]), rot("y", placement[3]))
    tip = product(trans(*placement[2::-1]), rot("x", placement[4]), rot("z", placement[5]))
    rows, q = tuple(row for row, _ in table), np.array([position for _, position in table])
    poses = [Pose(T[:3, 3], T[:3, :3]) for T in (base, tip)]
    robot = Robot.from_dh(rows, convention=convention, base=poses[0], tip=poses[1])
    expected = product(base, *(row_matrix(convention, row, position) for row, position in table), tip)
    np.testing.assert_allclose(frame_pose(robot, q), expected, atol=1e-12)
    np.testing.assert_array_equal(frame_pose(robot, q, "base"), np.eye(4))


@pytest.mark.parametrize("convention", ["standard", "modified"])
def test_link_masses_are_in_the_frame_of_their_row(convention: str) -> None:
    """Static torque is the derivative of the potential energy, here of three point masses by differences."""
    com = [(0.1, -0.2, 0.3), (0.0, 0.2, 0.1), (-0.1, 0.0, 0.2)]
    rows = tuple(
        DHJoint(kind, 0.3, 0.2, 0.4, 0.7, mass=mass, center_of_mass=center)
        for kind, mass, center in zip(("revolute", "prismatic", "revolute"), (3.0, 2.0, 1.0), com, strict=True)
    )
    robot = Robot.from_dh(rows, convention=convention)
    assert robot.mass == pytest.approx(6.0)

    def energy(q: np.ndarray) -> float:
        T, total = np.eye(4), 0.0
        for row, position, center in zip(rows, q, com, strict=True):
            T = T @ row_matrix(convention, row, position)
            total += row.mass * 9.81 * (T @ [*center, 1.0])[2]
        return total

    q, h = np.array([0.4, -0.3, 1.1]), 1e-6
    expected = [(energy(q + h * e) - energy(q - h * e)) / (2 * h) for e in np.eye(3)]
    np.testing.assert_allclose(pin.rnea(robot.model, robot.data, q, 0 * q, 0 * q), expected, atol=1e-6)


def test_link_inertia_is_about_the_center_of_mass_in_the_axes_of_the_row() -> None:
    """For a bar off the joint axis, Steiner's theorem gives the inertia about the joint."""
    row = DHJoint("revolute", a=0.5, mass=2.0, center_of_mass=(-0.2, 0.0, 0.0), inertia=(0.01, 0, 0, 0.04, 0, 0.05))
    robot = Robot.from_dh([row])
    torque = pin.rnea(robot.model, robot.data, np.array([0.7]), np.zeros(1), np.ones(1))
    assert torque[0] == pytest.approx(0.05 + 2.0 * (0.5 - 0.2) ** 2)


def test_limits_of_the_table_and_of_the_default_rule() -> None:
    given = DHJoint("revolute", lower=-1.0, upper=2.0, velocity=3.0, acceleration=5.0, jerk=70.0, torque=11.0)
    sparse = DHJoint("revolute", velocity=2.0)
    rows = (given, sparse, DHJoint("prismatic"), DHJoint("continuous", lower=-1.0, upper=1.0, name="spin"))
    robot = Robot.from_dh(rows)
    assert robot.joint_names == ("joint_1", "joint_2", "joint_3", "spin")
    np.testing.assert_array_equal(robot.limit("lower"), [-1.0, -np.inf, -np.inf, -np.inf])
    np.testing.assert_array_equal(robot.limit("upper"), [2.0, np.inf, np.inf, np.inf])
    np.testing.assert_array_equal(robot.limit("velocity"), [3.0, 2.0, 1.0, np.pi])
    np.testing.assert_array_equal(robot.limit("acceleration"), [5.0, 8.0, 4.0, 4.0 * np.pi])
    np.testing.assert_array_equal(robot.limit("jerk"), [70.0, 80.0, 40.0, 40.0 * np.pi])
    np.testing.assert_array_equal(robot.limit("torque"), [11.0, np.inf, np.inf, np.inf])
    everything = {"position", "velocity", "acceleration", "jerk", "torque"}
    assert robot.joints[0].provenance == dict.fromkeys(everything, "published")
    assert robot.joints[1].provenance == {"velocity": "published", "acceleration": "default", "jerk": "default"}
    assert [finding.subject for finding in robot.findings if finding.code == "default_limits"] == [
        "joint_2",
        "joint_3",
        "spin",
    ]


KR16_AXIS_6 = DHJoint("revolute", alpha=-np.pi / 2, lower=-np.radians(350), upper=np.radians(350), velocity=11.29)
"""A joint that turns further and faster than the other axes of the arm."""
BALL = (0.02, 0.0, 0.0, 0.02, 0.0, 0.02)
REMARKS = [
    ("no_reach", (DHJoint("revolute", alpha=1.0), DHJoint("revolute"))),
    ("suspicious_angle", (replace(KR16_AXIS_6, a=0.1, alpha=-90.0),)),
    ("suspicious_angle", (replace(KR16_AXIS_6, a=0.1, theta=90.0),)),
    ("suspicious_angle", (replace(KR16_AXIS_6, a=0.1, lower=-180.0, upper=180.0),)),
    ("suspicious_angle", (replace(KR16_AXIS_6, a=0.1, velocity=647.0),)),
    ("suspicious_length", (replace(KR16_AXIS_6, a=35.0), replace(KR16_AXIS_6, d=40.0))),
    ("suspicious_length", (DHJoint("prismatic", lower=0.0, upper=30.0), replace(KR16_AXIS_6, a=25.0))),
    ("suspicious_length", (DHJoint("prismatic", lower=0.0, upper=0.6, velocity=80.0),)),
    ("absurd_limit", (replace(KR16_AXIS_6, a=0.1, velocity=1e5),)),
    ("mass_missing", (replace(KR16_AXIS_6, a=0.1, mass=2.0, inertia=BALL), KR16_AXIS_6)),
    ("suspicious_mass", (replace(KR16_AXIS_6, a=0.1, mass=8400.0, inertia=(90.0, 0, 0, 90.0, 0, 90.0)),)),
    ("suspicious_inertia", (replace(KR16_AXIS_6, a=0.1, mass=2.0, inertia=(9.0, 0, 0, 9.0, 0, 9.0)),)),
]


@pytest.mark.parametrize(("code", "rows"), REMARKS, ids=[f"{i}-{code}" for i, (code, _) in enumerate(REMARKS)])
def test_a_usable_table_is_remarked_upon(code: str, rows: tuple[DHJoint, ...]) -> None:
    robot = Robot.from_dh(rows)
    assert [finding.code for finding in robot.findings if finding.severity == "warning"] == [code]
    assert np.isfinite(frame_pose(robot, np.zeros(len(rows)))).all()


def test_a_sound_table_gets_no_warning() -> None:
    rows = (replace(KR16_AXIS_6, a=0.68, d=0.675), replace(KR16_AXIS_6, kind="prismatic", d=0.2, velocity=1.5))
    findings = Robot.from_dh(rows).findings
    assert {finding.severity for finding in findings} == {"info"}
