"""Remedies where a shaped motion breaks a limit: a wider tolerance of its path, slower motions, no shaping."""

from __future__ import annotations

from collections.abc import Iterator

from planner.errors import LimitsUnsatisfiable, PlanningError, Remedy
from planner.planning.attempts import Proposals, Refused
from planner.planning.proofs import Change, first_proved, proved
from planner.problems.problem import CartesianMotion, PlanningProblem

WIDER_THAN_NEEDED = 1.05
"""Factor on the deviation of the shaped motion for the tolerance that is offered."""

SLOWER_SHARES = (0.99, 0.95, 0.8, 0.6, 0.4)
"""Shares of the speed at which a value that grows with its square keeps its limit; the first that leads to a plan is
offered."""

TOLERANCE_EXPLAINED = "a tolerance within which the shaped motion keeps to its path"
"""The explanation of a wider tolerance, for a person."""

SLOWER_EXPLAINED = "slow enough for the shaped motion to keep its limits and to stay on its path"
"""The explanation of lower limits, for a person."""

REPORTED_EXPLAINED = "the plan is not shaped, and its certificate reports the residual vibration"
"""The explanation of the remedy without shaping, for a person."""


def shaping_remedies(refused: Refused) -> Proposals[list[Remedy]]:
    """Find remedies for a refused problem whose residual vibration is to be suppressed; none otherwise."""
    attempt, problem = refused.attempt, refused.attempt.problem
    mode = problem.residual_vibration
    if mode is None or not mode.suppress:
        return []
    remedies: list[Remedy] = []
    for changes in (_wider(problem, refused.refusal), _slower(problem, refused.refusal)):
        remedies += yield from first_proved(changes, attempt)
    reported = Remedy(("residual_vibration", "suppress"), False, REPORTED_EXPLAINED)
    return remedies + (yield from proved([reported], attempt))


def _wider(problem: PlanningProblem, refusal: PlanningError) -> Iterator[Change]:
    """Yield a wider tolerance of the one motion of the tool whose tolerance the shaped motion exceeds."""
    for name in ("tolerance_position", "tolerance_orientation"):
        fields = [
            ("waypoints", i, "motion", name)
            for i, waypoint in enumerate(problem.waypoints)
            if isinstance(waypoint.motion, CartesianMotion) and getattr(waypoint.motion, name) == refusal.limit
        ]
        if isinstance(refusal, LimitsUnsatisfiable) and refusal.value is not None and len(fields) == 1:
            yield [Remedy(fields[0], WIDER_THAN_NEEDED * refusal.value, TOLERANCE_EXPLAINED)]


def _slower(problem: PlanningProblem, refusal: PlanningError) -> Iterator[Change]:
    """Yield lower limits on the whole trajectory, where the shaped motion exceeds a limit or a tolerance."""
    if not (isinstance(refusal, LimitsUnsatisfiable) and refusal.value and refusal.limit):
        return
    for share in SLOWER_SHARES:
        speed = share * min(1.0, abs(refusal.limit / refusal.value)) ** 0.5
        scales = {"velocity_scale": speed, "acceleration_scale": speed**2}
        yield [
            Remedy(("limits", name), getattr(problem.limits, name) * scale, SLOWER_EXPLAINED)
            for name, scale in scales.items()
        ]
