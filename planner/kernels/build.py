"""The compilation of the kernels, by the compiler of the PyPI package `ziglang`: the machine needs none.

`python -m planner.kernels.build` compiles them for this machine; pip does so while it builds the package. The library
knows nothing of Python, so that one serves every version.
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import platform
import shutil
import subprocess
import sys
import sysconfig
import tempfile
from pathlib import Path

SOURCES = Path(__file__).parent / "source"
"""The folder of the C++ sources; an installed package has none."""

LIBRARIES = Path(__file__).parent / "built"
"""The folder of the compiled libraries."""

PROCESSOR = os.environ.get("PLANNER_BUILD_PROCESSOR") or platform.machine()
"""The processor that a wheel is built for: this machine's unless the environment names another."""

COMPILER = "ziglang==0.17.1"
"""The package that compiles, as pyproject.toml requires it for building."""

MOST_SECONDS = 300.0
"""The time that the compiler may take for one library, s: it takes some 5 s on a quiet machine."""

KEPT_FOLDERS = 8
"""The number of folders of libraries that stay in a checkout, the latest ones: another branch needs no compiler."""

FLAGS = (
    *("-O3", "-std=c++17", "-fPIC", "-shared", "-s", "-nostdlib++", "-fno-exceptions", "-fno-rtti"),
    *("-fno-math-errno", "-fno-trapping-math", "-ffp-contract=off", "-Wall", "-Wextra", "-Werror", "-Wno-psabi"),
)
"""What every library is compiled with: no flag lets two runs, or two levels of a processor, round differently."""

LEVELS = {"x86_64": ("x86_64_v3", "x86_64_v2")}
"""The levels of a processor that libraries are compiled for, the fastest first and the last for every machine; the
others have one."""


def digest() -> str:
    """Digest the sources and this file: a library serves the sources of its digest only."""
    content = hashlib.sha256(Path(__file__).read_bytes())
    for file in sorted(SOURCES.iterdir()):
        content.update(file.name.encode() + b"\0" + file.read_bytes() + b"\0")
    return content.hexdigest()[:16]


def build(processor: str | None = None) -> Path:
    """Compile the kernels unless that is done, and return the folder of the libraries.

    Args:
        processor: `x86_64` or `aarch64`; None: `PROCESSOR`.

    Raises:
        OSError, subprocess.SubprocessError: The compiler is not there or failed.
    """
    folder = LIBRARIES / digest()
    processor = processor or PROCESSOR
    names = library_names(processor)
    if all((folder / name).is_file() for name in names.values()):
        return folder  # also where nothing may be written
    LIBRARIES.mkdir(exist_ok=True)
    with (LIBRARIES / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)  # several processes may import the library of a fresh checkout at once
        if not all((folder / name).is_file() for name in names.values()):
            older = sorted((old for old in LIBRARIES.iterdir() if old.is_dir()), key=lambda old: -old.stat().st_mtime)
            for old in older[KEPT_FOLDERS - 1 :]:
                shutil.rmtree(old)
            folder.mkdir(exist_ok=True)
            with tempfile.TemporaryDirectory(dir=LIBRARIES) as work:
                for level, name in names.items():
                    _compile(processor, level, Path(work) / name)
                    (Path(work) / name).replace(folder / name)
    return folder


def library_names(processor: str) -> dict[str, str]:
    """Return the names of the library files by processor level, the fastest first, the generic one last."""
    return {level: f"kernels-{processor}-{level}.so" for level in LEVELS.get(processor, ("baseline",))}


def wheel_tag() -> str:
    """Return the tag of a wheel with the libraries of `PROCESSOR`: any Python 3, one platform."""
    if sys.platform == "linux":
        return f"py3-none-manylinux_2_28_{PROCESSOR}"
    return f"py3-none-{sysconfig.get_platform().replace('-', '_').replace('.', '_')}"


def _compile(processor: str, level: str, library: Path) -> None:
    target = ("-target", f"{processor}-linux-gnu.2.28") if sys.platform == "linux" else ()
    command = (
        sys.executable,
        "-m",
        "ziglang",
        "c++",
        *target,
        f"-mcpu={level}",
        *FLAGS,
        "kernels.cpp",
        "-o",
        str(library),
    )
    caches = {name: str(library.parent / "cache") for name in ("ZIG_GLOBAL_CACHE_DIR", "ZIG_LOCAL_CACHE_DIR")}
    done = subprocess.run(  # noqa: S603 - no caller's text in it
        command, cwd=SOURCES, env=os.environ | caches, timeout=MOST_SECONDS, capture_output=True, text=True, check=False
    )
    if done.returncode:
        raise OSError(f"{COMPILER} failed: {done.stderr.strip()[-2000:]}")


if __name__ == "__main__":
    print(build(*sys.argv[1:2]))  # noqa: T201 - a command
