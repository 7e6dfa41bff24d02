"""A limited quantity is one class: certificate and back ends keep a constraint that only this file defines."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin
import pytest

from planner import Limits, PlanningError, certify, plan
from planner.backends import BACKENDS
from planner.constraints import Constraint
from planner.dynamics import path_dynamics
from planner.kinematics.forward import JointStates
from planner.plans.result import Plan
from planner.robots import Robot
from planner.spatial import FloatArray
from tests.planner.problems_of_tests import problem_of

LEAST_USED = {"toppra": 0.9, "trapezoidal": 0.3}
"""Share of the limit that a plan uses where it follows the limit along the path, or where the path is only slowed."""


@dataclass(frozen=True)
class KineticEnergy(Constraint):
    """The kinetic energy of the arm, J."""

    name: str = "kinetic_energy"
    unit: str = "J"
    order: int = 2

    def is_known(self, robot: Robot) -> bool:
        return robot.has_dynamics

    def values(self, states: JointStates) -> FloatArray:
        still = np.zeros_like(states.q)
        momentum = path_dynamics(states.robot, states.q, states.v, still).inertia
        return 0.5 * np.einsum("ij,ij->i", momentum, states.v)[:, None]


def energies(made: Plan, count: int = 2000) -> FloatArray:
    """Return energies by Pinocchio, at evenly spaced times."""
    robot = made.path.robot
    data = robot.model.createData()
    times = np.linspace(0.0, made.trajectory.duration, count)
    rates = zip(*made.trajectory.evaluate(times, [0, 1]), strict=True)
    return np.array([pin.computeKineticEnergy(robot.model, data, q, v) for q, v in rates])


@pytest.mark.long_table
@pytest.mark.parametrize("kind", sorted(BACKENDS))
def test_a_quantity_that_only_this_file_knows_is_kept_and_certified(kind: str) -> None:
    problem, backend = problem_of("kuka_kr16_l6_2", 3, 3), BACKENDS[kind]()
    free = plan(problem, backend)
    most = 0.25 * float(energies(free).max())
    kept = plan(replace(problem, limits=Limits(further={KineticEnergy(): most})), backend)
    highest = float(energies(kept).max())
    assert LEAST_USED.get(kind, 0.5) * most < highest <= most * (1.0 + 1e-6)
    (check,) = (check for check in kept.certificate.checks if check.quantity == "kinetic_energy")
    assert (check.satisfied, check.enforced, check.unit(problem.robot)) == (True, True, "J")
    assert check.peak == pytest.approx(highest, rel=1e-3)
    assert check.limit == pytest.approx(most)


def test_a_trajectory_that_breaks_a_further_limit_is_not_certified() -> None:
    made = plan(problem_of("kuka_kr16_l6_2", 3, 3))
    highest = float(energies(made).max())
    for share, satisfied in ((0.999, False), (1.001, True)):
        limits = Limits(further={KineticEnergy(): share * highest})
        certificate = certify(made.path.robot, made.trajectory, limits=limits, enforced=["position", "velocity"])
        assert certificate.satisfied is satisfied


def test_the_narrower_further_limit_of_the_whole_and_of_a_waypoint_holds() -> None:
    problem = problem_of("kuka_kr16_l6_2", 3, 3)
    own = replace(problem.waypoints[1], limits=Limits(further={KineticEnergy(): 5.0}))
    problem = replace(problem, waypoints=(problem.waypoints[0], own, *problem.waypoints[2:]))
    limits = replace(problem, limits=Limits(further={KineticEnergy(): 9.0})).segment_limits()
    assert limits.further[KineticEnergy()].tolist() == [5.0, *[9.0] * (len(problem.waypoints) - 2)]


def test_a_further_limit_that_is_none_is_refused() -> None:
    with pytest.raises(PlanningError, match="kinetic_energy"):
        plan(replace(problem_of("kuka_kr16_l6_2", 3, 3), limits=Limits(further={KineticEnergy(): 0.0})))
