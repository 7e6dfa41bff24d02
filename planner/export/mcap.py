"""MCAP: a recording of ROS 2 messages for players and viewers: trajectory, joint states, the robot and its links."""

from __future__ import annotations

import json
from collections.abc import Iterator
from io import BytesIO
from typing import Any
from xml.etree.ElementTree import Element, SubElement, tostring

import numpy as np
import pinocchio as pin
from mcap_ros2.writer import Writer

from planner.export.base import ExportOptions, Format
from planner.export.ros2 import NANOSECONDS, header, joint_trajectory, nanoseconds
from planner.plans.result import Plan
from planner.problems.actions import SetOutput
from planner.robots import Robot
from planner.robots.files.pinocchio_model import BASE_LINK, LINKS, urdf_of_model
from planner.robots.files.urdf_writer import add_origin, text_of
from planner.shapes import surface
from planner.spatial import FloatArray, rotation_from_rpy

TRAJECTORY_TOPIC = "joint_trajectory"
"""The topic of the trajectory, below the root."""

STATES_TOPIC = "joint_states"
"""The topic of the samples, below the root, on which ROS 2 has the states of joints."""

OUTPUTS_TOPIC = "outputs"
"""The topic of the outputs that are set, below the root."""

TRANSFORMS_TOPIC = "tf"
"""The topic of the transforms of links, below the root, where viewers look for them."""

TRANSFORMS_PER_SECOND = 25
"""Largest rate of transforms, 1/s: a viewer needs no more, and they are the largest messages."""

DESCRIPTION_TOPIC = "robot_description"
"""The topic of the robot as URDF, below the root, where viewers look for it."""

STRING = "string data"
"""The definition of `std_msgs/msg/String`."""

KEY_VALUE = "string key\nstring value"
"""The definition of `diagnostic_msgs/msg/KeyValue`."""

TIME = "int32 sec\nuint32 nanosec\n"
"""The fields of `builtin_interfaces/Time` and `Duration`."""

HEADER = f"""
{"=" * 80}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{"=" * 80}
MSG: builtin_interfaces/Time
{TIME}"""
"""The definitions of the message header and of the time, which follow the definitions that use them."""

JOINT_STATE = f"std_msgs/Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort{HEADER}"
"""The definition of `sensor_msgs/msg/JointState`."""

JOINT_TRAJECTORY = f"""std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint[] points{HEADER}{"=" * 80}
MSG: trajectory_msgs/JointTrajectoryPoint
float64[] positions
float64[] velocities
float64[] accelerations
float64[] effort
builtin_interfaces/Duration time_from_start
{"=" * 80}
MSG: builtin_interfaces/Duration
{TIME}"""
"""The definition of `trajectory_msgs/msg/JointTrajectory`."""

TRANSFORMS = f"""geometry_msgs/TransformStamped[] transforms
{"=" * 80}
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
{"=" * 80}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{"=" * 80}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
{"=" * 80}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w{HEADER}"""
"""The definition of `tf2_msgs/msg/TFMessage`."""


def render(plan: Plan, options: ExportOptions) -> bytes:
    """Write a plan as messages on `/joint_trajectory` (one, at 0) and `/joint_states` (one a sample, at its time).

    Viewers find the robot on `/robot_description`, and the transforms of its links on `/tf`. Outputs that are set are
    on `/outputs` at their times, a name and a value in JSON. Efforts are the torques when these are included. The time
    of the recording begins at 0.

    Raises:
        MissingDynamics: Torques are included, and the robot has neither inertias nor a payload.
    """
    samples = plan.samples(options.sample_period, options.include)
    times, whole = nanoseconds(samples), joint_trajectory(plan, samples)
    file = BytesIO()
    writer = Writer(file)
    trajectory = writer.register_msgdef("trajectory_msgs/msg/JointTrajectory", JOINT_TRAJECTORY)
    state = writer.register_msgdef("sensor_msgs/msg/JointState", JOINT_STATE)
    writer.write_message(f"/{TRAJECTORY_TOPIC}", trajectory, whole, 0)
    if plan.problem.actions:
        value = writer.register_msgdef("diagnostic_msgs/msg/KeyValue", KEY_VALUE)
        for timed in plan.actions:
            if isinstance(timed.action, SetOutput):
                pair = {"key": timed.action.name, "value": json.dumps(timed.action.value)}
                writer.write_message(f"/{OUTPUTS_TOPIC}", value, pair, round(timed.time * NANOSECONDS))
    for k, (time, point) in enumerate(zip(times, whole["points"], strict=True)):
        message = {"header": header(time), "name": whole["joint_names"], "position": point["positions"]}
        message |= {"velocity": point["velocities"], "effort": point["effort"]}
        writer.write_message(f"/{STATES_TOPIC}", state, message, time, sequence=k)
    description = writer.register_msgdef("std_msgs/msg/String", STRING)
    writer.write_message(f"/{DESCRIPTION_TOPIC}", description, {"data": robot_description(plan.path.robot)}, 0)
    transforms, shown = writer.register_msgdef("tf2_msgs/msg/TFMessage", TRANSFORMS), -NANOSECONDS
    for time, position in zip(times, samples.position, strict=True):
        if time - shown >= NANOSECONDS / TRANSFORMS_PER_SECOND or time == times[-1]:
            shown = time
            links = link_transforms(plan.path.robot.model, position)
            stamp = header(time, BASE_LINK)
            entries = [{"header": stamp, "child_frame_id": name, "transform": each} for name, each in links]
            writer.write_message(f"/{TRANSFORMS_TOPIC}", transforms, {"transforms": entries}, time)
    writer.finish()
    return file.getvalue()


FORMAT = Format("mcap", "application/x-mcap", ".mcap", render)
"""The form of recordings that ROS 2's players and Foxglove read."""


SIZES = ("radius", "length", "size")
"""The sizes of URDF's simple shapes."""


def robot_description(robot: Robot) -> str:
    """Return a URDF document of an arm for viewers.

    A link is drawn by the simple shapes of its description. Without these a box surrounds each collision shape.
    """
    document = urdf_of_model(robot.model)
    links = {link.get("name"): link for link in document.findall("link")}
    for shape in robot.geometry:
        placement = pin.SE3(rotation_from_rpy(*shape["rpy"]), np.array(shape["position"]))
        sizes = {size: np.atleast_1d(shape[size]) for size in SIZES if size in shape}
        _add_visual(links[shape["frame"]], placement, shape["kind"], sizes)
    for collider in () if robot.geometry else robot.collision_shapes:
        corners = surface(collider.shape).vertices
        low, high = corners.min(axis=0), corners.max(axis=0)
        placement = collider.placement * pin.SE3(np.eye(3), 0.5 * (low + high))
        _add_visual(links[_joint_link(robot.model, collider.joint)], placement, "box", {"size": high - low})
    return tostring(document, encoding="unicode")


def _add_visual(link: Element, placement: pin.SE3, kind: str, sizes: dict[str, FloatArray]) -> None:
    visual = SubElement(link, "visual")
    add_origin(visual, placement)
    SubElement(SubElement(visual, "geometry"), kind, {name: text_of(*value) for name, value in sizes.items()})


def _joint_link(model: pin.Model, number: int) -> str:
    """Return the name of the link that a joint moves, by the joint's number; 0: the base."""
    return f"{model.names[number]}_link" if number else BASE_LINK


def link_transforms(model: pin.Model, position: FloatArray) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the name of each link but the base, and its `geometry_msgs/msg/Transform` in the base.

    Args:
        model: The model of the arm.
        position: The joint position (joints,), rad or m.
    """
    data = model.createData()
    pin.framesForwardKinematics(model, data, position)
    poses = {_joint_link(model, number): data.oMi[number] for number in range(model.njoints)}
    frames = (number for number, frame in enumerate(model.frames) if frame.type in LINKS)
    poses = {model.frames[number].name: data.oMf[number] for number in frames} | poses
    for name, pose in poses.items():
        if name != BASE_LINK:
            rotation = pin.Quaternion(pose.rotation).coeffs().tolist()
            yield (
                name,
                {
                    "translation": dict(zip("xyz", pose.translation.tolist(), strict=True)),
                    "rotation": dict(zip("xyzw", rotation, strict=True)),
                },
            )
