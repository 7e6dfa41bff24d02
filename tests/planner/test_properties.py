"""What must hold for every plan of every back end, on random requests."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.backends import BACKENDS, Guarantee
from planner.export import FORMATS, ExportOptions
from planner.plan import plan
from planner.polynomials import differentiate, horner
from planner.problem import PlanningProblem
from tests.planner.problems import PARTS, REQUESTS, problems

CONTINUITY = {"cubic": 1, "trapezoidal": 1, "quintic": 2, "toppra": 1, "min_effort": 2, "ruckig": 2, "auto": 2}
DENSE = np.linspace(0.0, 1.0, 33)


@pytest.mark.parametrize("part", PARTS)
@pytest.mark.parametrize("kind", sorted(BACKENDS))
@settings(max_examples=REQUESTS * 9 // 10 // len(PARTS))
@given(data=st.data())
def test_every_plan_keeps_its_promises(kind: str, part: int, data: st.DataObject) -> None:
    keeps_its_promises(kind, data.draw(problems(kind)))


@pytest.mark.parametrize("kind", sorted(BACKENDS))
@settings(max_examples=max(10, settings.default.max_examples // 80))
@given(data=st.data())
def test_the_same_request_gives_the_same_bytes(kind: str, data: st.DataObject) -> None:
    problem = data.draw(problems(kind))
    result = plan(problem)
    options = ExportOptions(sample_period=result.trajectory.duration / 10.7)
    assert FORMATS["json"].render(plan(problem), options) == FORMATS["json"].render(result, options)


def keeps_its_promises(kind: str, problem: PlanningProblem) -> None:
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

    # Continuity between the pieces, each derivative measured by its own largest value.
    for order in range(CONTINUITY[kind] + 1):
        coefficients = differentiate(trajectory.coefficients, order)
        values = horner(coefficients[:, None], tau[..., None])
        jumps = np.abs(values[1:, 0] - values[:-1, -1]).max(initial=0.0)
        assert jumps <= 1e-9 * max(np.abs(values).max(), 1.0)
    assert int(result.certificate.continuity[1:]) >= CONTINUITY[kind]
