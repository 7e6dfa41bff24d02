"""Export formats and their options."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from planner.errors import UnsupportedFormat
from planner.plans.result import Plan

INCLUDABLE = (
    "jerk",
    "torque",
    "tcp_pose",
    "tcp_rpy",
    "tcp_velocity",
    "tcp_acceleration",
    "polynomials",
)
"""Names of the quantities that samples have on request; `polynomials` belong to the `npz` format."""


@dataclass(frozen=True)
class ExportOptions:
    """The options by which a plan is written.

    Attributes:
        sample_period: Time between samples, s; the last one is at the end.
        include: Further quantities, some of `INCLUDABLE`.
        repeat: Number of times that a robot program runs the trajectory; 0: until an operator stops it. Other forms
            have it once.
    """

    sample_period: float = 0.01
    include: frozenset[str] = frozenset()
    repeat: int = 1


@dataclass(frozen=True)
class Format:
    """One form that a plan can leave in.

    Attributes:
        name: The form's name.
        media_type: The media type of a file of this form.
        suffix: How the name of such a file ends, with the dot.
        render: What writes a plan.
    """

    name: str
    media_type: str
    suffix: str
    render: Callable[[Plan, ExportOptions], bytes]


def refuse_actions(plan: Plan, form: str) -> None:
    """Refuse to leave actions out.

    Raises:
        UnsupportedFormat: The plan has actions.
    """
    if plan.problem.actions:
        raise UnsupportedFormat(f"{form} carries no actions; json, msgpack, npz, mcap and programs of robots do")
