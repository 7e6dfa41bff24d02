"""Scenes of seven kinds, like MotionBenchMaker's, sized by the reach of an arm, and problems in them."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.kinematics.forward import tool_pose
from planner.kinematics.inverse import all_solutions
from planner.scene import CollisionChecker, Scene, SceneObject, clearances
from planner.shapes import Box, Cylinder
from planner.spatial import Pose, rotation_from_rpy
from planner.trajectories.polynomials import PiecewisePolynomial

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.robots import Robot
    from planner.shapes import Shape
    from planner.spatial import FloatArray

ROOM = 0.005
"""Clearance of an arm at the start and at the goal, m: enough for the checks of every planner."""

MOST_DRAWS = 40
"""The most poses that are drawn for one end of a problem before another scene is made."""

MOST_LAYOUTS = 50
"""The most scenes that are made for one problem."""

LOW_SHOULDER = 0.15
"""Height of the shoulder that the layouts are made for, as a share of the reach: they are lifted with it."""

FORWARD = (0.0, np.pi / 2.0, 0.0)
"""Roll, pitch and yaw of a tool that points away from the base, rad."""

DOWN = (np.pi, 0.0, 0.0)
"""Roll, pitch and yaw of a tool that points down, rad."""

UPRIGHT_TILT = 0.05
"""The largest change of roll or pitch at the ends of problems with an upright tool, rad."""


class Place(NamedTuple):
    """The region of the tool at an end of a problem.

    Attributes:
        low: (3,), m: a corner of a box.
        high: (3,), m: the opposite one.
        rpy: Roll, pitch and yaw of the tool there, rad, before some of it is changed at random.
        tilt: The largest change of each of them, rad.
    """

    low: Sequence[float]
    high: Sequence[float]
    rpy: tuple[float, float, float]
    tilt: float = 0.3


class Layout(NamedTuple):
    """Shapes with their positions, and where the tool is to go."""

    things: list[tuple[Shape, Sequence[float]]]
    places: list[Place]


class Problem(NamedTuple):
    """A free motion to be planned.

    Attributes:
        kind: Of the scene.
        number: Of the problem among the problems of its kind.
        scene: The obstacles.
        start: (joints,), rad or m.
        goal: (joints,), rad or m.
    """

    kind: str
    number: int
    scene: Scene
    start: FloatArray
    goal: FloatArray


def bookshelf(reach: float, rng: np.random.Generator, width: float = 0.9, shelves: int = 4) -> Layout:
    """Return shelves in front of the arm, with things on them; from one opening to another."""
    front, depth, thick = reach * rng.uniform(0.6, 0.7), 0.35 * reach, 0.025 * reach
    half, gap = width * reach / 2.0, 0.4 * reach
    bottom = rng.uniform(-0.2, 0.0) * reach
    middle = front + depth / 2.0
    height = shelves * gap
    things: list[tuple[Shape, Sequence[float]]] = [
        (Box([depth, 2.0 * half, thick]), [middle, 0.0, bottom + k * gap]) for k in range(shelves + 1)
    ]
    uprights = (-half, 0.0, half) if width > 0.8 else (-half, half)
    things += [(Box([depth, thick, height]), [middle, side, bottom + height / 2.0]) for side in uprights]
    things.append((Box([thick, 2.0 * half, height]), [front + depth, 0.0, bottom + height / 2.0]))
    places = []
    for k in range(shelves):
        low, high = bottom + k * gap, bottom + (k + 1) * gap
        for a, b in ((-half, 0.0), (0.0, half)) if width > 0.8 else ((-half, half),):
            inset = 0.25 * (b - a)
            box = [front + 0.1 * depth, a + inset, low + 0.3 * gap], [front + 0.5 * depth, b - inset, low + 0.7 * gap]
            places.append(Place(*box, FORWARD))
            if rng.random() < 0.5:
                size = rng.uniform(0.15, 0.3) * gap
                where = [front + 0.75 * depth, rng.uniform(a + size, b - size), low + thick / 2.0 + size]
                things.append((Cylinder(0.4 * size, 2.0 * size), where))
        if high > 0.9 * reach:
            break
    return Layout(things, places)


def tall_bookshelf(reach: float, rng: np.random.Generator) -> Layout:
    """Return a wide shelf with an upright in the middle."""
    return bookshelf(reach, rng)


def small_bookshelf(reach: float, rng: np.random.Generator) -> Layout:
    """Return a narrow shelf."""
    return bookshelf(reach, rng, width=0.6, shelves=3)


def box(reach: float, rng: np.random.Generator) -> Layout:
    """Return an open box on the floor; into it and out of it."""
    x, y = rng.uniform(0.45, 0.55) * reach, rng.uniform(-0.35, 0.35) * reach
    side, height, thick = rng.uniform(0.45, 0.55) * reach, rng.uniform(0.3, 0.4) * reach, 0.03 * reach
    ground = rng.uniform(-0.3, -0.2) * reach
    things: list[tuple[Shape, Sequence[float]]] = [(Box([side, side, thick]), [x, y, ground])]
    for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)):
        size = [thick, side, height] if a else [side, thick, height]
        things.append((Box(size), [x + a * side / 2.0, y + b * side / 2.0, ground + height / 2.0]))
    inside = Place(
        [x - 0.2 * side, y - 0.2 * side, ground + 0.3 * height],
        [x + 0.2 * side, y + 0.2 * side, ground + 0.7 * height],
        DOWN,
    )
    outside = Place([-0.1 * reach, -0.7 * reach, 0.0], [0.5 * reach, 0.7 * reach, 0.3 * reach], DOWN)
    return Layout(things, [inside, outside])


def cage(reach: float, rng: np.random.Generator) -> Layout:
    """Build a cage of bars with a plate in it; from outside or above through its bars, and out again."""
    x, y = rng.uniform(0.5, 0.6) * reach, rng.uniform(-0.2, 0.2) * reach
    side, thick, ground = 0.6 * reach, 0.03 * reach, rng.uniform(-0.25, -0.05) * reach
    corners = [(x + a * side / 2.0, y + b * side / 2.0) for a in (-1, 1) for b in (-1, 1)]
    things: list[tuple[Shape, Sequence[float]]] = [
        (Box([thick, thick, side]), [*corner, ground + side / 2.0]) for corner in corners
    ]
    for level in (0.0, 1.0):
        for a, b in ((1, 0), (-1, 0), (0, 1), (0, -1)):
            size = [thick, side, thick] if a else [side, thick, thick]
            things.append((Box(size), [x + a * side / 2.0, y + b * side / 2.0, ground + level * side]))
    things.append((Box([0.5 * side, 0.5 * side, thick]), [x, y, ground]))
    inside = Place(
        [x - 0.2 * side, y - 0.25 * side, ground + 0.3 * side],
        [x + 0.1 * side, y + 0.25 * side, ground + 0.7 * side],
        FORWARD,
        0.6,
    )
    outside = Place(
        [0.1 * reach, -0.8 * reach, ground + 0.2 * side], [0.4 * reach, -0.5 * reach, ground + side], FORWARD, 1.0
    )
    return Layout(things, [inside, outside])


def table_under(reach: float, rng: np.random.Generator) -> Layout:
    """Return a table with legs, reached into from above and from below."""
    x, top = rng.uniform(0.55, 0.65) * reach, rng.uniform(0.2, 0.35) * reach
    length, width, thick = 0.6 * reach, 1.2 * reach, 0.03 * reach
    things: list[tuple[Shape, Sequence[float]]] = [(Box([length, width, thick]), [x, 0.0, top])]
    for a in (-1, 1):
        for b in (-1, 1):
            leg = Box([2 * thick, 2 * thick, top + 0.4 * reach])
            things.append(
                (leg, [x + a * (length / 2 - thick), b * (width / 2 - thick), (top - 0.4 * reach) / 2.0 - thick])
            )
    above = Place(
        [x - 0.2 * reach, -0.4 * reach, top + 0.1 * reach],
        [x + 0.1 * reach, 0.4 * reach, top + 0.3 * reach],
        FORWARD,
        0.8,
    )
    below = Place([x - 0.2 * reach, -0.4 * reach, top - 0.4 * reach], [x, 0.4 * reach, top - 0.2 * reach], FORWARD, 0.5)
    return Layout(things, [above, below])


def table_pick(reach: float, rng: np.random.Generator) -> Layout:
    """Return a table with things standing close together; from between some of them to between others."""
    x, top = 0.55 * reach, rng.uniform(-0.05, 0.05) * reach
    things: list[tuple[Shape, Sequence[float]]] = [
        (Box([0.7 * reach, 1.4 * reach, 0.03 * reach]), [x, 0.0, top - 0.015 * reach])
    ]
    for _ in range(12):
        height, radius = rng.uniform(0.15, 0.4) * reach, rng.uniform(0.02, 0.05) * reach
        where = [rng.uniform(x - 0.3 * reach, x + 0.3 * reach), rng.uniform(-0.6, 0.6) * reach, top + height / 2.0]
        things.append((Cylinder(radius, height), where))
    low, high = [x - 0.2 * reach, -0.6 * reach, top + 0.08 * reach], [x + 0.15 * reach, 0.6 * reach, top + 0.15 * reach]
    return Layout(things, [Place(low, high, DOWN), Place(low, high, DOWN)])


def pillars(reach: float, rng: np.random.Generator) -> Layout:
    """Build tall posts around the arm; from one gap between them through others to a third."""
    things: list[tuple[Shape, Sequence[float]]] = []
    for k in range(6):
        angle, away = np.pi / 3.0 * (k + rng.uniform(-0.2, 0.2)), rng.uniform(0.5, 0.6) * reach
        things.append((Cylinder(0.04 * reach, 2.0 * reach), [away * np.cos(angle), away * np.sin(angle), 0.3 * reach]))
    places = []
    for k in range(6):
        angle = np.pi / 3.0 * (k + 0.5)
        x, y = 0.7 * reach * np.cos(angle), 0.7 * reach * np.sin(angle)
        reached = [x - 0.05 * reach, y - 0.05 * reach, 0.0], [x + 0.05 * reach, y + 0.05 * reach, 0.4 * reach]
        places.append(Place(*reached, (0.0, np.pi / 2.0, angle), 0.4))
    return Layout(things, places)


KINDS: dict[str, Callable[[float, np.random.Generator], Layout]] = {
    "tall_bookshelf": tall_bookshelf,
    "small_bookshelf": small_bookshelf,
    "box": box,
    "cage": cage,
    "table_under": table_under,
    "table_pick": table_pick,
    "pillars": pillars,
}
"""The layouts by their names."""


def problem(robot: Robot, kind: str, number: int, *, is_upright: bool = False) -> Problem:
    """Make a problem: the same one for the same arm, kind and number.

    Args:
        robot: The arm.
        kind: Of the scene.
        number: Of the problem.
        is_upright: Whether the axis of the tool that points down, see `axis_down`, does so at both ends.
    """
    rng = np.random.default_rng([list(KINDS).index(kind), number])
    reach, shoulder = _size(robot)
    up = np.array([0.0, 0.0, shoulder - LOW_SHOULDER * reach])
    for _ in range(MOST_LAYOUTS):
        layout = KINDS[kind](reach, rng)
        scene = Scene(
            [SceneObject(f"thing_{k}", [shape], Pose(at + up)) for k, (shape, at) in enumerate(layout.things)]
        )
        checker = CollisionChecker(robot, Scene(scene.objects, margin=ROOM), self_collision=True)
        first, second = rng.choice(len(layout.places), 2, replace=False)
        ends = [layout.places[first], layout.places[second]]
        if is_upright:
            ends = [end._replace(tilt=UPRIGHT_TILT) for end in ends]
        start = _position(robot, checker, ends[0], up, rng)
        goal = None if start is None else _position(robot, checker, ends[1], up, rng)
        if start is not None and goal is not None:
            return Problem(kind, number, scene, start, goal)
    raise RuntimeError(f"{robot.id} finds no room in {kind} {number}")


def axis_down(kind: str) -> tuple[float, float, float]:
    """Return the axis of the tool that points down in upright problems: z, or x if z is level."""
    place = KINDS[kind](1.0, np.random.default_rng(0)).places[0]
    return (0.0, 0.0, 1.0) if place.rpy == DOWN else (1.0, 0.0, 0.0)


def _size(robot: Robot) -> tuple[float, float]:
    """Return the largest distance of the tool from the base in random joint positions, and joint 2's height, m."""
    rng = np.random.default_rng(0)
    lower, upper = np.maximum(robot.limit("lower"), -np.pi), np.minimum(robot.limit("upper"), np.pi)
    far = [np.linalg.norm(tool_pose(robot, q).position[:2]) for q in rng.uniform(lower, upper, (500, robot.dof))]
    return float(np.quantile(far, 0.99)), float(
        sum(p.translation[2] for p in robot.model.jointPlacements.tolist()[1:3])
    )


def _position(
    robot: Robot, checker: CollisionChecker, place: Place, up: FloatArray, rng: np.random.Generator
) -> FloatArray | None:
    """Draw a collision-free joint position with the tool at a place; None: none was found."""
    for _ in range(MOST_DRAWS):
        position = rng.uniform(place.low, place.high) + up
        rpy = np.array(place.rpy) + rng.uniform(-place.tilt, place.tilt, 3)
        if place.rpy == DOWN:
            rpy[2] = rng.uniform(-np.pi, np.pi)
        solutions = all_solutions(robot, Pose(position, rotation_from_rpy(*rpy)))
        for k in rng.permutation(len(solutions)).tolist():
            still = PiecewisePolynomial(np.ones(1), solutions[k][None, :, None])
            if clearances(checker, still).is_proved:
                return np.asarray(solutions[k], dtype=np.float64)
    return None
