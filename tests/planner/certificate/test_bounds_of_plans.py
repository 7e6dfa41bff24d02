"""Bounds of the plans of every back end against dense samples, which use no code of the bounds."""

from __future__ import annotations

import numpy as np
import pytest

from planner.backends import BACKENDS, BackEnd
from planner.certificate.joint_motions import TOOL_DEVIATION
from planner.dynamics import inverse_dynamics
from planner.errors import PlanningError
from planner.guarantees import TCP_ORDERS
from planner.kinematics.forward import JointStates
from planner.limits import Limits
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.transitions import StopTransition, ThroughTransition
from planner.robots import load_robot
from planner.robots.payload import Payload
from planner.trajectories.trajectory import Trajectory
from tests.sizes import NAME

PLANS, SAMPLES = {"quick": (2, 20_000), "large": (12, 100_000), "soak": (150, 1_000_000)}[NAME]
"""Number of plans of each back end, and of samples of each plan."""

SHARES = np.array([1e-6, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0 - 1e-6])
"""Fractions of each piece for additional samples: some pieces are shorter than the sample time."""

ROUNDING_OF_SAMPLES = 1e-10
"""Relative amount by which rounding alone may put a sample above a bound."""

ABOVE = 0.01
"""Relative amount by which a bound may exceed the largest sample."""

WIDE = dict.fromkeys(TCP_ORDERS, 1000.0)
"""Limits of the tool that never bind, so that the certificate reports its motion."""


def random_problem(seed: int) -> PlanningProblem:
    """Make a motion of a loaded UR5e through random positions, with limits of torque and of the tool."""
    rng = np.random.default_rng(seed)
    robot = load_robot("ur5e")
    count = int(rng.integers(3, 7))
    through = rng.random() < 0.6
    waypoints = [
        JointWaypoint(
            tuple(rng.uniform(-1.5, 1.5, robot.dof).tolist()),
            transition=ThroughTransition() if through and 0 < k < count - 1 else StopTransition(),
        )
        for k in range(count)
    ]
    limits = Limits(**WIDE | {"tcp_linear_velocity": float(rng.uniform(0.3, 3.0))})
    return PlanningProblem(robot, waypoints, limits=limits, payload=Payload(float(rng.uniform(0.5, 3.0))))


def largest(problem: PlanningProblem, trajectory: Trajectory) -> dict[str, float]:
    """Return the largest torque as a share of its limit, and the largest rates of the tool, at dense samples."""
    assert problem.payload is not None
    robot = problem.robot.with_payload(problem.payload)
    found = dict.fromkeys(["torque", *TCP_ORDERS], 0.0)
    inside = trajectory.breakpoints[:-1, None] + trajectory.lengths[:, None] * SHARES
    every = np.sort(np.concatenate([np.linspace(0.0, trajectory.duration, SAMPLES), inside.ravel()]))
    for times in np.array_split(every, max(1, SAMPLES // 20_000)):
        states = trajectory.evaluate(times, [0, 1, 2, 3])
        at = JointStates(robot, *states)
        use = np.abs(inverse_dynamics(robot, *states[:3])) / robot.limit("torque")
        found["torque"] = max(found["torque"], float(use.max()))
        for name in TCP_ORDERS:
            found[name] = max(found[name], float(at.tool_rate(name).max()))
    return found


@pytest.mark.sized
@pytest.mark.parametrize("kind", BACKENDS)
def test_no_sample_of_a_plan_exceeds_a_bound(kind: str) -> None:
    backend: type[BackEnd] = BACKENDS[kind]
    planned = 0
    for seed in range(4 * PLANS):
        problem = random_problem(seed)
        try:
            made = plan(problem, backend())
        except PlanningError:
            continue
        samples = largest(problem, made.trajectory)
        bounded = {check.quantity: check for check in made.certificate.checks if check.method == "bounded"}
        assert set(bounded) - {TOOL_DEVIATION} == set(samples)
        for quantity, check in ((name, bounded[name]) for name in samples):
            assert check.limit is not None
            assert check.lower is not None
            peak, lower = (
                value / (check.limit if quantity == "torque" else 1.0) for value in (check.peak, check.lower)
            )
            assert samples[quantity] <= peak * (1.0 + ROUNDING_OF_SAMPLES), (seed, quantity)
            assert lower <= peak <= lower * (1.0 + ABOVE), (seed, quantity)
            if quantity != "tcp_centripetal_acceleration":  # samples may miss a bend where the tool is almost at rest
                assert peak <= samples[quantity] * (1.0 + ABOVE), (seed, quantity)
        planned += 1
        if planned == PLANS:
            return
    pytest.fail(f"{planned} of {PLANS} plans were made")
