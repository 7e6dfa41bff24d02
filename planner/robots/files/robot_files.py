"""Reads a robot from a file of any format as a URDF document with its meshes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element, ParseError

from defusedxml.ElementTree import fromstring

from planner.robots.collision.mesh_files import meshes_in_folder
from planner.robots.files.documents import RobotFiles, package_folder
from planner.robots.files.parameters import with_calibration, with_joint_limits

PACKAGE_SCHEMES = ("package", "model")
"""Schemes of addresses that begin with the name of a package."""


def read_robot_files(
    path: Path,
    *,
    arguments: Mapping[str, str] | None = None,
    packages: Sequence[Path] = (),
    calibration: Path | None = None,
    joint_limits: Path | None = None,
) -> RobotFiles:
    """Read a robot from a URDF, xacro or MJCF file.

    Meshes of `package://NAME/...` and `$(find NAME)` are looked for in the folder NAME: in `packages`, or else above
    the file or beside a folder above it. A xacro file is a program: expand only files that you trust.

    Args:
        path: The file. The package xacro expands `.xacro` files and documents with elements of xacro. MuJoCo (package
            mujoco-core) compiles an XML document `<mujoco>`. Any other file is a URDF document.
        arguments: Arguments of a xacro file, by name.
        packages: Folders that have the folders of ROS packages.
        calibration: The calibration file of an arm of Universal Robots, as `ur_calibration` extracts it.
        joint_limits: A `joint_limits.yaml` of MoveIt or of a driver; its limits replace the limits in the file.

    Raises:
        OSError: A file cannot be read.
        InvalidRobotModel: A file cannot be expanded or compiled, or a package for it is not installed.
    """
    text = path.read_text(encoding="utf-8")
    root = _root(text)
    if path.suffix == ".xacro" or (root is not None and _has_xacro(root)):
        from planner.robots.files.xacro_files import expand_xacro

        text = expand_xacro(path, arguments or {}, packages)
        root = _root(text)
    if root is not None and root.tag == "mujoco":
        from planner.robots.files.mjcf import read_mjcf

        files = read_mjcf(path)
    else:
        files = RobotFiles(text, meshes={} if root is None else _meshes(root, path, packages))
    urdf = files.urdf if calibration is None else with_calibration(files.urdf, calibration)
    urdf = urdf if joint_limits is None else with_joint_limits(urdf, joint_limits)
    return replace(files, urdf=urdf)


def _root(text: str) -> Element | None:
    """Return the root element of a document; None: it is not plain XML, which the reader of URDF reports."""
    try:
        element: Element = fromstring(text, forbid_dtd=True)
    except (ParseError, ValueError):
        return None
    return element


def _has_xacro(root: Element) -> bool:
    """Tell whether a document has elements of xacro; the namespace alone stays behind in expanded ones, too."""
    return any(str(element.tag).partition("}")[0].endswith("xacro") for element in root.iter())


def _meshes(root: Element, file: Path, packages: Sequence[Path]) -> dict[str, bytes]:
    """Return the meshes that a URDF names and that are there."""
    found: dict[str, bytes] = {}
    workspace = [own.parent for own in file.resolve().parents if (own / "package.xml").is_file()][:1]
    for name in {mesh.get("filename", ""): None for mesh in root.iterfind("link/*/geometry/mesh")}:
        scheme, separator, rest = name.partition("://")
        package, _, relative = rest.partition("/")
        if separator and scheme in PACKAGE_SCHEMES:
            own = package_folder(package, file, packages)
            folders = [] if own is None else [own]
        else:
            relative, folders = name, [file.resolve().parent, *workspace, *packages]
        read = (meshes_in_folder(folder)(relative) for folder in folders)
        data = next((each for each in read if each is not None), None)
        if data is not None:
            found[name] = data
    return found
