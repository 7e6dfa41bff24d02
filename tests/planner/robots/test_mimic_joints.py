"""Mimic joints follow the joint that they mimic when that one is locked: against Pinocchio's model of all joints."""

from __future__ import annotations

import pickle
from typing import TYPE_CHECKING, Any

import numpy as np
import pinocchio as pin
import pytest

from planner.errors import InvalidRobotModel
from planner.robots import Robot
from planner.robots.derived.external_axes import ExternalAxis
from planner.robots.payload import Payload
from planner.spatial import Pose
from tests.planner.robots.urdfs import INERTIAL, joint, link, robot

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.spatial import FloatArray

SLIDE = {"kind": "prismatic", "limit": '<limit lower="0.01" upper="0.3" velocity="1" effort="1"/>'}
SOLID = (
    '<collision><origin xyz="0.01 0.02 0.03" rpy="0.1 0.2 0.3"/><geometry><box size="0.1 0.02 0.2"/></geometry>'
    f"</collision>{INERTIAL}"
)
GRIPPER = robot(
    *(link(name, SOLID) for name in ("base", "upper", "hand", "thumb", "finger", "nail", "flap")),
    joint("shoulder", "base", "upper", axis='<axis xyz="0 1 0"/>', origin='<origin xyz="0 0.1 0.3" rpy="0.3 0 0.2"/>'),
    joint("wrist", "upper", "hand", axis='<axis xyz="0.6 0 0.8"/>'),
    joint("pinch", "hand", "thumb", axis='<axis xyz="0 1 0"/>', **SLIDE),
    # The nail stands before its parent, the finger, and mimics a joint that mimics the thumb.
    joint("bent", "finger", "nail", axis='<axis xyz="0 0.6 0.8"/>', more='<mimic joint="other" multiplier="3"/>'),
    joint("other", "hand", "finger", more='<mimic joint="pinch" multiplier="-2.5" offset="0.2"/>'),
    joint("lid", "nail", "flap", axis='<axis xyz="1 0 0"/>', more='<mimic joint="bent" multiplier="-0.5" offset="1"/>'),
)
"""An arm of two joints with a gripper: one joint slides, and three turn with it."""

LINKAGE = robot(
    *(link(name, SOLID) for name in ("base", "lower", "upper", "hand", "tcp")),
    joint("first", "base", "lower", axis='<axis xyz="0 1 0"/>'),
    joint("rod", "lower", "upper", axis='<axis xyz="0 1 0"/>', more='<mimic joint="first" multiplier="-1"/>'),
    joint("turn", "upper", "hand"),
    joint("plate", "hand", "tcp", kind="fixed", axis="", limit=""),
)
"""An arm whose second joint reverses the turn of the first."""


def gripper_at(pinch: float) -> dict[str, float]:
    """Return positions of the joints of the gripper, by the elements of the document."""
    other = -2.5 * pinch + 0.2
    return {"pinch": pinch, "other": other, "bent": 3.0 * other, "lid": -0.5 * (3.0 * other) + 1.0}


def assert_equals_full_model(
    arm: Robot, urdf: str, held: Mapping[str, float], payload: pin.Inertia | None = None
) -> None:
    """Compare all shapes and the torques of gravity with Pinocchio's own reading of the document."""
    full = pin.buildModelFromXML(urdf, mimic=False)
    if payload is not None:
        tip = full.frames[full.getFrameId(arm.tip_frame, pin.FrameType.BODY)]
        full.appendBodyToJoint(tip.parentJoint, payload, tip.placement)
    solids = pin.buildGeomFromUrdfString(full, urdf, pin.GeometryType.COLLISION)
    names = list(full.names)[1:]
    for q in np.random.default_rng(3).uniform(0.01, 0.3, (3, arm.dof)):
        known = {**held, **dict(zip(arm.joint_names, q, strict=True))}
        data, whole = full.createData(), np.array([known[name] for name in names])
        placed = solids.createData()
        pin.updateGeometryPlacements(full, data, solids, placed, whole)
        expected = {
            full.frames[solid.parentFrame].name: placement.homogeneous
            for solid, placement in zip(solids.geometryObjects, placed.oMg, strict=True)
        }
        found = shapes_at(arm, q)
        assert found.keys() == expected.keys()
        for name, placement in found.items():
            np.testing.assert_allclose(placement, expected[name], rtol=0.0, atol=1e-12, err_msg=name)
        torques = dict(zip(names, pin.computeGeneralizedGravity(full, data, whole), strict=True))
        own = pin.computeGeneralizedGravity(arm.model, arm.model.createData(), q)
        np.testing.assert_allclose(own, [torques[name] for name in arm.joint_names], rtol=0.0, atol=1e-10)


def shapes_at(arm: Robot, q: FloatArray) -> dict[str, FloatArray]:
    data = arm.model.createData()
    pin.forwardKinematics(arm.model, data, q)
    return {shape.link: (data.oMi[shape.joint] * shape.placement).homogeneous for shape in arm.collision_shapes}


def mimic_findings(arm: Robot) -> set[tuple[str, str | None]]:
    return {(each.severity, each.subject) for each in arm.findings if each.code == "mimic_joint_held"}


@pytest.mark.parametrize(
    ("options", "pinch"),
    [
        ({"locked": {"pinch": 0.25}}, 0.25),
        ({"locked": {"pinch": 0.25}, "joints": ["shoulder", "wrist"]}, 0.25),
        ({}, 0.01),
        ({"joints": ["shoulder", "wrist"]}, 0.01),
    ],
)
def test_mimic_joints_follow_a_joint_that_the_document_s_reader_holds(options: dict[str, Any], pinch: float) -> None:
    """The leader is locked, or at its default position, the limit nearest to 0."""
    arm = Robot.from_urdf(GRIPPER, tip_frame="hand", **options)
    assert arm.joint_names == ("shoulder", "wrist")
    assert_equals_full_model(arm, GRIPPER, gripper_at(pinch))
    assert mimic_findings(arm) == {("info", "other"), ("info", "bent"), ("info", "lid")}


@pytest.mark.parametrize("pinch", [0.01, 0.25])
def test_mimic_joints_follow_a_joint_that_a_derived_robot_locks(pinch: float) -> None:
    whole = Robot.from_urdf(GRIPPER, tip_frame="thumb")
    assert whole.joint_names == ("shoulder", "wrist", "pinch")
    assert mimic_findings(whole) == {("warning", "other"), ("warning", "bent"), ("warning", "lid")}
    arm = pickle.loads(pickle.dumps(whole)).derived(locked={"pinch": pinch})  # noqa: S301
    assert_equals_full_model(arm, GRIPPER, gripper_at(pinch))
    assert mimic_findings(arm) == {("info", "other"), ("info", "bent"), ("info", "lid")}
    again = whole.derived(locked={"wrist": 0.3}).derived(locked={"pinch": pinch})
    assert_equals_full_model(again, GRIPPER, {**gripper_at(pinch), "wrist": 0.3})


def test_mimic_joints_follow_on_external_axes() -> None:
    rail = ExternalAxis("rail", "prismatic", (1, 0, 0), lower=0.0, upper=1.0, velocity=1.0)
    whole = Robot.from_urdf(GRIPPER, tip_frame="thumb").derived(external_axes=[rail])
    arm = whole.derived(locked={"pinch": 0.25, "rail": 0.0})
    assert_equals_full_model(arm, GRIPPER, gripper_at(0.25))


@pytest.mark.parametrize("first", [0.0, 0.7])
def test_what_a_mimic_joint_of_the_arm_carries_follows_too(first: float) -> None:
    """Joints, tool and payload behind the mimic joint follow."""
    body = pin.Inertia(2.0, np.array([0.1, 0.0, 0.2]), np.diag([0.1, 0.2, 0.15]))
    payload = Payload(2.0, (0.1, 0.0, 0.2), (0.1, 0.2, 0.15))
    tool = Pose(np.array([0.0, 0.1, 0.2]))
    whole = Robot.from_urdf(LINKAGE)
    arm = whole.with_payload(payload).with_tool(tool).derived(locked={"first": first})
    assert arm.joint_names == ("turn",)
    assert_equals_full_model(arm, LINKAGE, {"first": first, "rod": -first}, body)
    np.testing.assert_allclose(arm.tool_in_tip.translation, [0.0, 0.1, 0.2], atol=1e-12)
    fixed = whole.derived(locked={"turn": 0.2}).with_payload(payload).with_tool(tool)
    np.testing.assert_allclose(fixed.tool_in_tip.translation, [0.0, 0.1, 0.2], atol=1e-12)


@pytest.mark.parametrize("mimic", ['joint="nobody"', 'joint="other"', "", 'joint="lid"', 'joint="plate"'])
def test_a_mimic_joint_without_a_leader_that_could_move_is_held_at_its_offset(mimic: str) -> None:
    """The leader does not exist, is the joint itself, is missing, forms a circle, or is fixed."""
    broken = GRIPPER.replace('<mimic joint="pinch" multiplier="-2.5"', f"<mimic {mimic}")
    broken = broken.replace(
        "</robot>", link("end") + joint("plate", "hand", "end", kind="fixed", axis="", limit="") + "</robot>"
    )
    arm = Robot.from_urdf(broken, tip_frame="hand")
    assert ("warning", "other") in mimic_findings(arm)
    full = pin.buildModelFromXML(GRIPPER, mimic=False)
    data, names = full.createData(), list(full.names)[1:]
    pin.framesForwardKinematics(full, data, np.array([{"other": 0.2}.get(name, 0.0) for name in names]))
    solid = pin.SE3(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3), np.array([0.01, 0.02, 0.03]))
    expected = data.oMf[full.getFrameId("finger", pin.FrameType.BODY)] * solid
    np.testing.assert_allclose(shapes_at(arm, np.zeros(2))["finger"], expected.homogeneous, atol=1e-12)


def test_a_mimic_joint_beyond_all_numbers_is_refused() -> None:
    huge = GRIPPER.replace('multiplier="-2.5"', 'multiplier="1e9"').replace('multiplier="3"', 'multiplier="1e9"')
    for tip in ("hand", "thumb"):
        with pytest.raises(InvalidRobotModel) as refused:
            Robot.from_urdf(huge, tip_frame=tip)
        assert {each.subject for each in refused.value.findings if each.severity == "error"} >= {"bent"}
