"""Pictures from the library: refused arguments, and the limits that they show."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from defusedxml.ElementTree import fromstring

from planner.backends import Trapezoidal
from planner.errors import InvalidProblem
from planner.limits import Limits
from planner.planning import plan
from planner.plans.result import Plan
from planner.plots.picture import draw_robot_at
from planner.plots.view import stick_model
from planner.problems.problem import JointWaypoint, LinearMotion, PlanningProblem, PoseWaypoint
from planner.robots import Robot, catalogue_ids, load_robot
from planner.spatial import Pose
from tests.documents.read_pictures import graphs_of


@pytest.fixture(scope="module")
def slowed() -> Plan:
    """Joint 1 moves there at 0.5 rad/s and back at 1 rad/s at most, with enough time to reach both."""
    first, second = (Limits(velocity=(v, 3.0, 3.0)) for v in (0.5, 1.0))
    waypoints = (
        JointWaypoint((0.0, 0.5, 0.5)),
        JointWaypoint((1.0, 0.5, 0.5), limits=first),
        JointWaypoint((0.0, 0.5, 0.5), limits=second),
    )
    return plan(PlanningProblem(load_robot("three_dof_arm"), waypoints), Trapezoidal())


def test_limits_are_those_in_force_on_each_segment(slowed: Plan) -> None:
    axis = slowed.plot("velocity", joints=["joint_1"]).figure.axes[0]
    dashed = [line for line in axis.lines if line.get_linestyle() == "--"]
    turn = slowed.trajectory.arrivals[1]
    upper = max(dashed, key=lambda line: line.get_ydata().max())
    time, values = upper.get_data()
    assert values[time < turn] == pytest.approx(np.degrees(0.5))
    assert values[time > turn] == pytest.approx(np.degrees(1.0))
    velocity = axis.lines[0].get_ydata()
    assert (np.abs(velocity) <= values * (1.0 + 1e-9)).all()


@pytest.mark.large_only
def test_the_same_plan_gives_the_same_bytes(slowed: Plan) -> None:
    first, second = (slowed.plot("position", "path").svg() for _ in range(2))
    assert first == second
    assert not re.search(rb"<dc:date>", first)


def test_joints_are_drawn_in_their_order_whatever_the_order_asked(slowed: Plan) -> None:
    (graph,) = graphs_of(slowed.plot("acceleration", joints=["joint_3", "joint_1"]).svg())
    assert list(graph.lines) == ["acceleration.joint_1", "acceleration.joint_3"]


@pytest.mark.parametrize(
    ("options", "message"),
    [({"joints": ["elbow"]}, "no joint 'elbow'"), ({"joints": []}, "no joint shows nothing")],
)
def test_joints_that_are_not_there_are_refused(slowed: Plan, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InvalidProblem, match=message):
        slowed.plot(**options)


def test_names_that_there_are_not_are_refused(slowed: Plan) -> None:
    with pytest.raises(ValueError, match="show: speed; there are position"):
        slowed.plot("speed")
    with pytest.raises(ValueError, match="axes: w; there are x"):
        slowed.plot("tcp_position", axes=["w"])
    with pytest.raises(ValueError, match="axes: nothing; there are x"):
        slowed.plot("tcp_position", axes=[])
    with pytest.raises(ValueError, match="view: above"):
        slowed.plot("path", view="above")


@pytest.mark.parametrize("positions", [[[0.0, 0.5]], [], [[0.0, 0.5, np.nan]], np.zeros((2, 3, 1))])
def test_positions_of_another_robot_are_refused(positions: Any) -> None:
    with pytest.raises(ValueError, match="positions: rows of 3 numbers are needed, one a joint of three_dof_arm"):
        draw_robot_at(load_robot("three_dof_arm"), positions)


def test_a_joint_that_its_limits_hold_is_said_to_be_held() -> None:
    robot = load_robot("three_dof_arm")
    held = replace(robot.joints[1], lower=0.5, upper=0.5)
    robot = replace(robot, joints=(robot.joints[0], held, robot.joints[2]))
    waypoints = [JointWaypoint((0.0, 0.5, 0.5)), JointWaypoint((1.0, 0.5, 0.0))]
    beside = plan(PlanningProblem(robot, waypoints)).plot("position").figure.axes[1]
    texts = [text.get_text() for text in beside.texts]
    assert texts[1] == f"held at {np.degrees(0.5):.4g}°"
    assert not any("held" in texts[k] or "nan" in texts[k] for k in (0, 2))


@pytest.mark.parametrize("robot_id", catalogue_ids())
def test_stick_models_go_from_the_base_to_the_tool(robot_id: str) -> None:
    """Turning joint 1 turns all links after it; the sticks between turning joints keep their lengths."""
    robot = load_robot(robot_id)
    random = np.random.default_rng(0)
    lower, upper = np.maximum(robot.limit("lower"), -3.0), np.minimum(robot.limit("upper"), 3.0)
    one, other = (stick_model(robot, random.uniform(lower, upper)) for _ in range(2))
    assert one.shape == (robot.dof + 2, 3)
    assert (one[0] == 0.0).all()
    turning = np.append(robot.is_angle, True)
    lengths = [np.linalg.norm(np.diff(points, axis=0), axis=1) for points in (one, other)]
    assert lengths[0][turning] == pytest.approx(lengths[1][turning], abs=1e-12)


def test_the_path_of_a_fixed_tool_is_drawn_on_the_workpiece() -> None:
    """The picture holds the rim, some decimetres around the workpiece, and not the tool that stands 1.2 m away."""
    tool = Pose.from_rpy([1.2, 0.3, 0.9], [0.0, -1.5, 0.0])
    robot = load_robot("kuka_kr16_2").derived(id="holding", fixed_tool=tool)
    ends = [Pose.from_rpy([0.1, y, 0.05], [np.pi, 0.0, np.pi]) for y in (-0.1, 0.2)]
    waypoints = [PoseWaypoint(ends[0]), PoseWaypoint(ends[1], motion=LinearMotion())]
    axes = plan(PlanningProblem(robot, waypoints), Trapezoidal()).plot("path", view="xy").figure.axes[0]
    texts = [text.get_text() for legend in [axes.get_legend(), *axes.figure.legends] if legend for text in legend.texts]
    assert texts == ["in the frame of the workpiece"]
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    assert left < 100.0 < right < 600.0
    assert -600.0 < low < -100.0
    assert 200.0 < high < 600.0


ODD = "a\x00\x01\x1b\x7f\x85\ufffe\uffff\U0001ffffb <--> & z"
"""Characters that XML allows, discourages and forbids."""


@pytest.mark.parametrize("view", ["isometric", "xy"])
def test_a_robot_whose_frames_coincide_is_drawn_as_one_dot(view: str) -> None:
    joint = '<axis xyz="0 0 1"/><limit lower="-1" upper="1" velocity="1" effort="1"/>'
    robot = Robot.from_urdf(
        '<robot name="point"><link name="base"/><link name="arm"/><joint name="turn" type="revolute">'
        f'<parent link="base"/><child link="arm"/>{joint}</joint></robot>'
    )
    (axes,) = draw_robot_at(robot, view=view).figure.axes
    dots = [collection.get_offsets() for collection in axes.collections]
    assert np.concatenate(dots).tolist() == [[0.0, 0.0]]
    moved = plan(PlanningProblem(robot, (JointWaypoint((0.0,)), JointWaypoint((1.0,)))), Trapezoidal())
    fromstring(moved.plot("robot", view=view).svg())
    fromstring(moved.animate(view=view).svg)


@pytest.mark.large_only
@pytest.mark.filterwarnings("ignore:Glyph")
def test_pictures_are_well_formed_whatever_titles_and_names_hold(slowed: Plan) -> None:
    first, *others = slowed.problem.waypoints
    requested = replace(slowed.problem, waypoints=(replace(first, name=ODD), *others))
    named = replace(slowed, problem=requested)
    at_zero = draw_robot_at(load_robot("three_dof_arm"), title=ODD)
    for picture in (slowed.plot("position", title=ODD), named.plot("position", "path"), at_zero):
        svg = picture.svg().decode()
        assert "&amp; z" in svg or "& z" in svg
        assert fromstring(svg).tag.endswith("svg")
    moving = named.animate().svg
    texts = [text.text for text in fromstring(moving).iter("{http://www.w3.org/2000/svg}text")]
    kept = ODD.replace("\x00\x01\x1b", "\ufffd" * 3).replace("\ufffe\uffff", "\ufffd" * 2)
    assert any(text is not None and kept in text for text in texts)
