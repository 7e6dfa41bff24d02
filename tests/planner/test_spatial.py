"""Rotation matrices and their checks; roll, pitch and yaw of successive rotations, against scipy and at its gaps."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from planner.spatial import (
    FloatArray,
    Pose,
    is_rotation,
    right_jacobians,
    rotation_from_rpy,
    rotation_vector,
    rotation_vectors,
    rpy_from_rotations,
)

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
    """Its roll is a half turn, up to rounding."""
    rng = np.random.default_rng(3)
    rotations = np.array([rotation_from_rpy(np.pi + 1e-12 * e, 1e-12 * e, 0.4) for e in rng.normal(size=100)])
    assert np.ptp(rpy_from_rotations(rotations), axis=0).max() < 1e-10


@pytest.mark.parametrize("pitch", [QUARTER, -QUARTER])
def test_at_a_quarter_turn_of_pitch_the_roll_stays(pitch: float) -> None:
    """The roll stays at 0.7, or 0 without a rotation before; the yaw follows from it, and rounding decides no angle."""
    locked = np.array([rotation_from_rpy(0.2, pitch, yaw) for yaw in np.linspace(0.0, 1.0, 50)])
    alone = rpy_from_rotations(locked)
    assert not alone[:, 0].any()
    after = rpy_from_rotations(np.concatenate([rotation_from_rpy(0.7, np.sign(pitch) * 1.5, 0.0)[None], locked]))
    assert after[:, 0] == pytest.approx(0.7, abs=1e-12)
    for angles in (alone, after[1:]):
        assert np.array([rotation_from_rpy(*row) for row in angles]) == pytest.approx(locked, abs=1e-9)
        assert np.abs(np.diff(angles[:, 2])).max() < 0.05


def _turns_of_all_sizes() -> FloatArray:
    """Return rotation vectors (N, 3) from almost no turn to almost, and exactly, half a turn."""
    rng = np.random.default_rng(3)
    axes = rng.normal(size=(40, 3))
    axes = np.vstack([axes, np.eye(3), -np.eye(3), [[1.0, -1.0, 0.0], [0.0, 1.0, -1.0], [-1.0, 0.0, 1e-9]]])
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    gaps = [0.0, 1e-15, 1e-12, 1e-10, 1e-9, 1e-8, 1e-6, 1e-4, 9.9e-4, 1.1e-3, 1e-2, 0.1]
    sizes = np.array([*gaps, 1.0, *(np.pi / 2.0 + gap for gap in (-1e-9, 0.0, 1e-9)), *(np.pi - gap for gap in gaps)])
    vectors: FloatArray = (sizes[:, None, None] * axes).reshape(-1, 3)
    return vectors


def test_the_logarithm_of_many_rotations_is_that_of_pinocchio() -> None:
    vectors = _turns_of_all_sizes()
    rotations = np.array([pin.exp3(vector) for vector in vectors])
    found = rotation_vectors(rotations)
    for vector, rotation, own in zip(vectors, rotations, found, strict=True):
        expected = pin.log3(rotation)
        if np.linalg.norm(vector) > np.pi - 1e-14:  # both are logarithms
            expected = expected if expected @ own > 0.0 else -expected
            vector = vector if vector @ own > 0.0 else -vector
        assert np.abs(own - expected).max() < 1e-10  # Pinocchio's own error a hundredth of a radian before half a turn
        assert np.abs(own - vector).max() < 1e-12
        assert np.abs(pin.exp3(own) - rotation).max() < 1e-12
        assert (rotation_vector(rotation) == pin.log3(rotation)).all()


def test_a_half_turn_is_as_long_as_it_is() -> None:
    half = np.diag([1.0, -1.0, -1.0])
    assert rotation_vectors(half[None])[0] == pytest.approx([np.pi, 0.0, 0.0])
    assert np.linalg.norm(rotation_vector(half)) == pytest.approx(np.pi)


@pytest.mark.parametrize("size", [0.0, 1e-9, 0.009, 0.011, 1.0, 3.0])
def test_the_right_jacobian_is_that_of_pinocchio(size: float) -> None:
    vectors = np.random.default_rng(2).normal(size=(20, 3))
    vectors *= size / np.linalg.norm(vectors, axis=1, keepdims=True)
    assert right_jacobians(vectors) == pytest.approx(np.array([pin.Jexp3(vector) for vector in vectors]), abs=1e-12)


def test_the_product_of_poses_is_that_of_pinocchio() -> None:
    for _ in range(20):
        first, second = pin.SE3.Random(), pin.SE3.Random()
        expected = first * second
        for other in (Pose(second.translation, second.rotation), second, second.homogeneous):
            product = Pose(first.translation, first.rotation) @ other
            assert product.position == pytest.approx(expected.translation, abs=1e-12)
            assert product.rotation == pytest.approx(expected.rotation, abs=1e-12)


def test_a_product_with_a_pose_of_any_orientation_has_none() -> None:
    turned = Pose.from_rpy([1.0, 0.0, 0.0], [0.0, 0.0, QUARTER])
    product = turned @ Pose([1.0, 0.0, 0.0])
    assert product.position == pytest.approx([1.0, 1.0, 0.0])
    assert product.rotation is None
