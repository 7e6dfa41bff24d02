"""The compiled search for sampled peaks against plain numpy that evaluates all samples of a round at once."""

from __future__ import annotations

import numpy as np
import pytest

from planner.trajectories.sampled_peaks import BEND_COLUMNS, PEAK_ACCURACY, sampled_peaks
from tests.planner.kernels import reference


def waves(seed: int, pieces: int, columns: int):  # type: ignore[no-untyped-def]
    """Make functions of piece and unit time: sums of waves, with peaks that samples may miss."""
    rng = np.random.default_rng(seed)
    amplitudes, rates, phases = rng.uniform(0.2, 1.0, (3, pieces, columns))
    spots, widths = rng.uniform(0.0, 1.0, (pieces, columns)), rng.uniform(0.02, 0.5, (pieces, columns))

    def use(at: np.ndarray, units: np.ndarray) -> np.ndarray:
        t = units[:, None]
        smooth = amplitudes[at] * np.sin(6.0 * rates[at] * t + phases[at])
        return np.asarray(smooth + 0.7 * np.exp(-(((t - spots[at]) / widths[at]) ** 2)))

    return use


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("decided_at", [np.inf, 1.2])
def test_peaks_are_those_of_numpy(seed: int, decided_at: float) -> None:
    rng = np.random.default_rng(100 + seed)
    pieces, columns = int(rng.integers(1, 12)), int(rng.integers(1, 7))
    quantities = np.sort(np.concatenate([np.arange(min(2, columns)), rng.integers(0, min(2, columns), columns)]))[
        :columns
    ]
    quantities = np.unique(quantities, return_inverse=True)[1]
    groups = np.arange(pieces) % int(rng.integers(1, pieces + 1))
    parts, use = rng.integers(2, 40, pieces), waves(seed, pieces, columns)
    above = rng.uniform(0.0, 1.0, int(groups.max()) + 1) if seed % 2 else 0.0
    found = sampled_peaks(use, parts, quantities, groups, decided_at=decided_at, above=above)
    expected = reference.sampled_peaks(use, parts, quantities, groups, decided_at=decided_at, above=above)
    for own, peer in zip(found, expected, strict=True):
        assert np.array_equal(own, peer)


@pytest.mark.parametrize("power", [1.0, 0.5])
def test_bends_between_samples_open_them_as_in_numpy(power: float) -> None:
    """A tool nearly stands still, so that its path bends within a moment."""

    def use(at: np.ndarray, units: np.ndarray) -> np.ndarray:
        speed = 0.01 + np.abs(units - 0.4137) * (1.0 + at)
        centripetal = np.exp(-(((units - 0.4137) / 0.003) ** 2)) * 0.9
        return np.column_stack([centripetal, np.sin(units), speed, 0.6 + 0.0 * units, 2.0 + at])

    parts, quantities, groups = np.array([9, 30]), np.array([0, 1]), np.zeros(2, dtype=int)
    found = sampled_peaks(use, parts, quantities, groups, bend=(0, power))
    expected = reference.sampled_peaks(use, parts, quantities, groups, bend=(0, power))
    assert use(np.zeros(1), np.zeros(1)).shape[1] == 2 + BEND_COLUMNS
    for own, peer in zip(found, expected, strict=True):
        assert np.array_equal(own, peer)
    assert found.use[0, 0] > 0.85


@pytest.mark.parametrize("power", [1.0, 0.5])
@pytest.mark.parametrize("corner", [0.31, 0.3293, 0.4, 0.77])
def test_a_corner_where_the_speed_begins_to_bound_bends_is_found(corner: float, power: float) -> None:
    """Up to the corner the use grows with the square of the speed, from there on it falls slowly."""

    def use(at: np.ndarray, units: np.ndarray) -> np.ndarray:
        speed = 1.0 + 0.2 * (units - corner)
        centripetal = np.minimum(speed**2, 1.0 - 0.07 * (units - corner))
        return np.column_stack([centripetal**power, speed, 1.0 + 0.0 * units, 0.01 + 0.0 * units])

    found = sampled_peaks(use, np.array([3]), np.array([0]), np.array([0]), bend=(0, power))
    expected = reference.sampled_peaks(use, np.array([3]), np.array([0]), np.array([0]), bend=(0, power))
    assert 1.0 - PEAK_ACCURACY <= found.use[0, 0] <= 1.0
    for own, peer in zip(found, expected, strict=True):
        assert np.array_equal(own, peer)


def test_what_is_no_number_breaks_every_limit() -> None:
    def use(at: np.ndarray, units: np.ndarray) -> np.ndarray:
        return np.where(units[:, None] > 0.6, np.nan, 0.1)

    found = sampled_peaks(use, np.array([8]), np.array([0]), np.array([0]))
    assert found.use[0, 0] == np.inf


def test_an_error_in_the_functions_ends_the_search() -> None:
    def use(at: np.ndarray, units: np.ndarray) -> np.ndarray:
        raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        sampled_peaks(use, np.array([8]), np.array([0]), np.array([0]))
