"""Another version of this project beside the one that runs: a checkout, or a commit of the history."""

from __future__ import annotations

import subprocess
import tempfile
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

HERE = Path(__file__).parents[1]
"""The checkout of this version."""

NAMES = ("before", "now")
"""The other version and this one."""

BEFORE = "261a886"
"""The commit that a benchmark compares this version with by default."""

SLOWER = 1.05
"""Ratio of times above which a figure counts as slower."""


@contextmanager
def checkout_of(version: str) -> Iterator[Path]:
    """Yield the folder of a version: a folder itself, or a commit, which is checked out until the block ends."""
    if Path(version).is_dir():
        yield Path(version).resolve()
        return
    with tempfile.TemporaryDirectory() as folder:
        archive = Path(folder, "version.tar")
        subprocess.run(["git", "archive", "--output", archive, version], cwd=HERE, check=True)
        subprocess.run(["tar", "--extract", "--file", archive, "--directory", folder], check=True)
        archive.unlink()
        yield Path(folder)
