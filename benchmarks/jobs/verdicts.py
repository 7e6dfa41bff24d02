"""Faults of a plan or a refusal, by the known answer of the job and by the other back ends."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from benchmarks.corpus.checks import FASTEST, LAWS, SHORT, SLOW, STEADY
from benchmarks.corpus.corpus import backend_of, job
from planner.backends.base import enforced
from planner.problems.problem import JointMotion
from planner.problems.transitions import ThroughTransition

if TYPE_CHECKING:
    from collections.abc import Iterator

    from benchmarks.corpus.job import Job

Record = dict[str, Any]


def judge(records: list[Record]) -> list[Record]:
    """Return the records, each with `faults`, a list of pairs of a kind and a description."""
    durations = {(it["job"], it["backend"]): it["duration"] for it in records if it["outcome"] == "planned"}
    return [{**it, "faults": list(_faults(it, job(it["job"]), durations))} for it in records]


def _faults(record: Record, asked: Job, durations: dict[tuple[str, str], float]) -> Iterator[tuple[str, str]]:
    outcome, kind = record["outcome"], record["backend"]
    if outcome == "refused":
        if asked.infeasible is None:
            yield "refused", f"{record['code']}: {record['message']}"
        elif record["code"] not in asked.codes:
            yield "another reason", f"{record['code']}, though {asked.infeasible}"
    elif outcome != "planned":
        yield outcome, record.get("message", "")
    else:
        if asked.infeasible is not None:
            yield "broken", f"planned, though {asked.infeasible}"
        if "broken" in record:
            yield "broken", record["broken"]
        for raised in record["raised"]:
            yield "warned", raised
        yield from _slow(record, asked, durations)
        if kind == "auto" and any("the fastest" in message for _, message in record["warnings"]):
            yield from _false_praise(record, asked, durations)
    if record.get("seconds", 0.0) > asked.budget:
        yield "over budget", f"{record['seconds']:.2f} s of {asked.budget:.2f} s"


def _slow(record: Record, asked: Job, durations: dict[tuple[str, str], float]) -> Iterator[tuple[str, str]]:
    duration, kind = record["duration"], record["backend"]
    twin = durations.get((asked.twin, kind)) if asked.twin is not None else None
    if twin is not None and not twin / SLOW - SHORT <= duration <= twin * SLOW + SHORT:
        yield "unlike twin", f"{duration:.6g} s, {asked.twin} takes {twin:.6g} s"
    if asked.least_duration is not None and duration < asked.least_duration / SLOW:
        yield "broken", f"{duration:.6g} s is less than length over speed, {asked.least_duration:.6g} s"
    if asked.durations is not None and kind in LAWS and LAWS[kind] in asked.durations:
        known = asked.durations[LAWS[kind]]
        if duration > known * SLOW + SHORT:
            yield "slow", f"{duration:.6g} s, in closed form {known:.6g} s"
            return
    if kind not in STEADY:
        return
    if asked.most_duration is not None and duration > asked.most_duration:
        yield "slow", f"{duration:.6g} s, by length over speed at most {asked.most_duration:.6g} s"
    best, other = _best(kind, asked, durations)
    if duration > best * SLOW + SHORT:
        slow = "slow" if same_path(asked) else "slow on its path"
        yield slow if kind in FASTEST else "slow by its law", f"{duration:.6g} s, {other} takes {best:.6g} s"


def _best(kind: str, asked: Job, durations: dict[tuple[str, str], float]) -> tuple[float, str]:
    """Return the least duration, s, of the back ends that keep no less than this one, and whose it is."""
    kept = enforced(backend_of(kind, asked))
    others = [
        (duration, other)
        for (name, other), duration in durations.items()
        if name == asked.name and enforced(backend_of(other, asked)) >= kept
    ]
    return min(others)


def _false_praise(record: Record, asked: Job, durations: dict[tuple[str, str], float]) -> Iterator[tuple[str, str]]:
    best, other = _best("auto", asked, durations)
    if record["duration"] > best * SLOW + SHORT:
        yield "false warning", f'"the fastest", {record["duration"]:.6g} s; {other} takes {best:.6g} s'


def same_path(asked: Job) -> bool:
    """Tell whether all back ends move along the same path: through passed waypoints each draws its own curve."""
    waypoints = asked.problem.waypoints
    return not any(
        isinstance(waypoint.transition, ThroughTransition) and isinstance(waypoint.motion, JointMotion)
        for waypoint in waypoints
    )
