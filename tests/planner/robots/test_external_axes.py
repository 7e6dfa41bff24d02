"""External axes in front of an arm, checked against the same arm and axes as one URDF, read by Pinocchio itself."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from hypothesis import strategies as st

from planner.dynamics import inverse_dynamics
from planner.errors import InvalidRobotModel
from planner.kinematics import jacobian, tool_pose
from planner.robots import ExternalAxis, Robot, load_robot
from planner.spatial import Pose, rotation_from_rpy
from tests.planner.robots.frames import frame_pose
from tests.planner.robots.urdfs import INERTIAL, joint, link, robot

KUKA = load_robot("kuka_kr16_2")
RAIL = ExternalAxis("rail", "prismatic", (1, 0, 0), lower=0.0, upper=3.0, velocity=1.0)
ORIGIN = '<origin xyz="0.1 0.2 0.3" rpy="0.4 0.5 0.6"/>'
ARM = (
    *(link(name, INERTIAL) for name in ("foot", "a", "b", "c")),
    joint("turn", "foot", "a"),
    joint("slide", "a", "b", kind="prismatic", axis='<axis xyz="1 0 0"/>', origin=ORIGIN),
    joint("bend", "b", "c", axis='<axis xyz="0 1 0"/>', origin=ORIGIN),
)
"""An arm whose foot has a mass, which counts if an external axis moves it."""

numbers = st.floats(-1.0, 1.0, allow_subnormal=False)
poses = st.tuples(*[numbers] * 3, *[st.floats(-3.0, 3.0)] * 3)
directions = st.one_of(
    st.sampled_from([(1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0), (0.0, 0.0, 1.0)]),
    st.tuples(*[numbers] * 3).filter(lambda axis: np.linalg.norm(axis) > 0.1),
)
axes_drawn = st.lists(
    st.tuples(st.sampled_from(["prismatic", "revolute"]), directions, poses, st.booleans()), min_size=1, max_size=3
)


def errors(refused: pytest.ExceptionInfo[InvalidRobotModel]) -> set[str]:
    return {finding.code for finding in refused.value.findings if finding.severity == "error"}


def spelled(values: tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in values)


def origin_of(pose: tuple[float, ...]) -> str:
    return f'<origin xyz="{spelled(pose[:3])}" rpy="{spelled(pose[3:])}"/>'


def to_pose(pose: tuple[float, ...]) -> Pose:
    return Pose(np.array(pose[:3]), rotation_from_rpy(*pose[3:]))


@given(axes_drawn, poses, st.integers(0, 2**32 - 1))
def test_the_arm_on_its_axes_is_the_urdf_that_has_them(
    drawn: list[tuple[str, tuple[float, ...], tuple[float, ...], bool]], arm_origin: tuple[float, ...], seed: int
) -> None:
    """Poses, Jacobians and torques agree (gravity, Coriolis and inertias of foot, carriages and arm)."""
    axes, elements, before = [], [link("ground")], "ground"
    for k, (kind, axis, pose, is_heavy) in enumerate(drawn):
        body = {"mass": 40.0, "center_of_mass": (0.1, -0.2, 0.3), "inertia": (2.0, 0.1, -0.2, 3.0, 0.15, 2.5)}
        own = ExternalAxis(f"e{k}", kind, axis, to_pose(pose), -1.0, 1.0, **(body if is_heavy else {}))  # type: ignore[arg-type]
        axes.append(own)
        inertial = (
            '<inertial><origin xyz="0.1 -0.2 0.3"/><mass value="40"/>'
            '<inertia ixx="2" ixy="0.1" ixz="-0.2" iyy="3" iyz="0.15" izz="2.5"/></inertial>'
        )
        unit = tuple(np.array(axis) / np.linalg.norm(axis))
        elements += [link(f"carriage_{k}", inertial if is_heavy else "")]
        direction = f'<axis xyz="{spelled(unit)}"/>'
        elements += [joint(f"e{k}", before, f"carriage_{k}", kind=kind, origin=origin_of(pose), axis=direction)]
        before = f"carriage_{k}"
    elements += [joint("mount", before, "foot", kind="fixed", origin=origin_of(arm_origin), axis="", limit="")]
    ours = Robot.from_urdf(robot(*ARM)).derived(external_axes=axes, arm_origin=to_pose(arm_origin))
    theirs = pin.buildModelFromXML(robot(*elements, *ARM))
    data, tip = theirs.createData(), theirs.getFrameId("c")
    assert ours.joint_names == (*ours.external_axes, "turn", "slide", "bend") == tuple(theirs.names)[1:]
    q, v, a = np.random.default_rng(seed).uniform(-1.0, 1.0, (3, ours.dof))
    pin.framesForwardKinematics(theirs, data, q)
    np.testing.assert_allclose(frame_pose(ours, q), data.oMf[tip].homogeneous, atol=1e-9)
    J = pin.computeFrameJacobian(theirs, data, q, tip, pin.LOCAL_WORLD_ALIGNED)
    np.testing.assert_allclose(jacobian(ours, q), J, atol=1e-9)
    torques = inverse_dynamics(ours, q[None], v[None], a[None])[0]
    np.testing.assert_allclose(torques, pin.rnea(theirs, data, q, v, a), atol=1e-7)


def test_the_axes_are_joints_with_limits_of_their_owner() -> None:
    on_rail = KUKA.derived(id="on_rail", external_axes=[RAIL], limits={"joint_a1": {"velocity": 1.0}})
    first = on_rail.joints[0]
    assert (first.name, first.kind, first.lower, first.upper, first.velocity) == ("rail", "prismatic", 0.0, 3.0, 1.0)
    assert first.provenance == {"position": "owner", "velocity": "owner", "acceleration": "default", "jerk": "default"}
    assert on_rail.external_axes == ("rail",)
    assert on_rail.limit("velocity")[1] == 1.0
    assert on_rail.mass == pytest.approx(KUKA.mass + 60.0)  # the rail moves the foot, too
    assert KUKA.external_axes == ()
    twice = on_rail.derived(external_axes=[ExternalAxis("lift", "prismatic", (0, 0, 1), lower=0.0, upper=1.0)])
    assert twice.external_axes == ("lift", "rail")
    assert twice.derived(locked={"lift": 0.5}).external_axes == ("rail",)


def test_named_positions_tool_and_shapes_come_along() -> None:
    home = [0.0, -1.5, 1.5, 0.0, 0.5, 0.0]
    known = KUKA.derived(tool=Pose(np.array([0.0, 0.0, 0.2])), named_positions={"home": home})
    far = ExternalAxis("rail", "prismatic", (0, 1, 0), lower=0.5, upper=3.0)
    on_rail = known.derived(external_axes=[far], named_positions={"end": [3.0, *home]})
    assert on_rail.named_positions == {"home": (0.5, *home), "end": (3.0, *home)}
    np.testing.assert_allclose(on_rail.tool_in_tip.homogeneous, known.tool_in_tip.homogeneous)
    moved = {shape.link: shape.joint for shape in on_rail.collision_shapes}
    still = {shape.link: shape.joint for shape in known.collision_shapes}
    assert {name: number + 1 for name, number in still.items()} == moved
    pairs = {(pair.link_1, pair.link_2): pair.reason for pair in known.collision_pairs}
    assert {(pair.link_1, pair.link_2): pair.reason for pair in on_rail.collision_pairs} == pairs


def test_the_base_is_mounted_and_no_more_the_arm() -> None:
    """The rail of a hanging arm stands upright; an arm with a mounting of its own needs the rail's `mounting` too."""
    upside_down = Pose(np.zeros(3), rotation_from_rpy(np.pi, 0.0, 0.0))
    hanging = KUKA.derived(external_axes=[RAIL], arm_origin=upside_down)
    assert hanging.model.gravity.linear.tolist() == [0.0, 0.0, -9.81]
    ceiling = KUKA.derived(mounting=upside_down)
    with pytest.raises(InvalidRobotModel) as refused:
        ceiling.derived(external_axes=[RAIL])
    assert errors(refused) == {"mounting_missing"}
    told = ceiling.derived(external_axes=[RAIL], arm_origin=upside_down, mounting=Pose(np.zeros(3), np.eye(3)))
    q, rest = np.array([[0.7, 0.1, -1.2, 1.1, 0.3, 0.4, 0.5]]), np.zeros((1, 7))
    torques = [inverse_dynamics(own, q, rest, rest) for own in (hanging, told)]
    np.testing.assert_allclose(torques[0], torques[1], atol=1e-9)
    np.testing.assert_allclose(torques[0][0, 1:], inverse_dynamics(ceiling, q[:, 1:], rest[:, 1:], rest[:, 1:])[0])


@pytest.mark.parametrize(
    ("changes", "code"),
    [
        ({"axis": (0.0, 0.0, 0.0)}, "zero_axis"),
        ({"axis": (0.0, 1e-9, 0.0)}, "zero_axis"),
        ({"lower": None}, "missing_position_limit"),
        ({"lower": 3.0, "upper": 1.0}, "lower_not_below_upper"),
        ({"upper": float("nan")}, "non_finite_number"),
        ({"name": "joint_a1"}, "duplicate_name"),
        ({"name": "universe"}, "reserved_name"),
        ({"mass": -1.0}, "negative_mass"),
        ({"mass": 1.0, "inertia": (-1.0, 0.0, 0.0, 1.0, 0.0, 1.0)}, "inertia_not_positive_definite"),
        ({"origin": Pose(np.zeros(3), 2.0 * np.eye(3))}, "invalid_pose"),
        ({"origin": Pose(np.array([1e300, 0.0, 0.0]))}, "invalid_pose"),
        ({"velocity": 1e-9}, "absurd_limit"),
    ],
)
def test_an_axis_that_cannot_be_is_refused(changes: dict[str, object], code: str) -> None:
    with pytest.raises(InvalidRobotModel) as refused:
        KUKA.derived(external_axes=[ExternalAxis(**{**vars(RAIL), **changes})])  # type: ignore[arg-type]
    assert code in errors(refused)


def test_the_length_of_an_axis_does_not_matter() -> None:
    poses = []
    for length in (1.1e-9, 1.0, 1e8):
        robot = KUKA.derived(external_axes=[replace(RAIL, axis=(0.0, length, 0.0))])
        poses.append(tool_pose(robot, [0.7, 0.1, -1.2, 1.1, 0.3, 0.4, 0.5]).position)
    np.testing.assert_allclose(poses, [poses[1]] * 3, atol=1e-12)


def test_an_origin_without_axes_and_too_many_axes_are_refused() -> None:
    with pytest.raises(InvalidRobotModel) as refused:
        KUKA.derived(arm_origin=Pose(np.zeros(3)))
    assert errors(refused) == {"no_external_axes"}
    many = [ExternalAxis(f"e{k}", "continuous", (0, 0, 1)) for k in range(27)]
    with pytest.raises(InvalidRobotModel) as refused:
        KUKA.derived(external_axes=many)
    assert errors(refused) == {"too_many_joints"}
