"""G-code as waypoints: random programs beside their curves, planned paths beside circles, refused lines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from planner import (
    BlendTransition,
    CircularMotion,
    InvalidProblem,
    LinearMotion,
    PolylineMotion,
    PoseWaypoint,
    StopTransition,
    ThroughTransition,
    read_path,
)
from planner.spatial import FloatArray
from tests.planner.path_files.tool_paths import (
    SPACING,
    TABLE,
    arc,
    assert_same_curve,
    curve_of,
    line,
    planned,
    tool_points,
)
from tests.sizes import SIZE

START = "G21 G90\nG0 X0 Y0 Z0\n"


def waypoints_of(folder: Path, program: str, **options: object) -> list[PoseWaypoint]:
    file = folder / "path.ngc"
    file.write_text(program)
    found = read_path(file, **options).waypoints  # type: ignore[arg-type]
    return [waypoint for waypoint in found if isinstance(waypoint, PoseWaypoint)]


class Writer:
    """Writes a random program, and keeps its curve."""

    def __init__(self, generator: np.random.Generator) -> None:
        self.random = generator
        self.unit = 0.0254 if generator.random() < 0.5 else 1e-3
        self.is_absolute, self.motion = True, "G0"
        self.at = generator.uniform(-0.05, 0.05, 3).round(6)
        self.lines = [f"G{20 if self.unit == 0.0254 else 21} G17 G90", f"G0 {self.words(self.at)}"]
        self.curve: list[FloatArray] = []

    def number(self, value: float) -> str:
        return f"{value / self.unit:.9f}"

    def words(self, end: FloatArray) -> str:
        start = np.zeros(3) if self.is_absolute else self.at
        return " ".join(f"{axis}{self.number(value)}" for axis, value in zip("XYZ", end - start, strict=True))

    def write(self, motion: str, words: str) -> None:
        """Write a line with a number, a comment, modal words and small letters at random."""
        code = "" if motion == self.motion and self.random.random() < 0.5 else motion
        self.motion = motion
        text = f"{code} {words}"
        if self.random.random() < 0.3:
            text = f"N{len(self.lines)} {text} (to G3 X1) ; and more"
        if self.random.random() < 0.3:
            text = text.lower()
        if self.random.random() < 0.3:
            text = text.replace(" ", "")
        self.lines.append(text)

    def step(self) -> None:
        if self.random.random() < 0.2:
            self.is_absolute = not self.is_absolute
            self.lines.append("G90" if self.is_absolute else "G91")
        kind = self.random.choice(["line", "centre", "radius", "circle"])
        if kind == "line":
            end = self.random.uniform(-0.05, 0.05, 3)
            self.write(str(self.random.choice(["G0", "G1"])), self.words(end))
            self.curve.append(line(self.at, end))
            self.at = end
            return
        radius, first = self.random.uniform(0.002, 0.03), self.random.uniform(-np.pi, np.pi)
        turn = 2.0 * np.pi if kind == "circle" else self.random.uniform(0.2, 6.0)
        turn *= self.random.choice([-1.0, 1.0])
        centre = self.at - radius * np.array([np.cos(first), np.sin(first), 0.0])
        end = centre + radius * np.array([np.cos(first + turn), np.sin(first + turn), 0.0])
        offset = centre - self.at
        how = f"I{self.number(offset[0])} J{self.number(offset[1])}"
        if kind == "radius":
            how = f"R{self.number(radius if abs(turn) < np.pi else -radius)}"
        target = "" if kind == "circle" else f"{self.words(end)} "
        self.write("G2" if turn < 0.0 else "G3", target + how)
        self.curve.append(arc(centre, radius, first, turn))
        self.at = end


@pytest.mark.sized
def test_random_programs_have_the_curve_that_they_were_written_from(tmp_path: Path) -> None:
    file = tmp_path / "path.nc"
    for seed in range(SIZE.examples):
        writer = Writer(np.random.default_rng(seed))
        for _ in range(8):
            writer.step()
        file.write_text("\n".join([*writer.lines, "M30", "G1 X9999"]))
        read = read_path(file)
        assert_same_curve(curve_of(read), np.concatenate(writer.curve), 1e-6 + SPACING)
        last = read.waypoints[-1]
        assert isinstance(last, PoseWaypoint)
        np.testing.assert_allclose(last.pose.position, writer.at, atol=1e-8)


@pytest.mark.parametrize("blend", [None, 0.001])
def test_the_planned_tool_path_is_the_programs_curve(tmp_path: Path, blend: float | None) -> None:
    """A slot, whose lines and half circles join without a corner, then a full circle after a corner."""
    file = tmp_path / "slot.ngc"
    file.write_text(
        "G21\nG0 X0 Y0 Z0\nG1 X60 F3000\nG3 Y30 J15\nG1 X0\nG3 Y0 R15\nG1 Y-20\nG2 J10\nG1 X20\n",
    )
    read = read_path(file, frame=TABLE, blend=blend)
    made = planned(read)
    assert made.certificate.satisfied
    mm = 1e-3
    curve = np.concatenate(
        [
            line((0, 0, 0), (60 * mm, 0, 0)),
            arc((60 * mm, 15 * mm, 0), 15 * mm, -np.pi / 2, np.pi),
            line((60 * mm, 30 * mm, 0), (0, 30 * mm, 0)),
            arc((0, 15 * mm, 0), 15 * mm, np.pi / 2, np.pi),
            line((0, 0, 0), (0, -20 * mm, 0)),
            arc((0, -10 * mm, 0), 10 * mm, -np.pi / 2, -2 * np.pi),
            line((0, -20 * mm, 0), (20 * mm, -20 * mm, 0)),
        ]
    )
    times, points = tool_points(made)
    assert_same_curve(points, curve, 1.5e-4 + (blend or 0.0))
    speeds = np.linalg.norm(np.diff(points, axis=0), axis=1) / np.diff(times)
    assert speeds.max() < 0.05 * (1.0 + 1e-3)
    assert speeds.max() > 0.049
    stops = [k for k, each in enumerate(read.waypoints[1:-1], 1) if isinstance(each.transition, StopTransition)]
    assert len(stops) == (3 if blend is None else 1), "with a blend, only where the tool turns back"


def test_the_tool_passes_joins_without_a_corner_and_stops_at_others(tmp_path: Path) -> None:
    program = START + "G1 X10 F600\nX20\nG3 X30 Y10 J10\nG1 Y20\nX0\n"
    kinds = [type(each.transition) for each in waypoints_of(tmp_path, program)[1:]]
    assert kinds == [ThroughTransition, ThroughTransition, ThroughTransition, StopTransition, StopTransition]


def test_with_a_blend_lines_of_one_feed_become_one_polyline(tmp_path: Path) -> None:
    program = START + "G1 X10 F600\nY10\nX20\nF1200 Y20\nX30\nX10\n"
    _, slow, fast, back = waypoints_of(tmp_path, program, blend=0.001)
    assert isinstance(slow.motion, PolylineMotion)
    assert [pose.position.tolist() for pose in slow.motion.poses] == [[0.01, 0, 0], [0.01, 0.01, 0]]
    assert isinstance(fast.motion, PolylineMotion)
    assert isinstance(back.motion, LinearMotion)
    assert slow.limits is not None
    assert fast.limits is not None
    assert slow.limits.tcp_linear_velocity == pytest.approx(0.01)
    assert fast.limits.tcp_linear_velocity == pytest.approx(0.02)
    assert slow.transition == BlendTransition(0.001)
    assert isinstance(fast.transition, StopTransition), "there the tool turns back"


def test_feeds_limit_the_tool_and_rapid_moves_have_none(tmp_path: Path) -> None:
    _, fed, rapid, inch = waypoints_of(tmp_path, START + "G1 X10 F1200\nG0 X20\nG20 G1 X2 F60\n")
    assert [None if w.limits is None else w.limits.tcp_linear_velocity for w in (fed, rapid, inch)] == pytest.approx(
        [0.02, None, 0.0254]
    )


@pytest.mark.parametrize("axis", [(0.0, 0.0, -2.0), (1.0, 0.0, 0.0), (-0.3, 0.5, -0.8)])
def test_the_tool_axis_is_the_z_axis_of_all_poses(tmp_path: Path, axis: tuple[float, ...]) -> None:
    for waypoint in waypoints_of(tmp_path, START + "G1 X10\nG2 X20 R5\n", tool_axis=axis):
        rotation = waypoint.pose.rotation
        assert rotation is not None
        np.testing.assert_allclose(rotation[:, 2], axis / np.linalg.norm(axis), atol=1e-12)
        np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1.0)


def test_the_middle_of_an_arc_is_in_the_base_frame_and_poses_in_the_given_one(tmp_path: Path) -> None:
    *_, last = waypoints_of(tmp_path, START + "G3 X20 Y0 I10 J0\n", frame=TABLE)
    assert isinstance(last.motion, CircularMotion)
    assert last.frame is TABLE
    np.testing.assert_allclose(last.motion.via.to_frame(TABLE).position, [0.01, -0.01, 0.0], atol=1e-12)


def test_notes_name_what_is_left_out(tmp_path: Path) -> None:
    file = tmp_path / "path.gcode"
    file.write_text("%\nO0012\nG0 Z5\nM3 S900\nG0 X0 Y0\nG1 X5 E2\n/G4 P2\nG43 H1\nX6\nT2 M6\n")
    notes = read_path(file).notes
    assert notes[0] == "line 3: no waypoint, since X and Y had no value yet"
    assert notes[1] == "lines 6, 9: no feed F, so no limit on the speed of the tool"
    for number, words in ((4, "M codes"), (4, "spindle"), (6, "extruder"), (7, "dwells"), (8, "tool lengths")):
        assert any(f"{number}" in note.partition(":")[0] and words in note for note in notes), words


REFUSED = {
    "X10": (1, "need a motion"),
    "G1 X10 Y10 Z10": (1, "Begin with G0"),
    "G91 G0 X1": (1, "`X` must be absolute"),
    START + "G1 X10 X20": (3, "`X` must stand once"),
    START + "G0 G1 X10": (3, "one motion"),
    START + "G1 Xten": (3, "'Xten'"),
    START + "G1 X1e3": (3, "got 'X1e3'"),
    START + "G1 X#101": (3, "plain numbers"),
    START + "G1 X[1+2]": (3, "plain numbers"),
    START + "G1 X1 (no end": (3, "no end"),
    START + "G1 X10 F0": (3, "`F` must be greater than 0"),
    START + "G1 X10 A90": (3, "`A` must not be"),
    START + "A90": (3, "`A` must not be here"),
    START + "G1 X10 R5": (3, "`R` must not be in a G1"),
    START + "G2 X10": (3, "I and J, or a radius"),
    START + "G2 X10 I5 R5": (3, "not both"),
    START + "G2 X10 R4": (3, "`R` must be at least half"),
    START + "G2 R4": (3, "full circle"),
    START + "G2 X10 I3": (3, "distance from its centre; got 3 and 7"),
    START + "G2 I0 J0": (3, "radius greater than 0"),
    START + "G2 X10 Z1 I5": (3, "helical"),
    START + "G2 X10 I5 K1": (3, "`K` must not"),
    START + "G18\n": (3, "`G18` is not supported"),
    START + "G93\n": (3, "`G93` is not supported"),
    START + "\n\nG81 X1\n": (5, "`G81` is not supported"),
    START + "M98 P1000": (3, "subprograms"),
    START + "G1 X" + "9" * 400: (3, "at most 10000"),
    START + "G1 X٣": (3, "must have words"),
}


@pytest.mark.parametrize("program", REFUSED, ids=lambda text: text.splitlines()[-1][:20].strip())
def test_a_bad_line_is_refused_with_its_number(tmp_path: Path, program: str) -> None:
    number, words = REFUSED[program]
    with pytest.raises(InvalidProblem, match=words) as refusal:
        waypoints_of(tmp_path, program)
    assert f"line {number}: " in str(refusal.value)


@pytest.mark.parametrize("program", ["", "M30", "G0 X0 Y0 Z0", START + "G1 X0"])
def test_a_program_without_motion_is_refused(tmp_path: Path, program: str) -> None:
    with pytest.raises(InvalidProblem, match="must have a"):
        waypoints_of(tmp_path, program)


def test_too_many_moves_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidProblem, match="at most 10000 moves"):
        waypoints_of(tmp_path, START + "G91 G1 X0.01 F1\n" + "X0.01\n" * 10_000)
