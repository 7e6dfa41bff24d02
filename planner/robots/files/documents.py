"""The documents of a robot, and where the files are that they name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from planner.errors import Finding, InvalidRobotModel


@dataclass(frozen=True)
class RobotFiles:
    """The documents of a robot, for `Robot.from_urdf(files.urdf, srdf=files.srdf, meshes=files.meshes)`.

    Attributes:
        urdf: The URDF document.
        srdf: The SRDF document; None: there is none.
        meshes: The bytes of the meshes by the names that the URDF has for them.
    """

    urdf: str
    srdf: str | None = None
    meshes: Mapping[str, bytes] = field(default_factory=dict)


def package_folder(name: str, file: Path, packages: Sequence[Path]) -> Path | None:
    """Return the folder of a ROS package: in `packages`, or else above the file or beside a folder above it."""
    for folder in packages:
        if (folder / name).is_dir():
            return folder / name
        if folder.name == name:
            return folder
    for folder in file.resolve().parents:
        if folder.name == name:
            return folder
        if (folder / name).is_dir():
            return folder / name
    return None


def invalid_file(code: str, message: str) -> InvalidRobotModel:
    """Return the error for a robot file that cannot be used."""
    return InvalidRobotModel(message, [Finding(code, "error", None, message)])
