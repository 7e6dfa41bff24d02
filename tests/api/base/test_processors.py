"""The number of workers follows the quota of the container, by files as Linux has them."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

import pytest

from api.base.processors import available_processors
from api.base.settings import Settings

if TYPE_CHECKING:
    from pathlib import Path

ALL = len(os.sched_getaffinity(0))


@pytest.mark.parametrize(
    ("own", "files", "expected"),
    [
        ("0::/\n", {"cpu.max": "50000 100000\n"}, 1),
        ("0::/\n", {"cpu.max": f"{ALL * 100000 - 150000} 100000\n"}, max(1, ALL - 1)),
        ("0::/\n", {"cpu.max": "max 100000\n"}, ALL),
        ("0::/\n", {"cpu.max": "10000000 1000\n"}, ALL),
        ("0::/a/b\n", {"a/cpu.max": "100000 100000\n", "a/b/cpu.max": "max 100000\n"}, 1),
        (
            "1:cpu,cpuacct:/a\n",
            {"cpu,cpuacct/a/cpu.cfs_quota_us": "90000", "cpu,cpuacct/a/cpu.cfs_period_us": "100000"},
            1,
        ),
        ("1:cpu:/\n", {"cpu/cpu.cfs_quota_us": "-1\n", "cpu/cpu.cfs_period_us": "100000\n"}, ALL),
        ("0::/\n", {"cpu.max": "what nobody foresaw\n"}, ALL),
        ("", {}, ALL),
    ],
)
def test_a_quota_counts(own: str, files: dict[str, str], expected: int, tmp_path: Path) -> None:
    (tmp_path / "own").write_text(own)
    for name, content in files.items():
        file = tmp_path / "groups" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(content)
    assert available_processors(tmp_path / "groups", tmp_path / "own") == expected


def test_there_are_as_many_workers_as_processors() -> None:
    assert Settings().workers == available_processors() >= 1
