"""Torques against the textbook's two-link arm and against Lagrange's equations by differences."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from planner.dynamics import inverse_dynamics
from planner.errors import MissingDynamics
from planner.kinematics import FloatArray, Pose
from planner.robots import DHJoint, Robot, load_robot
from planner.robots.payload import Payload
from planner.spatial import rotation_x
from tests.planner.problems_of_tests import random_position

G = 9.81


def two_links() -> Robot:
    """Return an arm of two slender rods in a vertical plane: 0.4 m, 3 kg, and 0.3 m, 2 kg."""

    def rod(length: float, mass: float) -> DHJoint:
        moment = mass * length**2 / 12.0
        return DHJoint(
            kind="revolute",
            theta=0.0,
            d=0.0,
            a=length,
            alpha=0.0,
            mass=mass,
            center_of_mass=(-length / 2.0, 0.0, 0.0),
            inertia=(0.0, 0.0, 0.0, moment, 0.0, moment),
        )

    return Robot.from_dh([rod(0.4, 3.0), rod(0.3, 2.0)], base=Pose(np.zeros(3), rotation_x(np.pi / 2.0)))


@pytest.mark.parametrize("payload", [0.0, 1.5], ids=["empty", "loaded"])
def test_two_links_in_closed_form(payload: float) -> None:
    """The closed form is the planar elbow of Spong, Hutchinson and Vidyasagar, Robot Modeling and Control.

    The payload is a point at the tip.
    """
    l1, l2 = 0.4, 0.3
    m1, m2 = 3.0, 2.0 + payload
    c1, c2 = 0.2, (2.0 * 0.15 + payload * 0.3) / m2
    i1 = 3.0 * l1**2 / 12.0
    i2 = 2.0 * l2**2 / 12.0 + 2.0 * (0.15 - c2) ** 2 + payload * (0.3 - c2) ** 2
    robot = two_links().with_payload(Payload(payload)) if payload else two_links()
    rng = np.random.default_rng(1)
    q, v, a = rng.uniform(-3.0, 3.0, (3, 20, 2))
    (q1, q2), (v1, v2), (a1, a2) = q.T, v.T, a.T
    coupling = i2 + m2 * (c2**2 + l1 * c2 * np.cos(q2))
    swirl = m2 * l1 * c2 * np.sin(q2)
    weight2 = m2 * c2 * G * np.cos(q1 + q2)
    inertia1 = i1 + i2 + m1 * c1**2 + m2 * (l1**2 + c2**2 + 2.0 * l1 * c2 * np.cos(q2))
    weight1 = (m1 * c1 + m2 * l1) * G * np.cos(q1) + weight2
    torque1 = inertia1 * a1 + coupling * a2 - swirl * (2.0 * v1 * v2 + v2**2) + weight1
    torque2 = coupling * a1 + (i2 + m2 * c2**2) * a2 + swirl * v1**2 + weight2
    assert inverse_dynamics(robot, q, v, a) == pytest.approx(np.column_stack([torque1, torque2]), abs=1e-11)


def placements(robot: Robot, q: FloatArray) -> list[tuple[FloatArray, FloatArray, FloatArray, float, FloatArray]]:
    """Return for each moving body: centre of mass (3,), rotation, inertia about the centre in the body's axes, mass."""
    pin.forwardKinematics(robot.model, robot.data, q)
    bodies = zip(robot.data.oMi.tolist()[1:], robot.model.inertias.tolist()[1:], strict=True)
    return [(oMi.act(body.lever), oMi.rotation.copy(), body.inertia, body.mass) for oMi, body in bodies]


def mass_matrix(robot: Robot, q: FloatArray, h: float = 1e-5) -> FloatArray:
    """Compute the mass matrix (joints, joints) from the bodies' velocities by central differences."""
    M = np.zeros((robot.dof, robot.dof))
    here = placements(robot, q)
    ends = [(placements(robot, q + step), placements(robot, q - step)) for step in h * np.eye(robot.dof)]
    for i, (_, R, inertia, mass) in enumerate(here):
        linear = np.array([(above[i][0] - below[i][0]) / (2.0 * h) for above, below in ends])
        spins = [R.T @ (above[i][1] - below[i][1]) / (2.0 * h) for above, below in ends]
        angular = np.array([[spin[2, 1], spin[0, 2], spin[1, 0]] for spin in spins])
        M += mass * linear @ linear.T + angular @ inertia @ angular.T
    return M


def potential(robot: Robot, q: FloatArray) -> float:
    return sum(mass * G * float(centre[2]) for centre, _, _, mass in placements(robot, q))


def lagrange(robot: Robot, q: FloatArray, v: FloatArray, a: FloatArray, h: float = 1e-4) -> FloatArray:
    """Compute m a + (dM/dt) v - grad(v^T M v / 2 - V)."""
    steps = h * np.eye(robot.dof)
    slopes = np.array([(mass_matrix(robot, q + s) - mass_matrix(robot, q - s)) / (2.0 * h) for s in steps])
    lift = np.array([(potential(robot, q + s) - potential(robot, q - s)) / (2.0 * h) for s in steps])
    drift = np.einsum("kij,k,j->i", slopes, v, v) - 0.5 * np.einsum("kij,i,j->k", slopes, v, v)
    torque: FloatArray = mass_matrix(robot, q) @ a + drift + lift
    return torque


@pytest.mark.parametrize("robot_id", ["kuka_kr16_l6_2", "date_sorting_arm"])
def test_torques_obey_lagrange(robot_id: str) -> None:
    payload = Payload(4.0, (0.05, -0.02, 0.12), (0.02, 0.03, 0.04))
    robot, rng = load_robot(robot_id).with_payload(payload), np.random.default_rng(2)
    q = np.array([random_position(robot, rng) for _ in range(5)])
    v, a = rng.uniform(-2.0, 2.0, (2, 5, robot.dof))
    expected = np.array([lagrange(robot, *state) for state in zip(q, v, a, strict=True)])
    assert np.abs(expected).max() > 10.0
    assert inverse_dynamics(robot, q, v, a) == pytest.approx(expected, abs=1e-4)


@pytest.mark.parametrize("count", [0, 1, 2, 200])
@pytest.mark.parametrize("robot", [two_links(), load_robot("kuka_kr16_l6_2")], ids=lambda robot: robot.id)
def test_many_states_at_once_are_each_by_itself(robot: Robot, count: int) -> None:
    robot = robot.with_payload(Payload(4.0, (0.05, -0.02, 0.12), (0.02, 0.03, 0.04)))
    q, v, a = np.random.default_rng(3).uniform(-2.0, 2.0, (3, count, 2 * robot.dof))[..., ::2]  # not contiguous
    together = inverse_dynamics(robot, q, v, a)
    each = [inverse_dynamics(robot, *state) for state in zip(q, v, a, strict=True)]
    assert np.array_equal(together, np.reshape(each, (count, robot.dof)))
    peer = [pin.rnea(robot.model, robot.data, *state).copy() for state in zip(q, v, a, strict=True)]
    assert together == pytest.approx(np.reshape(peer, (count, robot.dof)), rel=1e-12, abs=1e-11)


def test_without_masses_there_are_no_torques() -> None:
    still = np.zeros((1, 6))
    with pytest.raises(MissingDynamics):
        inverse_dynamics(load_robot("date_sorting_arm"), still, still, still)


def test_one_state_is_a_row_of_many_and_shapes_must_fit() -> None:
    robot = load_robot("kuka_kr16_2")
    q, v, a = np.random.default_rng(4).uniform(-1.0, 1.0, (3, 6, 6))
    many = inverse_dynamics(robot, q, v, a)
    assert np.array_equal(inverse_dynamics(robot, q[2].tolist(), v[2].tolist(), a[2].tolist()), many[2])
    for wrong in ((q, v, a[:5]), (q[:, :5], v[:, :5], a[:, :5]), (q[0, :5], v[0, :5], a[0, :5]), (q, v[0], a[0])):
        with pytest.raises(ValueError, match="the robot has 6 joints"):
            inverse_dynamics(robot, *wrong)
