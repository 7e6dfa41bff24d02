"""As fast as can be along a curve, the jerk limits kept as well."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.backends.along_curve import (
    DURATION_TOLERANCE,
    CurveLaw,
    ToolSpeeds,
    broken_at,
    demands,
    follow_curve,
    stretched,
)
from planner.backends import speed_program as sp
from planner.backends.speed_program import PLACES, LinearLimits, QuadraticSpline, fastest_retiming
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
    law = broken_at(one, places[1:-1], run.owners).law
    for n in rounds:
        law = _split(law, n)
        limits, owners = _limits(path, run, law)
        sp.TRACE=[]
        x = fastest_retiming(law.lengths, limits)
        steps=len(sp.TRACE)
        if info is not None: info.setdefault("trace",[]).append(sp.TRACE)
        law = _retimed(law, x)
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


def _retimed(law, x):
    u, w = np.polynomial.legendre.leggauss(5)
    u, w = (u + 1) / 2, w / 2
    st = QuadraticSpline(law.lengths).states(x).reshape(3, 3, -1)
    b0, bm, b1 = st[0, 0], x[1:-1], st[0, 2]
    b = b0[:, None] * (1 - u) ** 2 + 2 * u * (1 - u) * bm[:, None] + u * u * b1[:, None]
    h = (w / np.sqrt(b)).sum(1) * law.lengths
    def state(at, t):
        s, v, a = (horner(differentiate(law.coefficients, k)[:, 0], t) for k in range(3))
        b, al = st[0, at], st[1, at]
        return s[:, None], (v * np.sqrt(b))[:, None], (a * b + v * al)[:, None]
    start, end = state(0, np.zeros_like(h)), state(-1, law.lengths)
    end[1][-1] = end[2][-1] = 0.0
    # C2: the same values on both sides
    for e, s in zip(end, start):
        s[1:] = e[:-1]
    return PiecewisePolynomial(h, quintic_hermite(h, start, end))


def _limits(path: JointPath, run: Run, law) -> tuple[LinearLimits, np.ndarray]:
    curve, lim = run.curve, path.limits
    s, s1, s2, s3 = (horner(differentiate(law.coefficients, k), PLACES * law.lengths[:, None])[..., None] for k in range(4))
    piece = np.clip(np.searchsorted(curve.breakpoints, s[:, 1, 0]) - 1, 0, len(curve.lengths) - 1)
    owner = run.owners[piece]
    at = np.clip(s - curve.breakpoints[piece][:, None, None], 0, curve.lengths[piece][:, None, None])
    c1, c2, c3 = (horner(curve.derivative_coefficients(k)[piece][:, None], at) for k in (1, 2, 3))
    q1, q2, q3 = c1 * s1, c2 * s1**2 + c1 * s2, c3 * s1**3 + 3 * c2 * s1 * s2 + c1 * s3
    A, J, V = lim.acceleration[owner][:, None], lim.jerk[owner][:, None], lim.velocity[owner][:, None]
    ts = ToolSpeeds(path, run)
    use = np.max(np.abs(q1) / V, axis=-1)
    use = np.maximum(use, ts.excess(s.ravel()).reshape(use.shape) * s1[..., 0])
    nj = q1.shape[-1]
    f = lambda x: x.transpose(2, 1, 0).reshape(nj, -1)
    use = use.T.reshape(1, -1)
    u0 = np.zeros_like(use)
    z = np.zeros((nj, use.size))
    by_b = np.concatenate([use**2, f(q2 / A), f(q3 / J)])
    by_a = np.concatenate([u0, f(q1 / A), f(3 * q2 / J)])
    by_c = np.concatenate([u0, z, f(q1 / J)])
    constant = np.concatenate([u0 + 1, z + 1, z])
    inverse = np.concatenate([u0, z, z + 1])
    return LinearLimits(by_b, by_a, by_c, np.zeros_like(by_b), constant, inverse), owner
