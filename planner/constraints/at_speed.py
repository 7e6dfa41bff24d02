"""Torques, accelerations and jerks of the joints as shares of limits that depend on their speeds."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from planner.constraints.constraint import Constraint
from planner.constraints.excess import first_excess
from planner.constraints.quantities import TORQUE
from planner.dynamics import torques_by_pace
from planner.kinematics.forward import JointStates
from planner.quantities import MEASURES
from planner.robots import Robot
from planner.robots.varying.torque_curves import TorqueCurves
from planner.spatial import FloatArray
from planner.tolerances import ROUNDING

FASTEST_PACE = 1e100
"""Multiple of the pace of a motion beyond which nothing is looked for."""


@dataclass(frozen=True)
class TorqueAtSpeed(Constraint):
    """The shares of the torques that torque curves allow at the speeds of the joints."""

    name: str = "torque_at_speed"
    unit: str = MEASURES["torque_at_speed"].unit
    order: int = 2
    of_joints: bool = True
    follows_path_speed: bool = False
    of_shares: bool = True

    def is_known(self, robot: Robot) -> bool:
        """Return whether a joint has a torque curve, and torques can be computed."""
        return robot.torque_curves is not None and robot.has_dynamics

    def has_factors(self, robot: Robot) -> bool:
        """Return that it has."""
        return True

    def values(self, states: JointStates) -> FloatArray:
        """Return the shares (N, joints) of the allowed torques, signed."""
        curves = states.robot.torque_curves
        if curves is None:
            return np.zeros_like(states.v)
        return TORQUE.values(states) / curves.at(np.abs(states.v))

    def factors(self, states: JointStates, limits: FloatArray, middle: FloatArray) -> FloatArray:
        """Return the factors. At the pace x the torque is a polynomial of x, and the speed is |v| x."""
        curves = states.robot.torque_curves
        if curves is None:
            return np.zeros_like(limits)
        held, linear, moved = torques_by_pace(states.robot, states.q, states.v, states.a)
        return 1.0 / largest_paces(curves, held, moved, np.abs(states.v), limits, linear)

    def shown(self, states: JointStates, column: int, limit: float) -> tuple[float, float]:
        """Return the torque of a joint and the largest one that is allowed at its speed, both magnitudes."""
        curves, torque = states.robot.torque_curves, abs(float(TORQUE.values(states)[0, column]))
        return torque, np.inf if curves is None else limit * float(curves.at(np.abs(states.v))[0, column])


TORQUE_AT_SPEED = TorqueAtSpeed()
"""The torques of the joints as shares of the allowed ones at their speeds."""


@dataclass(frozen=True)
class RateAtSpeed(Constraint):
    """The shares of the accelerations or jerks that a payload table allows at the speeds of the joints."""

    name: str
    unit: str
    order: int
    kept_with: str = ""
    of_joints: bool = True
    follows_path_speed: bool = False
    of_shares: bool = True

    def is_known(self, robot: Robot) -> bool:
        """Return whether the payload table of the robot has speeds."""
        return self.curves_of(robot) is not None

    def curves_of(self, robot: Robot) -> TorqueCurves | None:
        """Return the limits of the joints by their speeds with the payload of a robot; None: there are none."""
        return robot.rate_curves[self.kept_with]

    def rates(self, states: JointStates) -> FloatArray:
        """Return the accelerations or the jerks (N, joints)."""
        rates = states.a if self.order == 2 else states.j
        return np.zeros_like(states.v) if rates is None else rates

    def values(self, states: JointStates) -> FloatArray:
        """Return the shares (N, joints) of the allowed rates, signed."""
        curves = self.curves_of(states.robot)
        return np.zeros_like(states.v) if curves is None else self.rates(states) / curves.at(np.abs(states.v))

    def has_factors(self, robot: Robot) -> bool:
        """Return that it has."""
        return True

    def factors(self, states: JointStates, limits: FloatArray, middle: FloatArray) -> FloatArray:
        """Return the factors: at the pace x the rates grow with x^order, and the speeds with x."""
        curves = self.curves_of(states.robot)
        if curves is None:
            return np.zeros_like(limits)
        return 1.0 / self.largest_paces(curves, self.rates(states), np.abs(states.v), limits)

    def largest_paces(
        self, curves: TorqueCurves, rates: FloatArray, speeds: FloatArray, shares: FloatArray | float = 1.0
    ) -> FloatArray:
        """Return the paces (..., joints) up to which rates `rates` x^order keep to curves at the speeds `speeds` x.

        The share of the limit grows with the pace, for no curve ascends. So one line has the root on its own piece; the
        lines before it have theirs behind the end of their pieces.

        Args:
            curves: The curves of the joints.
            rates: Rates (..., joints) at the pace 1.
            speeds: Speeds (..., joints) at the pace 1, not negative.
            shares: The shares (..., joints) of the curves that may be used.
        """
        first, none = np.full(rates.shape, np.inf), np.zeros_like(rates)
        for begin, end, line, slope in zip(
            curves.speed.T, curves.ends.T, curves.intercepts.T, curves.slope.T, strict=True
        ):
            with np.errstate(divide="ignore", invalid="ignore"):
                low, high = (np.where(speeds > 0.0, at / speeds, np.inf) for at in (begin, end))
            low, limited = np.where(begin > 0.0, low, 0.0), np.isfinite(line) & np.isfinite(begin)
            terms = [none, np.where(limited, shares * slope, 0.0) * speeds, none, none]
            terms[self.order] = np.abs(rates)
            found = np.maximum(low, first_excess(np.stack(terms), np.where(limited, shares * line, np.inf)))
            first = np.where(limited & (found <= high), np.minimum(first, found), first)
        return first

    def shown(self, states: JointStates, column: int, limit: float) -> tuple[float, float]:
        """Return the rate of a joint and the largest one that is allowed at its speed, both magnitudes."""
        curves, rate = self.curves_of(states.robot), abs(float(self.rates(states)[0, column]))
        return rate, np.inf if curves is None else limit * float(curves.at(np.abs(states.v))[0, column])


ACCELERATION_AT_SPEED = RateAtSpeed("acceleration_at_speed", MEASURES["acceleration_at_speed"].unit, 2, "acceleration")
"""The accelerations of the joints as shares of the allowed ones at their speeds."""

JERK_AT_SPEED = RateAtSpeed("jerk_at_speed", MEASURES["jerk_at_speed"].unit, 3, "jerk")
"""The jerks of the joints as shares of the allowed ones at their speeds."""


def largest_paces(
    curves: TorqueCurves,
    held: FloatArray,
    moved: FloatArray,
    speeds: FloatArray,
    shares: FloatArray | float = 1.0,
    linear: FloatArray | float = 0.0,
) -> FloatArray:
    """Return the paces (..., joints) up to which torques keep to the curves at the speeds `speeds` x.

    At the pace x the torques are `held` + `linear` x + `moved` x^2.

    Args:
        curves: The curves of the joints.
        held: Torques (..., joints) at rest.
        moved: Torques (..., joints) that grow with the square of the pace, at the pace 1.
        speeds: Speeds (..., joints) at the pace 1, not negative.
        shares: The shares (..., joints) of the curves that may be used.
        linear: Torques (..., joints) that grow with the pace, at the pace 1.
    """
    first = np.full(held.shape, np.inf)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        for begin, end, torque, slope in zip(
            curves.speed.T, curves.ends.T, curves.intercepts.T, curves.slope.T, strict=True
        ):
            low, high = (np.where(at > 0.0, at / speeds, 0.0) for at in (begin, end))
            there = (low < FASTEST_PACE) & np.isfinite(torque)
            low = np.where(there, low, 0.0)
            for sign in (1.0, -1.0):
                excess = sign * held - shares * torque, shares * slope * speeds + sign * linear, sign * moved
                found = low + _first_positive(*_since(low, *excess))
                first = np.where(there & (found <= high), np.minimum(first, found), first)
    return first


def _since(low: FloatArray, constant: FloatArray, linear: FloatArray, square: FloatArray) -> tuple[FloatArray, ...]:
    """Return the coefficients of a parabola of x - low, by its coefficients of x."""
    return constant + low * (linear + low * square), linear + 2.0 * low * square, square


def _first_positive(constant: FloatArray, linear: FloatArray, square: FloatArray) -> FloatArray:
    """Return the least x >= 0 beyond which parabolas are positive; infinite: none."""
    inside = linear**2 - 4.0 * square * constant
    x = -2.0 * constant / (linear + np.sqrt(inside))
    grows = (linear > 0.0) | ((square > 0.0) & (inside >= 0.0))
    return np.where(constant > 0.0, 0.0, np.where(grows & (inside >= 0.0) & (x >= 0.0), x, np.inf))


def rows_at_speed(
    curves: TorqueCurves, by_b: FloatArray, by_a: FloatArray, held: FloatArray, speeds: FloatArray
) -> list[tuple[FloatArray, ...]]:
    """Return limits |by_b b + by_a a + offset| <= constant that keep torques near a retiming to torque curves.

    A retiming by b has the torques by_b b + by_a a + held and the speeds `speeds` sqrt(b). The tangent
    (b / p + p) / 2 at p^2 is above sqrt(b). So a line torque - slope speed of a curve becomes a linear limit of b.
    Near the fastest time scaling p is 1. Lines that are below the curve at that speed belong to other speeds, for which
    the next round has them.

    Args:
        curves: The curves of the joints.
        by_b: (..., joints).
        by_a: (..., joints).
        held: Torques (..., joints) at rest, within the curves.
        speeds: (..., joints), not negative.

    Returns:
        The coefficients of b and of a, the offsets and the constants, for each line and direction, each (..., joints).
    """
    careful = largest_paces(curves, np.abs(held), np.abs(by_b), speeds)
    kept = largest_paces(curves, held, by_b, speeds)
    careful = np.where(np.isfinite(careful), careful, 1.0)
    rest = curves.at(np.zeros_like(speeds))
    pace = np.where((careful < 1.0) & (kept >= 1.0), 1.0, careful)
    lines = list(zip(curves.intercepts.T, curves.slope.T, strict=True))

    def rooms() -> Iterator[tuple[FloatArray, FloatArray, np.ndarray]]:
        """Yield slope, constant part of the limit, and whether it counts at the speed of the pace, of each line."""
        within = curves.at(speeds * pace) * (1.0 - ROUNDING)
        for torque, slope in lines:
            counts = np.isfinite(torque) & (torque - slope * speeds * pace >= within)
            yield slope, torque - 0.5 * slope * speeds * pace, counts

    too_fast = np.any([counts & (room <= np.abs(held)) for _, room, counts in rooms()], axis=0)
    pace = np.where(too_fast, careful, pace)
    rows: list[tuple[FloatArray, ...]] = []
    for slope, room, counts in rooms():
        for sign in (1.0, -1.0):
            # The other side of each limit is out of the way: torques are within those at rest.
            unit = np.where(counts, room + 2.0 * rest, 1.0)
            parts = sign * by_b + 0.5 * slope * speeds / pace, sign * by_a, sign * held + 2.0 * rest
            rows.append((*(np.where(counts, part / unit, 0.0) for part in parts), np.ones_like(unit)))
    return rows
