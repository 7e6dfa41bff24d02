"""What helps where a robot would collide: to stop, a way around or over it, another configuration."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from planner.certificate.clearance import CLEARANCE_TOLERANCE
from planner.errors import Collision, Remedy, StartInCollision
from planner.kinematics.configurations import AHEAD, BEHIND, Configuration, named_parts
from planner.planning.attempts import Planned
from planner.planning.proofs import plan_with, proved
from planner.problems.motion_around import FreeMotion
from planner.problems.problem import JointMotion, PolylineMotion, PoseWaypoint
from planner.problems.transitions import BlendTransition, StopTransition, ThroughTransition
from planner.spatial import Pose

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.errors import ClearanceUnproved
    from planner.planning.attempts import Attempt, Proposals, Refused
    from planner.problems.problem import PlanningProblem

HEIGHTS = (0.1, 0.25, 0.5)
"""Heights above the higher end of a motion by which the tool is led over what is in its way, m."""

CORNERS = 0.3
"""Share of the height by which the corners of that way are cut."""

CHECKS_OF_WAY_AROUND = 1000
"""Motions that the search for a way around looks at: most ways take less, and refusals are not to take long."""

MOST_TRIED = 10
"""Number of changes that are tried, each of which is a whole plan."""

MOST_HELPING = 3
"""Number of changes that are offered."""


def collision_remedies(refused: Refused, refusal: Collision | ClearanceUnproved) -> Proposals[list[Remedy]]:
    """Find changes with each of which the problem has been planned.

    Args:
        refused: The attempt that was refused.
        refusal: The reason.
    """
    helping: list[Remedy] = []
    for tried, remedy in enumerate(_candidates(refused, refusal)):
        if tried >= MOST_TRIED or len(helping) >= MOST_HELPING:
            break
        helping += yield from proved([remedy], refused.attempt)
    return helping + (yield from _smaller_margin(refused.attempt, refusal))


def _candidates(refused: Refused, refusal: Collision | ClearanceUnproved) -> Iterator[Remedy]:
    if not isinstance(refusal, Collision) or isinstance(refusal, StartInCollision) or refusal.segment is None:
        return  # what takes long to prove would take as long again with every change
    problem = refused.attempt.problem
    ends = range(refusal.segment, min(refusal.segment + 2, len(problem.waypoints)))
    for i in ends:
        if isinstance(problem.waypoints[i].transition, BlendTransition | ThroughTransition):
            field = ("waypoints", i, "transition")
            yield Remedy(field, StopTransition(), "with a stop the robot goes straight to the waypoint")
    if len(ends) == 2:  # where the robot rests at its only waypoint there is no way to be changed
        yield from _other_ways(refused.attempt, refusal.segment)
    yield from _other_configurations(problem, ends)


def _other_configurations(problem: PlanningProblem, ends: Iterable[int]) -> Iterator[Remedy]:
    """Yield the configurations that a pose at an end of the motion may be reached in besides."""
    parts = named_parts(problem.robot)
    sides = dict(zip(("shoulder", "elbow", "wrist"), zip(BEHIND, AHEAD, strict=True), strict=True))
    for i in ends:
        waypoint = problem.waypoints[i]
        if not isinstance(waypoint, PoseWaypoint) or waypoint.configuration.names:
            continue
        for names in product(*(sides[part] for part in parts)):
            named = Configuration(**dict(zip(parts, names, strict=True)))  # type: ignore[arg-type]
            yield Remedy(("waypoints", i, "configuration"), named, "the arm goes another way in this configuration")


def _other_ways(attempt: Attempt, segment: int) -> Iterator[Remedy]:
    """Yield a way around by search, and motions of the tool that lead up, across and down again.

    Only a joint motion between stops gives way to them.
    """
    problem = attempt.problem
    first, second = problem.waypoints[segment], problem.waypoints[segment + 1]
    stops = isinstance(first.transition, StopTransition) and isinstance(second.transition, StopTransition)
    if not stops or not isinstance(second.motion, JointMotion):
        return
    field = ("waypoints", segment + 1, "motion")
    if not (second.duration or second.minimum_duration or isinstance(second.motion, FreeMotion)):
        yield Remedy(field, FreeMotion(most_checks=CHECKS_OF_WAY_AROUND), "a way around what is in the way")
    mounting = problem.robot.mounting
    up = np.array([0.0, 0.0, 1.0]) if mounting is None or mounting.rotation is None else mounting.rotation[2]
    solved = dict(zip(attempt.with_detours.numbers, attempt.solved.waypoints, strict=True))  # corners come first
    start, end = solved[segment].pose, solved[segment + 1].pose
    top = max(float(start.position @ up), float(end.position @ up))
    for height in HEIGHTS:
        poses = [Pose(p.position + (top + height - float(p.position @ up)) * up, p.rotation) for p in (start, end)]
        motion = PolylineMotion(poses, CORNERS * height)
        explanation = f"a higher approach: the tool goes over it, {height:g} m above the higher end"
        yield Remedy(field, motion, explanation)


def _smaller_margin(attempt: Attempt, refusal: Collision | ClearanceUnproved) -> Proposals[list[Remedy]]:
    """Return the largest margin, in whole millimetres, that the motion as it is keeps; none where that is none."""
    scene = attempt.problem.scene
    if scene is None or not refusal.limit or (refusal.value is not None and refusal.value <= 0.0):
        return []
    no_margins = tuple(replace(thing, margin=None) for thing in scene.objects)
    free = replace(scene, margin=CLEARANCE_TOLERANCE, objects=no_margins)  # nearer is what is taken and put down
    outcome = yield from plan_with([Remedy(("scene",), free, "")], attempt)
    report = outcome.plan.certificate.clearance if isinstance(outcome, Planned) else None
    if report is None or report.scene is None:
        return []
    kept = np.floor((report.scene.lower - CLEARANCE_TOLERANCE / 2.0) / CLEARANCE_TOLERANCE) * CLEARANCE_TOLERANCE
    own = [i for i, thing in enumerate(scene.objects) if thing.id in refusal.pair and thing.margin is not None]
    field = ("scene", "objects", own[0], "margin") if own else ("scene", "margin")
    if kept <= 0.0:
        return []
    remedy = Remedy(field, float(round(kept, 6)), "the motion keeps this much clear as it is")
    return (yield from proved([remedy], attempt))
