"""Another version of this project beside the one that runs: a checkout, or a commit of the history."""

from __future__ import annotations

import io
import subprocess
import tarfile
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
    files = subprocess.run(["git", "archive", version], cwd=HERE, check=True, stdout=subprocess.PIPE).stdout
    with tempfile.TemporaryDirectory() as folder:
        with tarfile.open(fileobj=io.BytesIO(files)) as archive:
            archive.extractall(folder, filter="data")
        yield Path(folder)
