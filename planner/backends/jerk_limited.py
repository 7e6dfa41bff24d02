"""As fast as can be along a curve, the jerk limits kept as well."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.backends.along_curve import (
    DURATION_TOLERANCE,
    CurveLaw,
    ToolSpeeds,
    demands,
    follow_curve,
    stretched,
)
from planner.backends.speed_program import PLACES, Grid, Limits3, fastest
from planner.polynomials import PiecewisePolynomial, horner, quintic_hermite, shifted, differentiate

if TYPE_CHECKING:
    from planner.backends.assembly import TimedPieces
    from planner.kinematics.poses import FloatArray
    from planner.paths import JointPath, Run

ENFORCED = frozenset({"velocity", "acceleration", "jerk", "torque", "tcp_linear_velocity", "tcp_angular_velocity"})
N = 100


def time_run(path: JointPath, run: Run, n=(30, 60, 100), info=None) -> TimedPieces:
    law = _fastest(path, run, n, info)
    pieces = follow_curve(run, law)
    needed = demands(path, pieces, ENFORCED)
    factor = max(demand.factor for demand in needed.values())
    if info is not None:
        info["factor"] = factor
        info["demand"] = max(needed.values())
        info["pieces"] = len(law.law.lengths)
    return stretched(pieces, factor)


def _fastest(path: JointPath, run: Run, rounds, info) -> CurveLaw:
    length = run.curve.breakpoints[-1]
    one = PiecewisePolynomial(np.ones(1), np.array([[[0, 0, 0, 10.0, -15, 6]]]) * length)
    places = run.curve.breakpoints
    tau = np.linspace(0, 1, 4001)
    times = np.interp(places, one.evaluate(tau, [0])[0][:, 0], tau)
    times[-1] = 1.0
    law = PiecewisePolynomial(np.diff(times), np.array([shifted(one.coefficients[0], t) for t in times[:-1]]))
    law.coefficients[:, 0, 0] = places[:-1]
    for n in rounds:
        law = _split(law, n)
        grid = Grid(law.lengths)
        limits, owners = _limits(path, run, law)
        x, steps = fastest(grid, limits, np.ones(len(law.lengths) + 2))
        law = _retimed(law, grid, x)
        if info is not None:
            info.setdefault("steps", []).append((len(owners), steps, round(float(law.lengths.sum()), 5)))
    return CurveLaw(law, owners)


def _split(law, n):
    """Long pieces in equal parts."""
    most = law.lengths.sum() / n
    parts = np.maximum(np.ceil(law.lengths / most - 1e-6), 1).astype(int)
    lengths = np.repeat(law.lengths / parts, parts)
    c = []
    for own, p, h in zip(law.coefficients, parts, law.lengths / parts):
        c += [shifted(own, k * h) for k in range(p)]
    return PiecewisePolynomial(lengths, np.array(c))


def _retimed(law, grid, x):
    u, w = np.polynomial.legendre.leggauss(5)
    u, w = (u + 1) / 2, w / 2
    st = grid.states(x)
    b0, bm, b1 = st[:, 0, 0], x[1:-1], st[:, 2, 0]
    b = b0[:, None] * (1 - u) ** 2 + 2 * u * (1 - u) * bm[:, None] + u * u * b1[:, None]
    h = (w / np.sqrt(b)).sum(1) * grid.widths
    def state(at, t):
        s, v, a = (horner(differentiate(law.coefficients, k)[:, 0], t) for k in range(3))
        b, al = st[:, at, 0], st[:, at, 1]
        return s[:, None], (v * np.sqrt(b))[:, None], (a * b + v * al)[:, None]
    start, end = state(0, np.zeros_like(h)), state(-1, law.lengths)
    end[1][-1] = end[2][-1] = 0.0
    # C2: the same values on both sides
    for e, s in zip(end, start):
        s[1:] = e[:-1]
    return PiecewisePolynomial(h, quintic_hermite(h, start, end))


def _limits(path: JointPath, run: Run, law) -> tuple[Limits3, np.ndarray]:
    curve, lim = run.curve, path.limits
    s, s1, s2, s3 = (horner(differentiate(law.coefficients, k), PLACES * law.lengths[:, None])[..., None] for k in range(4))
    piece = np.clip(np.searchsorted(curve.breakpoints, s[:, 1, 0]) - 1, 0, len(curve.lengths) - 1)
    owner = run.owners[piece]
    at = np.clip(s - curve.breakpoints[piece][:, None, None], 0, curve.lengths[piece][:, None, None])
    c1, c2, c3 = (horner(curve.derivative_coefficients(k)[piece][:, None], at) for k in (1, 2, 3))
    q1, q2, q3 = c1 * s1, c2 * s1**2 + c1 * s2, c3 * s1**3 + 3 * c2 * s1 * s2 + c1 * s3
    zero = np.zeros_like(q1)
    A, J, V = lim.acceleration[owner][:, None], lim.jerk[owner][:, None], lim.velocity[owner][:, None]
    acc = np.stack([q2 / A, q1 / A, zero], -1)
    jerk = np.stack([q3 / J, 3 * q2 / J, q1 / J], -1)
    ts = ToolSpeeds(path, run)
    use = np.max(np.abs(q1) / V, axis=-1)
    use = np.maximum(use, ts.excess(s.ravel()).reshape(use.shape) * s1[..., 0])
    vel = np.zeros((*use.shape, 1, 3))
    vel[..., 0, 0] = use**2
    rows = np.concatenate([vel, acc, jerk], axis=2)
    nj = q1.shape[-1]
    const = np.zeros(rows.shape[:-1])
    const[..., : 1 + nj] = 1.0
    inverse = np.zeros_like(const)
    inverse[..., 1 + nj :] = 1.0
    return Limits3(rows, const, inverse, np.zeros_like(const)), owner
