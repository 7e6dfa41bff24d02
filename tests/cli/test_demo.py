"""The main job: `planner demo`, as a user runs it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from matplotlib.image import imread

from tests.locations import ROOT

pytestmark = pytest.mark.large_only

CASES = {
    "refuelling_case_1": "Refuelling, case 1",
    "refuelling_case_1_poses": "Refuelling, case 1, poses",
    "refuelling_case_2": "Refuelling, case 2",
    "welding": "Welding sequence",
    "three_joint_arm_first": "Three-joint arm, set 1",
    "three_joint_arm_second": "Three-joint arm, set 2",
    "three_joint_arm_third": "Three-joint arm, set 3",
    "date_sorting_transition_1": "Date sorting, transition 1",
    "date_sorting_transition_2": "Date sorting, transition 2",
    "blended_lines": "Lines with blended corners",
}

PUBLISHED = {
    # Document 000, Section 4.4: sums of the published durations. Fastest is joint 3, with the cubic's peak of
    # 1.5 dq / T: 92 degrees in 7.33 s and 113 degrees in 12.63 s, of 156 degrees a second.
    "refuelling_case_1": ("cubic", 25.29, 1.5 * 92.0 / 7.33 / 156.0),
    "refuelling_case_1_poses": ("cubic", 25.29, None),
    "refuelling_case_2": ("cubic", 37.60, 1.5 * 113.0 / 12.63 / 156.0),
    # Document 002, Section 3: rest 10 s, move 5 s, rest 10 s, move back 5 s.
    "three_joint_arm_first": ("cubic", 30.0, None),
    "three_joint_arm_second": ("cubic", 30.0, None),
    "three_joint_arm_third": ("cubic", 30.0, None),
    # Document 004, Section 8: 30 s each; the joints' speeds on the straight line are not published.
    "date_sorting_transition_1": ("trapezoidal", 30.0, None),
    "date_sorting_transition_2": ("trapezoidal", 30.0, None),
}


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> tuple[list[str], Path]:
    """Lines that the demo prints, and the folder that it fills."""
    folder = tmp_path_factory.mktemp("demo")
    ran = subprocess.run(
        [sys.executable, "-m", "cli", "demo", "--output", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    return ran.stdout.splitlines(), folder


def _row(lines: list[str], title: str) -> list[str]:
    (line,) = (line for line in lines if re.match(rf"{re.escape(title)}\s\s", line))
    return re.split(r"\s\s+", line.strip())


@pytest.mark.parametrize("name", PUBLISHED)
def test_the_table_has_the_published_figures(demo: tuple[list[str], Path], name: str) -> None:
    backend, duration, velocity = PUBLISHED[name]
    row = _row(demo[0], CASES[name])
    assert row[1] == backend
    assert row[2] == f"{duration:.2f} s"
    if velocity is not None:
        assert row[3] == f"{100.0 * velocity:.1f} %"


@pytest.mark.parametrize("name", CASES)
def test_every_case_meets_its_waypoints_within_its_limits(demo: tuple[list[str], Path], name: str) -> None:
    row = _row(demo[0], CASES[name])
    assert 0.0 < float(row[3].removesuffix(" %")) <= 100.0
    assert 0.0 <= float(row[4].removesuffix(" %")) <= 100.0
    assert float(row[5]) <= 1e-6
    assert row[6].startswith("kept, C")
    assert float(row[7].removesuffix(" ms")) > 0.0


@pytest.mark.parametrize("name", CASES)
def test_every_case_has_a_picture(demo: tuple[list[str], Path], name: str) -> None:
    pixels = imread(demo[1] / f"{name}.png")[..., :3]
    height, width, _ = pixels.shape
    assert height >= 600
    assert width >= 1000
    for part in np.array_split(pixels, 3):  # position, velocity, acceleration
        assert (part.min(axis=2) < 0.5).mean() > 0.002


def test_the_service_was_stopped_cleanly(demo: tuple[list[str], Path]) -> None:
    log = (demo[1] / "service.log").read_text()
    assert "Traceback" not in log
    assert '"stopped"' in log


def test_nothing_is_wider_than_100_columns(demo: tuple[list[str], Path]) -> None:
    assert max(map(len, demo[0])) <= 100
