"""The kernel of passing states, against scipy's optimum of the same program."""

from __future__ import annotations

import numpy as np
import pytest
import ruckig
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import minimize

from planner.backends.ruckig.via_program import PIECES_PER_SEGMENT, _grid
from planner.kernels.passing import PassingProblem, PhasedMotions, best_states, read_cubics
from tests.planner.kernels.cubics import cubic_pieces

NEAR = 0.25
"""Share of the duration by which the search may exceed the optimum of the program: it ends at a gap of 0.05."""

NEARER = 0.9
"""Least share of that optimum for a motion whose jerks need not be constant on eight pieces."""


def program(seed: int, segments: int, joints: int) -> tuple[PassingProblem, np.ndarray]:
    """Make a random program with limits on jerk, acceleration and velocity, and durations that begin inside."""
    rng, grid = np.random.default_rng(seed), _grid(PIECES_PER_SEGMENT)
    travels = rng.uniform(0.3, 1.0, (segments, joints)) * rng.choice([-1.0, 1.0], (segments, joints))
    bounds = np.full((2, segments, joints, len(grid.powers)), 1e6)
    for power, most in ((1, 2.0), (2, 4.0), (3, 20.0)):
        bounds[..., grid.powers == power] = most * rng.uniform(0.7, 1.3, (segments, joints))[..., None]
    used = np.abs(travels[..., None] * grid.travel) / bounds.min(axis=0)
    times = [used[..., grid.powers == power].max(axis=(1, 2)) ** (1.0 / power) for power in (1, 2, 3)]
    parts = grid.rows, grid.travel, grid.powers, travels, bounds, np.zeros(segments), np.ones(segments)
    return PassingProblem(*parts), 1.05 * np.max(times, axis=0)


@pytest.mark.parametrize(("segments", "joints"), [(2, 1), (2, 2), (3, 1)])
@pytest.mark.parametrize("seed", [0])
def test_the_states_allow_for_a_duration_near_to_that_of_scipy(seed: int, segments: int, joints: int) -> None:
    given, start = program(seed, segments, joints)
    unknowns = given.coefficients.shape[1]
    free = segments * joints * (unknowns - 4)
    inner = (segments - 1) * joints * 2

    def slacks(times: np.ndarray, states: np.ndarray, numbers: np.ndarray) -> np.ndarray:
        ends = np.concatenate([states[:-1], states[1:]], axis=-1)
        scaled = ends * times[:, None, None] ** np.array([1.0, 2.0, 1.0, 2.0])
        own = np.concatenate([scaled, numbers.reshape(segments, joints, -1)], axis=-1)
        values = own @ given.coefficients.T + given.travels[..., None] * given.by_travel
        allowed = given.bounds * times[:, None, None] ** given.powers
        return np.concatenate([(allowed[0] - values).ravel(), (allowed[1] + values).ravel()])

    def at(x: np.ndarray) -> np.ndarray:
        states = np.zeros((segments + 1, joints, 2))
        states[1:-1] = x[segments : segments + inner].reshape(segments - 1, joints, 2)
        return slacks(x[:segments], states, x[segments + inner :])

    begin = np.concatenate([2.0 * start, np.zeros(inner + free)])
    best = minimize(
        lambda x: x[:segments].sum(),
        begin,
        jac=lambda x: np.append(np.ones(segments), np.zeros(len(x) - segments)),
        bounds=[(0.05, None)] * segments + [(None, None)] * (len(begin) - segments),
        constraints=[{"type": "ineq", "fun": at}],
        method="SLSQP",
        options={"ftol": 1e-9, "maxiter": 500},
    ).fun
    states = best_states(given, start, np.zeros((segments + 1, joints, 2)))
    assert (states[[0, -1]] == 0.0).all()
    assert NEARER * best <= duration_by_ruckig(given, states) <= best * (1.0 + NEAR)
    assert best <= duration_by_ruckig(given, np.zeros_like(states)) * 1.1


def duration_by_ruckig(given: PassingProblem, states: np.ndarray) -> float:
    """Return the least duration with these states at the waypoints, by the package ruckig."""
    segments, joints = given.travels.shape
    total = 0.0
    for k in range(segments):
        requested = ruckig.InputParameter(joints)
        requested.target_position = given.travels[k].tolist()
        (
            (requested.current_velocity, requested.current_acceleration),
            (requested.target_velocity, requested.target_acceleration),
        ) = (states[at].T.tolist() for at in (k, k + 1))
        of = {power: given.bounds[:, k][..., given.powers == power][..., 0] for power in (1, 2, 3)}
        requested.max_velocity, requested.min_velocity = of[1][0].tolist(), (-of[1][1]).tolist()
        requested.max_acceleration, requested.min_acceleration = of[2][0].tolist(), (-of[2][1]).tolist()
        requested.max_jerk = of[3].min(axis=0).tolist()
        motion = ruckig.Trajectory(joints)
        ruckig.Ruckig(joints).calculate(requested, motion)
        total += motion.duration
    return total


@given(st.integers(0, 2**32), st.integers(1, 4), st.integers(1, 7), st.booleans())
def test_phases_read_as_cubics_end_where_they_are_wanted(
    seed: int, joints: int, motions: int, with_jerks: bool
) -> None:
    """Joints with phases of their own, some of them next to nothing, one of them with no time at all."""
    rng = np.random.default_rng(seed)
    times = rng.uniform(0.1, 1.0, (motions, joints, 7)) * 10.0 ** rng.choice([0, 0, 0, -2, -20], (motions, joints, 7))
    times *= (1.0 / times.sum(axis=2))[..., None]
    times[rng.random(times.shape) < 0.1] = 0.0
    times[:, :, 3] += 1.0 - times.sum(axis=2)
    jerk = rng.normal(size=times.shape) * with_jerks
    p, v, a = np.zeros((3, motions, joints, 8))
    v[..., 0], a[..., 0] = rng.normal(size=(2, motions, joints))
    for k in range(7):
        t = times[..., k]
        p[..., k + 1] = p[..., k] + t * (v[..., k] + t * (a[..., k] / 2.0 + t * jerk[..., k] / 6.0))
        v[..., k + 1] = v[..., k] + t * (a[..., k] + t * jerk[..., k] / 2.0)
        a[..., k + 1] = a[..., k] + t * jerk[..., k]
    wanted = [values[..., -1] + 1e-13 * rng.normal(size=(motions, joints)) for values in (p, v, a)]
    of, lengths, coefficients = read_cubics(PhasedMotions(p, v, a, jerk, times), *wanted, 1e-12)
    for m in range(motions):
        h, c = lengths[of == m], coefficients[of == m]
        t = h[-1]
        ends = [((c[-1, :, 3] * t + c[-1, :, 2]) * t + c[-1, :, 1]) * t + c[-1, :, 0]]
        ends += [
            (3.0 * c[-1, :, 3] * t + 2.0 * c[-1, :, 2]) * t + c[-1, :, 1],
            6.0 * c[-1, :, 3] * t + 2.0 * c[-1, :, 2],
        ]
        states = p[m], v[m], a[m], jerk[m]
        peer_h, peer_c = cubic_pieces(states, times[m], wanted[0][m], (wanted[1][m], wanted[2][m]))
        assert h == pytest.approx(peer_h, rel=1e-12)
        if len(h) >= 3 and h.min() > 1e-3:
            for own, value in zip(ends[: 2 + with_jerks], wanted, strict=False):
                assert own == pytest.approx(value[m], abs=1e-14)
            assert c == pytest.approx(peer_c, rel=1e-9, abs=1e-11)
        assert c == pytest.approx(peer_c, rel=1e-9, abs=1e-4)  # a correction on short pieces needs large jerks
