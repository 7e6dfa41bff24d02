"""Recordings, read back by the format's own reader."""

from __future__ import annotations

import io

import numpy as np
import pinocchio as pin
import pytest
from defusedxml.ElementTree import fromstring
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from planner.backends import Quintic
from planner.export import ExportOptions, render
from planner.export.mcap import robot_description
from planner.planning import plan
from planner.robots import Robot, load_robot
from planner.robots.files.pinocchio_model import files_of_model
from planner.shapes import surface
from tests.planner.problems_of_tests import problem_of


def test_a_recording_has_the_trajectory_and_the_joint_states_at_their_times() -> None:
    solved = plan(problem_of("kuka_kr16_l6_2", 2, 3), Quintic())
    options = ExportOptions(0.05, frozenset({"torque"}))
    recording = render(solved, "mcap", options)
    assert recording == render(solved, "mcap", options)
    reader = make_reader(io.BytesIO(recording), decoder_factories=[DecoderFactory()])
    assert reader.get_header().profile == "ros2"
    messages = list(reader.iter_decoded_messages())
    assert {(schema.name, channel.topic) for schema, channel, _, _ in messages} == {
        ("trajectory_msgs/msg/JointTrajectory", "/joint_trajectory"),
        ("sensor_msgs/msg/JointState", "/joint_states"),
        ("std_msgs/msg/String", "/robot_description"),
        ("tf2_msgs/msg/TFMessage", "/tf"),
    }
    ((_, _, first, trajectory),) = (one for one in messages if one[1].topic == "/joint_trajectory")
    states = [one for one in messages if one[1].topic == "/joint_states"]
    names = list(solved.path.robot.joint_names)
    times = np.array([message.log_time for _, _, message, _ in states]) * 1e-9
    expected = solved.trajectory.evaluate(solved.trajectory.sample_times(0.05))
    assert first.log_time == 0
    assert trajectory.joint_names == names
    assert times[0] == 0.0
    assert abs(times[-1] - solved.trajectory.duration) < 1e-9
    for order, field in enumerate(("positions", "velocities", "accelerations")):
        assert (np.array([getattr(point, field) for point in trajectory.points]) == expected[order]).all()
    stamps = [point.time_from_start.sec + point.time_from_start.nanosec * 1e-9 for point in trajectory.points]
    assert np.abs(np.array(stamps) - times).max() < 1e-9
    assert all(state.name == names for _, _, _, state in states)
    assert (np.array([state.position for _, _, _, state in states]) == expected[0]).all()
    assert (np.array([state.velocity for _, _, _, state in states]) == expected[1]).all()
    torques = solved.path.dynamics.torques(
        solved.trajectory.segments[solved.trajectory.locate(solved.trajectory.sample_times(0.05))[0]], *expected
    )
    assert (np.array([state.effort for _, _, _, state in states]) == torques).all()
    stamped = [state.header.stamp.sec + state.header.stamp.nanosec * 1e-9 for _, _, _, state in states]
    assert np.abs(np.array(stamped) - times).max() < 1e-9


@pytest.mark.long_table
@pytest.mark.parametrize("robot_id", ["kuka_kr16_2", "welding_arm", "ur5e", "fr3"])
def test_a_viewer_finds_the_robot_and_the_transforms_of_its_links(robot_id: str) -> None:
    solved = plan(problem_of(robot_id, 2, 3), Quintic())
    reader = make_reader(io.BytesIO(render(solved, "mcap", ExportOptions(0.01))), decoder_factories=[DecoderFactory()])
    messages = list(reader.iter_decoded_messages(topics=["/robot_description", "/tf"]))
    (urdf,) = (message.data for _, channel, _, message in messages if channel.topic == "/robot_description")
    model = pin.buildModelFromXML(urdf)  # Pinocchio's own reader
    data = model.createData()
    assert urdf.count("<visual>") >= 5
    records = [(log.log_time * 1e-9, message) for _, channel, log, message in messages if channel.topic == "/tf"]
    assert records[0][0] == 0.0
    assert records[-1][0] == pytest.approx(solved.trajectory.duration, abs=1e-9)
    for time, message in records:
        names = list(model.names)[1:]
        order = [names.index(name) for name in solved.path.robot.joint_names]
        position = np.empty(model.nq)
        position[order] = solved.trajectory(min(time, solved.trajectory.duration))
        pin.framesForwardKinematics(model, data, position)
        links = {entry.child_frame_id: entry for entry in message.transforms}
        root = {entry.header.frame_id for entry in message.transforms}
        assert len(links) == len(message.transforms)
        bodies = {frame.name: k for k, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY}
        assert set(links) | root == set(bodies)
        for name, entry in links.items():
            pose, transform = data.oMf[bodies[name]], entry.transform
            answered = [getattr(transform.translation, axis) for axis in "xyz"]
            np.testing.assert_allclose(answered, pose.translation, atol=1e-9)
            turn = pin.Quaternion(*(getattr(transform.rotation, part) for part in "wxyz")).matrix()
            np.testing.assert_allclose(turn, pose.rotation, atol=1e-9)


def test_a_robot_without_simple_shapes_is_drawn_by_boxes_around_its_collision_shapes() -> None:
    robot = Robot.from_urdf(files_of_model(load_robot("three_dof_arm").model).urdf)
    assert not robot.geometry
    visuals = fromstring(robot_description(robot)).findall("link/visual")
    assert len(visuals) == len(robot.collision_shapes) > 0
    model = pin.buildModelFromXML(robot_description(robot))
    drawn = pin.buildGeomFromUrdfString(model, robot_description(robot), pin.GeometryType.VISUAL)
    data, boxes = model.createData(), drawn.createData()
    pin.updateGeometryPlacements(model, data, drawn, boxes, pin.neutral(model))
    pin.framesForwardKinematics(robot.model, arm := robot.model.createData(), pin.neutral(robot.model))
    for box, place, collider in zip(drawn.geometryObjects, boxes.oMg, robot.collision_shapes, strict=True):
        corners = surface(collider.shape).vertices @ collider.placement.rotation.T + collider.placement.translation
        moved = place.inverse().act(arm.oMi[collider.joint])
        inside = np.abs(corners @ moved.rotation.T + moved.translation)
        assert (inside <= box.geometry.halfSide + 1e-9).all()
        np.testing.assert_allclose(inside.max(axis=0), box.geometry.halfSide, atol=1e-9)
