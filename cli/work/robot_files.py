"""The robot that a command line names: one of the catalogue, or one described in a file."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import orjson
from pydantic import TypeAdapter, ValidationError

from api.base.errors import invalid, invalid_request
from api.contract.robots import RobotDefinition, RobotModel, UrdfModel
from api.store.contents.digests import canonical
from api.work.conversion.problems import to_robot
from api.work.tasks.robots import without_name
from planner.robots import load_robot

if TYPE_CHECKING:
    from planner.robots import Robot

LONGEST_ID = 64
"""The most characters of a robot's id."""


@dataclass(frozen=True)
class NamedRobot:
    """The robot of a command line.

    Attributes:
        id: Its id; that of a URDF file is the file's name without its suffix.
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


def named_robot(name: str, srdf: Path | None = None, tip_frame: str | None = None) -> NamedRobot:
    """Find the robot of a name: in a file if there is one, or else in the catalogue.

    Args:
        name: The path of a URDF file, or of a JSON file with a request of POST /v1/robots, or an id.
        srdf: The SRDF file that goes with a URDF file.
        tip_frame: The link of a URDF file that poses are about; None: the one at the end of the arm.

    Raises:
        OSError: A file cannot be read.
        UnicodeDecodeError: A file is no text.
        InvalidRequest: An SRDF file or a tip frame goes with no URDF file; a JSON file has no request.
    """
    path = Path(name)
    is_urdf = path.is_file() and path.suffix != ".json"
    if not is_urdf and (srdf is not None or tip_frame is not None):
        raise invalid([{"pointer": "/robot", "message": f"an SRDF or a tip goes with a URDF file; {name} is none"}])
    if not path.is_file():
        return NamedRobot(name)
    if not is_urdf:
        return _described_robot(path)
    model = UrdfModel(
        kind="urdf",
        urdf=path.read_text(encoding="utf-8"),
        srdf=None if srdf is None else srdf.read_text(encoding="utf-8"),
        tip_frame=tip_frame,
    )
    return NamedRobot(_id_of(path), model)


def _described_robot(path: Path) -> NamedRobot:
    """Read the robot in a request of POST /v1/robots; one derived from another needs that in the catalogue."""
    try:
        document = orjson.loads(path.read_bytes())
        definition = TypeAdapter(RobotDefinition).validate_python(document)
    except orjson.JSONDecodeError as error:
        raise invalid([{"pointer": "", "message": f"not JSON: {error}"}]) from None
    except ValidationError as error:
        raise invalid_request(error, document) from None
    return NamedRobot(definition.id or _id_of(path), without_name(definition, None))


def _id_of(path: Path) -> str:
    """Return the id of a robot in a file."""
    return re.sub(r"[^A-Za-z0-9_.-]+", "_", path.stem).lstrip("_.-")[:LONGEST_ID] or "robot"
