"""The catalogue's real arms against the figures of their makers, entered here again."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest

from planner.robots import catalogue_ids, load_robot
from planner.robots.payload import Payload
from tests.planner.robots.frames import frame_pose, product, rot, trans

FULL, HALF = [360.0] * 6, [360.0, 360.0, 180.0, 360.0, 360.0, 360.0]
UR_FIGURES = {
    # degrees, degrees/s (user manuals, 3.13 of CB3, 5.8 of the e-series), N m (article Max. joint torques)
    "ur3": (HALF, [180, 180, 180, 360, 360, 360], [56, 56, 28, 12, 12, 12]),
    "ur5": (HALF, [180] * 6, [150, 150, 150, 28, 28, 28]),
    "ur10": (HALF, [120, 120, 180, 180, 180, 180], [330, 330, 150, 56, 56, 56]),
    "ur3e": ([*HALF[:5], math.inf], [180, 180, 180, 360, 360, 360], [54, 54, 28, 9, 9, 9]),
    "ur5e": (HALF, [180] * 6, [150, 150, 150, 28, 28, 28]),
    "ur10e": (HALF, [120, 120, 180, 180, 180, 180], [330, 330, 150, 54, 54, 54]),
    "ur16e": (HALF, [120, 120, 180, 180, 180, 180], [330, 330, 150, 54, 54, 54]),
}
UR_CHAINS = {
    # config/*/default_kinematics.yaml: heights and lengths along the links' own axes, m
    "ur3e": (0.15185, -0.24355, -0.2132, 0.13105, -0.08535, 0.0921),
    "ur5e": (0.1625, -0.425, -0.3922, 0.1333, -0.0997, 0.0996),
    "ur10e": (0.1807, -0.6127, -0.57155, 0.17415, -0.11985, 0.11655),
    "ur16e": (0.1807, -0.4784, -0.36, 0.17415, -0.11985, 0.11655),
}
FRANKA = {
    # FCI documentation: lower, upper (rad), rad/s, rad/s^2, rad/s^3, N m
    "panda": (
        [-2.8973, -1.7628, -2.8973, -3.0718, -2.8973, -0.0175, -2.8973],
        [2.8973, 1.7628, 2.8973, -0.0698, 2.8973, 3.7525, 2.8973],
        [2.1750, 2.1750, 2.1750, 2.1750, 2.6100, 2.6100, 2.6100],
        [15, 7.5, 10, 12.5, 15, 20, 20],
        [7500, 3750, 5000, 6250, 7500, 10000, 10000],
    ),
    "fr3": (
        [-2.7437, -1.7837, -2.9007, -3.0421, -2.8065, 0.5445, -3.0159],
        [2.7437, 1.7837, 2.9007, -0.1518, 2.8065, 4.5169, 3.0159],
        [2.62, 2.62, 2.62, 2.62, 5.26, 4.18, 5.26],
        [10] * 7,
        [5000] * 7,
    ),
}
RATED_PAYLOADS = {
    # kg; for the UR10e, the arms with 12.5 kg on their label; older ones carry 10 kg
    "kuka_kr16_l6_2": 6.0,
    "kuka_kr16_2": 16.0,
    "ur3": 3.0,
    "ur5": 5.0,
    "ur10": 10.0,
    "ur3e": 3.0,
    "ur5e": 5.0,
    "ur10e": 12.5,
    "ur16e": 16.0,
    "panda": 3.0,
    "fr3": 3.0,
    "xarm7": 3.5,
}
QUANTITIES = ("lower", "upper", "velocity", "acceleration", "jerk")


def in_catalogue(*ids: str) -> list[str]:
    """List the robots that can be loaded: some come with the package example-robot-data alone."""
    return [robot_id for robot_id in ids if robot_id in catalogue_ids()]


@pytest.mark.parametrize("robot_id", catalogue_ids())
def test_figures_of_makers_and_estimates_name_their_source(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert set(robot.limit_sources) <= set().union(*(joint.provenance for joint in robot.joints))
    for joint in robot.joints:
        assert {name for name, origin in joint.provenance.items() if origin == "datasheet"} <= set(robot.limit_sources)
        assert not {name for name, origin in joint.provenance.items() if origin == "default"} & set(robot.limit_sources)


@pytest.mark.parametrize("robot_id", in_catalogue(*UR_FIGURES))
def test_universal_robots(robot_id: str) -> None:
    robot, (position, velocity, torque) = load_robot(robot_id), UR_FIGURES[robot_id]
    np.testing.assert_allclose(np.degrees(robot.limit("upper")), position)
    np.testing.assert_allclose(np.degrees(robot.limit("lower")), -np.array(position))
    np.testing.assert_allclose(np.degrees(robot.limit("velocity")), velocity)
    np.testing.assert_allclose(robot.limit("torque"), torque)
    for joint in robot.joints:  # "acceleration limits are not publicly available"
        assert (joint.provenance["velocity"], joint.provenance["torque"]) == ("datasheet", "datasheet")
        assert (joint.provenance["acceleration"], joint.provenance["jerk"]) == ("default", "default")


@pytest.mark.parametrize("robot_id", UR_CHAINS)
def test_e_series_stands_as_its_ros_description_has_it(robot_id: str) -> None:
    """The ROS description turns the base link by half a turn against the controller's base, and has no table."""
    robot, (h, a2, a3, d4, d5, d6) = load_robot(robot_id), UR_CHAINS[robot_id]
    quarter, half = np.pi / 2, np.pi
    last = product(rot("z", half), rot("y", half), rot("x", quarter))
    for q in np.random.default_rng(4).uniform(-np.pi, np.pi, (20, 6)):
        expected = product(
            *(trans(z=h), rot("z", q[0]), rot("x", quarter), rot("z", q[1]), trans(x=a2), rot("z", q[2])),
            *(trans(x=a3, z=d4), rot("z", q[3]), trans(y=d5), rot("x", quarter), rot("z", q[4])),
            *(trans(y=d6), last, rot("z", q[5])),
        )
        np.testing.assert_allclose(frame_pose(robot, q), expected, atol=1e-9)


@pytest.mark.parametrize("robot_id", in_catalogue(*FRANKA))
def test_franka(robot_id: str) -> None:
    robot = load_robot(robot_id)
    # Within 0.015 rad of the ends of its range FR3 may hardly move: there the position limits end.
    accuracy = {"lower": 0.015, "upper": 0.015, "velocity": 0.00101} if robot_id == "fr3" else {}
    for quantity, figures in zip(QUANTITIES, FRANKA[robot_id], strict=True):
        np.testing.assert_allclose(robot.limit(quantity), figures, rtol=0.0, atol=accuracy.get(quantity, 0.0))
        assert (np.abs(robot.limit(quantity)) <= np.abs(figures)).all() or quantity in ("lower", "upper")
    if robot_id == "fr3":
        assert (robot.limit("lower") > FRANKA["fr3"][0]).all() and (robot.limit("upper") < FRANKA["fr3"][1]).all()
    np.testing.assert_array_equal(robot.limit("torque"), [87, 87, 87, 87, 12, 12, 12])
    assert set().union(*(joint.provenance.values() for joint in robot.joints)) == {"datasheet"}


def test_fr3_stands_as_its_description_has_it() -> None:
    """The truth is robots/fr3/kinematics.yaml: an origin and roll for each joint."""
    origins = ((0, 0, 0.333), (0, 0, 0), (0, -0.316, 0), (0.0825, 0, 0), (-0.0825, 0.384, 0), (0, 0, 0), (0.088, 0, 0))
    rolls = np.array([0, -1, 1, 1, -1, 1, 1]) * np.pi / 2
    robot = load_robot("fr3")
    for q in np.random.default_rng(5).uniform(robot.limit("lower"), robot.limit("upper"), (20, 7)):
        joints = [
            product(trans(*origin), rot("x", roll), rot("z", angle))
            for origin, roll, angle in zip(origins, rolls, q, strict=True)
        ]
        np.testing.assert_allclose(frame_pose(robot, q), product(*joints, trans(z=0.107)), atol=1e-12)


@pytest.mark.skipif("xarm7" not in catalogue_ids(), reason="example-robot-data is not installed")
def test_xarm() -> None:
    """UFACTORY's robot specifications have 180 degrees/s, 1145 degrees/s^2, 28647 degrees/s^3, and the ranges."""
    robot = load_robot("xarm7")
    np.testing.assert_allclose(np.degrees(robot.limit("lower")), [-360, -118, -360, -11, -360, -97, -360])
    np.testing.assert_allclose(np.degrees(robot.limit("upper")), [360, 120, 360, 225, 360, 180, 360])
    for quantity, figure in (("velocity", 180), ("acceleration", 1145), ("jerk", 28647)):
        np.testing.assert_allclose(np.degrees(robot.limit(quantity)), [figure] * 7)
        assert {joint.provenance[quantity] for joint in robot.joints} == {"datasheet"}


@pytest.mark.parametrize("robot_id", in_catalogue(*RATED_PAYLOADS))
def test_rated_payloads(robot_id: str) -> None:
    robot = load_robot(robot_id)
    assert robot.rated_payload == RATED_PAYLOADS[robot_id]
    assert robot.rated_payload_source


def test_a_rated_payload_and_its_source_are_told_together() -> None:
    for robot in map(load_robot, catalogue_ids()):
        assert (robot.rated_payload is None) == (robot.rated_payload_source is None)
        assert (robot.rated_payload is None) == (robot.id not in RATED_PAYLOADS)


@pytest.mark.parametrize("robot_id", ["ur3e", "ur5e", "ur10e", "ur16e", "fr3"])
def test_masses_can_exist_and_the_motors_hold_them_with_the_rated_load(robot_id: str) -> None:
    robot = load_robot(robot_id)
    loaded = robot.with_payload(Payload(RATED_PAYLOADS[robot_id]))
    lower, upper = np.maximum(robot.limit("lower"), -np.pi), np.minimum(robot.limit("upper"), np.pi)
    for q in np.random.default_rng(3).uniform(lower, upper, (200, robot.dof)):
        assert np.linalg.eigvalsh(pin.crba(robot.model, robot.model.createData(), q)).min() > 0.0
        hold = pin.rnea(loaded.model, loaded.data, q, np.zeros(robot.dof), np.zeros(robot.dof))
        assert (np.abs(hold) < robot.limit("torque")).all()
