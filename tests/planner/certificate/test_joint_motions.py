"""Deviations of joints from straight joint motions, against ternary searches on the line at dense samples."""

from __future__ import annotations

import numpy as np
import pytest

from planner.certificate.joint_motions import farthest_joint
from planner.trajectories.polynomials import PiecewisePolynomial
from tests.planner.tool_motions.dense_paths import StraightPositions
from tests.sizes import NAME

SEEDS = range({"quick": 12, "large": 120, "soak": 1200}[NAME])
"""Seeds of random motions."""

ROUNDING = 1e-12
"""Difference of two computations of a distance, rad or m."""


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.sized
def test_the_deviation_of_joints_is_the_largest_of_dense_samples(seed: int) -> None:
    """Motions leave the line aside, before its start and beyond its end; some joints rest, and some hardly move."""
    rng = np.random.default_rng(seed)
    joints, pieces = int(rng.integers(1, 8)), int(rng.integers(1, 5))
    start, way = rng.normal(size=(2, joints))
    way *= rng.choice([0.0, 1e-6, 1.0, 3.0], size=joints)
    way[rng.integers(joints)] = 1.0
    off = 10.0 ** rng.uniform(-6.0, 0.5)
    corners = rng.uniform(-0.3 * off, 1.0 + 0.3 * off, (1, 1, 6)) * way[:, None]
    coefficients = start[:, None] * np.eye(1, 6) + corners + off * rng.normal(size=(1, joints, 6))
    motion = PiecewisePolynomial(rng.uniform(0.2, 1.5, 1), coefficients).split(np.array([pieces]))
    line = StraightPositions(np.array([start, start + way]))
    found, time, joint = farthest_joint(motion, start, start + way)
    (there,) = motion.evaluate(np.array([time]), [0])
    assert line.distances(there)[0] == pytest.approx(found, rel=1e-9, abs=ROUNDING)
    times = np.linspace(0.0, motion.breakpoints[-1], 4_001)
    (positions,) = motion.evaluate(times, [0])
    largest = line.distances(positions).max()
    assert found >= largest * (1.0 - 1e-9) - ROUNDING
    assert found <= largest * (1.0 + 1e-2) + ROUNDING
    shares = np.linspace(0.0, 1.0, 100_001)[:, None]
    away = np.abs(there[0] - start - shares * way)
    nearest = away[away.max(axis=1).argmin()]
    assert nearest[joint] == pytest.approx(found, rel=1e-3, abs=1e-4)


def test_a_motion_on_the_line_has_no_deviation() -> None:
    start, end = np.array([0.1, -0.2, 0.3]), np.array([1.1, 0.8, 0.3])
    law = np.array([0.0, 0.0, 3.0, -2.0])
    coefficients = start[:, None] * np.eye(1, 4) + (end - start)[:, None] * law
    assert farthest_joint(PiecewisePolynomial(np.ones(1), coefficients[None]), start, end)[0] <= ROUNDING


def test_a_motion_beyond_the_end_is_as_far_off_as_it_overshoots() -> None:
    coefficients = np.array([[[0.0, 1.5, 0.0], [0.0, 0.0, 0.0]]])
    found, time, joint = farthest_joint(
        PiecewisePolynomial(np.ones(1), coefficients), np.zeros(2), np.array([1.0, 0.0])
    )
    assert (found, time, joint) == pytest.approx((0.5, 1.0, 0))
