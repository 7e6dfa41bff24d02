"""Answers checked against their schemas."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pydantic import BaseModel

if TYPE_CHECKING:
    from httpx import Response


def checked(answer: Response, schema: type[BaseModel], status: int = 200) -> dict[str, Any]:
    """Return the answer as JSON if it matches its schema: no missing field, no extra field, no other type."""
    assert answer.status_code == status, answer.text
    assert answer.headers["Content-Type"] == "application/json"
    document: dict[str, Any] = answer.json()
    model = schema.model_validate_json(answer.content, strict=True)
    assert model.model_dump(mode="json", exclude_unset=True) == document
    return document
