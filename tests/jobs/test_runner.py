"""The job runner: records outcomes, survives its worker, detects slow jobs, and has correct closed forms."""

from __future__ import annotations

import os
import signal
from dataclasses import replace

import numpy as np
import pytest
from ruckig import InputParameter, Result, Ruckig, Trajectory

from benchmarks.corpus.closed_form import straight_times
from benchmarks.corpus.corpus import job
from benchmarks.jobs.jobs import Worker
from benchmarks.jobs.verdicts import judge
from planner.robots import load_robot

SEAM, FAR = "seam_straight-00-three_dof_arm", "infeasible-00-three_dof_arm"


@pytest.mark.large_only
def test_worker_is_replaced_when_it_dies() -> None:
    worker = Worker()
    try:
        assert worker.plan(SEAM, "trapezoidal")["outcome"] == "planned"
        pid = worker.process.pid
        assert pid is not None
        os.kill(pid, signal.SIGKILL)
        assert worker.plan(SEAM, "trapezoidal")["outcome"] == "died"
        refused = worker.plan(FAR, "cubic")
    finally:
        worker.stop()
    assert refused["outcome"] == "refused"
    assert refused["code"] in job(FAR).codes


def planned(kind: str, duration: float) -> dict[str, object]:
    return {
        "job": SEAM,
        "backend": kind,
        "outcome": "planned",
        "duration": duration,
        "seconds": 0.1,
        "warnings": [["auto_choice", "ruckig: the fastest"]],
        "raised": [],
    }


def test_judge_finds_what_is_slow_wrong_or_late() -> None:
    least = job(SEAM).least_duration
    assert least is not None
    good, slow, auto = planned("trapezoidal", least), planned("toppra", 1.1 * least), planned("auto", 1.2 * least)
    refused = {"job": SEAM, "backend": "cubic", "outcome": "refused", "code": "x", "message": "y", "seconds": 9.0}
    untrue = planned("cubic", 1.0) | {"job": FAR}
    kinds = [{kind for kind, _ in it["faults"]} for it in judge([good, slow, auto, refused, untrue])]
    assert kinds == [set(), {"slow"}, set(), {"refused", "over budget"}, {"broken"}]
    jerk_limited = planned("ruckig", least)
    assert {kind for kind, _ in judge([auto, jerk_limited])[0]["faults"]} == {"slow", "false warning"}


@pytest.mark.parametrize("scale", [1.0, 0.1, 1e-3])
@pytest.mark.parametrize(("jerk", "law"), [(True, "s_curve"), (False, "trapezoidal")])
def test_closed_forms_agree_with_ruckig(scale: float, jerk: bool, law: str) -> None:
    """Each joint in turn, from the time scaling that reaches all limits to the one that reaches none."""
    robot = load_robot("kuka_kr16_l6_2")
    for seed in range(20):
        rng = np.random.default_rng(seed)
        travel = float(scale * rng.uniform(0.1, 3.0))
        joint = replace(robot.joints[0], **{name: float(rng.uniform(0.5, 50.0)) for name in ("acceleration", "jerk")})
        one = replace(robot, joints=(joint, *robot.joints[1:]))
        given = InputParameter(1)
        given.current_position, given.target_position = [0.0], [travel]
        given.max_velocity, given.max_acceleration = [joint.velocity], [joint.acceleration]
        given.max_jerk = [joint.jerk if jerk else np.inf]
        motion = Trajectory(1)
        assert Ruckig(1).calculate(given, motion) in (Result.Working, Result.Finished)
        positions = np.zeros((2, 6))
        positions[1, 0] = travel
        times = {str(name): time for name, time in straight_times(one, positions).items()}
        assert times[law] == pytest.approx(motion.duration, rel=1e-9)
