"""What must hold for every plan of every back end, on random requests."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.backends import BACKENDS, Guarantee
from planner.export import FORMATS, ExportOptions
from planner.plan import Plan, plan
from planner.polynomials import differentiate, horner
from planner.problem import PlanningProblem
from tests.planner.problems import PARTS, REQUESTS, problems, try_on_random

CONTINUITY = {"cubic": 1, "trapezoidal": 1, "quintic": 2, "toppra": 1, "min_effort": 2, "ruckig": 2, "auto": 2}
DENSE = np.linspace(0.0, 1.0, 33)
SAMPLES = 100
"""Of torque and tool speeds."""


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("kind", sorted(BACKENDS))
def test_every_plan_keeps_its_promises(kind: str, part: int) -> None:
    try_on_random(REQUESTS * 9 // 10 // len(PARTS), part, problems(kind), keeps_its_promises)


@pytest.mark.parametrize("kind", sorted(BACKENDS))
@settings(max_examples=max(10, settings.default.max_examples // 80))
@given(data=st.data())
def test_the_same_request_gives_the_same_bytes(kind: str, data: st.DataObject) -> None:
    problem = data.draw(problems(kind))
    result = plan(problem)
    options = ExportOptions(sample_period=result.trajectory.duration / 10.7)
    assert FORMATS["json"].render(plan(problem), options) == FORMATS["json"].render(result, options)


def keeps_its_promises(problem: PlanningProblem) -> None:
    kind = problem.backend.kind
    result = plan(problem)
    trajectory, limits = result.trajectory, result.path.limits
    positions = np.array([waypoint.position for waypoint in problem.waypoints])

    assert (np.diff(trajectory.sample_times(trajectory.duration / 97.3)) > 0.0).all()
    assert (np.diff(trajectory.breakpoints) > 0.0).all()
    met, velocity = trajectory.evaluate(trajectory.arrivals, [0, 1])
    assert np.abs(met - positions).max() <= 1e-9
    assert np.abs(velocity).max() <= 1e-9
    assert np.abs(trajectory.evaluate(trajectory.departures, [0])[0] - positions).max() <= 1e-9

    # The limits, by dense samples, not by the certificate.
    guarantees = problem.backend.guarantees
    tau = DENSE * trajectory.lengths[:, None]
    for order, quantity in enumerate(("position", "velocity", "acceleration", "jerk")):
        if guarantees[quantity] is not Guarantee.HARD:
            continue
        values = horner(differentiate(trajectory.coefficients, order)[:, None], tau[..., None])
        if quantity == "position":
            assert (values >= limits.lower - 1e-9).all()
            assert (values <= limits.upper + 1e-9).all()
        else:
            bound = getattr(limits, quantity)[trajectory.segments][:, None]
            assert (np.abs(values) <= bound * (1.0 + 1e-9)).all()

    keeps_sampled_limits(result)

    # Continuity between the pieces, each derivative measured by its own largest value.
    for order in range(CONTINUITY[kind] + 1):
        coefficients = differentiate(trajectory.coefficients, order)
        values = horner(coefficients[:, None], tau[..., None])
        jumps = np.abs(values[1:, 0] - values[:-1, -1]).max(initial=0.0)
        assert jumps <= 1e-9 * max(np.abs(values).max(), 1.0)
    assert int(result.certificate.continuity[1:]) >= CONTINUITY[kind]


def keeps_sampled_limits(result: Plan) -> None:
    """Torque and tool speeds, at random times, by Pinocchio; the arms without torque limits have no inertias."""
    trajectory, robot, limits = result.trajectory, result.path.robot, result.path.limits
    data = robot.model.createData()
    times = trajectory.duration * np.random.default_rng(0).random(SAMPLES)
    segments = trajectory.segments[trajectory.locate(times)[0]]
    for segment, q, v, a in zip(segments, *trajectory.evaluate(times, [0, 1, 2]), strict=True):
        if robot.has_dynamics:
            assert (np.abs(pin.rnea(robot.model, data, q, v, a)) <= limits.torque[segment] * (1.0 + 1e-6)).all()
        pin.forwardKinematics(robot.model, data, q, v)
        speed = pin.getFrameVelocity(robot.model, data, robot.tool_frame_id, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)
        assert np.linalg.norm(speed.linear) <= limits.tcp_linear_velocity[segment] * (1.0 + 1e-6)
        assert np.linalg.norm(speed.angular) <= limits.tcp_angular_velocity[segment] * (1.0 + 1e-6)
