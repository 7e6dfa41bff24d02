"""The compiled library: a fixed build, equal on every level of a processor, with clear errors where it is missing."""

from __future__ import annotations

import ctypes
import platform
import tomllib
from typing import TYPE_CHECKING

import numpy as np
import pytest

from planner.kernels import build, library
from planner.kernels.serial_chain import inverse_dynamics
from planner.robots import load_robot
from planner.scene import CollisionChecker, Scene, SceneObject, clearances, edge
from planner.shapes import Box
from planner.spatial import Pose
from tests.locations import ROOT

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """Look for libraries in an empty folder, as an installed package would without its own."""
    monkeypatch.setattr(library, "LIBRARIES", tmp_path)
    monkeypatch.setattr(library, "SOURCES", tmp_path / "source")
    monkeypatch.setattr(library, "library", library.library.__wrapped__)
    return tmp_path


def test_the_compiler_has_one_version_everywhere() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert build.COMPILER in project["build-system"]["requires"]
    assert build.COMPILER in (ROOT / "constraints.txt").read_text(encoding="utf-8").splitlines()


def test_every_level_of_the_processor_gives_the_same_bytes(monkeypatch: pytest.MonkeyPatch) -> None:
    robot = load_robot("kuka_kr16_2")
    states = np.random.default_rng(0).uniform(-3.0, 3.0, (3, 50, robot.dof))
    things = [SceneObject(f"box_{k}", [Box([0.2, 0.3, 0.4])], Pose([1.0 + 0.3 * k, 0.5, 0.6])) for k in range(3)]
    checker = CollisionChecker(robot, Scene(things), self_collision=True)

    def answers() -> bytes:
        ways = [edge(start, end) for start, end in zip(states[0, :8], states[1, :8], strict=True)]
        proofs = [clearances(checker, way, tolerance=1e-3) for way in ways]
        distances = [(found.lower.tobytes(), found.upper.tobytes(), found.distances) for found in proofs]
        return inverse_dynamics(robot.chain, *states).tobytes() + repr(distances).encode()

    fastest = library.library()
    folder = library._folder()
    found = {answers()}
    for name in build.library_names(platform.machine()).values():
        if "v3" in name and not fastest.runs_x86_64_v3():
            continue
        with monkeypatch.context() as patch:
            one = ctypes.CDLL(str(folder / name))
            patch.setattr(library, "library", lambda one=one: one)
            library._kernel.cache_clear()
            found.add(answers())
        library._kernel.cache_clear()
    assert len(found) == 1


def test_without_a_library_the_error_says_what_to_run(elsewhere: Path) -> None:
    with pytest.raises(ImportError, match="install the package trajectory-planner again"):
        library.library()


def test_a_damaged_library_is_refused(elsewhere: Path) -> None:
    for name in build.library_names(platform.machine()).values():
        (elsewhere / "digest").mkdir(exist_ok=True)
        (elsewhere / "digest" / name).write_bytes(b"\x7fELF and no more")
    with pytest.raises(ImportError, match=r"cannot be loaded.*again with pip"):
        library.library()


def test_changed_sources_never_run_with_an_old_library(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Without a compiler that is an error, even beside an old library."""
    (tmp_path / "source").mkdir()
    (tmp_path / "source/kernels.cpp").write_text("changed")
    (tmp_path / "built/old").mkdir(parents=True)
    monkeypatch.setattr(build, "SOURCES", tmp_path / "source")
    monkeypatch.setattr(build, "LIBRARIES", tmp_path / "built")
    monkeypatch.setattr(build.sys, "executable", "/nowhere/python")
    with pytest.raises(ImportError, match="do not match the sources: run `pip install ziglang=="):
        library.library.__wrapped__()


def test_sources_that_come_back_are_not_compiled_again(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Switching between two branches cost 12 to 25 s at each start of a service."""
    compiled: list[str] = []

    def compile_(_processor: str, level: str, made: Path) -> None:
        compiled.append(level)
        made.write_bytes(b"")

    (tmp_path / "source").mkdir()
    monkeypatch.setattr(build, "SOURCES", tmp_path / "source")
    monkeypatch.setattr(build, "LIBRARIES", tmp_path / "built")
    monkeypatch.setattr(build, "_compile", compile_)
    folders = []
    for branch in ("one", "other", "one", "other"):
        (tmp_path / "source/kernels.cpp").write_text(branch)
        folders.append(build.build())
    assert folders[:2] == folders[2:]
    assert len(compiled) == 2 * len(build.library_names(platform.machine()))
    for number in range(2 * build.KEPT_FOLDERS):
        (tmp_path / "source/kernels.cpp").write_text(str(number))
        build.build()
    assert len([path for path in (tmp_path / "built").iterdir() if path.is_dir()]) == build.KEPT_FOLDERS


def test_a_library_that_is_there_needs_no_place_to_write_and_no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """The checkout belongs to another user and is read-only."""

    def refuse(*_: object, **__: object) -> None:
        raise PermissionError("read-only file system")

    monkeypatch.setattr(build.Path, "mkdir", refuse)
    monkeypatch.setattr(build.fcntl, "flock", refuse)
    monkeypatch.setattr(build.sys, "executable", "/nowhere/python")
    assert library._folder().name == build.digest()


def test_arrays_of_another_shape_or_type_do_not_reach_a_kernel() -> None:
    assert library.doubles([[1, 2], [3, 4]], 2, 2).dtype == np.float64
    assert library.doubles(np.arange(8.0).reshape(2, 4)[:, ::2], 2, 2).flags.c_contiguous
    with pytest.raises(ValueError, match="expected"):
        library.doubles(np.zeros((2, 3)), 3, 2)
    with pytest.raises(KeyError):
        library.call("inverse_dynamics", "no number")  # type: ignore[arg-type]
