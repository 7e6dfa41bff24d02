"""Reads YAML files of ROS, with the angles in degrees that they may have."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner.robots.files.documents import invalid_file

UNITS = {"!radians": 1.0, "!degrees": math.pi / 180.0, "!meters": 1.0, "!millimeters": 1e-3}
"""The units that xacro knows in YAML, in rad or m."""


def read_yaml(path: Path) -> Mapping[str, Any]:
    """Read a YAML file that is a mapping.

    Raises:
        OSError: The file cannot be read.
        InvalidRobotModel: It is no such file, or PyYAML is not installed.
    """
    try:
        import yaml
    except ModuleNotFoundError:
        message = f"{path.name} is a YAML file; install `pyyaml`, or the extra `models`"
        raise invalid_file("missing_package", message) from None

    loader: Any = type("Loader", (yaml.SafeLoader,), {})  # units are not for all users of PyYAML

    for tag, unit in UNITS.items():
        loader.add_constructor(tag, lambda own, node, unit=unit: float(own.construct_scalar(node)) * unit)
    try:
        document = yaml.load(path.read_text(encoding="utf-8"), loader)  # noqa: S506 - a safe loader
    except (yaml.YAMLError, ValueError) as error:
        raise invalid_file("not_yaml", f"{path.name} is not YAML: {error}") from error
    if not isinstance(document, dict):
        raise invalid_file("not_yaml", f"{path.name} has no fields")
    return document


def mapping_in(values: Mapping[str, Any], key: str, path: Path) -> Mapping[str, Any]:
    """Return a field that is a mapping.

    Raises:
        InvalidRobotModel: There is none.
    """
    value = values.get(key)
    if not isinstance(value, dict):
        raise invalid_file("missing_field", f"{path.name} must have the field {key} with fields of its own")
    return value


def number_in(values: Mapping[str, Any], key: str, path: Path) -> float:
    """Return a field that is a finite number.

    Raises:
        InvalidRobotModel: There is none.
    """
    value = values.get(key)
    if not isinstance(value, int | float) or isinstance(value, bool) or not math.isfinite(value):
        raise invalid_file("not_a_number", f"{path.name}: `{key}` must be a number; got {value!r}")
    return float(value)
