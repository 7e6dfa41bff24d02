"""Reads G-code: straight moves and arcs in the XY plane."""

from __future__ import annotations

import math
import re
from collections import defaultdict

import numpy as np

from planner.path_files.steps import SHORTEST_STEP, Step, ToolPath, arc_steps
from planner.path_files.texts import METRES, MOST_STEPS, listed_lines, parse_number, refused
from planner.spatial import FloatArray, Pose

COMMENT = re.compile(r"\([^()]*\)|;.*")
"""Text between brackets, and the rest of a line after a semicolon."""

WORD = re.compile(r"\s*([A-Za-z])\s*([+-]?(?:\d+\.?\d*|\.\d+))(?![eE])", re.ASCII)
"""A letter and a number; an exponent would look like an extruder position."""

NUMBERS = "NO"
"""Letters of the numbers of lines and programs."""

AXES = "XYZ"
"""Letters of the coordinates."""

MOTIONS = {"G0", "G1", "G2", "G3"}
"""Codes that move the tool; each stays in force."""

UNITS = {"G20": METRES["inch"], "G21": METRES["mm"]}
"""The unit of length by code, m."""

WITHOUT_EFFECT = {"G17", "G40", "G49", "G54", "G61", "G64", "G80", "G91.1", "G94"}
"""Codes of the state that this reader assumes, and of path modes, which `blend` replaces."""

LEFT_OUT = {
    "G4": "dwells",
    "G43": "tool lengths: the `tool` of the request has them",
    "M": "M codes, such as spindle and coolant",
    "S": "spindle speeds",
    "T": "tool numbers",
    "E": "extruder positions",
}
"""Descriptions of codes and letters that do not move the tool."""

RADIUS_TOLERANCE = 2e-3
"""Largest difference between the radii at the ends of an arc, as a share of the radius."""

RADIUS_ROUNDING = 2e-5
"""Largest such difference from the rounding of coordinates, m."""


def read_gcode(text: str, unit: float, rotation: FloatArray) -> ToolPath:
    """Read a G-code program.

    Args:
        text: The program.
        unit: The unit of length, in m, until a G20 or G21.
        rotation: (3, 3): the orientation of the tool.

    Raises:
        InvalidProblem: The first line that cannot be read.
    """
    program = _Program(unit, rotation)
    for number, line in enumerate(text.splitlines(), 1):
        try:
            program.run(number, line)
        except ValueError as error:
            raise refused(f"line {number}: {error}") from None
        if program.has_ended:
            break
        if len(program.path.steps) > MOST_STEPS:
            raise refused(f"line {number}: a program must have at most {MOST_STEPS} moves. Split the file.")
    return program.finish()


class _Program:
    """The state of a program."""

    def __init__(self, unit: float, rotation: FloatArray) -> None:
        self.unit, self.rotation = unit, rotation
        self.has_ended, self.is_absolute = False, True
        self.motion: str | None = None
        self.speed: float | None = None
        self.position = np.full(3, np.nan)
        self.path = ToolPath()
        self.left_out: dict[str, list[int]] = defaultdict(list)
        self.without_feed: list[int] = []

    def run(self, number: int, line: str) -> None:
        """Run a line.

        Raises:
            ValueError: It cannot be read.
        """
        codes, words = self.words(number, line)
        for code in codes:
            self.set_mode(number, code)
        if "F" in words:
            self.speed = parse_number(words.pop("F"), "F", self.unit) / 60.0
            if self.speed <= 0.0:
                raise ValueError("`F` must be greater than 0.")
        if "G4" in codes:
            words = {letter: value for letter, value in words.items() if letter not in "PX"}
        if "G43" in codes:
            words.pop("H", None)
        if set(words) & set("XYZIJKR"):
            self.move(number, words)
        elif words:
            raise ValueError(f"`{min(words)}` must not be here: no code of the line uses it. Delete it.")

    def words(self, number: int, line: str) -> tuple[list[str], dict[str, str]]:
        """Return the codes of a line, and its other words by letter."""
        content = COMMENT.sub(" ", line).strip().removeprefix("/").strip()
        codes: list[str] = []
        words: dict[str, str] = {}
        at = 0
        while at < len(content) and content != "%":
            if (found := WORD.match(content, at)) is None:
                rest = content[at : at + 20].strip()
                raise ValueError(
                    f"must have words such as G1 or X10.5; got {rest!r}. Write plain numbers: no expressions, "
                    "parameters or subprograms."
                )
            at = found.end()
            letter, value = found[1].upper(), found[2]
            if letter == "G":
                codes.append(f"G{float(value):g}")
            elif letter == "M":
                self.stop_or_note(number, f"{float(value):g}")
            elif letter in LEFT_OUT:
                self.left_out[letter].append(number)
            elif letter in words:
                raise ValueError(f"`{letter}` must stand once in a line; got it twice.")
            elif letter not in NUMBERS:
                words[letter] = value
        if len(MOTIONS.intersection(codes)) > 1:
            raise ValueError(f"a line must have one motion; got {' and '.join(codes)}.")
        return codes, words

    def stop_or_note(self, number: int, code: str) -> None:
        """Note an M code, or end the program."""
        if code in ("98", "99"):
            raise ValueError(f"`M{code}` is not supported: subprograms. Write their moves here.")
        if code in ("2", "30"):
            self.has_ended = True
        else:
            self.left_out["M"].append(number)

    def set_mode(self, number: int, code: str) -> None:
        """Set the motion, the unit or the kind of coordinates."""
        if code in MOTIONS:
            self.motion = code
        elif code in UNITS:
            self.unit = UNITS[code]
        elif code in ("G90", "G91"):
            self.is_absolute = code == "G90"
        elif code in LEFT_OUT:
            self.left_out[code].append(number)
        elif code not in WITHOUT_EFFECT:
            raise ValueError(
                f"`{code}` is not supported. Use G0, G1, G2, G3, G17, G20, G21, G90, G91 and F, "
                "to which most post-processors can be set."
            )

    def move(self, number: int, words: dict[str, str]) -> None:
        """Move the tool.

        Raises:
            ValueError: A word is missing, or too many.
        """
        if self.motion is None:
            raise ValueError("coordinates need a motion. Write G0 or G1 before them.")
        is_arc = self.motion in ("G2", "G3")
        if wrong := set(words) - set("XYZIJR" if is_arc else AXES):
            raise ValueError(f"`{min(wrong)}` must not be in a {self.motion} in the XY plane. Delete it.")
        end = self.position.copy()
        for axis, letter in enumerate(AXES):
            if letter in words:
                value = parse_number(words[letter], letter, self.unit)
                end[axis] = value if self.is_absolute else end[axis] + value
                if not self.is_absolute and np.isnan(end[axis]):
                    raise ValueError(f"`{letter}` must be absolute (G90) at its first use: the start is not known.")
        if np.isnan(self.position).any():
            self.begin(number, end)
        elif is_arc:
            self.arc(number, words, end)
        else:
            speed = self.feed(number) if self.motion == "G1" else None
            self.path.steps.append(Step(Pose(end, self.rotation), None, speed))
        self.position = end

    def begin(self, number: int, end: FloatArray) -> None:
        """Move to the start, which has all coordinates."""
        missing = [letter for letter, value in zip(AXES, end, strict=True) if np.isnan(value)]
        if self.motion != "G0":
            unknown = [letter for letter, value in zip(AXES, self.position, strict=True) if np.isnan(value)]
            raise ValueError(
                f"{self.motion} needs a start: {' and '.join(unknown)} had no value before. "
                "Begin with G0 and X, Y and Z."
            )
        if missing:
            self.path.notes.append(f"line {number}: no waypoint, since {' and '.join(missing)} had no value yet")
        else:
            self.path.start = Pose(end, self.rotation)

    def feed(self, number: int) -> float | None:
        """Return the speed in force, m/s, and note if there is none."""
        if self.speed is None:
            self.without_feed.append(number)
        return self.speed

    def arc(self, number: int, words: dict[str, str], end: FloatArray) -> None:
        """Move along an arc.

        Raises:
            ValueError: It is none.
        """
        begin = self.position
        if abs(end[2] - begin[2]) > SHORTEST_STEP:
            raise ValueError("an arc must keep its Z: helical arcs are not supported. Export them as lines.")
        clockwise = self.motion == "G2"
        centre = self.centre(words, begin, end, clockwise)
        spokes = [point[:2] - centre for point in (begin, end)]
        radii = [float(np.hypot(*spoke)) for spoke in spokes]
        if abs(radii[0] - radii[1]) > RADIUS_ROUNDING + RADIUS_TOLERANCE * radii[0]:
            raise ValueError(
                f"the start and the end of an arc must have one distance from its centre; "
                f"got {radii[0] / self.unit:.6g} and {radii[1] / self.unit:.6g}. Check I and J."
            )
        if radii[0] < SHORTEST_STEP:
            raise ValueError("an arc must have a radius greater than 0. Check I and J.")
        first, last = (math.atan2(spoke[1], spoke[0]) for spoke in spokes)
        angle = (first - last if clockwise else last - first) % (2.0 * math.pi)
        if np.linalg.norm(end - begin) < SHORTEST_STEP:
            angle = 2.0 * math.pi
        turn = -angle if clockwise else angle

        def point(share: float) -> FloatArray:
            radius, at = radii[0] + share * (radii[1] - radii[0]), first + share * turn
            return np.array([*(centre + radius * np.array([math.cos(at), math.sin(at)])), begin[2]])

        self.path.steps += arc_steps(point, angle, end, self.rotation, self.feed(number))

    def centre(self, words: dict[str, str], begin: FloatArray, end: FloatArray, clockwise: bool) -> FloatArray:
        """Return the centre of an arc (2,), by its I and J or by its R."""
        if "R" not in words:
            if not set(words) & set("IJ"):
                raise ValueError(f"{self.motion} needs a centre, I and J, or a radius, R.")
            offsets = [parse_number(words.get(letter, "0"), letter, self.unit) for letter in "IJ"]
            centre: FloatArray = begin[:2] + np.array(offsets)
            return centre
        if set(words) & set("IJ"):
            raise ValueError("an arc must have I and J, or R, not both.")
        radius = parse_number(words["R"], "R", self.unit)
        chord = end[:2] - begin[:2]
        length = float(np.hypot(*chord))
        if length < SHORTEST_STEP:
            raise ValueError("a full circle must have I and J: R leaves its centre open.")
        if length > 2.0 * (abs(radius) * (1.0 + RADIUS_TOLERANCE) + RADIUS_ROUNDING):
            got = f"{abs(radius) / self.unit:.6g} for a distance of {length / self.unit:.6g}"
            raise ValueError(f"`R` must be at least half of the distance from start to end; got {got}.")
        height = math.sqrt(max(radius**2 - 0.25 * length**2, 0.0))
        is_left = clockwise != (radius > 0.0)
        left = np.array([-chord[1], chord[0]]) / length
        middle: FloatArray = 0.5 * (begin + end)[:2]
        return middle + (height if is_left else -height) * left

    def finish(self) -> ToolPath:
        """Return the path, with notes."""
        if self.path.start is None:
            raise refused("must have a start: a G0 with X, Y and Z.")
        if self.without_feed:
            self.path.notes.append(
                f"{listed_lines(self.without_feed)}: no feed F, so no limit on the speed of the tool"
            )
        for code, lines in self.left_out.items():
            self.path.notes.append(f"{listed_lines(lines)}: left out {LEFT_OUT[code]}")
        return self.path
