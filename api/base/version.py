"""The version of the service."""

from __future__ import annotations

import tomllib
from functools import cache
from importlib.metadata import version
from pathlib import Path

NAME = "trajectory-planner"
"""The name of the package."""

PROJECT = Path(__file__).parents[1] / "pyproject.toml"
"""The file that says the version, where the package runs from a checkout: it may have been changed since the package
was installed from there."""


@cache
def service_version() -> str:
    """Read the version of the checkout or, where there is none, of the installed package."""
    if not PROJECT.is_file():
        return version(NAME)
    project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
    return str(project["version"])
