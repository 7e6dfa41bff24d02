"""Robots derived from others by their owner: own limits, locked joints, mountings, named positions."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.dynamics import inverse_dynamics
from planner.errors import InvalidRobotModel
from planner.kinematics import forward_kinematics
from planner.robots import Robot, load_robot
from planner.robots.derived.own_limits import OwnLimits
from planner.robots.payload import Payload
from planner.spatial import Pose, rotation_from_rpy
from tests.planner.robots.frames import frame_pose
from tests.planner.robots.urdfs import joint, link, robot

KUKA = load_robot("kuka_kr16_2")
ARM = Robot.from_urdf(
    robot(
        *(link(name) for name in ("base", "a", "b", "c")),
        joint("turn", "base", "a", kind="continuous", limit='<limit velocity="2" effort="0"/>'),
        joint("slide", "a", "b", kind="prismatic", axis='<axis xyz="1 0 0"/>'),
        joint("bend", "b", "c", axis='<axis xyz="0 1 0"/>', origin='<origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/>'),
    )
)
"""A continuous, a prismatic and a revolute joint; accelerations and jerks by the default rule, no torque of `turn`."""


def findings(refused: pytest.ExceptionInfo[InvalidRobotModel]) -> set[tuple[str, str | None]]:
    return {(finding.code, finding.subject) for finding in refused.value.findings if finding.severity == "error"}


def test_narrower_limits_are_the_owners_and_the_robot_stays_as_it_was() -> None:
    own = KUKA.derived(limits={"joint_a1": {"lower": -1.0, "velocity": 1.5, "torque": 900.0}})
    first = own.joints[0]
    assert (first.lower, first.upper, first.velocity, first.torque) == (-1.0, KUKA.joints[0].upper, 1.5, 900.0)
    assert {name for name, origin in first.provenance.items() if origin == "owner"} == {
        "position",
        "velocity",
        "torque",
    }
    assert own.joints[1:] == KUKA.joints[1:]
    assert own.findings == ()
    assert KUKA.joints[0].provenance["velocity"] == "datasheet"
    assert own.limit("velocity")[0] == 1.5
    assert own.limit_sources == KUKA.limit_sources


def test_wider_limits_take_the_place_of_defaults_and_estimates_alone() -> None:
    wider = ARM.derived(limits={"bend": {"acceleration": 99.0}})
    assert (wider.joints[2].acceleration, wider.joints[2].provenance["acceleration"]) == (99.0, "owner")
    assert [(f.code, f.severity, f.subject) for f in wider.findings] == [("limit_widened", "warning", "bend")]
    assert "99" in wider.findings[0].message
    assert KUKA.derived(limits={"joint_a1": {"jerk": 1e4}}).joints[0].jerk == 1e4
    with pytest.raises(InvalidRobotModel) as refused:
        KUKA.derived(limits={"joint_a1": {"velocity": 3.0}, "joint_a2": {"lower": -3.0, "upper": 0.7}})
    assert findings(refused) == {("wider_limit", "joint_a1"), ("wider_limit", "joint_a2")}
    with pytest.raises(InvalidRobotModel) as refused:  # what an owner has narrowed stays narrow
        ARM.derived(limits={"bend": {"jerk": 5.0}}).derived(limits={"bend": {"jerk": 6.0}})
    assert findings(refused) == {("wider_limit", "bend")}


def test_a_limit_where_there_was_none_and_one_equal_to_the_known() -> None:
    own = ARM.derived(limits={"turn": {"torque": 12.0, "velocity": 2.0 * (1.0 + 1e-12)}})
    assert (own.joints[0].torque, own.joints[0].velocity) == (12.0, 2.0)
    assert own.findings == ()


def test_a_continuous_joint_with_limits_is_revolute() -> None:
    own = ARM.derived(limits={"turn": {"lower": -7.0, "upper": 7.0}})
    assert (own.joints[0].kind, own.joints[0].lower, own.joints[0].upper) == ("revolute", -7.0, 7.0)
    with pytest.raises(InvalidRobotModel) as refused:
        ARM.derived(limits={"turn": {"lower": -7.0}})
    assert findings(refused) == {("one_sided_position_limit", "turn")}


def test_limits_that_differ_by_direction_are_narrower_than_those_of_both() -> None:
    own = ARM.derived(limits={"bend": {"velocity": 0.5, "velocity_range": [-0.5, 0.25], "torque_range": (-3.0, 1.0)}})
    index = ARM.joint_names.index("bend")
    assert own.bounds("velocity")[:, index].tolist() == [-0.5, 0.25]
    assert own.bounds("torque")[:, index].tolist() == [-3.0, 1.0]
    assert own.joints[index].provenance["torque"] == "owner"
    assert own.joints[index].ranges["velocity"] == (-0.5, 0.25)
    np.testing.assert_array_equal(own.bounds("acceleration"), [-ARM.limit("acceleration"), ARM.limit("acceleration")])
    own.derived(limits={"bend": {"velocity_range": [-0.4, 0.25]}})
    for wider in ([-0.5, 0.3], [-0.6, 0.2]):
        with pytest.raises(InvalidRobotModel) as refused:
            own.derived(limits={"bend": {"velocity_range": wider}})
        assert findings(refused) == {("wider_limit", "bend")}


@pytest.mark.parametrize(
    ("limits", "code"),
    [
        ({"bend": {"velocity_range": [-0.1]}}, "absurd_limit"),
        ({"bend": {"velocity_range": [0.0, 0.1]}}, "absurd_limit"),
        ({"bend": {"velocity_range": [-0.1, math.nan]}}, "absurd_limit"),
        ({"bend": {"jerk_range": [-1.0, 1.0]}}, "unknown_limit"),
        ({"bend": {"jerk": [-1.0, 1.0]}}, "absurd_limit"),
        ({"arm": {"velocity": 1.0}}, "unknown_joint"),
        ({"bend": {"speed": 1.0}}, "unknown_limit"),
        ({"bend": {"velocity": 0.0}}, "absurd_limit"),
        ({"bend": {"velocity": -1.0}}, "absurd_limit"),
        ({"bend": {"jerk": math.nan}}, "absurd_limit"),
        ({"bend": {"jerk": math.inf}}, "absurd_limit"),
        ({"bend": {"lower": math.nan}}, "absurd_limit"),
        ({"bend": {"lower": 1.0, "upper": 0.5}}, "lower_not_below_upper"),
        ({"bend": {"lower": 1.0, "upper": 1.0}}, "lower_not_below_upper"),
    ],
)
def test_limits_that_are_none_are_refused(limits: dict[str, OwnLimits], code: str) -> None:
    with pytest.raises(InvalidRobotModel) as refused:
        ARM.derived(limits=limits)
    assert code in {finding for finding, _ in findings(refused)}


@pytest.mark.parametrize("held", [("turn",), ("slide",), ("bend",), ("turn", "slide"), ("slide", "bend")])
def test_locked_joints_stand_still(held: tuple[str, ...]) -> None:
    """All frames, the tool and torques with a payload agree with the whole arm with those joints at their positions."""
    rng = np.random.default_rng(7)
    whole = ARM.with_tool(Pose(np.array([0.1, 0.2, 0.3]))).with_payload(Payload(3.0, (0.1, 0.0, 0.2), (0.1, 0.2, 0.2)))
    for q in rng.uniform(-1.2, 1.2, (20, 3)):
        part = whole.derived(locked={name: q[whole.joint_names.index(name)] for name in held})
        left = [k for k, name in enumerate(whole.joint_names) if name not in held]
        assert part.joints == tuple(whole.joints[k] for k in left)
        assert part.dof == part.model.nq == len(left)
        for frame in ("base", "a", "b", "c"):
            np.testing.assert_allclose(frame_pose(part, q[left], frame), frame_pose(whole, q, frame), atol=1e-12)
        tools = (forward_kinematics(arm, [values])[0] for arm, values in ((part, q[left]), (whole, q)))
        first, second = (tool.position for tool in tools)
        np.testing.assert_allclose(first, second, atol=1e-12)
        rates = np.zeros((2, 3))
        rates[:, left] = rng.normal(size=(2, len(left)))
        expected = inverse_dynamics(whole, q[None], rates[:1], rates[1:])[0, left]
        torques = inverse_dynamics(part, q[None, left], rates[:1, left], rates[1:, left])[0]
        np.testing.assert_allclose(torques, expected, atol=1e-9)


def test_a_group_of_the_robot_is_what_is_left() -> None:
    srdf = '<robot name="test"><group name="g"><joint name="turn"/><joint name="bend"/></group></robot>'
    links = [link(name) for name in ("base", "a", "b", "c")]
    slide = '<limit lower="0.1" upper="0.4" velocity="1" effort="1"/>'
    joints = [
        joint("turn", "base", "a"),
        joint("slide", "a", "b", kind="prismatic", limit=slide),
        joint("bend", "b", "c"),
    ]
    whole = Robot.from_urdf(robot(*links, *joints), srdf=srdf, tip_frame="c")
    assert whole.derived(group="g").joint_names == ("turn", "bend")
    for part, slid in ((whole.derived(group="g"), 0.1), (whole.derived(group="g", locked={"slide": 0.3}), 0.3)):
        np.testing.assert_allclose(frame_pose(part, [0.5, 0.2]), frame_pose(whole, [0.5, slid, 0.2]), atol=1e-12)
    with pytest.raises(InvalidRobotModel) as refused:
        whole.derived(group="arm")
    assert findings(refused) == {("unknown_group", "arm")}


def test_joints_are_locked_within_their_limits_and_not_all() -> None:
    with pytest.raises(InvalidRobotModel) as refused:
        ARM.derived(locked={"bend": 2.0, "hand": 0.0})
    assert findings(refused) == {("outside_position_limits", "bend"), ("unknown_joint", "hand")}
    with pytest.raises(InvalidRobotModel) as refused:
        ARM.derived(locked={"turn": 0.0, "slide": 0.0, "bend": 0.0})
    assert findings(refused) == {("no_joints", None)}


@given(angles=st.tuples(*[st.floats(-3.0, 3.0)] * 3), position=st.tuples(*[st.floats(-1.5, 1.5)] * 6))
def test_gravity_follows_the_mounting(angles: tuple[float, ...], position: tuple[float, ...]) -> None:
    """Static torques are the slope of the potential energy in the world; poses stay in the base frame."""
    rotation = rotation_from_rpy(*angles)
    mounted = KUKA.derived(mounting=Pose(np.array([0.0, 0.0, 2.0]), rotation))
    q = np.array(position)

    def energy(q: np.ndarray) -> float:
        centre = np.array(pin.centerOfMass(KUKA.model, KUKA.data, q))  # of what moves
        return float(9.81 * KUKA.mass * (rotation @ centre)[2])

    still = np.zeros((1, 6))
    torques = inverse_dynamics(mounted, q[None], still, still)[0]
    step = 1e-5 * np.eye(6)
    slope = [(energy(q + h) - energy(q - h)) / 2e-5 for h in step]
    np.testing.assert_allclose(torques, slope, atol=1e-4)
    np.testing.assert_array_equal(frame_pose(mounted, q), frame_pose(KUKA, q))
    assert mounted.kinematic_content == KUKA.kinematic_content


def test_a_mounting_has_an_orientation_and_stays_through_another_derivation() -> None:
    with pytest.raises(InvalidRobotModel) as refused:
        KUKA.derived(mounting=Pose(np.array([0.0, 0.0, 2.0])))
    assert findings(refused) == {("invalid_pose", "mounting")}
    hanging = KUKA.derived(mounting=Pose(np.zeros(3), rotation_from_rpy(np.pi, 0.0, 0.0))).derived(id="again")
    np.testing.assert_allclose(hanging.model.gravity.linear, [0.0, 0.0, 9.81], atol=1e-12)
    assert hanging.mounting is not None
    np.testing.assert_allclose(KUKA.model.gravity.linear, [0.0, 0.0, -9.81])


def test_named_positions_are_held_against_the_limits_and_inherited() -> None:
    own = ARM.derived(named_positions={"home": [9.0, 0.1, 0.2], "far": np.array([0.0, 1.4, 1.4])})
    assert own.named_positions == {"home": (9.0, 0.1, 0.2), "far": (0.0, 1.4, 1.4)}
    narrower = own.derived(limits={"bend": {"upper": 1.0}}, named_positions={"rest": [0.0, 0.0, 0.0]})
    assert narrower.named_positions == {"home": (9.0, 0.1, 0.2), "rest": (0.0, 0.0, 0.0)}
    assert own.derived(locked={"slide": 0.0}).named_positions == {"home": (9.0, 0.2), "far": (0.0, 1.4)}
    with pytest.raises(InvalidRobotModel) as refused:
        ARM.derived(named_positions={"a": [0.0, 0.0], "b": [0.0, 0.0, 1.6], "": [0.0, 0.0, 0.0]})
    assert findings(refused) == {
        ("wrong_number_count", "a"),
        ("outside_position_limits", "b"),
        ("invalid_name", ""),
    }


def test_the_tool_and_the_id_are_the_owners() -> None:
    own = KUKA.derived(id="cell_4", tool=Pose(np.array([0.0, 0.0, 0.2])))
    assert (own.id, KUKA.id) == ("cell_4", "kuka_kr16_2")
    np.testing.assert_allclose(own.tool_in_tip.translation, [0.0, 0.0, 0.2], atol=1e-12)
    np.testing.assert_allclose(own.derived().tool_in_tip.translation, [0.0, 0.0, 0.2], atol=1e-12)
