"""docs/figures.md: every command runs, and values read from its picture equal the documents' own numbers."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest
from typer.testing import CliRunner

from cli import app
from cli.work import pictures
from docs.tools.figures import FIGURES, IMAGES, PAGE, PICTURED, Figure, document
from tests.documents.published import document as published
from tests.documents.published import homogeneous, standard_dh
from tests.documents.read_pictures import Graph, graphs_of

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.spatial import FloatArray

BY_NUMBER = {(figure.document, figure.number): figure for figure in FIGURES}
CASES = published("ngv_refuelling")["cases"]
SETS = published("three_dof_arm")["movement_sets"]
TRANSITIONS = published("date_sorting")["transitions"]
READ = 0.8
"""Permitted reading error of a value, in points of the picture: a curve is drawn to a ninth of one."""


def drawn(folder: Path, *command: str, view: str | None = None) -> list[Graph]:
    path = folder / "figure.svg"
    seen = [] if view is None else ["--view", view]
    result = CliRunner().invoke(app, [*command, *seen, "-o", str(path)])
    assert result.exit_code == 0, result.output
    return graphs_of(path.read_bytes())


def figure(folder: Path, document: str, number: str) -> list[Graph]:
    return drawn(folder, *BY_NUMBER[document, number].command)


def assert_follows(graph: Graph, line: str, truth: Callable[[FloatArray], FloatArray], slack: float = 0.0) -> None:
    """Assert that a line of a graph follows a function of time within the line width.

    Steps may be drawn as slopes.
    """
    time, values = graph.lines[line].T
    x, y = READ * graph.pixel
    nearby = np.array([truth(time + shift) for shift in (-x, 0.0, x)])
    assert len(time) > 2
    assert (values > nearby.min(axis=0) - y - slack).all()
    assert (values < nearby.max(axis=0) + y + slack).all()


def test_the_page_is_what_the_script_makes() -> None:
    assert PAGE.read_text(encoding="utf-8") == document()
    assert len(FIGURES) == len(BY_NUMBER) == 15 + 9 + 25
    assert {path.stem for path in IMAGES.iterdir()} == {f.name for f in FIGURES if f.number in PICTURED}
    shown = re.findall(r"\(images/figures/(\w+)\.png\)", PAGE.read_text(encoding="utf-8"))
    assert sorted(shown) == sorted(path.stem for path in IMAGES.iterdir())


@pytest.mark.long_table
@pytest.mark.parametrize("shown", FIGURES, ids=lambda shown: shown.name)
def test_every_command_runs(shown: Figure, tmp_path: Path) -> None:
    _, *arguments = shown.line.split()
    *arguments, name = arguments
    path = tmp_path / name
    assert CliRunner().invoke(app, [*arguments, str(path)]).exit_code == 0
    lines = re.findall(r"<(?:path|line|polyline|polygon|circle)\b", path.read_text(encoding="utf-8"))
    assert path.suffix == ".html" or len(lines) > 10, "nothing is drawn"


@cache
def joint_cubics(case: str, joint: str) -> tuple[FloatArray, FloatArray]:
    """Return ends (segments + 1,), s, and coefficients (segments, 4) by the document's formula, degrees."""
    segments = CASES[case]["cubics"][joint]["segments"]
    ends = np.cumsum([0.0, *(segment["duration_s"] for segment in segments)])
    return ends, np.array([segment["computed_angle_coefficients_deg"] for segment in segments])


def joint_curve(case: str, joint: str, order: int) -> Callable[[FloatArray], FloatArray]:
    ends, coefficients = joint_cubics(case, joint)

    def at(time: FloatArray) -> FloatArray:
        time = np.clip(time, 0.0, ends[-1])
        rows = np.clip(np.searchsorted(ends, time, side="right") - 1, 0, len(coefficients) - 1)
        pairs = zip(coefficients[rows], time - ends[rows], strict=True)
        return np.array([np.polynomial.Polynomial(row).deriv(order)(local) for row, local in pairs])

    return at


JOINT_FIGURES = [
    (f"4.{4 + 6 * k + row}", case, joint)
    for k, case in enumerate(("case_1", "case_2"))
    for row, joint in enumerate(("joint_1", "joint_2", "joint_3", "joint_5", "joint_6"))
]


@pytest.mark.long_table
@pytest.mark.parametrize(("number", "case", "joint"), JOINT_FIGURES)
def test_figures_4_4_to_4_14_are_the_published_cubics(number: str, case: str, joint: str, tmp_path: Path) -> None:
    angle, velocity = figure(tmp_path, "000", number)
    assert_follows(angle, f"position.{joint}", joint_curve(case, joint, 0))
    assert_follows(velocity, f"velocity.{joint}", joint_curve(case, joint, 1))


@pytest.mark.long_table
@pytest.mark.parametrize(("number", "case"), [("4.9", "case_1"), ("4.15", "case_2")])
def test_figures_4_9_and_4_15_have_all_joints(number: str, case: str, tmp_path: Path) -> None:
    graphs = figure(tmp_path, "000", number)
    for order, (graph, quantity) in enumerate(zip(graphs, ("position", "velocity"), strict=True)):
        assert len(graph.lines) == 6
        for joint in ("joint_1", "joint_2", "joint_3", "joint_5", "joint_6"):
            assert_follows(graph, f"{quantity}.{joint}", joint_curve(case, joint, order))


def test_figure_4_1_is_the_product_of_the_table(tmp_path: Path) -> None:
    """Base, elbows and tool at zero, from above and from the side, by Table 3.1."""
    rows = [(0.0, 0.45, np.pi / 2), (0.0, 0.68, 0.0), (0.7, 0.0, np.pi / 2)]
    points = [standard_dh(rows[:k], np.zeros(k))[:3, 3] * 1000.0 for k in range(4)]
    for view, columns in (("xy", [0, 1]), ("xz", [0, 2])):
        (graph,) = drawn(tmp_path, *BY_NUMBER["000", "4.1"].command, view=view)
        expected = np.array(points)[:, columns]
        for point in expected:
            assert np.abs(graph.lines["robot.0"] - point).max(axis=1).min() < 2.0
        assert np.abs(graph.lines["robot.0"][[0, -1]] - expected[[0, -1]]).max() < 2.0


@pytest.mark.long_table
@pytest.mark.parametrize(("number", "case"), [("4.2", "case_1"), ("4.3", "case_2")])
def test_figures_4_2_and_4_3_end_at_the_points(number: str, case: str, tmp_path: Path) -> None:
    (graph,) = drawn(tmp_path, *BY_NUMBER["000", number].command, view="xy")
    q = np.radians(np.array(CASES[case]["joint_angles"]["q_deg"], dtype=float))
    assert len(graph.lines) == len(q)
    for k, row in enumerate(q):
        wrist = standard_dh([(0.0, 0.45, np.pi / 2), (0.0, 0.68, 0.0), (0.7, 0.0, 0.0)], row[:3])[:2, 3] * 1000.0
        assert graph.lines[f"robot.{k}"][-1] == pytest.approx(wrist, abs=2.0)


def tool_line(axis: str, order: int) -> Callable[[FloatArray], FloatArray]:
    """Return the published pieces of the first movement set and its rests, mm, in local time (E25)."""
    pieces = SETS[0]["corrected_piecewise"]
    breaks = np.array([0.0, *pieces["breakpoints_s"]])
    polynomials = [np.polynomial.Polynomial(np.atleast_1d(piece)).deriv(order) for piece in pieces[axis]]

    def at(time: FloatArray) -> FloatArray:
        rows = np.clip(np.searchsorted(breaks, time, side="right") - 1, 0, 3)  # the last piece is after the end
        return np.array(
            [polynomials[row](t - breaks[row]) for row, t in zip(rows, np.clip(time, 0.0, 30.0), strict=True)]
        )

    return at


@pytest.mark.long_table
@pytest.mark.parametrize("number", range(9))
def test_figures_3_0_to_3_8_are_the_published_polynomials(number: int, tmp_path: Path) -> None:
    axis, order = "xyz"[number // 3], number % 3
    (graph,) = figure(tmp_path, "002", f"3.{number}")
    quantity = ("tcp_position", "tcp_velocity", "tcp_acceleration")[order]
    slack = 0.02 * abs(SETS[0]["computed_peak_acceleration_mm_s2"]["xyz".index(axis)]) if order == 2 else 0.0
    assert_follows(graph, f"{quantity}.{axis}", tool_line(axis, order), slack)


@pytest.mark.long_table
@pytest.mark.parametrize(("number", "columns"), [("10", "xy"), ("11", "xz"), ("12", "yz")])
def test_figures_10_to_12_reach_as_far_as_the_document_says(
    number: str, columns: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """No further than 800 mm, no nearer than 43.93 mm (printed 44), and from 650 to 1450 mm above the floor."""
    monkeypatch.setattr(pictures, "WORKSPACE_POINTS", 1500)
    (graph,) = figure(tmp_path, "004", number)
    dots = graph.dots["workspace"]
    assert len(dots) == 1500
    if columns == "xy":
        radius = np.linalg.norm(dots, axis=1)
        assert 43.9 - 2.0 < radius.min() < 100.0
        assert 700.0 < radius.max() < 800.0 + 2.0
    else:
        assert 700.0 < np.abs(dots[:, 0]).max() < 802.0
        assert 648.0 < dots[:, 1].min() < 700.0
        assert 1400.0 < dots[:, 1].max() < 1452.0


TEST_POINTS = published("date_sorting")["test_points"]["points"]


@pytest.mark.long_table
@pytest.mark.parametrize(("number", "points"), [("6", (1, 2)), ("7", (3, 4)), ("8", (5, 5))])
@pytest.mark.parametrize("columns", ["xy", "xz", "yz"])
def test_figures_6_to_8_have_the_arm_at_the_points_of_table_2(
    number: str, points: tuple[int, int], columns: str, tmp_path: Path
) -> None:
    """The tool is where the table says, the joints where the document's transforms (E26) have them."""
    (graph,) = drawn(tmp_path, *BY_NUMBER["004", number].command, view=columns)
    assert len(graph.lines) == 2
    for row, point in enumerate(points):
        published_point = TEST_POINTS[point - 1]
        theta = np.radians([published_point[f"theta{k}_deg"] for k in (1, 2, 3, 4)])
        chain = homogeneous("z", theta[0], (0, 0, 800.0 + published_point["l1_mm"]))
        chain = chain @ homogeneous("y", theta[1], (0, published_point["l2_mm"] + 150.0, 0))
        wrist, tool = chain[:3, 3], np.array(published_point["position_mm"], dtype=float)
        line = graph.lines[f"robot.{row}"]
        seen = ["xyz".index(axis) for axis in columns]
        assert line[0] == pytest.approx(np.zeros(2), abs=2.0)
        assert line[-1] == pytest.approx(tool[seen], abs=2.0)
        assert np.abs(line - wrist[seen]).max(axis=1).min() < 2.0


def share(time: FloatArray) -> FloatArray:
    """Return the path fraction of Section 7: T = 30, t1 = 10, t2 = 20 s."""
    time = np.clip(time, 0.0, 30.0)
    rising, steady = 0.0025 * time**2, 0.25 + 0.05 * (time - 10.0)
    return np.where(time < 10.0, rising, np.where(time < 20.0, steady, 1.0 - 0.0025 * (30.0 - time) ** 2))


def rate(time: FloatArray) -> FloatArray:
    """Return its derivative, 1/s."""
    return np.clip(np.minimum(0.005 * time, 0.005 * (30.0 - time)), 0.0, 0.05)


START, END = (np.array(TRANSITIONS[0][key], dtype=float) for key in ("start_mm", "end_mm"))


@pytest.mark.large_only
def test_figures_17_22_23_and_27_are_the_line_and_the_trapezoid(tmp_path: Path) -> None:
    request = BY_NUMBER["004", "22"].command[1]
    quantities = ("tcp_position", "tcp_orientation", "tcp_velocity", "tcp_speed")
    position, orientation, velocity, speed = drawn(
        tmp_path, "plot", request, *(f"--show={name}" for name in quantities)
    )
    for k, axis in enumerate("xyz"):
        assert_follows(position, f"tcp_position.{axis}", lambda t, k=k: START[k] + share(t) * (END - START)[k])
        assert_follows(velocity, f"tcp_velocity.{axis}", lambda t, k=k: rate(t) * (END - START)[k])
    assert_follows(speed, "tcp_speed.speed", lambda t: rate(t) * np.linalg.norm(END - START))
    # Section 7: the tool turns by 90 degrees about its y axis, the base's x axis, from a turn of 90 degrees about z.
    assert_follows(orientation, "tcp_orientation.roll", lambda t: 90.0 * share(t))
    assert_follows(orientation, "tcp_orientation.pitch", np.zeros_like)
    assert_follows(orientation, "tcp_orientation.yaw", lambda t: np.full_like(t, 90.0))


@pytest.mark.large_only
def test_figure_29_the_velocity_is_the_derivative_of_the_position(tmp_path: Path) -> None:
    position, velocity = figure(tmp_path, "004", "29")
    times = np.linspace(1.0, 29.0, 57)
    for axis in "xyz":
        drawn_positions = [np.interp(times + h, *position.lines[f"tcp_position.{axis}"].T) for h in (-1.0, 1.0)]
        differences = 0.5 * (drawn_positions[1] - drawn_positions[0])
        read = np.interp(times, *velocity.lines[f"tcp_velocity.{axis}"].T)
        assert differences == pytest.approx(read, abs=2.0 * position.pixel[1] + 0.3)  # a corner is off by 1/4 of 1.25


@pytest.mark.large_only
def test_figures_25_and_26_bring_the_tool_along_the_line(tmp_path: Path) -> None:
    """The drawn joints, put through the document's transforms (E26), are on the line of figure 22."""
    (turning,), (sliding,) = figure(tmp_path, "004", "25"), figure(tmp_path, "004", "26")
    times = np.linspace(0.0, 30.0, 31)
    theta = [np.radians(np.interp(times, *turning.lines[f"position.theta{k}"].T)) for k in (1, 2, 3, 4)]
    l1, l2 = (np.interp(times, *sliding.lines[f"position.{name}"].T) for name in ("l1", "l2"))
    for row, time in enumerate(times):
        tool = (
            homogeneous("z", theta[0][row], (0, 0, 800.0 + l1[row]))
            @ homogeneous("y", theta[1][row], (0, l2[row] + 150.0, 0))
            @ homogeneous("z", theta[2][row])
            @ homogeneous(shift=(0, 150.0, 0))
        )[:3, 3]
        assert tool == pytest.approx(START + share(np.array(time)) * (END - START), abs=2.5)


@pytest.mark.large_only
def test_figures_30_to_35_are_the_statics_of_the_second_transition(tmp_path: Path) -> None:
    """Section 6, with torques and angles read from one picture; what accelerates is 0.03 % of what weighs."""
    request = BY_NUMBER["004", "30"].command[1]
    turns = [f"--joint=theta{k}" for k in (1, 2, 3, 4)]
    angle, rates, torque = drawn(
        tmp_path, "plot", request, *turns, *(f"--show={q}" for q in ("position", "velocity", "torque"))
    )
    times = np.linspace(0.5, 29.5, 59)
    theta = {k: np.radians(np.interp(times, *angle.lines[f"position.theta{k}"].T)) for k in (1, 2, 3, 4)}
    weight = 9.81 * 0.15
    expected = {
        1: np.zeros_like(times),
        2: weight * np.cos(theta[2]) * np.sin(theta[3]),
        3: weight * np.sin(theta[2]) * np.cos(theta[3]),
        4: np.zeros_like(times),
    }
    for k, values in expected.items():
        read = np.interp(times, *torque.lines[f"torque.theta{k}"].T)
        assert read == pytest.approx(values, abs=2.0 * torque.pixel[1] + 0.01 * weight)
        slope = np.degrees(np.gradient(theta[k], times))[1:-1]
        assert np.interp(times[1:-1], *rates.lines[f"velocity.theta{k}"].T) == pytest.approx(slope, abs=0.2)
    (forces,) = figure(tmp_path, "004", "31")
    assert_follows(forces, "torque.l1", lambda t: np.full_like(t, 9.81), slack=0.02)
    assert_follows(forces, "torque.l2", np.zeros_like, slack=0.02)


ALTERNATIVE = np.array([-150.0, 150.0, 1050.0]), np.array([0.0, 400.0, 1200.0])
"""Points 1 and 2 (Table 2), mm: from one to the other theta2 turns by 90 degrees and l2 grows by 250 mm."""


def smooth(time: FloatArray) -> FloatArray:
    """Return the polynomial of degree 5 from 0 to 1 that begins and ends at rest, in 30 s."""
    tau = np.clip(time / 30.0, 0.0, 1.0)
    return np.asarray(tau**3 * (10.0 - 15.0 * tau + 6.0 * tau**2))


@pytest.mark.large_only
def test_figures_36_and_37_are_the_joints_straight_from_point_1_to_point_2(tmp_path: Path) -> None:
    """By the position equations of section 3.2: x = -150 cos theta2, y = 150 + l2, z = 1050 + 150 sin theta2."""
    command = BY_NUMBER["004", "36"].command
    s = np.linspace(0.0, 1.0, 2001)
    truth = np.column_stack(
        [-150.0 * np.cos(np.pi / 2.0 * s), 150.0 + 250.0 * s, 1050.0 + 150.0 * np.sin(np.pi / 2 * s)]
    )
    assert truth[[0, -1]] == pytest.approx(np.array(ALTERNATIVE))
    for view in ("xy", "xz", "yz"):
        (graph,) = drawn(tmp_path, *command, view=view)
        curve = truth[:, ["xyz".index(axis) for axis in view]]
        line = graph.dots["path"]
        assert np.linalg.norm(line[:, None] - curve, axis=2).min(axis=1).max() < 2.0 * graph.pixel.max()
        assert np.linalg.norm(curve[::50, None] - line, axis=2).min(axis=1).max() < 2.0 * graph.pixel.max()
    (speed,) = figure(tmp_path, "004", "37")
    length = np.hypot(150.0 * np.pi / 2.0, 250.0)
    assert_follows(speed, "tcp_speed.speed", lambda t: (smooth(t + 1e-4) - smooth(t - 1e-4)) / 2e-4 * length)


def test_the_reader_sees_what_is_wrong(tmp_path: Path) -> None:
    angle, _ = figure(tmp_path, "000", "4.4")
    right = joint_curve("case_1", "joint_1", 0)
    for wrong in (lambda t: right(t) + 0.3, lambda t: right(t - 0.2), lambda t: 1.02 * right(t)):
        with pytest.raises(AssertionError):
            assert_follows(angle, "position.joint_1", wrong)
