"""Plain numpy with the results of the kernels of profiles, and linear programs solved by trying their corners."""

from __future__ import annotations

from itertools import combinations
from typing import NamedTuple

import numpy as np

from planner.kernels.profile import LimitRows, Parts, PathLimits

POINTS, PROBES = np.linspace(0.0, 1.0, 3), np.linspace(0.0, 1.0, 5)
BERNSTEIN = np.array([[1.0, -0.5, 0.0], [0.0, 2.0, 0.0], [0.0, -0.5, 1.0]])
AT_PROBES = np.column_stack([(1 - PROBES) * (1 - 2 * PROBES), 4 * PROBES * (1 - PROBES), PROBES * (2 * PROBES - 1)])
INNER = PROBES[1:-1]
PARALLEL, MOST_BEND, CLOSE = 1e-10, 0.9, 0.95


class UseOfLimits(NamedTuple):
    """How a profile uses the limits on each interval, each (intervals,).

    Attributes:
        bend: Half of what u grows by: it keeps the limits at both ends, or breaks them the least; 0: u is constant.
        used: The largest share of a limit that is used then.
        unused: The share of the tightest limit that a constant u leaves unused, on average; elsewhere 0.
        dips: Largest excess of x over its bound between probes, relative to the bound; 0 where x is far below it.
    """

    bend: np.ndarray
    used: np.ndarray
    unused: np.ndarray
    dips: np.ndarray


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


def times_between(lengths: np.ndarray, x: np.ndarray, bend: np.ndarray, start: float, end: float) -> np.ndarray:
    """Integrate 1 / sqrt(x) by Gauss's rule with 60 points."""
    points, weights = np.polynomial.legendre.leggauss(60)
    p = (start + (end - start) * (points + 1.0) / 2.0)[:, None]
    x_at = x[:-1] * (1.0 - p) + x[1:] * p - 2.0 * p * (1.0 - p) * bend * lengths
    times: np.ndarray = weights @ (1.0 / np.sqrt(x_at)) * (end - start) / 2.0 * lengths
    return times


def judge_profile(
    limits: PathLimits,
    throughout: np.ndarray,
    groups: np.ndarray,
    x: np.ndarray,
    rule: np.ndarray,
    *,
    may_split: bool,
    is_first: bool,
) -> tuple[np.ndarray, Parts | None]:
    neglected, stuck, waste, steepest, least, tolerated, mended = rule[:-1].tolist()
    use = use_of_limits(limits, throughout, x)
    times = times_between(limits.lengths, x, use.bend, 0.0, 1.0)
    broken = (use.used > tolerated) & ~throughout
    hopeless = broken & (use.used > mended)
    wasted, enough = use.unused * times, waste * (np.bincount(groups, times) / np.bincount(groups))[groups]
    if may_split and (
        is_first or wasted.sum() > neglected * times.sum() or times[hopeless].sum() > stuck * times.sum()
    ):
        coarse = broken | (use.dips > tolerated - 1.0) | (wasted > enough)
        crossed, inner = fastest_crossings(limits, x, steepest)
        wasteful = (times - crossed > enough) & ~coarse
        inner[inner < least] = 0.0
        inner[inner > 1.0 - least] = 1.0
        inner[inner[:, 1] - inner[:, 0] < least, 1] = 1.0
        inner[(inner[:, 0] == 0.0) & (inner[:, 1] == 1.0), 0] = 0.5
        inner[~wasteful] = [0.0, 1.0]
        inner = np.column_stack([inner, np.zeros(len(inner))])
        inner[coarse] = [0.25, 0.5, 0.75]
        rows, starts, ends = shares_between(inner)
        new = ends - starts < 1.0
        return use.bend, Parts(
            rows, starts, ends, np.where(new, hopeless[rows], throughout[rows])
        ) if new.any() else None
    whole = np.arange(len(times)), np.zeros_like(times), np.ones_like(times), throughout | broken
    return use.bend, Parts(*whole) if broken.any() else None


def shares_between(inner: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the parts between points (rows, N) on rows: their row, and the shares where they begin and end."""
    count = len(inner)
    points = np.column_stack([np.zeros(count), np.sort(inner, axis=1), np.ones(count)])
    there = np.diff(points, axis=1) > 0.0
    return np.nonzero(there)[0], points[:, :-1][there], points[:, 1:][there]


def cut_curves(
    lengths: np.ndarray,
    coefficients: np.ndarray,
    segments: np.ndarray,
    groups: np.ndarray,
    weights: np.ndarray,
    rule: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    fewest, most_turn, least, of_run, most, at_rest, rounding = rule.tolist()
    powers = np.arange(coefficients.shape[2])
    s = np.linspace(0.0, 1.0, 5)[:, None, None, None] * lengths[:, None, None]
    first = (coefficients * powers * s ** np.maximum(powers - 1, 0)).sum(axis=3) / weights[segments]
    second = (coefficients * powers * (powers - 1) * s ** np.maximum(powers - 2, 0)).sum(axis=3) / weights[segments]
    speeds, bends = np.linalg.norm(first, axis=2), np.linalg.norm(second, axis=2)
    counted = np.where(bends > np.sqrt(rounding) * bends.max(axis=0), bends, 0.0)
    turns = (counted / np.maximum(speeds, rounding * speeds.max(axis=0))).mean(axis=0) * lengths
    spans, runs = np.bincount(segments, lengths)[segments], np.bincount(groups, lengths)[groups]
    shares = np.maximum(lengths / spans, of_run / least * lengths / runs)
    wanted = np.ceil(fewest * np.maximum(turns / (most_turn * least), shares) - rounding)
    parts = np.clip(wanted, 1, most).astype(int)[:, None]
    changes = np.diff(groups) > 0
    starts, ends = np.append(True, changes)[:, None], np.append(changes, True)[:, None]
    near = np.linspace(0.0, 1.0, int(at_rest) + 1)[1:-1] ** 2 / np.maximum(parts, 1 + (starts & ends))
    inner = np.arange(1, parts.max()) / parts, np.where(starts, near, 0.0), np.where(ends, 1.0 - near, 1.0)
    return shares_between(np.minimum(np.hstack(inner), 1.0))


def limits_on_intervals(
    lengths: np.ndarray,
    segments: np.ndarray,
    derivatives: tuple[np.ndarray, np.ndarray],
    joint_limits: tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray],
    rows: LimitRows,
    used: np.ndarray | None,
    slower: np.ndarray,
    numbers: np.ndarray,
) -> PathLimits:
    most_rest, least_used, most_ratio = numbers.tolist()
    first, second = derivatives
    middle, half, lower, upper = (side[segments] for side in joint_limits)
    row_middle, row_half = rows.middle[segments], rows.half[segments]
    per_u = np.concatenate([first[::2] / half, rows.by_u / row_half], axis=2) * slower[:, None]
    per_x = np.concatenate([second[::2] / half, rows.by_x / row_half], axis=2) * slower[:, None]
    held = np.clip((rows.rest - row_middle) / row_half, -most_rest, most_rest)
    rest = np.concatenate([np.broadcast_to(-middle / half, first[::2].shape), held], axis=2)
    shares = (first / np.where(first < 0.0, lower, upper)).max(axis=2)
    bounds = np.maximum(np.maximum(shares, 0.0 if used is None else used), least_used) ** -2
    return PathLimits(lengths, per_u, per_x, rest, np.minimum(bounds, most_ratio * bounds.min(axis=0)) / slower)
