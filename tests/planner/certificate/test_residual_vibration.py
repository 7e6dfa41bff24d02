"""The bound on residual vibration at all frequencies of a band against dense frequencies."""

from __future__ import annotations

import numpy as np
import pytest

from planner.certificate.residual_vibration import AMPLITUDE_KNOWN_TO, certify_residual_vibration, residual_amplitudes
from planner.planning import plan
from planner.problems.problem import JointWaypoint, PlanningProblem
from planner.problems.residual_vibration import ResidualVibration
from planner.robots import load_robot
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.kernels.arms import quintics

KUKA = load_robot("kuka_kr16_2")
FREQUENCIES = 20_001


def bound_against_dense(motions: list[PiecewisePolynomial], mode: ResidualVibration, after: np.ndarray) -> None:
    """Compare the check of motions, the last with a velocity at its end, with amplitudes at dense frequencies."""
    still = np.zeros_like(after)
    ends = np.cumsum([motion.breakpoints[-1] for motion in motions])
    (check,) = certify_residual_vibration(mode, KUKA.joint_names, motions, ends, (still, after))
    band = mode.frequency * np.linspace(1.0 - mode.frequency_error, 1.0 + mode.frequency_error, FREQUENCIES)
    lasts = [*[still] * (len(motions) - 1), after]
    each = zip(motions, lasts, strict=True)
    dense = np.array([residual_amplitudes(own, band, mode.damping, (still, last)) for own, last in each])
    assert check.method == "bounded"
    assert check.lower is not None
    assert dense.max() <= check.peak * (1.0 + 1e-12)
    assert check.peak <= dense.max() * (1.0 + AMPLITUDE_KNOWN_TO) * (1.0 + 1e-9)
    assert check.lower <= dense.max() * (1.0 + 1e-6)


@pytest.mark.parametrize("damping", [0.0, 0.05, 0.3])
def test_no_frequency_exceeds_the_bound_for_random_motions(damping: float) -> None:
    rng = np.random.default_rng(int(100 * damping))
    for seed in range(8):
        made = quintics(KUKA, seed, int(rng.integers(1, 8)), float(rng.uniform(0.1, 2.0)), float(rng.uniform(0.3, 3.0)))
        error = float(rng.choice([0.0, 0.02, 0.15, 0.19]))
        mode = ResidualVibration(float(rng.uniform(0.5, 20.0)), damping, error)
        bound_against_dense([made], mode, rng.normal(size=6))


@pytest.mark.long_table
@pytest.mark.parametrize("kind", ["cubic", "quintic", "trapezoidal", "ruckig", "toppra"])
def test_no_frequency_exceeds_the_bound_for_plans_of_any_duration(kind: str) -> None:
    """Slow motions leave a tiny part of their accelerations, which the bound has to resolve."""
    start = JointWaypoint((0.0, -1.4, 1.5, 0.0, 0.6, 0.0))
    for seconds in (1.5, 6.0, 60.0):
        ends = [start, JointWaypoint((0.9, -0.9, 1.2, 0.4, 0.9, 0.5), duration=seconds)]
        trajectory = plan(PlanningProblem(KUKA, ends), kind).trajectory
        for damping in (0.0, 0.1):
            bound_against_dense([trajectory], ResidualVibration(4.0, damping), np.zeros(6))


def test_the_bound_holds_for_several_motions() -> None:
    motions = [quintics(KUKA, seed) for seed in range(4)]
    for frequency in (1.0, 6.0):
        bound_against_dense(motions, ResidualVibration(frequency, 0.02), np.zeros(6))
