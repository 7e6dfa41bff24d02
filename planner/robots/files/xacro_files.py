"""Expands xacro files by the package xacro."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from threading import Lock
from unittest.mock import patch

from planner.robots.files.documents import invalid_file, package_folder

EXPANSION = Lock()
"""Held during an expansion: the package keeps its state in global variables."""


def expand_xacro(path: Path, arguments: Mapping[str, str], packages: Sequence[Path]) -> str:
    """Expand a xacro file to a URDF document.

    Args:
        path: The file.
        arguments: Its arguments, by name.
        packages: Folders that have the folders of ROS packages.

    Raises:
        OSError: The file cannot be read.
        InvalidRobotModel: The package xacro is not installed, or the file cannot be expanded.
    """
    try:
        import xacro
        from xacro import substitution_args
    except ModuleNotFoundError:
        raise invalid_file(
            "missing_package", f"{path.name} is a xacro file; install `xacro`, or the extra `models`"
        ) from None
    path.open().close()  # the package reports a missing file as a fault of the document

    def find(name: str) -> str:
        folder = package_folder(name, path, packages)
        if folder is None:
            message = f"the package {name} is not above {path.name} nor beside a folder above it; name its folder"
            raise invalid_file("package_not_found", message)
        return str(folder)

    # The package asks ROS for packages; here no ROS is needed.
    finds = (
        patch.object(substitution_args, "_eval_find", find),
        patch.dict(substitution_args._eval_dict, find=find),
    )
    with EXPANSION, finds[0], finds[1]:
        try:
            document = xacro.process_file(str(path), mappings=dict(arguments))
        except Exception as error:
            raise invalid_file("xacro_failed", f"{path.name} cannot be expanded: {error}") from error
    text: str = document.toprettyxml(indent="  ")
    return text
