"""Payloads with tolerances as generators of a zonotope of inertial parameters.

Torques are linear in the mass, the first moments and the inertia of a payload about a fixed point. Let c be the given
centre of mass, d a displacement within the tolerance, and S(d) = d^T d 1 - d d^T. A body of mass m at c + d has the
first moments m (c + d) and the inertia m S(c + d). Its difference from the given body is a sum of generators, each
times a number from -1 to 1:

- the mass tolerance as a point mass at c;
- for each axis, half the difference of two point masses of the largest mass at opposite sides of the box. Their
  quadratic terms cancel;
- the elements of S(d) times the largest mass, and the share of each principal moment.
"""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.kernels import serial_chain
from planner.kernels.serial_chain import NO_FORCE, SerialChain

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.robots import Robot
    from planner.robots.payload import Payload
    from planner.spatial import FloatArray

AXES = np.eye(3)
"""The axes of the tip frame."""

MANY_ROBOTS = 32
"""Number of robots whose generators are kept."""

INERTIAS = slice(12, 25)
"""The mass, centre of mass and inertia among the numbers of a link of a chain."""

DRIVES = slice(26, 29)
"""The rotor inertia and the friction among these numbers."""


class PayloadTolerances(NamedTuple):
    """Bodies on massless arms, whose torques bound the effect of the tolerances of payloads.

    Attributes:
        chains: The links (bodies, joints, `LINK_NUMBERS`) of the arm with each body alone.
        weights: (generators, bodies): each generator is a sum of bodies with these factors.
        load: The load of the arm without a process force.
    """

    chains: FloatArray
    weights: FloatArray
    load: FloatArray

    def torques(self, positions: FloatArray, velocities: FloatArray, accelerations: FloatArray) -> FloatArray:
        """Return the torques (generators, ..., joints) in states (..., joints) of the arm."""
        rows = [values.reshape(-1, values.shape[-1]) for values in (positions, velocities, accelerations)]
        each = [serial_chain.inverse_dynamics(SerialChain(links, self.load), *rows) for links in self.chains]
        torques: FloatArray = np.einsum("kc,cnj->knj", self.weights, np.array(each))
        return torques.reshape(-1, *positions.shape)

    def path_dynamics(self, positions: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return the terms (3, generators, points, joints) of the torques along a path, as `PathDynamics` has them."""
        chains = (SerialChain(links, self.load) for links in self.chains)
        each = np.array([serial_chain.path_dynamics(chain, positions, first, second) for chain in chains])
        terms: FloatArray = np.einsum("kc,ctnj->tknj", self.weights, each)
        return terms


@lru_cache(maxsize=MANY_ROBOTS)
def payload_tolerances(robot: Robot) -> PayloadTolerances | None:
    """Return the generators of the tolerances of a robot's payloads; None: the payloads have no tolerances."""
    generators = [generator for payload in robot.uncertain_payloads for generator in _generators(payload)]
    if not generators:
        return None
    tip = robot.model.frames[robot.tip_frame_id]
    chains: list[FloatArray] = []
    weights: list[FloatArray] = []
    for generator in generators:
        row = np.zeros(sum(map(len, generators)))
        for factor, mass, center, inertia in generator:
            row[len(chains)] = factor
            links = robot.chain.links.copy()
            links[:, INERTIAS] = links[:, DRIVES] = 0.0
            rotation = tip.placement.rotation
            turned = (rotation @ inertia @ rotation.T).ravel()
            links[tip.parentJoint - 1, INERTIAS] = [mass, *tip.placement.act(center), *turned]
            chains.append(links)
        weights.append(row)
    return PayloadTolerances(np.array(chains), np.array(weights), np.hstack([robot.model.gravity.linear, NO_FORCE]))


_Body = tuple[float, float, "FloatArray", "FloatArray"]
"""A factor, and the mass, centre of mass and inertia of a body in the tip frame."""


def _generators(payload: Payload) -> Iterator[list[_Body]]:
    """Yield the generators of a payload, none without effect."""
    center, box = np.array(payload.center_of_mass), np.array(payload.center_of_mass_tolerance)
    heaviest, none = payload.largest_mass, np.zeros((3, 3))
    if payload.mass_tolerance > 0.0:
        yield [(1.0, payload.mass_tolerance, center, none)]
    for axis, reach in zip(AXES, box.tolist(), strict=True):
        if reach > 0.0:
            yield [(0.5 * side, heaviest, center + side * reach * axis, none) for side in (1.0, -1.0)]
    of_box = heaviest * (box @ box - box**2)
    moments = of_box + payload.inertia_tolerance * np.array(payload.inertia)
    products = [(heaviest * box[i] * box[k], np.outer(AXES[i], AXES[k])) for i, k in combinations(range(3), 2)]
    shapes = [(moment, np.outer(axis, axis)) for moment, axis in zip(moments.tolist(), AXES, strict=True)]
    shapes += [(product, matrix + matrix.T) for product, matrix in products]
    yield from ([(1.0, 0.0, np.zeros(3), size * shape)] for size, shape in shapes if size > 0.0)
