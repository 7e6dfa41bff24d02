"""Recordings, read back by the format's own reader."""

from __future__ import annotations

import io

import numpy as np
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory

from planner.backends import Quintic
from planner.export import ExportOptions, render
from planner.planning import plan
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
