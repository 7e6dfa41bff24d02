"""Motions cut where joints reverse, so that no joint changes its direction on a piece."""

from __future__ import annotations

import numpy as np

from planner.kernels.serial_chain import REST_SPEED
from planner.spatial import FloatArray
from planner.trajectories.polynomials import SegmentedPolynomial, bernstein_matrix, differentiate, powers, shifted

ENDS_SHARE = 1e-9
"""Share of a piece at its ends within which it is not cut."""


def cut_at_reversals(motion: SegmentedPolynomial, joints: np.ndarray) -> tuple[SegmentedPolynomial, np.ndarray]:
    """Cut the pieces of a motion where joints reverse.

    Args:
        motion: The motion.
        joints: Whether (joints,) the reversals of a joint count.

    Returns:
        The motion, and the index of the piece that each of its pieces is a part of.
    """
    rates = differentiate(motion.coefficients) * powers(motion.lengths, motion.coefficients.shape[2] - 1)[:, None]
    bernstein = rates @ bernstein_matrix(rates.shape[2])
    both = (bernstein.min(axis=2) < 0.0) & (bernstein.max(axis=2) > 0.0) & joints
    cuts: list[FloatArray] = [np.zeros(0)] * len(motion.lengths)
    for piece, joint in np.argwhere(both).tolist():
        roots = np.roots(rates[piece, joint, ::-1])
        real = roots.real[np.abs(roots.imag) <= ENDS_SHARE]
        cuts[piece] = np.union1d(cuts[piece], real[(real > ENDS_SHARE) & (real < 1.0 - ENDS_SHARE)])
    of = np.repeat(np.arange(len(cuts)), [1 + len(own) for own in cuts])
    if len(of) == len(cuts):
        return motion, of
    ends = [np.concatenate([[0.0], own, [1.0]]) for own in cuts]
    starts = np.concatenate([own[:-1] for own in ends]) * motion.lengths[of]
    lengths = np.concatenate([np.diff(own) for own in ends]) * motion.lengths[of]
    coefficients = shifted(motion.coefficients[of], starts[:, None])
    return SegmentedPolynomial(lengths, coefficients, motion.segments[of]), of


def directions(motion: SegmentedPolynomial) -> FloatArray:
    """Return the signs (pieces, joints) of the velocities in the middle of each piece."""
    (velocities,) = motion.evaluate_on(np.arange(len(motion.lengths)), motion.lengths / 2.0, [1])
    return np.sign(velocities)


def towards(signs: FloatArray, velocities: FloatArray) -> FloatArray:
    """Return velocities (..., joints) which have the given signs even where they vanish; 0: they stay."""
    slowest = 2.0 * REST_SPEED
    return np.where(signs == 0.0, velocities, signs * np.maximum(signs * velocities, slowest))
