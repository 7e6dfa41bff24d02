"""Bodies and answers about projects of the page that the service keeps."""

from __future__ import annotations

from pydantic import BaseModel, ConfigDict

from api.contract.parts.common import Answer


class Project(BaseModel):
    """A project as the page saves it: a plan request. Any other JSON object is kept, too; nothing in it is checked."""

    model_config = ConfigDict(extra="allow", frozen=True, defer_build=True)


class ProjectSummary(Answer):
    """A saved project, without its content."""

    name: str
    """The name of the project."""
    changed: str
    """The time at which it was saved last (RFC 3339)."""
    content: str
    """The SHA-256 of its JSON, `sha256:...`: it changes with the project. In double quotes it is the `ETag`."""
    size: int
    """The size of its JSON, bytes."""


class ProjectsAnswer(Answer):
    """A page of the projects that are kept."""

    projects: list[ProjectSummary]
    """The projects, in the order of the names."""
    next_cursor: str | None
    """The `cursor` of the next page; null: this is the last."""
