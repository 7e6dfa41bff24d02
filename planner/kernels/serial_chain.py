"""A serial chain of joints, and the torques of its motions."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import pinocchio as pin
from numpy.typing import ArrayLike

from planner.kernels.library import call, doubles
from planner.spatial import FloatArray

LINK_NUMBERS = 29
"""Numbers that describe a joint and the link behind it: the size of the structure `Link` of the kernels."""

REST_SPEED = 1e-9
"""Speed, rad/s or m/s, up to which a joint rests, without Coulomb friction: still joints have rounding."""

LOAD_NUMBERS = 15
"""Numbers that describe free fall and the force of the tool: the size of the structure `Load` of the kernels."""

MAGNITUDE_NUMBERS = 5
"""Numbers in the structure `Magnitude` of the kernels."""

NO_FORCE = (0.0,) * 9 + (-1.0, 0.0)
"""The numbers of `Load` for a force of the tool, without one."""


class SerialChain(NamedTuple):
    """Joints that turn about, or slide along, the z axes of their frames, each carried by the one before.

    Attributes:
        links: (joints, `LINK_NUMBERS`). First the rotation (9, row by row) and origin (3) of the joint's frame in the
            one before, at position 0. Then the mass of its link, centre of mass (3) in that frame, inertia (9) about
            the centre of mass. A joint of a positioner has the link before it instead, which it moves. Then 1 for a
            revolute joint, 0 for a prismatic one. Last, the rotor inertia, the Coulomb friction and the viscous
            friction by the speed. SI units.
        load: (`LOAD_NUMBERS`,). First the acceleration (3) of free fall in the frame that stands still: the base, or
            the frame of a positioner's last joint. Then the force (3) and the moment (3) that the tool exerts, and the
            point (3) of a link where it does. Then the index of this link, or -1 without a force. Then 1 for the base's
            axes, 0 for the link's. Last, the number of the joints of a positioner, which come first. SI units.
    """

    links: FloatArray
    load: FloatArray

    @classmethod
    def of_model(
        cls,
        model: pin.Model,
        turns: np.ndarray,
        force: ArrayLike = NO_FORCE,
        drives: ArrayLike | None = None,
        positioner: int = 0,
    ) -> SerialChain:
        """Read the chain of a Pinocchio model.

        Args:
            model: Its joints turn about, or slide along, their z axes.
            turns: Whether each joint turns, (joints,).
            force: The numbers of `load` for the force of the tool.
            drives: Rotor inertia, Coulomb friction and viscous friction (joints, 3); None: none.
            positioner: Number of the first joints that move the base; the link behind them stands still. The model's
                gravity is in the base frame with these joints at 0.
        """
        placements, inertias = model.jointPlacements.tolist()[1:], model.inertias.tolist()
        inertias, gravity = [*inertias[:positioner], *inertias[positioner + 1 :]], model.gravity.linear
        for placement in placements[:positioner]:
            gravity = placement.rotation.T @ gravity
        rows = [
            np.hstack([at.rotation.ravel(), at.translation, body.mass, body.lever, body.inertia.ravel(), turning])
            for at, body, turning in zip(placements, inertias, turns, strict=True)
        ]
        of_drives = np.zeros((len(rows), 3)) if drives is None else drives
        return cls(np.hstack([rows, of_drives]), np.hstack([gravity, force, positioner]))


def inverse_dynamics(
    chain: SerialChain, positions: FloatArray, velocities: FloatArray, accelerations: FloatArray
) -> FloatArray:
    """Compute the torques (states, joints) at states of a chain, by the recursive Newton-Euler algorithm.

    Raises:
        ValueError: The shapes differ, or do not fit the chain.
    """
    states, joints = len(positions), len(chain.links)
    motion = [doubles(values, states, joints) for values in (positions, velocities, accelerations)]
    torques = np.empty((states, joints))
    call("inverse_dynamics", joints, doubles(chain.links, joints, LINK_NUMBERS), chain.load, states, *motion, torques)
    return torques


def path_dynamics(chain: SerialChain, positions: FloatArray, first: FloatArray, second: FloatArray) -> FloatArray:
    """Compute the terms (3, points, joints) of the torques along a path: inertia, centripetal and gravity.

    They are M q', M q'' + C(q, q') q' and g at positions q of the path with derivatives q' and q''.

    Raises:
        ValueError: The shapes differ, or do not fit the chain.
    """
    points, joints = len(positions), len(chain.links)
    path = [doubles(values, points, joints) for values in (positions, first, second)]
    terms = np.empty((3, points, joints))
    call("path_dynamics", joints, doubles(chain.links, joints, LINK_NUMBERS), chain.load, points, *path, *terms)
    return terms


def torque_magnitudes(magnitudes: FloatArray, velocities: FloatArray, accelerations: FloatArray) -> FloatArray:
    """Bound the torques (states, joints) of a chain at all positions of its joints, by the magnitudes of its motion.

    Args:
        magnitudes: (joints + 1, `MAGNITUDE_NUMBERS`). First the largest distance of a joint from the one before. Then
            magnitudes of the mass of its link, of its first moments and of its inertia about the joint's origin. Last,
            1 for a revolute joint, 0 for a prismatic one. The last row has free fall, force and moment of the tool, and
            the index of its link or -1. Then the number of the joints of a positioner. No rows: the bounds are 0.
        velocities: (states, joints).
        accelerations: (states, joints).
    """
    states, joints = velocities.shape
    torques = np.zeros((states, joints))
    if len(magnitudes):
        motion = [doubles(values, states, joints) for values in (velocities, accelerations)]
        call("torque_magnitudes", joints, doubles(magnitudes, joints + 1, MAGNITUDE_NUMBERS), states, *motion, torques)
    return torques
