"""Trajectories of any origin: from a request to the library's value."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from api.contract.parts import common
from planner.certificate import interpolated, interpolation_of
from planner.errors import InvalidProblem
from planner.trajectories.polynomials import powers
from planner.trajectories.trajectory import Trajectory

if TYPE_CHECKING:
    from collections.abc import Sequence

    from api.contract import requests
    from planner import FieldPath
    from planner.robots import Robot
    from planner.spatial import FloatArray


def to_trajectory(
    given: requests.GivenTrajectory, robot: Robot, field: FieldPath = ()
) -> tuple[requests.Interpolation, Trajectory]:
    """Make the trajectory that a controller runs, by the requested interpolation, or the best that the columns allow.

    Args:
        given: Samples, polynomials, or both, and which of them counts.
        robot: The robot whose joints they are of.
        field: Where the request holds it.

    Raises:
        InvalidProblem: It lacks columns that the interpolation needs, or makes no trajectory of the robot.
    """
    samples, interpolation = given.samples, given.interpolation
    if interpolation is None and samples is not None:
        interpolation = interpolation_of(samples.velocity is not None, samples.acceleration is not None)
    elif interpolation is None:
        interpolation = "polynomials"
    try:
        if interpolation == "polynomials":
            if given.polynomials is None:
                raise _needed("polynomials")
            return interpolation, from_polynomials(given.polynomials, robot.joint_names)
        if samples is None:
            raise _needed("samples")
        position, velocity, acceleration = (
            None if values is None else to_matrix(values, robot.dof, ("samples", name))
            for name, values in (
                ("position", samples.position),
                ("velocity", samples.velocity),
                ("acceleration", samples.acceleration),
            )
        )
        assert position is not None  # noqa: S101 - of the schema
        return interpolation, interpolated(robot, samples.time, position, velocity, acceleration, interpolation)
    except InvalidProblem as error:
        raise InvalidProblem([((*field, *fault.field), fault.message) for fault in error.faults]) from None


def _needed(what: str) -> InvalidProblem:
    return InvalidProblem([((what,), "must be given: the interpolation reads them")])


def from_polynomials(polynomials: Sequence[requests.JointCurve], joint_names: Sequence[str]) -> Trajectory:
    """Make the piecewise polynomials of a robot's joints a trajectory; pieces of no length are left out.

    Raises:
        InvalidProblem: The joints are not the robot's, or their breakpoints differ or do not increase. Or the rows of
            coefficients are not one a piece, all of one length, or a position is beyond all bounds.
    """
    field: FieldPath = ("polynomials",)
    if [polynomial.joint for polynomial in polynomials] != list(joint_names):
        raise InvalidProblem([(field, f"must have one entry for each joint, in the order {', '.join(joint_names)}")])
    breakpoints = np.array(polynomials[0].breakpoints)
    lengths = np.diff(breakpoints)
    order = len(polynomials[0].coefficients[0])
    faults: list[tuple[FieldPath, str]] = []
    for j, polynomial in enumerate(polynomials):
        if polynomial.breakpoints != polynomials[0].breakpoints:
            faults.append(((*field, j, "breakpoints"), "must be the same for all joints"))
        if len(polynomial.coefficients) != len(lengths):
            message = f"must have one row for each of the {len(lengths)} pieces; got {len(polynomial.coefficients)}"
            faults.append(((*field, j, "coefficients"), message))
        wrong = [i for i, row in enumerate(polynomial.coefficients) if len(row) != order]
        faults += [((*field, j, "coefficients", i), f"must have {order} coefficients, as the first row") for i in wrong]
    backwards = np.flatnonzero(lengths < 0.0)
    if len(backwards):
        faults.append(
            ((*field, 0, "breakpoints", int(backwards[0]) + 1), "must not be less than the breakpoint before it")
        )
    elif breakpoints[-1] == breakpoints[0]:
        faults.append(((*field, 0, "breakpoints"), "must not all be equal: the trajectory would take no time"))
    if faults:
        raise InvalidProblem(faults)
    coefficients = np.array([polynomial.coefficients for polynomial in polynomials]).transpose(1, 0, 2)
    farthest = np.abs(coefficients * powers(lengths[:, None], order)).sum(axis=2)
    if beyond := np.argwhere(farthest > common.LARGEST).tolist():
        message = f"must keep the position within {common.LARGEST:g} rad or m of 0"
        raise InvalidProblem([((*field, j, "coefficients", i), message) for i, j in beyond])
    pieces = np.flatnonzero(lengths > 0.0)
    ends = np.array([0.0, lengths[pieces].sum()])
    return Trajectory(lengths[pieces], coefficients[pieces], np.zeros(len(pieces), dtype=int), ends, ends)


def to_matrix(rows: Sequence[Sequence[float]], columns: int, field: FieldPath) -> FloatArray:
    """Make rows (N, columns) an array.

    Raises:
        InvalidProblem: Naming each row that has another length.
    """
    wrong = [i for i, row in enumerate(rows) if len(row) != columns]
    if wrong:
        raise InvalidProblem(
            [((*field, i), f"must have one value for each of the {columns} joints; got {len(rows[i])}") for i in wrong]
        )
    return np.array(rows, dtype=np.float64)
