"""Tolerances of payloads and friction, and following errors, as generators of a zonotope of torques.

Torques are linear in the mass, the first moments and the inertia of a payload about a fixed point. Let c be the given
centre of mass, d a displacement within the tolerance, and S(d) = d^T d 1 - d d^T. A body of mass m at c + d has the
first moments m (c + d) and the inertia m S(c + d). Its difference from the given body is a sum of generators, each
times a number from -1 to 1:

- the mass tolerance as a point mass at c;
- for each axis, half the difference of two point masses of the largest mass at opposite sides of the box. Their
  quadratic terms cancel;
- the elements of S(d) times the largest mass, and the share of each principal moment.

The tolerance of the friction of a joint is a generator, too. So is, for each joint with a following error e, half the
difference of the torques at its positions q + e and q - e. The terms of second and higher order in e are a remainder.
In the position of each joint a torque is a trigonometric polynomial of degree 2 (a polynomial where the joint slides).
Let its magnitude be at most M at all positions. Bernstein's inequality bounds its first, second and third derivatives
by 2 M, 4 M and 8 M. For sliding joints, Markov's inequality within 1 m does. The part of gravity and of the tool's
force has the degree 1, and M as the bound of all derivatives. `torque_magnitudes` of the kernels is such an M.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import lru_cache
from itertools import combinations
from typing import NamedTuple

import numpy as np

from planner.kernels import serial_chain
from planner.kernels.serial_chain import NO_FORCE, SerialChain
from planner.robots import Robot
from planner.robots.description import JointFriction
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

MARKOV_RADIUS = 1.0
"""Distance, m, about the position of a sliding joint within which the bounds on its derivatives hold."""

OF_DEGREE_1 = 0.25
"""Share of the bound on a second derivative of degree 2 that bounds a second derivative of degree 1."""

HIGHER_ORDERS = 1.02
"""Factor on bounds for derivatives away from the middle of that range, for following errors up to 0.1 m."""


class TorqueTolerances(NamedTuple):
    """Chains whose torques bound the effects of tolerances on the torques of a robot.

    Attributes:
        chains: The links (chains, joints, `LINK_NUMBERS`) of each chain.
        weights: (generators, chains): each generator is a sum of the torques of chains with these factors.
        loads: (chains, `LOAD_NUMBERS`), the loads of the chains.
        friction: The tolerances of the joints' friction, the last chain and generator; None: there are none.
        magnitudes: (joints + 1, `MAGNITUDE_NUMBERS`), for the remainder of following errors; no rows: it is 0.
    """

    chains: FloatArray
    weights: FloatArray
    loads: FloatArray
    friction: JointFriction | None
    magnitudes: FloatArray

    def torques(self, positions: FloatArray, velocities: FloatArray, accelerations: FloatArray) -> FloatArray:
        """Return the torques (generators, ..., joints) in states (..., joints); the last is the remainder."""
        rows = [values.reshape(-1, values.shape[-1]) for values in (positions, velocities, accelerations)]
        each = [
            serial_chain.inverse_dynamics(SerialChain(*chain), *rows)
            for chain in zip(self.chains, self.loads, strict=True)
        ]
        torques = np.einsum("kc,cnj->knj", self.weights, np.array(each))
        return np.concatenate([torques, self.remainder(*rows[1:])[None]]).reshape(-1, *positions.shape)

    def remainder(self, velocities: FloatArray, accelerations: FloatArray) -> FloatArray:
        """Return the bounds (N, joints) on the terms of higher order in the following errors."""
        return serial_chain.torque_magnitudes(self.magnitudes, velocities, accelerations)

    def by_pace(self, q: FloatArray, v: FloatArray, a: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the coefficients (generators, ..., joints) of 1, x and x^2 at the pace x, see `torques_by_pace`."""
        still = np.zeros_like(q)
        held = self.torques(q, still, still)
        moved, linear = self.torques(q, v, a) - held, np.zeros_like(held)
        if self.friction is not None:
            held[-2], linear[-2] = self.friction.along(v, v.shape[-1])
            moved[-2] = 0.0
        return held, linear, moved

    def path_dynamics(self, positions: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
        """Return the terms (3, generators, points, joints) of the torques along a path, as `PathDynamics` has them.

        Tolerances of the Coulomb friction are part of the torques at rest. Viscous friction is left out.
        """
        chains = (SerialChain(*chain) for chain in zip(self.chains, self.loads, strict=True))
        each = np.array([serial_chain.path_dynamics(chain, positions, first, second) for chain in chains])
        terms = np.einsum("kc,ctnj->tknj", self.weights, each)
        if self.friction is not None:
            terms[2, -1] += self.friction.coulomb
        still = np.zeros_like(first)
        motions = ((still, first), (first, second), (still, still))
        by_u, by_x, rest = (self.remainder(*motion) for motion in motions)
        remainder = np.stack([by_u - rest, by_x - rest, rest])
        return np.concatenate([terms, remainder[:, None]], axis=1)


@lru_cache(maxsize=MANY_ROBOTS)
def torque_tolerances(robot: Robot) -> TorqueTolerances | None:
    """Return the generators of the tolerances of a robot; None: it has neither tolerances nor following errors."""
    friction, errors = robot.friction_tolerance, robot.following_errors
    if not robot.has_dynamics or (friction is None and errors is None and not robot.uncertain_payloads):
        return None
    tip, arm = robot.model.frames[robot.payload_frame_id], robot.chain.links
    # A joint of a positioner has the link before it in its row.
    row_of_tip = tip.parentJoint - (tip.parentJoint >= len(robot.positioner))
    massless, free_fall = arm.copy(), robot.chain.load.copy()
    free_fall[3:-1] = NO_FORCE
    massless[:, INERTIAS] = massless[:, DRIVES] = 0.0
    generators: list[list[tuple[float, FloatArray, FloatArray]]] = []
    bodies: list[FloatArray] = []
    for generator in (generator for payload in robot.uncertain_payloads for generator in _generators(payload)):
        row = []
        for factor, mass, center, inertia in generator:
            links, rotation = massless.copy(), tip.placement.rotation
            turned = (rotation @ inertia @ rotation.T).ravel()
            links[row_of_tip, INERTIAS] = [mass, *tip.placement.act(center), *turned]
            row.append((factor, links, free_fall))
        generators.append(row)
        bodies.append(_inertial_magnitudes([(factor, links[row_of_tip]) for factor, links, _ in row]))
    for joint, error in enumerate([] if errors is None else errors.tolist()):
        sides = [(0.5, error), (-0.5, -error)] if error else []
        generators.append([(factor, _shifted(arm, joint, shift), robot.chain.load) for factor, shift in sides])
    if friction is not None:
        links = massless.copy()
        links[:, -2:] = np.column_stack(friction)
        generators.append([(1.0, links, free_fall)])
    generators = [generator for generator in generators if generator]
    chains = [chain for generator in generators for chain in generator]
    if not chains:
        return None
    numbers = np.repeat(np.arange(len(generators)), list(map(len, generators)))
    weights = np.zeros((len(generators), len(chains)))
    weights[numbers, np.arange(len(chains))] = [factor for factor, _, _ in chains]
    magnitudes = np.empty((0, serial_chain.MAGNITUDE_NUMBERS))
    if errors is not None:
        # Free fall counts by a quarter: so much more.
        at_tip = HIGHER_ORDERS / OF_DEGREE_1 * errors.sum() * np.sum([np.zeros(3), *bodies], axis=0)
        magnitudes = _magnitudes(robot, errors, at_tip, row_of_tip)
    links, loads = np.array([links for _, links, _ in chains]), np.array([load for _, _, load in chains])
    return TorqueTolerances(links, weights, loads, friction, magnitudes)


def _shifted(links: FloatArray, joint: int, shift: float) -> FloatArray:
    """Return the links of a chain without drives whose joint is a shift away, rad or m."""
    links = links.copy()
    links[:, DRIVES] = 0.0
    rotation = links[joint, :9].reshape(3, 3)
    if links[joint, 25]:
        c, s = np.cos(shift), np.sin(shift)
        links[joint, :9] = (rotation @ np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])).ravel()
    else:
        links[joint, 9:12] += shift * rotation[:, 2]
    return links


def _inertial_magnitudes(bodies: Sequence[tuple[float, FloatArray]]) -> FloatArray:
    """Return the magnitudes (3,) of mass, first moments and inertia about the origin of a sum of bodies.

    Args:
        bodies: A factor and the numbers of a link of each.
    """
    mass, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for factor, link in bodies:
        own, center = factor * link[12], link[13:16]
        mass, first = mass + own, first + own * center
        second += factor * link[16:25].reshape(3, 3) + own * (center @ center * np.eye(3) - np.outer(center, center))
    return np.array([abs(mass), np.linalg.norm(first), np.linalg.norm(second, 2)])


def _magnitudes(robot: Robot, errors: FloatArray, at_tip: FloatArray, tip: int) -> FloatArray:
    """Return the numbers of `torque_magnitudes` for the remainder of following errors (joints,).

    Args:
        robot: The robot.
        errors: The following errors, rad or m.
        at_tip: Magnitudes (3,) by which bodies at the tip count, too.
        tip: The index of the joint that moves the tip.
    """
    links, load = robot.chain
    reach = np.where(links[:, 25] == 0.0, np.abs([robot.limit("lower"), robot.limit("upper")]).max(axis=0), 0.0)
    reach = np.where(links[:, 25] == 0.0, reach + MARKOV_RADIUS, 0.0) + np.linalg.norm(links[:, 9:12], axis=1)
    by_order = HIGHER_ORDERS * (2.0 * errors.sum() ** 2 + 4.0 / 3.0 * (errors**3).sum())
    own = by_order * np.array([_inertial_magnitudes([(1.0, link)]) for link in links])
    own[tip] += at_tip
    force, moment, point = (float(np.linalg.norm(load[k : k + 3])) for k in (3, 6, 9))
    of_force = OF_DEGREE_1 * by_order * np.array([force, moment + force * point])
    last = [OF_DEGREE_1 * np.linalg.norm(load[:3]), *of_force, load[12], load[14]]
    return np.vstack([np.column_stack([reach, own, links[:, 25]]), last])


_Body = tuple[float, float, FloatArray, FloatArray]
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
