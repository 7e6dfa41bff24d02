"""Plans of every back end whose proofs are written, checked and tampered with."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

import planner
from planner.spatial import quaternion

if TYPE_CHECKING:
    from collections.abc import Iterator

ROBOTS = ("kuka_kr16_2", "fr3", "ur5e", "date_sorting_arm")
BACK_ENDS = (planner.Cubic(), planner.Quintic(), planner.Trapezoidal(), planner.Ruckig(), planner.Toppra())

VARIED = (7, 20, 31, 32, 35, 40, 41, 59, 67, 88)
"""Numbers of quick plans of the large run: together they have all robots, back ends and claims."""

SEED = 27
"""Seed of the plans of the large run."""

SHARE_OF_SCENES = 0.4
"""Share of the plans with a scene that keep it in the large run, because their files are slow."""

SHARE_OF_FORCES = 0.3
"""Share of the plans of robots with dynamics in which the tool exerts a force."""

SHARE_AT_SPEED = 0.2
"""Share of the plans whose limits depend on the speed of the joints."""

SHARE_OF_ZONES = 0.5
"""Share of the plans in a scene with a speed zone, at speeds that hardly slow the robot."""

SHARE_OF_FOLLOWING = 0.3
"""Share of the other plans whose joints have following errors."""

SHARE_OF_CURVES = 0.3
"""Share of the lines that become polylines, and of the circles that become splines."""

DRIVE = ("friction", "damping", "rotor_inertia")
"""Names of the values of drives."""

MOST_PIECES = 6
"""Number of pieces above which few plans enter the large run, because their files are slow."""

SHARE_OF_LARGE = 0.05
"""Share of these plans that enter."""


def scene() -> planner.Scene:
    """Return a floor, a box and a post."""
    return planner.Scene(
        [
            planner.SceneObject("floor", [planner.HalfSpace([0.0, 0.0, 1.0], -0.6)]),
            planner.SceneObject("box", [planner.Box([0.3, 0.3, 0.2])], planner.Pose([1.1, 0.9, 0.1])),
            planner.SceneObject("post", [planner.Cylinder(0.08, 0.9)], planner.Pose([-1.0, 1.1, 0.2])),
        ],
        margin=0.005,
    )


def problem(robot: planner.Robot, generator: np.random.Generator, waypoints: int) -> planner.PlanningProblem:
    """Return waypoints near each other, half of the time in a scene, with limits of the tool."""
    lower, upper = robot.limit("lower").clip(-2.5, 2.5), robot.limit("upper").clip(-2.5, 2.5)
    start = lower + generator.uniform(0.3, 0.7, robot.dof) * (upper - lower)
    steps = generator.uniform(-0.12, 0.12, (waypoints, robot.dof)) * (upper - lower)
    positions = (start + steps.cumsum(axis=0)).clip(lower, upper)
    limits = planner.Limits(
        tcp_linear_velocity=float(generator.uniform(0.3, 2.0)),
        tcp_angular_velocity=float(generator.uniform(1.0, 6.0)),
        tcp_linear_acceleration=float(generator.uniform(5.0, 40.0)) if generator.random() < 0.5 else None,
    )
    around = scene() if generator.random() < 0.5 else None
    return planner.PlanningProblem(robot, [planner.JointWaypoint(q) for q in positions], limits=limits, scene=around)


def varied(plain: planner.PlanningProblem, generator: np.random.Generator) -> planner.PlanningProblem:
    """Return a problem with further content: poses, lines, circles, kept axes, a payload, friction, limits of power."""
    robot, waypoints = plain.robot, list(plain.waypoints)
    changes: dict[str, Any] = {}
    if robot.has_dynamics and generator.random() < 0.3:
        drives = {
            joint.name: dict(zip(DRIVE, generator.uniform(0.0, 2.0, len(DRIVE)).tolist(), strict=True))
            for joint in robot.joints
        }
        changes["robot"] = robot = robot.derived(limits=drives)
    if robot.has_dynamics and generator.random() < 0.3:
        changes["payload"] = planner.Payload(mass=float(generator.uniform(0.1, 2.0)))
    if robot.has_dynamics and generator.random() < 0.3:
        power = tuple(generator.uniform(300.0, 3000.0, robot.dof).tolist())
        total = float(generator.uniform(500.0, 5000.0))
        changes["limits"] = replace(plain.limits, power=power, total_power=total)
    positions = [waypoint.position for waypoint in waypoints if isinstance(waypoint, planner.JointWaypoint)]
    before, last = (planner.forward_kinematics(robot, position) for position in positions[-2:])
    kind = generator.choice(["joints", "pose", "line", "circle", "axis"])
    if kind == "pose":
        waypoints[-1] = planner.PoseWaypoint(last)
    elif kind == "line":
        moved = planner.Pose(before.position + generator.uniform(-0.1, 0.1, 3), before.rotation)
        waypoints[-1] = planner.PoseWaypoint(moved, motion=planner.LinearMotion())
    elif kind == "circle":
        via, end = (before.position + generator.uniform(-0.08, 0.08, 3) for _ in range(2))
        motion = planner.CircularMotion(via=planner.Pose(via))
        waypoints[-1] = planner.PoseWaypoint(planner.Pose(end, before.rotation), motion=motion)
    elif kind == "axis":
        assert before.rotation is not None  # noqa: S101 - forward kinematics has one
        kept = planner.ToolAxis(tuple(before.rotation[:, 2].tolist()), float(generator.uniform(0.1, 1.0)))
        other = kept_region(before, generator)
        waypoints[-1] = replace(waypoints[-1], motion=planner.FreeMotion(keep=(kept, other)))
    if robot.has_dynamics and generator.random() < SHARE_OF_FORCES and kind != "axis":
        force, moment = generator.uniform(-20.0, 20.0, 3), generator.uniform(-1.0, 1.0, 3)
        exerted = planner.ProcessForce(tuple(force), tuple(moment), "base" if generator.random() < 0.5 else "tool")
        waypoints[-1] = replace(waypoints[-1], process_force=exerted)
    if generator.random() < SHARE_AT_SPEED:
        changes["robot"] = slower_when_fast(robot)
    if plain.scene is not None and generator.random() < SHARE_OF_ZONES:
        clearance, speed = generator.uniform([0.5, 0.5], [1.5, 2.0]).tolist()
        changes["speed_zones"] = [planner.SpeedZone(clearance, speed, ["box"])]
    if generator.random() < SHARE_OF_FOLLOWING and not {"robot", "limits"} & changes.keys():
        errors = generator.uniform(1e-4, 3e-3, robot.dof).tolist()
        followed = zip(robot.joints, errors, strict=True)
        changes["robot"] = robot.derived(limits={joint.name: {"following_error": error} for joint, error in followed})
    if kind in ("line", "circle") and generator.random() < SHARE_OF_CURVES:
        corner = planner.Pose(before.position + generator.uniform(-0.05, 0.05, 3), before.rotation)
        curve = planner.PolylineMotion([corner], blend=0.01) if kind == "line" else planner.SplineMotion([corner])
        waypoints[-1] = replace(waypoints[-1], motion=curve)
    return replace(plain, waypoints=waypoints, **changes)


def kept_region(pose: planner.Pose, generator: np.random.Generator) -> planner.PoseConstraint:
    """Return a constraint of a random kind around a pose of the tool."""
    assert pose.rotation is not None  # noqa: S101 - forward kinematics has one
    normal, point = tuple(generator.normal(size=3)), tuple(pose.position.tolist())
    far = float(generator.uniform(0.3, 1.5))
    kinds = (
        planner.ToolOrientation(tuple(quaternion(pose.rotation).tolist()), far),
        planner.ToolInBox(pose, (far, far, far)),
        planner.ToolInHalfSpace(normal, float(np.dot(normal, point) / np.linalg.norm(normal)) + far / 2.0),
        planner.ToolNearPlane(point, normal, far),
        planner.ToolNearLine(point, normal, far),
    )
    return kinds[int(generator.integers(len(kinds)))]


def slower_when_fast(robot: planner.Robot) -> planner.Robot:
    """Return a robot whose limits of torque, acceleration and jerk fall with the speed of the joints."""
    table = planner.PayloadTable(
        masses=(0.0, 10.0),
        acceleration=(1.0, 0.8),
        speeds=(0.1, 0.5, 0.9),
        acceleration_at_speeds=((1.0, 0.8, 0.5), (0.9, 0.7, 0.4)),
        jerk_at_speeds=((1.0, 0.9, 0.6), (0.9, 0.8, 0.5)),
    )
    speeds, torques, limits = (0.2, 0.5, 0.9), (1.0, 0.8, 0.6), dict[str, Any]()
    for joint, torque, speed in zip(robot.joints, robot.limit("torque"), robot.limit("velocity"), strict=True):
        if np.isfinite([torque, speed]).all():
            shares = tuple(speed * x for x in speeds), tuple(torque * x for x in torques)
            limits[joint.name] = {"torque_curve": planner.TorqueCurve(*shares)}
    return robot.derived(limits=limits, payload_table=table)


def plan_of(number: int) -> planner.Plan:
    """Return one of the random plans of the large run, the same for the same number."""
    attempt = 0
    while True:
        generator = np.random.default_rng([SEED, number, attempt])
        attempt += 1
        robot = planner.load_robot(ROBOTS[generator.integers(len(ROBOTS))])
        backend = BACK_ENDS[generator.integers(len(BACK_ENDS))]
        try:
            asked = problem(robot, generator, int(generator.integers(2, 4)))
            asked = asked if generator.random() < SHARE_OF_SCENES else replace(asked, scene=None)
            plan = planner.plan(varied(asked, generator), backend)
        except planner.PlanningError:
            continue
        if len(plan.trajectory.lengths) <= MOST_PIECES or generator.random() < SHARE_OF_LARGE:
            return plan


def plans(generator: np.random.Generator, number: int) -> Iterator[planner.Plan]:
    """Yield as many random plans as wanted, over all robots and back ends."""
    robots = [planner.load_robot(name) for name in ROBOTS]
    made = tried = 0
    while made < number:
        robot, backend = robots[tried % len(robots)], BACK_ENDS[tried % len(BACK_ENDS)]
        tried += 1
        try:
            plan = planner.plan(problem(robot, generator, int(generator.integers(2, 4))), backend)
        except planner.PlanningError:
            continue
        made += 1
        yield plan
