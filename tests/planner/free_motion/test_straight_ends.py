"""Windows with millimetres of clearance, which the tool enters and leaves on a straight line."""

from __future__ import annotations

from dataclasses import replace
from itertools import product

import numpy as np
import pytest

import planner
from planner.shapes import Box
from planner.spatial import FloatArray, Pose
from tests.planner.free_motion.cases import ARM

HALF, LENGTH = 0.02, 0.2
"""Half the width of a square rod at the flange, and its length, m."""

CENTRE, DEPTH = np.array([1.25, 0.0, 0.9]), 0.02
"""The middle of a window in a plate across x, and the plate's thickness, m."""

FORWARD = np.array([[0.0, 0.0, 1.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0]])
"""The tool's z axis points along x."""

OUTSIDE = planner.JointWaypoint([1.2, -1.2, 1.4, 0.0, 0.8, 0.0])


def window(room: float) -> planner.Scene:
    """Make a plate with a window around the rod, with this clearance on each side, m."""
    rest = (0.5 - HALF - room) / 2.0
    off = HALF + room + rest
    places = {"left": (0.0, off), "right": (0.0, -off), "top": (off, 0.0), "bottom": (-off, 0.0)}
    plates = [
        planner.SceneObject(
            name,
            [Box([DEPTH, 1.0 if y == 0.0 else 2.0 * rest, 2.0 * rest if y == 0.0 else 1.0])],
            Pose(CENTRE + np.array([0.0, y, z])),
        )
        for name, (z, y) in places.items()
    ]
    rod = planner.AttachedObject("rod", [Box([2.0 * HALF, 2.0 * HALF, LENGTH])], Pose([0.0, 0.0, LENGTH / 2.0]))
    return planner.Scene(plates, attached=[rod])


def rod_at(positions: FloatArray) -> FloatArray:
    """Return points on the long edges of the rod (positions, points, 3), m."""
    corners = [[x, y, z] for x, y in product((-HALF, HALF), repeat=2) for z in np.linspace(0.0, LENGTH, 41)]
    poses = planner.forward_kinematics(ARM, positions)
    return np.array([np.array(corners) @ np.asarray(pose.rotation).T + pose.position for pose in poses])


@pytest.mark.parametrize("room", [0.005, pytest.param(0.01, marks=pytest.mark.large_only)])
@pytest.mark.parametrize("into", [True, False], ids=["into the window", "out of it"])
def test_the_tool_passes_a_window_with_millimetres_of_room(into: bool, room: float) -> None:
    """No motion was found among 20,000 samples, though a free motion to a pose in front and a line were planned."""
    tip = Pose(CENTRE + np.array([0.09 - LENGTH, 0.0, 0.0]), FORWARD)
    inside = planner.JointWaypoint(planner.inverse_kinematics(ARM, tip, reference=OUTSIDE.position).position)
    goal: planner.PoseWaypoint | planner.JointWaypoint = planner.PoseWaypoint(tip) if into else OUTSIDE
    waypoints = [OUTSIDE if into else inside, replace(goal, motion=planner.FreeMotion())]
    plan = planner.plan(planner.PlanningProblem(ARM, waypoints, scene=window(room)), planner.Toppra())
    times = np.linspace(0.0, plan.trajectory.duration, 2000)
    points = rod_at(plan.trajectory.evaluate(times, [0])[0]).reshape(-1, 3)
    beside = points[np.abs(points[:, 0] - CENTRE[0]) < DEPTH / 2.0] - CENTRE
    in_plate = beside[np.abs(beside).max(axis=1) < 0.5]
    assert len(in_plate) > 10
    assert np.abs(in_plate[:, 1:]).max() < HALF + room
