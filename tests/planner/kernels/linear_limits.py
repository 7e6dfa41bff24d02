"""Plain numpy with the results of the kernels of linear limits and of the start of a retiming."""

from __future__ import annotations

import numpy as np

POINTS = np.array([0.0, 0.5, 1.0])


def spline_maps(widths: np.ndarray, *, begins_evenly: bool) -> np.ndarray:
    # Beyond both ends there is an interval of no width, whose unknown is the value at the end.
    padded = np.concatenate([[0.0], widths, [0.0]])
    both = padded[:-1] + padded[1:]
    value, slope = np.zeros((2, 3, len(both))), np.zeros((2, 3, len(both)))
    value[0, 0] = value[1, 1] = padded[1:] / both
    value[0, 1] = value[1, 2] = padded[:-1] / both
    slope[0, 0] = slope[1, 1] = -1.0 / both
    slope[0, 1] = slope[1, 2] = 1.0 / both
    start, end = value[0, :, None, :-1], value[1, :, None, 1:]
    middle, u = np.array([0.0, 1.0, 0.0])[:, None, None], POINTS[:, None]
    maps = np.empty((3, 3, len(POINTS), len(widths)))
    maps[0] = (1.0 - u) ** 2 * start + 2.0 * u * (1.0 - u) * middle + u * u * end
    maps[1] = (1.0 - u) * slope[0, :, None, :-1] + u * slope[1, :, None, 1:]
    maps[2] = (start - 2.0 * middle + end) / widths**2
    if begins_evenly:
        maps[:, 1, :, 0] += maps[:, 0, :, 0]
        maps[:, 0, :, 0] = 0.0
    return maps


def states_of(maps: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Return b, a and c (3, points) of unknowns (intervals + 2,)."""
    return (maps[:, 0] * x[:-2] + maps[:, 1] * x[1:-1] + maps[:, 2] * x[2:]).reshape(3, -1)


def scales(limits: list[np.ndarray], states: np.ndarray) -> np.ndarray:
    by_b, by_a, by_c, offset, constant, inverse = limits
    values = np.abs(by_b * states[0] + by_a * states[1] + by_c * states[2])
    with np.errstate(divide="ignore", invalid="ignore"):
        plain = np.where(inverse == 0.0, (constant - np.abs(offset)) / values, np.inf)
        bound = np.where(inverse > 0.0, inverse / np.sqrt(states[0]), np.inf)
        holds = (inverse > 0.0) & (offset != 0.0)
        bound = np.where(holds, bound / 2.0, bound)
        jerk = np.fmin.reduce(bound / values, axis=0) ** (2.0 / 3.0)
        held = np.where(holds, bound / np.abs(offset), np.inf).min(axis=0, initial=np.inf) ** 2
    found: np.ndarray = np.fmin(np.fmin(np.fmin(np.fmin.reduce(plain, axis=0), jerk), held), np.inf)
    return found


def smooth_start(
    maps: np.ndarray,
    limits: list[np.ndarray],
    weights: np.ndarray,
    reaches: np.ndarray,
    largest: float,
    worth: float,
) -> np.ndarray:
    count = maps.shape[3]

    def duration(x: np.ndarray) -> float:
        states = states_of(maps, x)
        return float(weights @ (scales(limits, states).min() * states[0]) ** -0.5)

    best = np.ones(count + 2)
    allowed = scales(limits, states_of(maps, best)).reshape(len(POINTS), -1).min(axis=0)
    shortest, allowed = duration(best), np.minimum(allowed, largest * allowed.min())
    for reach in reaches.tolist():
        wide = np.pad(allowed, 2 * reach, mode="edge")
        near = np.lib.stride_tricks.sliding_window_view(wide, 4 * reach + 1).min(axis=1)
        window = np.full(2 * reach + 1, 1.0 / (2 * reach + 1))
        for _ in range(2):
            near = np.convolve(np.pad(near, reach, mode="edge"), window, mode="valid")
        smooth = np.pad(near, 1, mode="edge")
        if (value := duration(smooth)) < worth * shortest:
            best, shortest = smooth, value
    return best


def joint_rows(
    width: int,
    at: np.ndarray,
    joint_limits: tuple[np.ndarray, np.ndarray, np.ndarray],
    motion: np.ndarray,
    speeds: np.ndarray | None,
) -> np.ndarray:
    (lower, upper), (middle, half), jerk = (part[..., at, :] for part in joint_limits)
    _, v, a, j = motion
    used = (v / np.where(v < 0.0, lower, upper)).max(axis=1)
    used = np.maximum(used, 0.0 if speeds is None else speeds)
    none = np.zeros_like(v)
    speed = [used[:, None] ** 2, *np.zeros((3, len(used), 1)), np.ones((len(used), 1)), np.zeros((len(used), 1))]
    of_a = [a / half, v / half, none, -middle / half, none + 1.0, none]
    of_j = [j / jerk, 3.0 * a / jerk, v / jerk, none, none, none + 1.0]
    rows = np.array([np.hstack(parts).T for parts in zip(speed, of_a, of_j, strict=True)])
    return np.concatenate([rows, np.zeros((6, width - rows.shape[1], len(used)))], axis=1)


def retime_scaling(
    widths: np.ndarray, scaling: np.ndarray, unknowns: np.ndarray, gauss: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Solve for the quintics by their values and derivatives at both ends."""
    maps = spline_maps(widths, begins_evenly=False)
    b, a, _ = states_of(maps, unknowns).reshape(3, len(POINTS), -1)
    u, weights = gauss[0][:, None], gauss[1]
    parabola = b[0] * (1.0 - u) ** 2 + 2.0 * u * (1.0 - u) * unknowns[1:-1] + b[-1] * u**2
    lengths = weights @ parabola**-0.5 * widths
    quintics = []
    for i, h in enumerate(lengths):
        law = np.polynomial.Polynomial(scaling[i])
        rows, wanted = [], []
        for x, t, k in ((0.0, 0.0, 0), (widths[i], h, -1)):
            powers = np.arange(6)
            for order, value in enumerate(
                (law(x), law.deriv()(x) * b[k, i] ** 0.5, law.deriv(2)(x) * b[k, i] + law.deriv()(x) * a[k, i])
            ):
                factor = np.prod([powers - d for d in range(order)], axis=0) if order else np.ones(6)
                rows.append(factor * t ** np.maximum(powers - order, 0))
                wanted.append(value)
        quintics.append(np.linalg.solve(np.array(rows), np.array(wanted)))
    return lengths, np.array(quintics)
