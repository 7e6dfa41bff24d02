"""The OpenAPI document as the code of a checkout makes it: `python -m clients.document > openapi.json`."""

from __future__ import annotations

import sys
from functools import cache
from typing import Any

import orjson

from api.base.settings import Settings
from api.http.openapi import completed, described_by_fastapi, schema_names
from api.http.routers import ROUTERS
from api.work.tasks.openapi import formats_of_plans, forms_of_answers, schemas_named


@cache
def openapi_document(max_waypoints: int) -> dict[str, Any]:
    """Make the document of a service that takes so many waypoints in one request."""
    described = described_by_fastapi([route for router in ROUTERS for route in router.routes])
    schemas = schemas_named(**schema_names(described), max_waypoints=max_waypoints)
    return completed(described, {"schemas": schemas, "forms": forms_of_answers(), "formats": formats_of_plans()})


def document() -> bytes:
    """Write the document of a service with the default settings."""
    caps = Settings.model_construct()
    return orjson.dumps(openapi_document(caps.max_waypoints), option=orjson.OPT_INDENT_2)


if __name__ == "__main__":
    sys.stdout.buffer.write(document())
