"""Open coordinates of tool motions: the cheapest turns by all ways through dense kinematics, paths by differences."""

from __future__ import annotations

import resource
from time import process_time

import numpy as np
import pinocchio as pin
import pytest

from benchmarks.corpus.tracing import tool_at
from planner.kinematics.configurations import configurations
from planner.kinematics.inverse import solution_layers
from planner.kinematics.options import InverseKinematicsOptions
from planner.problems.regions import ANY_TURN, Region
from planner.robots import ExternalAxis, Robot, load_robot
from planner.spatial import FloatArray, Pose, rotation_from_rpy, rotation_z
from planner.tool_motions.pose_paths import Arc, Line, PosePath
from planner.tool_motions.pose_splines import PoseSpline
from planner.tool_motions.redundancy import way as ways
from planner.tool_motions.redundancy.coordinates import OpenCoordinates
from planner.tool_motions.redundancy.offset_paths import OffsetPath
from planner.tool_motions.redundancy.smoothing import curve_through, smoothed
from planner.tool_motions.redundancy.way import cheapest_values

HOMES = {"kuka_kr16_2": (0.3, -1.2, 1.4, 0.2, 0.6, 0.1), "ur5e": (0.0, -1.5, 1.6, -1.6, -1.5, 0.2)}
TURN = 2.0 * np.pi
RAIL = ExternalAxis("rail", "prismatic", (1.0, 0.0, 0.0), lower=0.0, upper=2.0, velocity=1.0)
TABLE = ExternalAxis(
    "table", "revolute", (0.0, 0.3, 1.0), Pose([1.0, 0.2, 0.3], rotation_from_rpy(0.1, 0.2, 0.3)), -4.0, 4.0, 1.5
)


def line_from(robot: Robot, home: FloatArray, turn: float) -> Line:
    start = tool_at(robot, home)
    end = Pose(start.position + np.array([0.1, 0.15, -0.05]), start.rotation @ rotation_from_rpy(0.2, -0.1, turn))
    return Line(start, end)


@pytest.mark.parametrize("arm", HOMES)
def test_no_way_over_72_turns_is_cheaper(arm: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The truth is the least of all 373,248 ways over three poses, with solutions confirmed one by one."""
    robot, home, nodes = load_robot(arm), np.array(HOMES[arm]), 5
    monkeypatch.setattr(ways, "FEWEST_NODES", nodes)
    monkeypatch.setattr(ways, "NODES_OF_CURVE", nodes)
    monkeypatch.setattr(ways, "MOST_REFINEMENTS", 0)
    monkeypatch.setattr(ways, "room_off_limits", np.zeros_like)
    path, velocity = line_from(robot, home, 1.5), robot.limit("velocity")
    lower, upper = robot.limit("lower"), robot.limit("upper")
    (own,) = configurations(robot, home[None])

    def step(starts: FloatArray, ends: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the costs of steps (...), and their ends on the nearest turns; infinite beyond limits and reach."""
        ends = ends + TURN * np.round((starts - ends) / TURN)
        moved = np.abs(ends - starts)
        costs = (nodes - 1) * ((moved / velocity) ** 2).sum(axis=-1)
        fine = ((ends >= lower) & (ends <= upper) & (moved <= 1.0)).all(axis=-1)
        return np.where(fine, costs, np.inf), ends

    layers = []
    for u in np.linspace(0.0, 1.0, nodes)[1:]:
        pose = path.pose(float(u))
        turns = [0.0] if u == 1.0 else np.arange(-36, 36) * TURN / 72.0
        poses = [Pose(pose.position, pose.rotation @ rotation_z(angle)) for angle in turns]
        of_turns = solution_layers(robot, poses, InverseKinematicsOptions(), home)
        rows = np.full((len(turns), robot.dof), np.nan)
        for row, solutions in zip(rows, of_turns, strict=True):
            alike = [q for q in solutions if configurations(robot, q[None])[0] == own]
            row[:] = alike[0] if alike else np.nan
        layers.append(rows)
    with np.errstate(invalid="ignore"):
        first, q1 = step(home, layers[0])
        second, q2 = step(q1[:, None], layers[1])
        third, q3 = step(q2[:, :, None], layers[2])
        last, _ = step(q3[:, :, :, None], layers[3])
    every = first[:, None, None] + second[:, :, None] + third + last[..., 0]
    assert every.shape == (72, 72, 72)
    way = cheapest_values(OpenCoordinates(robot, ANY_TURN), path, home, [], "continuous")
    assert way is not None
    assert way.cost == pytest.approx(np.nanmin(every), abs=1e-7)
    chosen = np.round(way.values[1:-1, 0] * 72.0 / TURN).astype(int) + 36
    assert every[tuple(chosen % 72)] == pytest.approx(way.cost, abs=1e-7)


@pytest.mark.parametrize("arm", HOMES)
def test_finer_turns_cost_no_more_and_hardly_turn_the_wrist(arm: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, home = load_robot(arm), np.array(HOMES[arm])
    coordinates, path = OpenCoordinates(robot, ANY_TURN), line_from(robot, home, 0.0)
    fine = cheapest_values(coordinates, path, home, [], "continuous")
    monkeypatch.setattr(ways, "MOST_REFINEMENTS", 0)
    coarse = cheapest_values(coordinates, path, home, [], "continuous")
    assert fine is not None and coarse is not None
    assert fine.cost <= coarse.cost
    for value, position, u in zip(fine.values, fine.positions, np.linspace(0.0, 1.0, len(fine.values)), strict=True):
        written, reached = path.pose(float(u)), tool_at(robot, position)
        assert reached.position == pytest.approx(written.position, abs=1e-4)
        assert reached.rotation == pytest.approx(written.rotation @ rotation_z(float(value[0])), abs=1e-3)


@pytest.mark.parametrize("turns", [(0, 0), (0, 1), (-1, 0)])
def test_ranges_of_whole_numbers_are_ranges(turns: tuple[int, int]) -> None:
    robot, home = load_robot("kuka_kr16_2"), np.array(HOMES["kuka_kr16_2"])
    way = cheapest_values(
        OpenCoordinates(robot, Region(rotation_z=turns)), line_from(robot, home, 0.2), home, [], "continuous"
    )
    assert way is not None
    assert turns[0] <= way.values.min() <= way.values.max() <= turns[1]
    assert way.values[[0, -1]] == pytest.approx(0.0)


@pytest.mark.parametrize("kind", ["line", "arc", "spline"])
@pytest.mark.parametrize("axes", ["rail", "table", "none"])
def test_twists_of_offset_paths_are_differences_of_their_poses(kind: str, axes: str) -> None:
    robot = load_robot("kuka_kr16_2")
    if axes != "none":
        robot = robot.derived(external_axes=[RAIL]) if axes == "rail" else robot.derived(positioner=[TABLE])
    region, rng = Region(x=(-0.1, 0.1), rotation_y=(-0.5, 0.5), rotation_z=(-1.0, 1.0)), np.random.default_rng(3)
    coordinates = OpenCoordinates(robot, region)
    poses = [Pose(rng.uniform(-1.0, 1.0, 3), rotation_from_rpy(*rng.uniform(-0.6, 0.6, 3))) for _ in range(3)]
    paths: dict[str, PosePath] = {
        "line": Line(poses[0], poses[2]),
        "arc": Arc.through(poses[0], poses[1], poses[2]),
        "spline": PoseSpline.through(poses[0], poses[1:2], poses[2]),
    }
    values = smoothed(rng.uniform(0.05, 0.1, (9, 3 + coordinates.carried)))
    curve = curve_through(values, np.full(values.shape[1], -9.0), np.full(values.shape[1], 9.0))
    carried = coordinates.carried
    parts = [
        type(curve)(curve.lengths, curve.coefficients[:, columns]) for columns in (slice(carried), slice(carried, None))
    ]
    path = OffsetPath(
        paths[kind], region, parts[1], curve.breakpoints, coordinates.frame, parts[0] if carried else None
    )
    for u in (0.21, 0.5, 0.83):
        before, here, after = (path.pose(at) for at in (u - 1e-5, u, u + 1e-5))
        linear = (after.position - before.position) / 2e-5
        angular = here.rotation @ pin.log3(before.rotation.T @ after.rotation) / 2e-5
        assert path.twist(u) == pytest.approx(np.concatenate([linear, angular]), abs=1e-5)
        # The whole robot reaches the offset pose where its arm reaches this one with fixed axes.
        offset = region.pose(paths[kind].pose(u), parts[1].evaluate(np.array([u]), [0])[0][0])
        own = np.array([0.3, -1.2, 1.4, 0.2, 0.6, 0.1])
        moved = np.append(parts[0].evaluate(np.array([u]), [0])[0][0], own)
        arm, whole = tool_at(coordinates.arm, own), tool_at(robot, moved)
        apart = [
            pin.SE3(a.rotation, a.position).actInv(pin.SE3(b.rotation, b.position))
            for a, b in ((arm, here), (whole, offset))
        ]
        assert apart[0].homogeneous == pytest.approx(apart[1].homogeneous, abs=1e-9)


def test_smoothing_keeps_the_ends_and_slow_waves_and_takes_out_fine_ones() -> None:
    u = np.linspace(0.0, 1.0, 101)
    slow, fine = np.sin(TURN * u), 0.01 * np.sin(TURN * 33.0 * u)
    found = smoothed((slow + fine)[:, None])[:, 0]
    assert found[[0, -1]] == pytest.approx((slow + fine)[[0, -1]])
    assert np.abs(found - slow).max() < 2e-3
    assert smoothed(np.column_stack([u, u**2])) == pytest.approx(np.column_stack([u, u**2]))


@pytest.mark.large_only
def test_two_thousand_poses_with_72_turns_take_5_s_and_300_mb() -> None:
    robot, home = load_robot("kuka_kr16_2"), np.array(HOMES["kuka_kr16_2"])
    here, s = tool_at(robot, home), np.linspace(0.0, 1.0, 2000)
    positions = here.position + np.column_stack([0.15 * np.sin(6.0 * s), 0.4 * s, 0.05 * np.sin(25.0 * s)])
    turns = zip(0.3 * np.sin(5.0 * s), 0.3 * np.sin(7.0 * s), 4.0 * s, strict=True)
    poses = [Pose(p, here.rotation @ rotation_from_rpy(*turn)) for p, turn in zip(positions, turns, strict=True)]
    path = PoseSpline.through(poses[0], poses[1:-1], poses[-1])
    before, began = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss, process_time()
    way = cheapest_values(OpenCoordinates(robot, ANY_TURN), path, home, [], "continuous")
    assert process_time() - began < 5.0
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 300 * 1024
    assert way is not None and len(way.values) == 2000


@pytest.mark.parametrize("with_rail", [False, True])
def test_an_arm_with_seven_joints_turns_its_tool_within_narrow_limits(with_rail: bool) -> None:
    """It has no closed form. The last joint alone would turn by 1 rad, and may turn by 0.3 rad."""
    robot, home = load_robot("fr3"), np.array([0.1, -0.5, 0.2, -2.0, 0.1, 1.7, 0.6])
    robot = robot.derived(limits={robot.joint_names[6]: {"lower": 0.4, "upper": 0.7}})
    start = tool_at(robot, home)
    if with_rail:
        robot, home = robot.derived(external_axes=[RAIL]), np.append(0.5, home)
        start = tool_at(robot, home)
    poses = [
        Pose(start.position + np.array([0.0, 0.02 * k, 0.0]), start.rotation @ rotation_z(np.sin(0.5 * np.pi * k)))
        for k in range(5)
    ]
    path = PoseSpline.through(poses[0], poses[1:-1], poses[-1])
    way = cheapest_values(OpenCoordinates(robot, ANY_TURN), path, home, [], "continuous")
    assert way is not None
    assert ((way.positions >= robot.limit("lower") - 1e-9) & (way.positions <= robot.limit("upper") + 1e-9)).all()
    assert np.abs(np.diff(way.positions, axis=0)).max() < 0.3
    for value, position, u in zip(way.values, way.positions, np.linspace(0.0, 1.0, len(way.values)), strict=True):
        written, reached = path.pose(float(u)), tool_at(robot, position)
        assert reached.position == pytest.approx(written.position, abs=1e-6)
        assert reached.rotation == pytest.approx(written.rotation @ rotation_z(float(value[-1])), abs=1e-6)
