"""GET /llms.txt: the operations for language models."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from tests.api.conftest import RunningService


def test_the_guide_lists_every_operation_of_the_document(service: RunningService) -> None:
    answer = service.client.get("/llms.txt")
    assert answer.headers["content-type"].startswith("text/plain")
    assert answer.text.startswith("# Trajectory planner\n\n> ")
    operation = r"^- \[(GET|POST|PUT|PATCH|DELETE) (\S+)\]\(/openapi\.json\): (.+)$"
    listed = re.findall(operation, answer.text, flags=re.MULTILINE)
    paths = service.client.get("/openapi.json").json()["paths"]
    assert listed == [
        (method.upper(), path, described["summary"])
        for path, methods in paths.items()
        for method, described in methods.items()
    ]
