"""Jobs that carry things about: palletising, pick and place, bin picking, screwdriving, machine tending."""

from __future__ import annotations

from itertools import product

import numpy as np

from benchmarks.corpus.arms import DOWN, Place
from benchmarks.corpus.job import Draft
from benchmarks.corpus.programme import STOP, Programme, Untraceable
from benchmarks.corpus.tracing import on_line, trace
from planner.limits import Limits
from planner.problems.moves import CartesianMove
from planner.problems.problem import LinearMotion, RelativeWaypoint
from planner.spatial import rotation_x, rotation_y, rotation_z

PALLETS = ((2, 2, 1), (2, 1, 2), (3, 2, 1), (1, 3, 2), (2, 1, 3), (3, 1, 1))
"""Columns, rows and layers."""


def palletising(place: Place, variant: int) -> Draft:
    """Return a palletising job from a conveyor to slots and back, with every second layer turned by a quarter."""
    columns, rows, layers = PALLETS[variant % 6]
    speed = (1.0, 0.5, 0.2)[variant % 3]
    quarter = 0.2 if place.robot.id == "date_sorting_arm" else DOWN  # its wrist does not turn about the vertical
    programme, share = Programme(place), 0.5 * (variant % 2)
    passing = (STOP, programme.blend(0.03), programme.blend(0.08))[variant // 6 % 3]
    for layer, row, column in product(range(layers), range(rows), range(columns)):
        slot = (0.12 * column, 0.1 + 0.12 * row, 0.08 * layer - 0.2, layer % 2, 0.0)
        for x, y, z, yaw, taken in ((0.0, -0.25, -0.1, 0.0, share), slot):
            turn = rotation_z(quarter * yaw)
            programme.to(place.at(x, y, z + 0.12, turn), transition=passing)
            programme.line(place.at(x, y, z, turn), transition=STOP)
            programme.grip(taken)
            programme.line(place.at(x, y, z + 0.12, turn), transition=passing)
    programme.joints(place.position)
    limits = Limits(velocity_scale=speed, acceleration_scale=speed)
    return Draft(programme, {"slots": PALLETS[variant % 6], "speed": speed, "share": share}, limits)


def pick_and_place(place: Place, variant: int) -> Draft:
    """Return one part from here to there, the gripper closing and opening, by joint motions or by lines only."""
    lines, dwell = variant % 2 == 1, (0.2, 0.0, 0.5)[variant % 3]
    far, share = (0.2, 0.35, 0.05)[variant // 2 % 3], (0.0, 0.5, 1.0)[variant % 3]
    programme = Programme(place)
    passing = (programme.blend(0.04), STOP)[variant // 6 % 2]
    for y, dz, taken in ((-far, -0.1, share), (far, -0.15 + 0.05 * (variant % 4), 0.0)):
        move = programme.line if lines else programme.to
        move(place.at(0.0, y, dz + 0.15), transition=passing)
        programme.line(place.at(0.0, y, dz), speed=0.25, dwell=dwell)
        programme.grip(taken)
        programme.line(place.at(0.0, y, dz + 0.15), transition=passing)
    programme.joints(place.position)
    return Draft(programme, {"lines": lines, "dwell": dwell, "far": far, "share": share})


def bin_picking(place: Place, variant: int) -> Draft:
    """Return parts that lie tilted in a bin: in along the tool's axis, out straight up, to a drop point."""
    rng = np.random.default_rng(variant)
    tilts = rng.integers(-3, 4, (4, 2)) * 0.1
    programme = Programme(place)
    drop = place.at(0.0, 0.3, 0.05)
    for corner, (a, b) in enumerate(tilts):
        turn = rotation_x(a) @ rotation_y(b)
        x, y = 0.1 * (corner % 2) - 0.05, 0.1 * (corner // 2) - 0.15
        programme.to(place.at(x, y, 0.05, turn), transition=programme.blend(0.02) if variant % 2 else STOP)
        _approach(programme, 0.12 * place.size)
        programme.grip(0.3 * (variant % 3))
        programme.line(place.at(x, y, 0.15, turn), transition=programme.blend(0.05) if variant % 2 else STOP)
        programme.to(drop, dwell=0.1)
        programme.grip(0.0)
    return Draft(programme, {"tilts": tilts.tolist(), "share": 0.3 * (variant % 3)})


def _approach(programme: Programme, depth: float) -> None:
    """Move along the tool's own axis; straight down where only the position counts."""
    pose = programme.pose
    if pose.rotation is None:
        there = type(pose)(pose.position - [0.0, 0.0, depth])
        programme.line(there)
        return
    there = type(pose)(pose.position + depth * pose.rotation[:, 2], pose.rotation)
    programme.line(there)
    move = CartesianMove((0.0, 0.0, depth))
    programme.waypoints[-1] = RelativeWaypoint(frame="tool", move=move, motion=LinearMotion())


def screwdriving(place: Place, variant: int) -> Draft:
    """Drive screws into rows of holes: above, slowly down, wait, up; the tool turns with the screw or not."""
    columns, rows = ((4, 1), (3, 2), (2, 3))[variant % 3]
    depth, slow, yaw = (0.01, 0.03, 0.002)[variant // 3 % 3], (0.01, 0.05)[variant % 2], 0.5 * (variant % 2)
    programme = Programme(place, place.at(0.0, 0.0, 0.05))
    for row, column in product(range(rows), range(columns)):
        x, y = 0.06 * column - 0.1, 0.06 * row - 0.05
        programme.to(place.at(x, y, 0.0))
        programme.line(place.at(x, y, -depth, rotation_z(yaw)), speed=slow * place.size, dwell=0.8)
        programme.line(place.at(x, y, 0.0))
    programme.to(place.at(0.0, 0.0, 0.05))
    return Draft(programme, {"depth": depth, "speed": slow, "yaw": yaw})


STRETCHED = {
    "kuka_kr16_l6_2": (0.3, -1.2, 1.4, 0.0, 0.0, 0.0),
    "ngv_refuelling_arm": (0.3, -0.4, 1.0, 0.0, 0.0, 0.0),
    "date_sorting_arm": (0.3, 0.2, 0.2, 0.0, 0.0, 0.0),
    "three_dof_arm": (0.3, -0.9, -1.2),
    "ur5": (0.3, -1.2, 1.4, -0.2, 0.0, 0.0),
    "panda": (0.3, -0.4, 0.0, -1.6, 0.0, 1.2, 0.0),
}
"""Home positions with the wrist stretched, where an arm has one."""

DIRECTIONS = ((0.0, 0.0, -1.0), (0.0, 0.0, 1.0), (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (-0.6, 0.0, -0.8), (-0.6, 0.0, 0.8))
"""Up, down, in, out and aslant: they keep a stretched wrist in its plane."""


def machine_tending(place: Place, variant: int) -> Draft:
    """Return out of a stretched home position in a straight line, into the machine, out again, and straight home."""
    home = np.array(STRETCHED[place.robot.id])
    home[0] += (0.0, -0.3, 0.9)[variant // 6 % 3]
    programme = Programme(place, home)
    start = programme.pose
    radial = start.position * [1.0, 1.0, 0.0] / np.hypot(*start.position[:2])
    direction = np.column_stack([radial, np.cross([0.0, 0.0, 1.0], radial), [0.0, 0.0, 1.0]]) @ DIRECTIONS[variant % 6]
    away = type(start)(start.position + 0.1 * place.size * direction, start.rotation)
    if trace(place.robot, on_line(start, away, 0.002 * place.size), home) is None:
        raise Untraceable
    programme.line(away)
    if variant % 2:
        programme.joints(place.position)
        programme.line(place.at(0.1, 0.1, 0.0), speed=0.5)
        programme.line(place.at(-0.05, 0.1, 0.0))
        programme.joints(home)
    else:
        programme.line(start)
    return Draft(programme, {"home": home.tolist(), "direction": DIRECTIONS[variant % 6]})


FAMILIES = {
    "palletising": palletising,
    "pick_and_place": pick_and_place,
    "bin_picking": bin_picking,
    "screwdriving": screwdriving,
    "machine_tending": machine_tending,
}
