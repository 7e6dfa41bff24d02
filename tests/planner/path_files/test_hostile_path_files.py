"""Changed bytes of valid path files: a finite path or a refusal, never another error."""

from __future__ import annotations

from pathlib import Path

import ezdxf
import numpy as np
import pytest

from planner import InvalidProblem, PathFile, PoseWaypoint, read_path
from planner.path_files.texts import MOST_BYTES
from tests.sizes import SIZE

PIECES = [
    b"",
    b"nan",
    b"inf",
    b"-1e308",
    b"1e999",
    b"0",
    b"-",
    b".",
    b"\x00",
    b"\xff",
    b"(",
    b'"',
    b"\n",
    b"\r",
    b"9" * 30,
]
"""Replacements that break readers."""

GCODE = b"G21 G90\nG0 X0 Y0 Z5\nG1 X10 F600\nG3 X20 Y10 I0 J10\nG2 X40 R10\nG91 G1 X5\nG20 G0 Z1\nM30\n"
CSV = b"x,y,z,roll,pitch,yaw,speed\n0,0,0,3.1,0,0,1\n1,0,0.5,3.1,0,0,1\n1,1,0.5,3.1,0,1,1\n"


def dxf(folder: Path) -> bytes:
    document = ezdxf.new("R2000")
    space = document.modelspace()
    space.add_line((0, 0), (10, 5))
    space.add_arc((5, 5), 3, 20, 200)
    space.add_circle((5, 15), 3)
    space.add_lwpolyline([(0, 0, 0.5), (10, 0, -1.0), (10, 10, 0)], format="xyb", close=True)
    space.add_polyline3d([(0, 0, 1), (10, 0, 2), (10, 10, 3)])
    document.saveas(folder / "valid.dxf")
    return (folder / "valid.dxf").read_bytes()


def is_finite(read: PathFile) -> bool:
    positions = [each.pose.position for each in read.waypoints if isinstance(each, PoseWaypoint)]
    rotations = [each.pose.rotation for each in read.waypoints if isinstance(each, PoseWaypoint)]
    return len(positions) > 1 and bool(np.isfinite(positions).all() and np.isfinite(np.array(rotations)).all())


@pytest.mark.sized
@pytest.mark.parametrize("kind", ["ngc", "csv", "dxf"])
def test_changed_bytes_give_a_finite_path_or_a_refusal(tmp_path: Path, kind: str) -> None:
    valid = {"ngc": GCODE, "csv": CSV}.get(kind) or dxf(tmp_path)
    begin = valid.rfind(b"ENTITIES") if kind == "dxf" else 0
    end = valid.find(b"ENDSEC", begin) if kind == "dxf" else len(valid)
    file = tmp_path / f"path.{kind}"
    file.write_bytes(valid)
    assert is_finite(read_path(file))
    refused = 0
    for seed in range(4 * SIZE.examples):
        random = np.random.default_rng(seed)
        content = bytearray(valid)
        for _ in range(random.integers(1, 4)):
            at = int(random.integers(begin, end))
            line_end = content.find(b"\n", at)
            length = max(line_end - at, 0) if random.random() < 0.5 else int(random.integers(0, 4))
            content[at : at + length] = PIECES[random.integers(len(PIECES))]
        file.write_bytes(content)
        try:
            assert is_finite(read_path(file))
        except InvalidProblem:
            refused += 1
    assert refused > 0


@pytest.mark.parametrize("kind", ["ngc", "csv", "dxf"])
def test_a_file_that_is_too_large_is_refused(tmp_path: Path, kind: str) -> None:
    file = tmp_path / f"path.{kind}"
    with file.open("wb") as written:
        written.truncate(MOST_BYTES + 1)
    with pytest.raises(InvalidProblem, match="at most 16 MiB"):
        read_path(file)


def test_other_suffixes_are_refused_by_name(tmp_path: Path) -> None:
    with pytest.raises(InvalidProblem, match=r"suffixes \.csv, .*\.dxf; got path\.step"):
        read_path(tmp_path / "path.step")


def test_a_missing_file_is_the_systems_error(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read_path(tmp_path / "path.csv")
