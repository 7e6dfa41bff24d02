"""Which matrices are rotations; roll, pitch and yaw of rotations in a row, against scipy's, and without an answer."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner.spatial import is_rotation, rotation_from_rpy, rpy_from_rotations

QUARTER = np.pi / 2.0


def test_rotations_are_told_from_other_matrices() -> None:
    rotations = Rotation.random(50, random_state=3).as_matrix()
    assert is_rotation(rotations).all()
    assert is_rotation(np.round(rotations, 7)).all()
    others = [1.001 * rotations, -rotations, np.full_like(rotations, np.nan), np.zeros_like(rotations)]
    assert not is_rotation(np.array(others)).any()
    assert is_rotation(np.empty((0, 3, 3))).shape == (0,)


def test_one_rotation_has_the_angles_that_scipy_finds() -> None:
    rotations = Rotation.random(200, random_state=1).as_matrix()
    ours = np.array([rpy_from_rotations(rotation[None])[0] for rotation in rotations])
    assert ours == pytest.approx(Rotation.from_matrix(rotations).as_euler("xyz"), abs=1e-9)


def test_the_angles_make_the_rotations_again() -> None:
    rng = np.random.default_rng(2)
    rotations = np.array([rotation_from_rpy(*rng.normal(scale=3.0, size=3)) for _ in range(300)])
    found = rpy_from_rotations(rotations)
    assert np.array([rotation_from_rpy(*angles) for angles in found]) == pytest.approx(rotations, abs=1e-12)
    assert np.abs(np.diff(found[:, [0, 2]], axis=0)).max() <= np.pi + 1e-12


def test_angles_go_on_beyond_half_a_turn() -> None:
    turns = np.linspace(0.0, 20.0, 400)
    rotations = np.array([rotation_from_rpy(0.3, 0.2, turn) for turn in turns])
    assert rpy_from_rotations(rotations) == pytest.approx(
        np.column_stack([np.full(400, 0.3), np.full(400, 0.2), turns]), abs=1e-12
    )


def test_a_tool_that_points_down_does_not_flicker() -> None:
    """Its roll is half a turn, give or take rounding."""
    rng = np.random.default_rng(3)
    rotations = np.array([rotation_from_rpy(np.pi + 1e-12 * e, 1e-12 * e, 0.4) for e in rng.normal(size=100)])
    assert np.ptp(rpy_from_rotations(rotations), axis=0).max() < 1e-10


@pytest.mark.parametrize("pitch", [QUARTER, -QUARTER])
def test_at_a_quarter_turn_of_pitch_the_roll_stays(pitch: float) -> None:
    """From 0.7 before it, or 0 where there is nothing before; the yaw makes up for it, and no angle is chance."""
    locked = np.array([rotation_from_rpy(0.2, pitch, yaw) for yaw in np.linspace(0.0, 1.0, 50)])
    alone = rpy_from_rotations(locked)
    assert not alone[:, 0].any()
    after = rpy_from_rotations(np.concatenate([rotation_from_rpy(0.7, np.sign(pitch) * 1.5, 0.0)[None], locked]))
    assert after[:, 0] == pytest.approx(0.7, abs=1e-12)
    for angles in (alone, after[1:]):
        assert np.array([rotation_from_rpy(*row) for row in angles]) == pytest.approx(locked, abs=1e-9)
        assert np.abs(np.diff(angles[:, 2])).max() < 0.05
