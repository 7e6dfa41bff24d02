"""Friction and rotor inertia in descriptions of robots, and the findings about them."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

import numpy as np
import pytest

import planner
from planner import DHJoint, InvalidRobotModel, Robot

DRAKE = "https://drake.mit.edu"
"""The address that stands for Drake's elements."""


def _urdf(dynamics: str = "", transmissions: str = "", effort: float = 50.0) -> str:
    """Return an arm of two links, whose first joint has dynamics."""
    links = "".join(
        f'<link name="l{k}"><inertial><origin xyz="0.2 0 0"/><mass value="2"/>'
        '<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>'
        for k in range(3)
    )
    joints = "".join(
        f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/><origin xyz="0.4 0 0"/>'
        f'<axis xyz="0 1 0"/><limit lower="-2" upper="2" velocity="2" effort="{effort}"/>{dynamics * (k == 0)}</joint>'
        for k in range(2)
    )
    return f"<robot name='arm' xmlns:drake={quoteattr(DRAKE)}>{links}{joints}{transmissions}</robot>"


def _transmission(inner: str, joints: str = '<joint name="j1"/>') -> str:
    return f'<transmission name="t">{joints}<actuator name="m">{inner}</actuator></transmission>'


def _codes(robot: Robot) -> list[str]:
    return [finding.code for finding in robot.findings if "friction" in finding.code]


def test_dynamics_of_a_urdf_are_in_its_torques() -> None:
    plain, rough = (Robot.from_urdf(_urdf(text)) for text in ("", '<dynamics friction="3" damping="0.5"/>'))
    q, v, a = [0.3, 0.2], [-1.5, 1.0], [0.4, -2.0]
    added = planner.inverse_dynamics(rough, q, v, a) - planner.inverse_dynamics(plain, q, v, a)
    np.testing.assert_allclose(added, [-3.0 - 0.75, 0.0], atol=1e-12)
    assert (_codes(plain), _codes(rough)) == ([], ["joint_friction"])
    (finding,) = (finding for finding in rough.findings if finding.code == "joint_friction")
    assert finding.message.endswith("rotor inertia of j0; neither is known of j1")


@pytest.mark.parametrize(
    ("inner", "inertia"),
    [
        ("<mechanicalReduction>20</mechanicalReduction><rotorInertia>1e-3</rotorInertia>", 0.4),
        ('<drake:gear_ratio value="-10"/><drake:rotor_inertia value="2e-3"/>', 0.2),
        ('<rotor_inertia value="0.3"/>', 0.3),
        ("<mechanicalReduction>100</mechanicalReduction>", 0.0),
    ],
)
def test_rotors_of_transmissions_are_seen_through_the_gears(inner: str, inertia: float) -> None:
    robot = Robot.from_urdf(_urdf(transmissions=_transmission(inner)))
    assert [joint.rotor_inertia for joint in robot.joints] == pytest.approx([0.0, inertia])
    q = np.zeros(2)
    pushed = planner.inverse_dynamics(robot, q, q, [0.0, 3.0]) - planner.inverse_dynamics(
        Robot.from_urdf(_urdf()), q, q, [0.0, 3.0]
    )
    np.testing.assert_allclose(pushed, [0.0, 3.0 * inertia], atol=1e-12)


def test_a_differential_transmission_has_no_rotor_of_one_joint() -> None:
    both = _transmission('<rotor_inertia value="0.3"/>', '<joint name="j0"/><joint name="j1"/>')
    assert not any(joint.has_drive for joint in Robot.from_urdf(_urdf(transmissions=both)).joints)


@pytest.mark.parametrize(
    ("dynamics", "kept"),
    [('friction="-1"', (0.0, 0.0)), ('damping="2e9"', (0.0, 0.0)), ('friction="60" damping="1"', (0.0, 1.0))],
)
def test_implausible_friction_is_left_out(dynamics: str, kept: tuple[float, float]) -> None:
    robot = Robot.from_urdf(_urdf(f"<dynamics {dynamics}/>"))
    assert (robot.joints[0].friction, robot.joints[0].damping) == kept
    (finding,) = (finding for finding in robot.findings if finding.code == "implausible_friction")
    assert finding.severity == "warning" and "is left out" in finding.message


@pytest.mark.parametrize(
    "inner", ['<rotor_inertia value="heavy"/>', '<gear_ratio value="1e200"/><rotor_inertia value="1"/>']
)
def test_a_rotor_that_is_no_number_or_too_large_is_left_out(inner: str) -> None:
    robot = Robot.from_urdf(_urdf(transmissions=_transmission(inner)))
    assert robot.joints[1].rotor_inertia == 0.0
    assert _codes(robot) == ["implausible_friction"]


def test_friction_that_takes_the_whole_torque_is_warned_of() -> None:
    robot = Robot.from_urdf(_urdf('<dynamics damping="30"/>'))
    (finding,) = (finding for finding in robot.findings if finding.code == "large_friction")
    assert "60 at its velocity limit, its torque limit is 50" in finding.message


def test_tables_and_owners_state_drives() -> None:
    rows = [DHJoint("revolute", a=0.4, mass=2.0, friction=2.0, damping=0.5, rotor_inertia=0.1, torque=50.0)] * 2
    robot = Robot.from_dh(rows)
    assert [(joint.friction, joint.damping, joint.rotor_inertia) for joint in robot.joints] == [(2.0, 0.5, 0.1)] * 2
    quiet = robot.derived(limits={"joint_1": {"friction": 0.0, "damping": 0, "rotor_inertia": 0.7}})
    assert [(joint.friction, joint.damping, joint.rotor_inertia) for joint in quiet.joints] == [
        (0.0, 0.0, 0.7),
        (2.0, 0.5, 0.1),
    ]
    assert quiet.joints[0].provenance["friction"] == "owner"
    held = robot.derived(locked={"joint_1": 0.2}).joints
    assert [joint.friction for joint in held] == [2.0]
    with pytest.raises(InvalidRobotModel, match="the friction of joint_1 is -1"):
        robot.derived(limits={"joint_1": {"friction": -1.0}})


def test_robots_of_the_catalogue_have_no_friction_that_no_maker_states() -> None:
    for name in planner.catalogue_ids():
        assert planner.load_robot(name).friction is None
