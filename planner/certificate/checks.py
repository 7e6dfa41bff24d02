"""The result of one check of a trajectory, and the certificate of all checks together."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

from planner.certificate.clearance import ClearanceReport
from planner.certificate.speed_zones import SpeedZoneCheck
from planner.quantities import MEASURES, Measure
from planner.robots import Robot
from planner.tolerances import LIMIT_TOLERANCE

OPTIONAL = ("lower", "segment", "relaxed_by", "own_unit")
"""Attributes of checks that are left out of plain values where they say nothing."""


@dataclass(frozen=True)
class Check:
    """The largest value of one quantity over the trajectory.

    Attributes:
        quantity: The quantity, one of `planner.quantities.MEASURES`.
        joint: The worst joint; None: the quantity is not one of joints.
        peak: Its most extreme value: signed for a position, a magnitude otherwise.
        limit: The limit there; None: there is none.
        ratio: Share of the limit that is used: 1 is all of it. A position counts from the middle of its range.
            None: no limit, or no bound.
        time: Time of the peak, s.
        method: `exact` (extrema of polynomials or values at known times), `bounded` (no value exceeds the peak at any
            time) or `sampled`.
        enforced: Whether the back end promises to keep the limit.
        bounded: False: the next lower derivative jumps, so this quantity has an impulse without a finite peak. An
            example is the jerk of a cubic at its ends.
        lower: Where the method is `bounded`, a value that is reached at `time`: the true peak is between this and
            `peak`. None: another method.
        segment: Index of the requested segment on which a limit binds; None: it does not bind, or no field sets it.
        relaxed_by: Names of the fields of the request, and of its robot, with which this limit would be wider.
        own_unit: Unit of a further quantity, which is not one of `MEASURES`; None: it is one of them.
    """

    quantity: str
    joint: str | None
    peak: float
    limit: float | None
    ratio: float | None
    time: float
    method: Literal["exact", "bounded", "sampled"]
    enforced: bool
    bounded: bool
    lower: float | None = None
    segment: int | None = None
    relaxed_by: tuple[str, ...] = ()
    own_unit: str | None = None

    def __post_init__(self) -> None:
        """Refuse a quantity that could not be shown.

        Raises:
            ValueError: It has no title and no unit.
        """
        if self.own_unit is None and self.quantity not in MEASURES:
            raise ValueError(f"the quantity {self.quantity!r} has no title and unit in planner.quantities")

    def unit(self, robot: Robot) -> str:
        """Return the unit of the peak and of the limit, of a check of this robot."""
        is_angle = self.joint is None or robot.joints[robot.joint_names.index(self.joint)].is_angle
        return self.measure.unit_at(is_angle)

    @property
    def measure(self) -> Measure:
        """The title and the unit of the quantity."""
        if self.own_unit is None:
            return MEASURES[self.quantity]
        return Measure(self.quantity.replace("_", " ").capitalize(), self.own_unit)

    @property
    def satisfied(self) -> bool:
        """Whether the quantity has a bound and stays within its limit."""
        if self.limit is None:
            return True
        return self.bounded and self.ratio is not None and self.ratio <= 1.0 + LIMIT_TOLERANCE


@dataclass(frozen=True)
class Certificate:
    """The check of a trajectory against every limit.

    Attributes:
        satisfied: Whether every enforced limit is kept. For a plan, or with given positions, every waypoint is also met
            to 1e-6 rad or m.
        waypoint_error: Largest distance of a joint from its waypoint at the waypoint's arrival, rad or m.
        continuity: `C0`, `C1`, ...: the continuous derivatives, with rest or the requested motion before and after; or
            `none`.
        checks: One a quantity, in the order of `QUANTITIES`.
        clearance: The clearances of the robot from itself and from objects; None: not requested.
        speed_zones: The highest speed in each requested speed zone.
    """

    satisfied: bool
    waypoint_error: float
    continuity: str
    checks: tuple[Check, ...]
    clearance: ClearanceReport | None = None
    speed_zones: tuple[SpeedZoneCheck, ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """Return the certificate in plain values, ready for JSON, without clearance and zones unless requested."""
        checks = (
            {k: v for k, v in vars(check).items() if k not in OPTIONAL or (v is not None and v != ())}
            for check in self.checks
        )
        values = {**vars(self), "checks": list(checks)}
        del values["clearance"], values["speed_zones"]
        if self.clearance is not None:
            values["clearance"] = self.clearance.as_dict()
        if self.speed_zones:
            values["speed_zones"] = [check.as_dict() for check in self.speed_zones]
        return values
