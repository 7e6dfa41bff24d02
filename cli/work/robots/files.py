"""The robot that a command line names: one of the catalogue, or one described in a file."""

from __future__ import annotations

import base64
import re
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any
from zipfile import ZIP_DEFLATED, ZipFile

import orjson
from pydantic import TypeAdapter, ValidationError

from api.base.errors import invalid_at, invalid_request
from api.contract.robots import RobotDefinition, RobotModel, UrdfModel, UrdfRobot
from api.store.contents.digests import canonical
from api.store.contents.mesh_archive import MeshArchive
from api.work.conversion.kept_meshes import keep_meshes
from api.work.conversion.robots import to_robot
from api.work.tasks.robots import without_name
from planner import read_robot_files
from planner.robots import load_robot

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.robots import Robot

LONGEST_ID = 64
"""The most characters of a robot's id."""


@dataclass(frozen=True)
class FileOptions:
    """Options for the file of a robot.

    Attributes:
        srdf: The SRDF file; None: the file's own, if it has one.
        tip_frame: The link that poses are about; None: the one at the end of the arm.
        arguments: Names and values of arguments of a xacro file.
        packages: Folders that have the folders of ROS packages.
        calibration: The calibration file of an arm of Universal Robots.
        joint_limits: The `joint_limits.yaml`.
    """

    srdf: Path | None = None
    tip_frame: str | None = None
    arguments: tuple[tuple[str, str], ...] = ()
    packages: tuple[Path, ...] = ()
    calibration: Path | None = None
    joint_limits: Path | None = None


NO_OPTIONS = FileOptions()
"""A file alone."""


@dataclass(frozen=True)
class NamedRobot:
    """The robot of a command line.

    Attributes:
        id: Its id; that of a file is the file's name without its suffix.
        model: The model in a file; None: the id is one of the catalogue.
    """

    id: str
    model: RobotModel | None = None

    def load(self) -> Robot:
        """Make the robot.

        Raises:
            UnknownRobot: There is none with this id.
            InvalidRobotModel: The file's model cannot be used.
        """
        return load_robot(self.id) if self.model is None else to_robot(self.model, self.id)

    @property
    def definition(self) -> bytes | None:
        """The model as the service keeps it, as canonical JSON; None: the service has the robot in its catalogue."""
        return None if self.model is None else canonical(self.model, exclude={"id", "visibility"})


def named_robot(name: str, options: FileOptions = NO_OPTIONS) -> NamedRobot:
    """Find the robot of a name: in a file if there is one, or else in the catalogue.

    Args:
        name: The path of a URDF, xacro or MJCF file, or of a JSON file with a request of POST /v1/robots, or an id.
        options: Options for the file, if it is not JSON.

    Raises:
        OSError: A file cannot be read.
        UnicodeDecodeError: A file is no text.
        InvalidRequest: There are options, but no file that they go with; a JSON file has no request.
        InvalidRobotModel: The file cannot be expanded, compiled or used.
    """
    path = Path(name)
    is_described = path.is_file() and path.suffix == ".json"
    if (is_described or not path.is_file()) and options != NO_OPTIONS:
        message = f"must be a URDF, xacro or MJCF file where options are given; got {name}"
        raise invalid_at("/robot", message)
    if not path.is_file():
        return NamedRobot(name)
    definition = _described_robot(path) if is_described else robot_request(path, options)
    robot_id, model = definition.id or _id_of(path), without_name(definition, None)
    if isinstance(model, UrdfModel):
        files = MeshArchive(definition.meshes) if definition.meshes else {}
        model, _ = keep_meshes(model, to_robot(model, robot_id), files)
    return NamedRobot(robot_id, model)


def robot_request(path: Path, options: FileOptions = NO_OPTIONS) -> UrdfRobot:
    """Make the request of POST /v1/robots for a robot in a URDF, xacro or MJCF file, with its meshes.

    Raises:
        OSError: A file cannot be read.
        UnicodeDecodeError: A file is no text.
        InvalidRobotModel: The file cannot be expanded or compiled.
    """
    files = read_robot_files(
        path,
        arguments=dict(options.arguments),
        packages=options.packages,
        calibration=options.calibration,
        joint_limits=options.joint_limits,
    )
    return UrdfRobot(
        kind="urdf",
        id=_id_of(path),
        urdf=files.urdf,
        srdf=files.srdf if options.srdf is None else options.srdf.read_text(encoding="utf-8"),
        tip_frame=options.tip_frame,
        meshes=_archive(files.meshes) if files.meshes else None,
    )


def _archive(meshes: Mapping[str, bytes]) -> str:
    """Return a zip archive in base64, with each mesh at the path that its address has in its package."""
    archive = BytesIO()
    with ZipFile(archive, "w", ZIP_DEFLATED) as written:
        for name, content in meshes.items():
            written.writestr((name.partition("://")[2] or name).lstrip("/"), content)
    return base64.b64encode(archive.getvalue()).decode()


def _described_robot(path: Path) -> Any:
    """Read the robot in a request of POST /v1/robots; one derived from another needs that in the catalogue."""
    try:
        document = orjson.loads(path.read_bytes())
        return TypeAdapter(RobotDefinition).validate_python(document)
    except orjson.JSONDecodeError as error:
        raise invalid_at("", f"not JSON: {error}") from None
    except ValidationError as error:
        raise invalid_request(error, document) from None


def _id_of(path: Path) -> str:
    """Return the id of a robot in a file."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", path.stem).lstrip("_.-")[:LONGEST_ID] or "robot"
