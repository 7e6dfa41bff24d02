"""The OpenAPI document as the code of a checkout makes it: `python -m clients.document > openapi.json`."""

from __future__ import annotations

import sys
import tomllib
from pathlib import Path

import orjson

import api
from api.openapi import openapi_document
from api.settings import Settings


def document() -> bytes:
    """Write the document of a service with the default settings, with the checkout's version, installed or not."""
    caps = Settings.model_construct()
    made = openapi_document(caps.max_waypoints)
    project = tomllib.loads(Path(api.__file__).parents[1].joinpath("pyproject.toml").read_text())["project"]
    made["info"]["version"] = project["version"]
    return orjson.dumps(made, option=orjson.OPT_INDENT_2)


if __name__ == "__main__":
    sys.stdout.buffer.write(document())
