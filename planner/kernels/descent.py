"""Levenberg-Marquardt within a box, from many starts to many poses at once."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planner.kernels.kinematics import Arm
from planner.kernels.library import call, doubles
from planner.spatial import FloatArray


class Box(NamedTuple):
    """The joint positions within which descents stay.

    Attributes:
        lower: (joints,), rad or m.
        upper: (joints,).
    """

    lower: FloatArray
    upper: FloatArray


def descend(
    arm: Arm,
    positions: FloatArray,
    rotations: FloatArray | None,
    starts: FloatArray,
    box: Box,
    patience: int,
    most: int,
    enough: float = -np.inf,
) -> tuple[FloatArray, FloatArray]:
    """Descend from starts to poses, and return the errors (N,), m and rad, and the joint positions (N, joints).

    A descent minimises |p* - p|^2 + |log(R* R^T)|^2, m and rad alike. The damping follows the squared error (Sugihara
    2011), and grows when a step does not reduce the error. So steps are Newton steps near a solution, and bounded at a
    singularity. A joint that presses against its limit takes no part in the step.

    Args:
        arm: The arm, and the point that is to be brought there.
        positions: (targets, 3), m.
        rotations: (targets, 3, 3), of the tip; None: positions alone count.
        starts: (N, joints), N / targets of them to each target, one behind the other.
        box: The limits.
        patience: After so many slow steps in a row a start is given up.
        most: Most steps.
        enough: Behind the first start that reaches this error, the others are left out: their error is infinite.

    Raises:
        ValueError: The shapes differ.
    """
    targets, count, joints = len(positions), len(starts), arm.joints
    given = doubles(positions, targets, 3), None if rotations is None else doubles(rotations, targets, 3, 3)
    limits = doubles(box.lower, joints), doubles(box.upper, joints)
    first, each = doubles(starts, count, joints), max(1, count // max(1, targets))
    if each * targets != count:
        raise ValueError(f"{count} starts are no multiple of {targets} targets")
    errors, ends = np.full(count, np.inf), first.copy()
    terms = *given, *limits, patience, most, float(enough)
    call("descend", joints, arm.frames, arm.point, count, each, *terms, first, errors, ends)
    return errors, ends
