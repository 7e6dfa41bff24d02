"""Motions in phases read as cubics by plain numpy, one motion at a time."""

from __future__ import annotations

import numpy as np

ROUNDING = 1e-12


def cubic_pieces(
    states: tuple[np.ndarray, ...], times: np.ndarray, travel: np.ndarray, end: tuple[np.ndarray, np.ndarray]
) -> tuple[np.ndarray, np.ndarray]:
    """Return lengths (pieces,) and coefficients (pieces, joints, 4) of one motion with phases (joints, phases).

    Args:
        states: Positions, velocities, accelerations and jerks of the phases.
        times: Durations (joints, phases).
        travel: Travel (joints,).
        end: Velocity and acceleration (joints,) at the end.
    """
    # In extended precision: a phase may be as short as 1e-8 of the whole.
    phases = times.astype(np.longdouble)
    phase_ends = np.cumsum(phases, axis=1)
    phase_starts = phase_ends - phases
    duration = phase_ends.max()
    cuts = np.unique(phase_ends[phase_ends < duration * (1.0 - ROUNDING)])
    cuts = np.concatenate([[0.0], cuts[cuts > ROUNDING * duration], [duration]])
    cuts = cuts[np.append(True, np.diff(cuts) > ROUNDING * duration)]
    middles = (cuts[:-1] + cuts[1:]) / 2.0
    phase = (middles[:, None, None] > phase_ends[:, :-1]).sum(axis=2)
    joint = np.arange(len(travel))
    p, v, a, j = (values[joint, phase] for values in states)
    since = (cuts[:-1, None] - phase_starts[joint, phase]).astype(np.float64)
    coefficients = np.stack(
        [
            p + since * (v + since * (a / 2.0 + since * j / 6.0)),
            v + since * (a + since * j / 2.0),
            (a + since * j) / 2.0,
            j / 6.0,
        ],
        axis=-1,
    )
    lengths = np.diff(cuts).astype(np.float64)
    return lengths, coefficients + _correction(lengths, coefficients, travel, end)


def _correction(
    lengths: np.ndarray, coefficients: np.ndarray, travel: np.ndarray, end: tuple[np.ndarray, np.ndarray]
) -> np.ndarray:
    """Return cubics from rest whose jerks, least in the mean square, correct the error at the end."""
    h = lengths[:, None]
    p, v, a, j = (coefficients[-1, :, k] for k in range(4))
    t = lengths[-1]
    missing = np.stack(
        [
            travel - (p + t * (v + t * (a + t * j))),
            end[0] - (v + t * (2.0 * a + 3.0 * t * j)),
            end[1] - (2.0 * a + 6.0 * t * j),
        ]
    )
    # Where there is no jerk, the acceleration jumps at the end.
    missing[2, ~coefficients[..., 3].any(axis=0)] = 0.0
    # What 1 unit of jerk on each piece does to position, velocity and acceleration at the end.
    left = lengths.sum() - np.cumsum(lengths)
    effect = np.stack(
        [
            lengths * (lengths**2 / 6.0 + left * (lengths + left) / 2.0),
            lengths * (lengths / 2.0 + left),
            lengths,
        ]
    )
    jerk = np.linalg.lstsq(effect, missing)[0]

    def from_zero(change: np.ndarray) -> np.ndarray:
        return np.concatenate([np.zeros((1, change.shape[1])), np.cumsum(change, axis=0)[:-1]])

    acceleration = from_zero(h * jerk)
    velocity = from_zero(h * (acceleration + h * jerk / 2.0))
    position = from_zero(h * (velocity + h * (acceleration / 2.0 + h * jerk / 6.0)))
    return np.stack([position, velocity, acceleration / 2.0, jerk / 6.0], axis=-1)
