"""Welding seams at the speed of the process: straight, curved, woven, and in several passes."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from benchmarks.corpus.job import Draft
from benchmarks.corpus.programme import STOP, Programme
from planner.spatial import rotation_x, rotation_y

if TYPE_CHECKING:
    from benchmarks.corpus.arms import Place

SPEEDS = (0.005, 0.001, 0.02, 0.0045, 0.0055, 0.01)
"""m/s of the torch."""

TILTS = (0.0, 0.4, -0.3)
"""Angle of the torch against the direction of welding, rad."""

CIRCLE = np.sqrt(0.5)


def straight(place: Place, variant: int) -> Draft:
    """Plan one line, or several with blends or stops at the corners, with and without an approach."""
    speed, tilt, legs = SPEEDS[variant % 6], TILTS[variant % 3], 1 + variant // 6
    approach = variant % 4 == 3
    torch = rotation_y(tilt)
    programme = Programme(place, place.at(-0.1, -0.1, 0.1 if approach else 0.0, torch))
    corner = (STOP, programme.blend(0.01))[variant % 2]
    if approach:
        programme.line(place.at(-0.1, -0.1, 0.0, torch))
    corners = ((0.05, -0.1), (0.05, 0.05), (-0.1, 0.1))
    for x, y in corners[:legs]:
        programme.line(place.at(x, y, 0.0, torch), speed=speed, transition=corner)
    programme.pass_last(STOP)
    if approach:
        programme.line(place.at(0.0, 0.0, 0.15, torch))
    parameters: dict[str, object] = {"speed": speed, "tilt": tilt, "legs": legs}
    return Draft(programme, parameters, only_seams=not approach)


def arc(place: Place, variant: int) -> Draft:
    """Plan line, tangent arc, line, with blends of 0 to 10 mm; a half circle; a circle in two halves."""
    speed, tilt, shape = SPEEDS[variant % 6], TILTS[variant % 3], variant // 6 % 3
    torch = rotation_x(tilt)
    programme = Programme(place, place.at(-0.1, -0.1, 0.0, torch))
    corner = (programme.blend(0.01), programme.blend(0.005), STOP)[variant % 3]
    center, radius = np.array([0.0, -0.05]), 0.05

    def at(angle: float) -> np.ndarray:
        x, y = center + radius * np.array([np.cos(angle), np.sin(angle)])
        return place.at(x, y, 0.0, torch).position

    if shape == 0:
        programme.line(place.at(0.0, -0.1, 0.0, torch), speed=speed, transition=corner)
        programme.arc(at(-np.pi / 4.0), place.at(0.05, -0.05, 0.0, torch), speed=speed, transition=corner)
        programme.line(place.at(0.05, 0.1, 0.0, torch), speed=speed)
    elif shape == 1:
        programme.line(place.at(0.0, -0.1, 0.0, torch), speed=speed, transition=corner)
        programme.arc(at(0.0), place.at(0.0, 0.0, 0.0, torch), speed=speed, transition=corner)
        programme.line(place.at(-0.1, 0.0, 0.0, torch), speed=speed)
    else:
        programme = Programme(place, place.at(-0.05, -0.05, 0.0, torch))
        programme.arc(at(-np.pi / 2.0), place.at(0.05, -0.05, 0.0, torch), speed=speed, transition=corner)
        programme.arc(at(np.pi / 2.0), place.at(-0.05, -0.05, 0.0, torch), speed=speed)
    parameters: dict[str, object] = {"speed": speed, "tilt": tilt, "shape": ("quarter", "half", "full")[shape]}
    return Draft(programme, parameters, only_seams=True)


def weave(place: Place, variant: int) -> Draft:
    """Return a zigzag across the joint, every tip rounded or stopped at."""
    speed, tips = SPEEDS[variant % 6], (8, 20, 40)[variant // 6 % 3]
    width, pitch = 0.006, 0.15 / tips
    torch = rotation_y(TILTS[variant % 3])
    programme = Programme(place, place.at(-0.1, 0.0, 0.0, torch))
    tip = (programme.blend(0.001), programme.blend(0.003), STOP)[variant % 3]
    for k in range(1, tips + 1):
        side = width * (1 if k % 2 else -1) * (k < tips)
        programme.line(place.at(-0.1 + pitch * k, side, 0.0, torch), speed=speed, transition=tip)
    return Draft(programme, {"speed": speed, "tips": tips}, only_seams=True)


def multi_pass(place: Place, variant: int) -> Draft:
    """Repeat a seam in passes beside and above, the torch tilted from pass to pass, with fast returns."""
    speed, passes = SPEEDS[variant % 6], (2, 3, 5)[variant // 6 % 3]
    programme = Programme(place, place.at(-0.1, -0.1, 0.05))
    lift = programme.blend(0.01) if variant % 2 else STOP
    for k in range(passes):
        side, up = 0.004 * ((k + 1) // 2) * (-1) ** k, 0.003 * k
        torch = rotation_x(0.1 * (-1) ** k * ((k + 1) // 2))
        programme.line(place.at(-0.1, side - 0.1, up, torch))
        programme.line(place.at(0.1, side - 0.1, up, torch), speed=speed)
        programme.line(place.at(0.1, side - 0.1, up + 0.05, torch), transition=lift)
        programme.line(place.at(-0.1, side - 0.1, up + 0.05, torch), transition=lift)
    return Draft(programme, {"speed": speed, "passes": passes})


FAMILIES = {"seam_straight": straight, "seam_arc": arc, "seam_weave": weave, "seam_multi_pass": multi_pass}
