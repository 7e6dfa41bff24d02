"""The limits in answers: position-dependent velocity limits at each sample."""

from __future__ import annotations

import json

import numpy as np
import pytest

from api.work.answers.formats import FORMATS
from api.work.answers.plans import AnswerOptions
from planner import (
    JointWaypoint,
    Limits,
    PlanningProblem,
    Robot,
    VelocityCurves,
    VelocityParabola,
    VelocityTable,
    load_robot,
    plan,
)

WITH_LIMITS = AnswerOptions(sample_period=0.02, include=frozenset({"limits"}))


@pytest.fixture(scope="module")
def curved() -> Robot:
    """Return an arm whose first joint has velocity curves."""
    kuka = load_robot("kuka_kr16_2")
    parabola, table = VelocityParabola(rate=4.0, end=2.0, offset=0.2), VelocityTable((-1.0, 0.0), (0.5, 1.5))
    return kuka.derived(limits={kuka.joint_names[0]: {"velocity_curves": VelocityCurves((parabola,), (table,))}})


def answer_of(robot: Robot, limits: Limits) -> dict[str, dict[str, np.ndarray]]:
    """Return the samples and limits of the answer for a back-and-forth motion of the first joint."""
    rest = [-1.5, 1.5, 0.0, 1.0, 0.0]
    waypoints = [JointWaypoint(position=(first, *rest)) for first in (-1.5, 1.5, -1.5)]
    done = plan(PlanningProblem(robot, waypoints, limits=limits))
    answer = json.loads(FORMATS["json"].render(done, WITH_LIMITS))
    return {part: answer[part] for part in ("samples", "limits")}


def test_limits_at_samples_follow_the_curves_and_the_limits_of_segments(curved: Robot) -> None:
    scale = 0.8
    answer = answer_of(curved, Limits(velocity_scale=scale))
    q, v = (np.array(answer["samples"][name]) for name in ("position", "velocity"))
    at_samples = answer["limits"]["at_samples"]["velocity"]
    lower, upper = (np.array(at_samples[side], dtype=float) for side in ("lower", "upper"))
    constant = curved.limit("velocity")
    assert upper[:, 0] == pytest.approx(scale * np.minimum(constant[0], np.sqrt(4.0 * (2.0 - q[:, 0])) - 0.2))
    assert lower[:, 0] == pytest.approx(-scale * np.minimum(constant[0], np.clip(1.5 + q[:, 0], 0.5, 1.5)))
    assert upper[:, 1:] == pytest.approx(np.tile(scale * constant[1:], (len(q), 1)))
    assert min(np.ptp(upper[:, 0]), np.ptp(lower[:, 0])) > 0.1
    assert ((lower - 1e-9 <= v) & (v <= upper + 1e-9)).all()


def test_limits_that_are_constant_on_segments_have_no_rows_of_samples() -> None:
    assert "at_samples" not in answer_of(load_robot("kuka_kr16_2"), Limits())["limits"]
