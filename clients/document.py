"""The OpenAPI document as the code of a checkout makes it: `python -m clients.document > openapi.json`."""

from __future__ import annotations

import sys

import orjson

from api.openapi import openapi_document
from api.settings import Settings


def document() -> bytes:
    """Write the document of a service with the default settings."""
    caps = Settings.model_construct()
    return orjson.dumps(openapi_document(caps.max_waypoints), option=orjson.OPT_INDENT_2)


if __name__ == "__main__":
    sys.stdout.buffer.write(document())
