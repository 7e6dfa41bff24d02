"""Descents by the kernel against the same algorithm in plain numpy, one at a time."""

from __future__ import annotations

import numpy as np
import pytest

from planner.kernels.descent import Box, descend
from planner.kernels.kinematics import Arm, tip_jacobians
from planner.spatial import FloatArray, rotation_vectors
from tests.planner.kernels.arms import arm_of, robots

PATIENCE, MOST = 3, 30


def plain(
    arm: Arm, position: FloatArray, rotation: FloatArray | None, q: FloatArray, box: Box
) -> tuple[float, FloatArray]:
    """Descend as Sugihara (2011) does, with numpy's solver, without the joints that press against limits."""

    def look(at: FloatArray) -> tuple[FloatArray, FloatArray, float]:
        points, turned, jacobians = tip_jacobians(arm, at[None])
        error = position - points[0]
        if rotation is not None:
            error = np.append(error, rotation_vectors(rotation @ turned[0].T[None])[0])
        return error, jacobians[0][: len(error)], float(error @ error)

    error, J, squared = look(q)
    damping, slow = 1e-3, 0
    for _ in range(MOST):
        if squared < 1e-20 or slow >= PATIENCE or damping > 1e12:
            break
        gradient = J.T @ error
        pressed = ((q <= box.lower) & (gradient < 0.0)) | ((q >= box.upper) & (gradient > 0.0))
        free = np.where(pressed, 0.0, J)
        normal = free.T @ free
        normal += (damping * min(squared, 1.0) + 1e-13 * (1.0 + normal.diagonal().max())) * np.eye(len(q))
        step = np.linalg.solve(normal, np.where(pressed, 0.0, gradient))
        step *= min(1.0, 1.5 / max(float(np.linalg.norm(step)), 1e-9))
        candidate = np.clip(q + step, *box)
        error_there, J_there, there = look(candidate)
        slow = slow + 1 if there > 0.5 * squared else 0
        if there < squared:
            q, error, J, squared, damping = candidate, error_there, J_there, there, max(damping / 4.0, 1e-3)
        else:
            damping *= 16.0
    return squared**0.5, q


def cases(name: str, count: int) -> tuple[Arm, FloatArray, FloatArray, FloatArray, Box]:
    """Return an arm, poses that it reaches, starts around them, and its limits, which contain most starts."""
    robot = robots()[name]
    box = Box(np.maximum(robot.limit("lower"), -3.0), np.minimum(robot.limit("upper"), 3.0))
    rng, arm = np.random.default_rng(count), arm_of(robot)
    q = rng.uniform(*box, (count, robot.dof))
    starts = q + rng.normal(0.0, 0.7, q.shape)
    positions, rotations, _ = tip_jacobians(arm, q)
    return arm, positions, rotations, np.clip(starts, *box), box


@pytest.mark.parametrize("turned", [True, False])
@pytest.mark.parametrize("name", robots())
def test_descents_are_those_of_numpy(name: str, turned: bool) -> None:
    arm, positions, rotations, starts, box = cases(name, 41)
    requested = rotations if turned else None
    errors, ends = descend(arm, positions, requested, starts, box, PATIENCE, MOST)
    expected = [
        plain(arm, position, rotation if turned else None, start, box)
        for position, rotation, start in zip(positions, rotations, starts, strict=True)
    ]
    # Rounding decides in rare cases where a descent far from its pose leads to: processors differ there.
    off = np.abs(ends - np.array([end for _, end in expected])).max(axis=1)
    both = (errors < 1e-9) & (np.array([error for error, _ in expected]) < 1e-9)
    assert both.sum() > 20
    assert np.quantile(off[both], 0.9) < 1e-5
    assert ((ends >= box.lower) & (ends <= box.upper)).all()


def test_ends_reach_the_poses() -> None:
    arm, positions, rotations, starts, box = cases("kuka", 100)
    errors, ends = descend(arm, positions, rotations, starts, box, PATIENCE, MOST)
    reached, turned, _ = tip_jacobians(arm, ends)
    missing = np.hstack([positions - reached, rotation_vectors(rotations @ turned.transpose(0, 2, 1))])
    assert errors == pytest.approx(np.linalg.norm(missing, axis=1), abs=1e-12)


@pytest.mark.parametrize("axis", np.eye(3))
@pytest.mark.parametrize("short", [0.0, 1e-12, 1e-6, 0.05])
def test_half_turns_are_descended(axis: FloatArray, short: float) -> None:
    """The error of a half turn is pi, and descents lead from it to the pose."""
    arm = arm_of(robots()["kuka"])
    q = np.array([[0.3, -1.2, 1.4, 0.2, 0.9, 0.1]])
    position, rotation, _ = tip_jacobians(arm, q)
    angle = np.pi - short
    cross = np.cross(axis, np.eye(3)).T
    half = np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * cross @ cross
    errors, ends = descend(arm, position, half @ rotation, q, Box(*np.array([[-9.0], [9.0]]) * np.ones(6)), 30, 0)
    assert errors == pytest.approx([angle], abs=1e-9)
    assert ends.tobytes() == q.tobytes()


def test_each_descent_has_the_same_bytes_alone_and_among_others() -> None:
    arm, positions, rotations, starts, box = cases("on a rail", 37)
    together = descend(arm, positions, rotations, starts, box, PATIENCE, MOST)
    for k in range(len(starts)):
        alone = descend(arm, positions[[k]], rotations[[k]], starts[[k]], box, PATIENCE, MOST)
        assert [values[0].tobytes() for values in alone] == [values[k].tobytes() for values in together]


def test_behind_the_first_that_is_enough_none_is_made() -> None:
    arm, positions, rotations, starts, box = cases("kuka", 30)
    to_first = positions[:1], rotations[:1], np.roll(starts, 7, axis=0)  # the eighth start is near the pose
    errors, ends = descend(arm, *to_first, box, PATIENCE, MOST)
    first = int(np.argmax(errors < 1e-8))
    fewer, fewer_ends = descend(arm, *to_first, box, PATIENCE, MOST, enough=1e-8)
    assert 0 < first < 25  # the case
    assert fewer[: first + 1].tobytes() == errors[: first + 1].tobytes()
    assert fewer_ends[first].tobytes() == ends[first].tobytes()
    assert np.isinf(fewer[first + 5 :]).all()


def test_what_is_no_number_ends() -> None:
    arm, positions, rotations, starts, box = cases("kuka", 6)
    positions[2] = np.nan
    errors, _ = descend(arm, positions, rotations, starts, box, PATIENCE, MOST)
    assert not errors[2] < 1.0
    assert np.isfinite(np.delete(errors, 2)).all()


def test_no_starts_and_wrong_shapes() -> None:
    arm, positions, rotations, starts, box = cases("kuka", 4)
    assert descend(arm, positions[:0], rotations[:0], starts[:0], box, PATIENCE, MOST)[1].shape == (0, 6)
    with pytest.raises(ValueError, match="multiple"):
        descend(arm, positions[:3], rotations[:3], starts, box, PATIENCE, MOST)
    with pytest.raises(ValueError, match="shape"):
        descend(arm, positions, rotations, starts[:, :5], box, PATIENCE, MOST)
