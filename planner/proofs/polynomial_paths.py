"""Paths of the tool as parts on which polynomials lead three slides and three turns: polylines and splines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from planner.certificate.path_parts import BETWEEN, BY_POWER, NODES, POWERS_BETWEEN, Poses
from planner.proofs.guides import link_of, share_coefficients
from planner.spatial import FloatArray

KNOWN_TO = 1e-9
"""Difference of the polynomials from the path at compared points, m or rad, above which a part is halved."""

LARGEST_BEND = 0.5
"""Angle, rad, between a part's direction and its chord above which the part is halved."""

LARGEST_TURN = 1.0
"""Angle, rad, of one turn above which a part is halved: the three turns are then about different axes."""

MOST_HALVINGS = 10
"""The most times that a part is halved."""

MOST_PARTS = 2_000
"""Number of parts above which a path is left out of proofs."""

SAMPLES = 9
"""Number of points of a part from which the search for the nearest one begins."""

NEWTON_STEPS_TO_PART = 4
"""Steps of the search for the nearest point."""

NEAREST = 3
"""Number of parts that are tried on an interval, the nearest first."""

AXES = np.array([[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]])
"""Rotation that takes the axis z to x, x to y and y to z."""


@dataclass(frozen=True, eq=False)
class PolynomialPath:
    """The parts of a path.

    Attributes:
        origins: (parts, 3), m, of the first points.
        starts: (parts, 3, 3), rotations there; None: any orientation will do.
        coefficients: (parts, powers, 3 or 6): displacement, m, and turns about z, y and x, rad, by u, u^2, ... to 1.
    """

    origins: FloatArray
    starts: FloatArray | None
    coefficients: FloatArray

    @classmethod
    def of(cls, poses: Poses, breakpoints: FloatArray) -> PolynomialPath | None:
        """Return the parts of a path that is smooth between breakpoints; None: there are too many parts."""
        starts, ends = breakpoints[:-1], breakpoints[1:]
        kept: list[tuple[FloatArray, ...]] = []
        for halving in range(MOST_HALVINGS + 1):
            *parts, is_rough = _fitted(poses, starts, ends)
            if halving == MOST_HALVINGS and is_rough.any():
                return None
            kept.append(tuple(part[~is_rough] for part in (starts, *parts)))
            middles = 0.5 * (starts + ends)[is_rough]
            starts, ends = np.concatenate([starts[is_rough], middles]), np.concatenate([middles, ends[is_rough]])
            if len(starts) > MOST_PARTS:
                return None
        first, origins, rotations, coefficients = (np.concatenate(each) for each in zip(*kept, strict=True))
        order = np.argsort(first)
        turned = None if coefficients.shape[2] == 3 else rotations[order]
        return cls(origins[order], turned, coefficients[order])

    @property
    def guides(self) -> list[dict[str, Any]]:
        """The parts as mechanisms: slides along x, y and z, then turns about z, y and x."""
        return [self._guide(part) for part in range(len(self.origins))]

    def _guide(self, part: int) -> dict[str, Any]:
        none, rotation = np.zeros(3), np.eye(3)
        links = [link_of(AXES, self.origins[part] if k == 0 else none, "prismatic") for k in range(3)]
        if self.starts is not None:
            links += [link_of(frame, none, "revolute") for frame in (self.starts[part], AXES.T, AXES.T)]
            rotation = AXES.T
        tool = {"joint": len(links), "rotation": rotation.tolist(), "translation": none.tolist()}
        return {"links": links, "rates": self.coefficients[part].T.tolist(), "tool": tool}

    @cached_property
    def _samples(self) -> FloatArray:
        """Points (parts, `SAMPLES`, 3) of the parts, m."""
        powers = np.linspace(0.0, 1.0, SAMPLES)[:, None] ** np.arange(1, self.coefficients.shape[1] + 1)
        points: FloatArray = self.origins[:, None] + powers @ self.coefficients[:, :, :3]
        return points

    def choices(self, positions: FloatArray) -> list[list[float]]:
        """Return the number of a part and the coefficients of the share of it, for the nearest parts.

        Args:
            positions: (6, 3), m, of the tool at the nodes of an interval.
        """
        middle = positions[len(positions) // 2]
        away = np.linalg.norm(self._samples - middle, axis=2).min(axis=1)
        return [[part, *self._shares(part, positions)] for part in np.argsort(away, kind="stable")[:NEAREST].tolist()]

    def _shares(self, part: int, positions: FloatArray) -> list[float]:
        samples, along = self._samples[part], self.coefficients[part, :, :3]
        powers = np.arange(1, len(along) + 1)
        u = np.linalg.norm(samples - positions[:, None], axis=2).argmin(axis=1) / (SAMPLES - 1.0)
        for _ in range(NEWTON_STEPS_TO_PART):
            miss = self.origins[part] + u[:, None] ** powers @ along - positions
            slope = (powers * u[:, None] ** (powers - 1)) @ along
            square = (slope * slope).sum(axis=1)
            u = u - np.divide((miss * slope).sum(axis=1), square, out=np.zeros_like(u), where=square > 0.0)
            u = u.clip(-1.0, 2.0)
        if u.min() < 0.0 or u.max() > 1.0:  # a polynomial through clipped shares may leave the range from 0 to 1
            u = np.full_like(u, u[len(u) // 2].clip(0.0, 1.0).round())
        return share_coefficients(u)


def _fitted(poses: Poses, first: FloatArray, last: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, np.ndarray]:
    """Return origins, rotations and coefficients of parts (N,), and whether they are too rough (N,)."""
    fractions = np.concatenate([NODES, BETWEEN])
    u = first[:, None] + (last - first)[:, None] * fractions
    positions, rotations = poses(u.ravel())
    values = positions.reshape(*u.shape, 3)
    origins, starts = values[:, 0], np.tile(np.eye(3), (len(first), 1, 1))
    values = values - origins[:, None]
    if rotations is not None:
        turned = rotations.reshape(*u.shape, 3, 3)
        starts = turned[:, 0]
        values = np.concatenate([values, _turns(starts.transpose(0, 2, 1)[:, None] @ turned)], axis=2)
    nodes, between = values[:, 1 : len(NODES)], values[:, len(NODES) :]
    coefficients = BY_POWER @ nodes
    error = np.abs(POWERS_BETWEEN @ coefficients - between).max(axis=(1, 2))
    steps, chords = np.diff(values[:, : len(NODES), :3], axis=1), nodes[:, -1:, :3]
    lengths = np.linalg.norm(steps, axis=2) * np.linalg.norm(chords, axis=2)
    is_bent = ((steps * chords).sum(axis=2) < np.cos(LARGEST_BEND) * lengths - KNOWN_TO**2).any(axis=1)
    is_turned = (np.abs(values[:, :, 3:]) > LARGEST_TURN).any(axis=(1, 2))
    return origins, starts, coefficients, (error > KNOWN_TO) | is_bent | is_turned


def _turns(rotations: FloatArray) -> FloatArray:
    """Return the angles (..., 3), rad, about z, y and x whose rotations one after the other are Rz Ry Rx."""
    about_z = np.arctan2(rotations[..., 1, 0], rotations[..., 0, 0])
    about_y = -np.arcsin(rotations[..., 2, 0].clip(-1.0, 1.0))
    about_x = np.arctan2(rotations[..., 2, 1], rotations[..., 2, 2])
    angles: FloatArray = np.stack([about_z, about_y, about_x], axis=-1)
    return angles
