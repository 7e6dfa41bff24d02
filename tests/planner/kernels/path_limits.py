"""Plain numpy with the results of the kernels of profiles, and linear programs solved by trying their corners."""

from __future__ import annotations

from itertools import combinations

import numpy as np

from planner.kernels.profile import PathLimits, UseOfLimits

POINTS, PROBES = np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, 5)
BERNSTEIN = np.array([[1.0, -0.5, 0.0], [0.0, 2.0, 0.0], [0.0, -0.5, 1.0]])
AT_PROBES = np.column_stack([(1 - PROBES) * (1 - 2 * PROBES), 4 * PROBES * (1 - PROBES), PROBES * (2 * PROBES - 1)])
INNER = PROBES[1:-1]
PARALLEL, MOST_BEND, CLOSE = 1e-10, 0.9, 0.95


def corners(rows: np.ndarray) -> np.ndarray:
    """Return the corners (x, u), (corners, 2), of the region u a + b x + c <= 0 with rows (rows, 3)."""
    found = []
    for first, second in combinations(rows / np.linalg.norm(rows[:, :2], axis=1, keepdims=True), 2):
        matrix = np.array([[first[1], first[0]], [second[1], second[0]]])
        if abs(np.linalg.det(matrix)) > 1e-14:
            found.append(np.linalg.solve(matrix, -np.array([first[2], second[2]])))
    points = np.array(found)
    values = points @ rows[:, 1::-1].T + rows[:, 2]
    size = np.abs(points) @ np.abs(rows[:, 1::-1]).T + np.abs(rows[:, 2])
    inside: np.ndarray = points[(values <= 1e-9 * size).all(axis=1)]
    return inside


def rows_of(limits: PathLimits, i: int, throughout: bool) -> np.ndarray:
    """Return the limits a u + b x + c <= 0 (rows, 3) on an interval."""
    d, bounds = limits.lengths[i], limits.bounds[:, i]
    a, b, c = limits.per_u[:, i] + 2.0 * d * POINTS[:, None] * limits.per_x[:, i], limits.per_x[:, i], limits.rest[:, i]
    if throughout:
        a, b, c = ((part.T @ BERNSTEIN).T for part in (a, b, c))
    else:
        a, b, c = (part[1:2] for part in (a, b, c))
        bounds = np.maximum(bounds, bounds[0] + (bounds[-1] - bounds[0]) * PROBES)
    c = np.clip(c, -0.9999, 0.9999)
    signed = [np.stack([s * a, s * b, s * c - 1.0], axis=-1).reshape(-1, 3) for s in (1.0, -1.0)]
    return np.vstack([*signed, np.column_stack([2.0 * d * INNER, np.ones(3), -bounds[1:-1]])])


def fastest_profile(limits: PathLimits, throughout: np.ndarray, rests: np.ndarray) -> np.ndarray:
    """Compute the kernel's profile: the largest x of each linear program backward, the largest u forward."""
    count = len(limits.lengths)
    controllable, x = np.zeros(count + 1), np.zeros(count + 1)
    polygons = [np.empty((0, 3))] * count
    for i in range(count - 1, -1, -1):
        own, step = rows_of(limits, i, bool(throughout[i])), 2.0 * limits.lengths[i]
        bound = min(limits.bounds[0, i], limits.bounds[-1, i - 1] if i else np.inf)
        more = [[0, 1, -bound], [0, -1, 0], [step, 1, -controllable[i + 1]], [-step, -1, 0]]
        polygons[i] = np.vstack([own[np.abs(own[:, :2]).max(axis=1) > 0.0], more])
        controllable[i] = 0.0 if rests[i] else corners(polygons[i])[:, 0].max()
    for i in range(count):
        a, b, c = polygons[i][polygons[i][:, 0] > 0.0].T
        u = (-(b * x[i] + c) / a).min()
        x[i + 1] = min(max(x[i] + 2.0 * limits.lengths[i] * u, 0.0), controllable[i + 1])
    return x


def range_of_u(limits: PathLimits, point: int, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    a, b, c = limits.per_u[point], limits.per_x[point], limits.rest[point]
    size = np.abs(a)
    binds = size > PARALLEL * size.max(axis=1, keepdims=True)
    middle = np.divide(-(b * x[:, None] + c), a, out=np.zeros_like(a), where=binds)
    reach = np.divide(1.0, size, out=np.full_like(a, np.inf), where=binds)
    return (middle - reach).max(axis=1), (middle + reach).min(axis=1)


def _used(limits: PathLimits, x0: np.ndarray, x1: np.ndarray, bend: np.ndarray) -> np.ndarray:
    p, d = PROBES[:, None], limits.lengths
    u_at = (x1 - x0) / (2.0 * d) + bend * (2.0 * p - 1.0)
    x_at = x0 + (x1 - x0) * p - 2.0 * bend * d * (p - p**2)
    per_u, per_x, rest = (np.tensordot(AT_PROBES, part, 1) for part in (limits.per_u, limits.per_x, limits.rest))
    moved = per_u * u_at[..., None] + per_x * x_at[..., None]
    used: np.ndarray = np.abs(moved / (1.0 - np.sign(moved) * rest)).max(axis=2)
    return used


def use_of_limits(limits: PathLimits, throughout: np.ndarray, x: np.ndarray) -> UseOfLimits:
    x0, x1, d = x[:-1], x[1:], limits.lengths
    u, inner, bound = (x1 - x0) / (2.0 * d), INNER[:, None], limits.bounds[1:-1]
    (low0, high0), (low1, high1) = range_of_u(limits, 0, x0), range_of_u(limits, -1, x1)
    over = x0 + (x1 - x0) * inner - bound
    for_speed = (over / (2.0 * d * (inner - inner**2))).max(axis=0)
    least, most = np.maximum(u - high0, low1 - u), np.minimum(u - low0, high1 - u)
    middle, nearest = (least + most) / 2.0, np.clip(0.0, least, most)
    near = np.clip(middle, np.minimum(2.0 * nearest, 0.0), np.maximum(2.0 * nearest, 0.0))
    bend = np.maximum(np.where(least > most, middle, near), for_speed)
    bend = np.minimum(bend, MOST_BEND * (np.sqrt(x0) + np.sqrt(x1)) ** 2 / (2.0 * d))
    bend = np.where(throughout, 0.0, bend)
    speeds = (over + bound - 2.0 * bend * d * (inner - inner**2)) / bound
    used = np.maximum(_used(limits, x0, x1, bend).max(axis=0), speeds.max(axis=0))
    linear = x0 + (x1 - x0) * PROBES[:, None]
    constant = np.maximum(_used(limits, x0, x1, np.zeros_like(d)), linear / limits.bounds)
    close = linear > CLOSE * limits.bounds
    between = np.diff(limits.bounds, n=2, axis=0) / bound / 8.0
    dips = np.where(close[:-2] | close[1:-1] | close[2:], between, 0.0).max(axis=0)
    unused = np.where(throughout, np.maximum(1.0 - constant, 0.0).mean(axis=0), 0.0)
    return UseOfLimits(bend, used, unused, np.maximum(dips, 0.0))


def fastest_crossings(limits: PathLimits, x: np.ndarray, steepest: float) -> tuple[np.ndarray, np.ndarray]:
    x0, x1, d, p = x[:-1], x[1:], limits.lengths, PROBES[:, None]
    u, top = (x1 - x0) / (2.0 * d), limits.bounds.max(axis=0)
    least, most = top / d / steepest, steepest * top / d
    gain = np.clip(range_of_u(limits, 0, x0)[1], np.maximum(u, least), most)
    brake = np.clip(-range_of_u(limits, -1, x1)[0], np.maximum(-u, least), most)
    highest = np.minimum(np.minimum(x0 + 2.0 * d * gain * p, x1 + 2.0 * d * brake * (1.0 - p)), limits.bounds)
    speeds = np.sqrt(highest)
    times = (2.0 * np.diff(p, axis=0) * d / (speeds[:-1] + speeds[1:])).sum(axis=0)
    peak = (u + brake) / (gain + brake)
    first = np.clip((top - x0) / (2.0 * d * gain), 0.0, peak)
    return times, np.column_stack([first, np.clip(1.0 - (top - x1) / (2.0 * d * brake), peak, 1.0)])
