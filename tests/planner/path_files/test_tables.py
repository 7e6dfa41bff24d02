"""CSV as waypoints: random round trips in every unit, planned lines, and refused rows."""

from __future__ import annotations

from itertools import pairwise, product
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from planner import (
    BlendTransition,
    InvalidProblem,
    JointWaypoint,
    PathFile,
    PolylineMotion,
    PoseWaypoint,
    StopTransition,
    load_robot,
    read_path,
)
from tests.planner.path_files.tool_paths import TABLE, assert_same_curve, line, planned, tool_points
from tests.sizes import SIZE

METRES = {"mm": 1e-3, "m": 1.0, "inch": 0.0254, None: 1.0}
RADIANS = {"rad": 1.0, "deg": np.pi / 180.0}


def read_table(folder: Path, text: str, **options: Any) -> PathFile:
    file = folder / "path.csv"
    file.write_text(text)
    return read_path(file, **options)


@pytest.mark.sized
@pytest.mark.parametrize(("units", "angle"), list(product(METRES, RADIANS)))
def test_random_poses_come_back_in_every_unit_and_notation(tmp_path: Path, units: str | None, angle: str) -> None:
    for seed in range(-(-SIZE.examples // len(METRES))):
        random = np.random.default_rng(seed)
        positions, turns = random.uniform(-2.0, 2.0, (5, 3)), Rotation.random(5, random_state=random)
        speeds = random.uniform(0.01, 1.0, 5)
        columns = {name: values / METRES[units] for name, values in zip("xyz", positions.T, strict=True)}
        notation = ("none", "rpy", "quaternion")[seed % 3]
        if notation == "rpy":
            rpy = turns.as_euler("xyz") / RADIANS[angle]
            columns |= dict(zip(("roll", "pitch", "yaw"), rpy.T, strict=True))
        if notation == "quaternion":
            columns |= dict(zip(("qx", "qy", "qz", "qw"), turns.as_quat().T, strict=True))
        columns["speed"] = speeds / METRES[units]
        names = random.permutation(list(columns))
        delimiter = str(random.choice([",", ";", "\t"]))
        rows = [names, *np.column_stack([columns[name] for name in names])]
        text = "# poses\n" + "\n".join(delimiter.join(str(cell) for cell in row) for row in rows)
        read = read_table(tmp_path, text, units=units, angle=angle)
        assert read.notes == ()
        for k, waypoint in enumerate(read.waypoints):
            assert isinstance(waypoint, PoseWaypoint)
            np.testing.assert_allclose(waypoint.pose.position, positions[k], atol=1e-12)
            expected = turns[k].as_matrix() if notation != "none" else np.diag([1.0, -1.0, -1.0])
            np.testing.assert_allclose(waypoint.pose.rotation, expected, atol=1e-12)
            limit = None if waypoint.limits is None else waypoint.limits.tcp_linear_velocity
            assert limit == (pytest.approx(speeds[k]) if k else None)


@pytest.mark.parametrize(("units", "angle"), list(product(METRES, RADIANS)))
def test_joint_positions_are_in_the_robots_order_and_in_units_of_their_joints(
    tmp_path: Path, units: str | None, angle: str
) -> None:
    """Joints that slide have lengths, joints that turn have angles; this arm has both."""
    arm = load_robot("date_sorting_arm")
    assert 0 < arm.is_angle.sum() < arm.dof
    random = np.random.default_rng(7)
    positions = random.uniform(-1.0, 1.0, (4, arm.dof))
    scale = np.where(arm.is_angle, RADIANS[angle], METRES[units])
    order = random.permutation(arm.dof)
    for prefix in ("", "position."):
        header = ",".join(["time", *(prefix + arm.joint_names[k] for k in order)])
        rows = [",".join(map(str, [n, *(row / scale)[order]])) for n, row in enumerate(positions)]
        read = read_table(tmp_path, "\n".join([header, *rows]), robot=arm, units=units, angle=angle)
        found = [waypoint.position for waypoint in read.waypoints if isinstance(waypoint, JointWaypoint)]
        np.testing.assert_allclose(found, positions, atol=1e-12)
        assert read.notes == ("left out column `time`",)


def test_the_planned_tool_path_is_the_tables_polyline(tmp_path: Path) -> None:
    corners = [(0, 0, 0), (60, 0, 0), (60, 40, 0), (60, 40, 20), (0, 0, 20)]
    text = "x,y,z\n" + "\n".join(",".join(map(str, corner)) for corner in corners)
    ends = np.array(corners) * 1e-3
    curve = np.concatenate([line(*pair) for pair in pairwise(ends)])
    for blend in (None, 0.004):
        read = read_table(tmp_path, text, units="mm", frame=TABLE, blend=blend)
        assert isinstance(read.waypoints[-1].motion, PolylineMotion) == (blend is not None)
        _, points = tool_points(planned(read))
        assert_same_curve(points, curve, 1.5e-4 + (blend or 0.0))


def test_joint_rows_stop_or_are_blended(tmp_path: Path) -> None:
    arm = load_robot("three_dof_arm")
    text = ",".join(arm.joint_names) + "\n0,0,0\n10,0,0\n10,20,0\n"
    for blend, inside in ((None, StopTransition()), (0.01, BlendTransition(0.01))):
        read = read_table(tmp_path, text, robot=arm, angle="deg", blend=blend)
        assert [each.transition for each in read.waypoints] == [inside, inside, StopTransition()]
        assert all(isinstance(each, JointWaypoint) for each in read.waypoints)


REFUSED = {
    "": "must have a header and rows",
    "x,y,z\n": "must have a motion",
    "x,y,z\n1,2,3\n": "must have a motion",
    "x,y,z\n1,2,3\n1,2,3\n": "must have a motion",
    "x,y,z\n1,2,3\n1,2\n": "line 3: must have 3 cells, as the header; got 2",
    "x,y,z\n1,2,3\n1,2,nan\n": "line 3: `z` must be a number",
    "x,y,z\n1,2,3\n1,inf,3\n": "line 3: `y` must be a number",
    "x,y,z\n1,2,3\n\n1,1e9,3\n": "line 4: `y` must be at most 10000",
    "x,y,z\n1,2,3\n1,1e999,3\n": "line 3: `y` must be at most 10000",
    "x;y;z\n1;2;3\n1;2,5;3\n": "line 3: `y` must be a number with a decimal point; got '2,5'",
    "x,y,z\n1,2,3\n1_0,2,3\n": "line 3: `x` must be a number",
    "x,y,z\n1,2,3\n0x1,2,3\n": "line 3: `x` must be a number",
    "x,y,z,x\n1,2,3,4\n": "line 1: column `x` must be there once",
    "# path\nx,y,z,roll\n1,2,3,4\n": "line 2: must have the column pitch",
    "x,y,z,qx,qy,qz,qw\n1,2,3,0,0,0,1\n2,2,3,0,0,0,0\n": "line 3: a quaternion must have the norm 1; got 0",
    "x,y,z,speed\n1,2,3,0\n2,2,3,0\n": "line 3: `speed` must be greater than 0",
    "1,2,3\n4,5,6\n": "robot: is required",
    'x,y,z\n1,2,3\n"' + "1" * 200_000 + '",2,3\n': "line 3: is not CSV",
}


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: text[:40].encode("unicode_escape").decode())
def test_a_bad_table_is_refused_with_its_lines(tmp_path: Path, text: str) -> None:
    with pytest.raises(InvalidProblem, match="^(path: )?" + REFUSED[text].replace("(", "\\(")):
        read_table(tmp_path, text)


def test_all_faults_of_a_table_are_listed_up_to_a_bound(tmp_path: Path) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        read_table(tmp_path, "x,y,z\n1,a,b\n2,3,4\nc,5,6\n")
    assert [fault.message.partition(" must")[0] for fault in refusal.value.faults] == [
        "line 2: `y`",
        "line 2: `z`",
        "line 4: `x`",
    ]
    with pytest.raises(InvalidProblem) as refusal:
        read_table(tmp_path, "x,y,z\n" + "a,b,c\n" * 1000)
    assert len(refusal.value.faults) == 20


def test_missing_joints_are_named(tmp_path: Path) -> None:
    arm = load_robot("ur5e")
    with pytest.raises(InvalidProblem, match=r"line 1: must have the columns x, .* of ur5e; wrist_3_joint not found"):
        read_table(tmp_path, ",".join(arm.joint_names[:5]) + "\n0,0,0,0,0\n", robot=arm)


def test_too_many_rows_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InvalidProblem, match="line 10002: must have at most 10000 rows"):
        read_table(tmp_path, "x,y,z\n" + "1,2,3\n" * 10_001)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"units": "cm"}, "units: must be one of mm, m, inch; got 'cm'"),
        ({"angle": "turn"}, "angle: must be one of rad, deg; got 'turn'"),
        ({"blend": 0.0}, "blend: must be at least 1e-05 m; got 0"),
        ({"blend": float("nan")}, "blend: must be at least 1e-05 m; got nan"),
        ({"lift": -1.0}, "lift: must be at least 0; got -1"),
        ({"lift": float("inf")}, "lift: must be at least 0; got inf"),
        ({"tool_axis": (0.0, 0.0, 0.0)}, "tool_axis: must be three numbers, not all 0"),
        ({"tool_axis": (0.0, 1.0)}, "tool_axis: must be three numbers"),
        ({"tool_axis": (0.0, float("nan"), 1.0)}, "tool_axis: must be three numbers"),
    ],
)
def test_bad_arguments_are_refused_by_name(tmp_path: Path, options: dict[str, Any], words: str) -> None:
    with pytest.raises(InvalidProblem) as refusal:
        read_table(tmp_path, "x,y,z\n1,2,3\n4,5,6\n", **options)
    assert str(refusal.value).startswith(words)
