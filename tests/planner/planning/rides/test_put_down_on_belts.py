"""Parts put down on a moving object: where they are afterwards in closed form, their clearance, and refusals."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pinocchio as pin
import pytest

import planner
from planner.certificate.clearance import segment_checkers
from planner.certificate.rides import certify_rides
from planner.problems.rides import RideMotion
from planner.spatial import Pose
from tests.planner.planning.rides.belt import ABOVE, ARM, DOWN, HOME, LINE, ONCE, off_part, on, part, pick, problem

SPEED = np.array([0.0, 0.15, 0.0])
TRAY = planner.SceneObject(
    "tray",
    [planner.Box([0.2, 0.2, 0.02])],
    Pose([0.55, -1.2, 0.1], np.eye(3)),
    motion=planner.ConstantVelocity(SPEED),
)
OVER, DOWN_ON = Pose([0.0, 0.0, 0.2], DOWN), Pose([0.0, 0.0, 0.0755], DOWN)
TWICE = planner.Budget(attempts=2)

PLACE = [
    on(OVER, "tray", earliest_arrival=5.5),
    on(DOWN_ON, "tray", motion=LINE, dwell=0.2, detach=["part"]),
    on(OVER, "tray", motion=LINE),
]


def tool_at(q: Any) -> pin.SE3:
    """Return the placement of the tool at a joint position, by Pinocchio."""
    data = ARM.model.createData()
    pin.framesForwardKinematics(ARM.model, data, np.asarray(q))
    return data.oMf[ARM.tool_frame_id]


def test_a_part_goes_from_belt_to_belt_and_moves_along() -> None:
    thing = part()
    plan = planner.plan(problem(thing, [*pick(2.5), *PLACE], TRAY, place=HOME), "ruckig", TWICE)
    assert [ride.object for ride in plan.rides] == ["part", "tray"]
    for moving in (thing, TRAY):
        assert off_part(plan, moving)[0] <= 1e-4
    taken, released = (plan.trajectory.arrivals[plan.requested_indices.index(k)] for k in (2, 5))
    (row,) = (k for k, w in enumerate(plan.problem.waypoints) if w.detach)
    assert plan.trajectory.arrivals[row] == released
    # The grip is where the tool met the part; the part then is where the tool has left it, and moves with the tray.
    at = plan.trajectory.evaluate(np.array([taken, released]), [0])[0]
    met = pin.SE3(np.eye(3), thing.pose.position + taken * np.array([0.0, 0.2, 0.0]))
    left = tool_at(at[1]) * tool_at(at[0]).actInv(met)
    after = segment_checkers(plan.problem, plan.path.positions)[-1]
    (there,) = (other for other in after.scene.moving if other.id == "part")
    for time in (released, released + 0.7, plan.trajectory.duration):
        expected = left.translation + (time - released) * SPEED
        assert there.pose_at(time).position == pytest.approx(expected, abs=2e-6)
    # Its distance from the arm at samples is never less than the proved one.
    clearance = plan.certificate.clearance
    assert clearance is not None and clearance.scene is not None and clearance.contacts is not None
    assert set(clearance.contacts.pair) == {"part", "tray"}
    assert clearance.contacts.upper == pytest.approx(5e-4, abs=2e-5), "0.5 mm above the tray where it is put down"


def test_the_arm_must_keep_clear_of_what_it_has_put_down() -> None:
    """Downstream of the tray the tool waits 5 cm above it, in the way of the part alone."""
    low = planner.PoseWaypoint(Pose([0.55, 0.3, 0.16], DOWN), dwell=6.0)
    given = problem(part(), [*pick(2.5), *PLACE, low], TRAY, place=HOME)
    with pytest.raises(planner.Collision) as refusal:
        planner.plan(given, "ruckig", TWICE)
    assert refusal.value.pair is not None
    assert refusal.value.pair[1] == "part"
    empty = [on(OVER, "tray", earliest_arrival=5.5), on(OVER, "tray", motion=LINE)]
    assert planner.plan(problem(part(), [*empty, low], TRAY, place=HOME), "ruckig", ONCE).rides


def test_a_free_motion_waits_until_a_part_that_the_arm_has_put_down_has_passed() -> None:
    held = planner.AttachedObject("part", [planner.Box([0.06] * 3)], Pose([0.0, 0.0, 0.035], np.eye(3)))
    high = planner.PoseWaypoint(Pose([0.55, 0.3, 0.45], DOWN), earliest_arrival=8.2)
    low = planner.PoseWaypoint(Pose([0.55, 0.3, 0.16], DOWN), dwell=1.5, motion=planner.FreeMotion())
    scene = planner.Scene([TRAY], [held], margin=0.005)
    given = planner.PlanningProblem(ARM, [HOME, *PLACE, high, low], scene=scene)
    plan = planner.plan(given, "ruckig", planner.Budget(attempts=3))
    assert plan.rides[0].arrival == pytest.approx(5.5)
    (said,) = (warning.message for warning in plan.warnings if warning.code == "waits_for_object")
    assert said.endswith("longer at waypoint 4, until part has passed")
    (checker,) = segment_checkers(plan.problem, plan.path.positions)[-1:]
    (there,) = (other for other in checker.scene.moving if other.id == "part")
    for time in np.linspace(plan.trajectory.departures[-2], plan.trajectory.duration, 200).tolist():
        tip = tool_at(plan.trajectory.evaluate(time, [0])[0]).translation
        assert np.abs(tip - there.pose_at(time).position).max() > 0.03 + 0.005, "the tip is out of the box"


def test_the_check_sees_a_part_that_is_released_at_another_time() -> None:
    plan = planner.plan(problem(part(), [*pick(2.5), *PLACE], TRAY, place=HOME), "ruckig", TWICE)
    (row,) = (k for k, w in enumerate(plan.problem.waypoints) if w.detach)
    other = list(plan.problem.waypoints)
    motion = other[row].motion
    assert isinstance(motion, RideMotion)
    other[row] = replace(other[row], motion=replace(motion, end=motion.end + 2e-3))
    (position, _) = certify_rides(plan.trajectory, replace(plan.problem, waypoints=other))
    assert position.peak == pytest.approx(3e-4, rel=0.05), "0.3 mm on the belt"
    assert not position.satisfied


@pytest.mark.parametrize(
    ("waypoints", "field", "words"),
    [
        (
            [*pick(), *PLACE[:2], planner.JointWaypoint(HOME, attach=[planner.Attach("part")])],
            ("waypoints", 6, "attach", 0, "id"),
            "since waypoint 5",
        ),
        ([on(ABOVE, attach=[planner.Attach("part")], detach=["part"])], ("waypoints", 1, "detach"), "takes itself"),
        (
            [*pick(), *PLACE[:2], HOME, on(OVER, "tray", attach=[planner.Attach("tray")])],
            ("waypoints", 5, "detach"),
            "takes itself",
        ),
        ([on(OVER, "tray", detach=["part"])], ("waypoints", 1, "detach", 0), "does not carry"),
    ],
)
def test_what_cannot_be_put_down_on_an_object_is_refused(waypoints: Any, field: Any, words: str) -> None:
    with pytest.raises(planner.InvalidProblem) as refusal:
        planner.plan(problem(part(), waypoints, TRAY), "ruckig")
    faults = {fault.field: fault.message for fault in refusal.value.faults}
    assert words in faults[field], faults
