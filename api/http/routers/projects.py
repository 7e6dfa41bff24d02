"""Projects of the page, kept in the database as they are: no worker looks at them."""

from __future__ import annotations

from http import HTTPStatus
from typing import TYPE_CHECKING, Annotated, Any, NoReturn
from urllib.parse import quote

import orjson
from fastapi import Header, Request, Response
from pydantic.json_schema import SkipJsonSchema

from api.base.errors import ProjectChanged, ProjectOfAnother, TooManyProjects, UnknownProject
from api.base.pages import DEFAULT_ENTRIES, first_page
from api.contract import stored_projects as schemas
from api.http.access.access import audit
from api.http.dependencies import Cursor, Limit, ProjectName, client, needs, read_object, service_of
from api.http.described import DATABASE_CODES, NOT_MODIFIED, returns, takes
from api.http.replies import is_known, is_named, not_modified, respond
from api.http.router import Router
from api.http.transport.answer import Answer
from api.store.contents.projects import project_content
from api.store.named_contents import PROJECTS, Bounds

if TYPE_CHECKING:
    from collections.abc import Callable

    from sqlalchemy import Connection

    from api.base.settings import Settings
    from api.store.clients import Client
    from api.store.contents.projects import ProjectContent

IfMatch = Annotated[
    str | SkipJsonSchema[None],
    Header(
        alias="If-Match",
        description="The `ETag` of the state that is to be changed; the answer is `project_changed` if the project has "
        "another state, or is gone. Omitted: any state.",
    ),
]
IfNoneMatch = Annotated[
    str | SkipJsonSchema[None],
    Header(
        alias="If-None-Match",
        description="`*`: the answer is `project_changed` if there is a project of this name. Omitted: it is replaced.",
    ),
]

SAVING_CODES = ("invalid_request", "payload_too_large", "unsupported_media_type", *DATABASE_CODES)
"""Codes of the problem documents that may answer a request to save a project."""

router = Router(tags=["projects"])


@router.get(
    "/v1/projects",
    summary="List the saved projects of the page, in pages.",
    description="The list has summaries; `get_project` has the projects.",
    dependencies=[needs("plan")],
    responses=returns(schemas.ProjectsAnswer, codes=("invalid_request", *DATABASE_CODES)),
)
async def list_projects(request: Request, limit: Limit = DEFAULT_ENTRIES, cursor: Cursor = None) -> Response:
    """Answer GET /v1/projects: a page."""
    found = await service_of(request).database.read(PROJECTS.behind, client(request).namespace, cursor or "", limit + 1)
    page, has_more = first_page(found, limit)
    answer = {
        "projects": [orjson.Fragment(summary) for _, summary in page],
        "next_cursor": page[-1][0] if has_more else None,
    }
    return Answer([orjson.dumps(answer)], HTTPStatus.OK, "application/json", {})


@router.get(
    "/v1/projects/{name}",
    summary="Get a project of the page.",
    description="The answer is the project, byte for byte as it was saved. Its `ETag` names its state.",
    dependencies=[needs("plan")],
    responses=returns(schemas.Project, codes=("invalid_request", "unknown_project", *DATABASE_CODES), shared=True)
    | NOT_MODIFIED,
)
async def get_project(request: Request, name: ProjectName) -> Response:
    """Answer GET /v1/projects/{name}."""
    content = await service_of(request).database.read(PROJECTS.find, client(request).namespace, name)
    if content is None:
        raise _unknown()
    tag = _tag(content.digest)
    if is_known(request, tag):
        return respond(not_modified(tag))
    return Answer([content.definition], HTTPStatus.OK, "application/json", {"ETag": tag})


@router.put(
    "/v1/projects/{name}",
    summary="Save a project of the page under a name.",
    description="It replaces an earlier project of this name; `If-Match` and `If-None-Match` say which one. A project "
    "that is saved again as it is stays as it is. Where the service requires keys, only the same key sees the project.",
    status_code=201,
    dependencies=[needs("projects:write")],
    responses=returns(
        schemas.ProjectSummary,
        codes=(*SAVING_CODES, "project_changed", "project_of_another", "too_many_projects"),
        status=201,
        also={200: "It replaces an earlier project of this name, or equals it."},
        shared=True,
    ),
    openapi_extra=takes(schemas.Project),
)
async def put_project(
    request: Request, name: ProjectName, match: IfMatch = None, none_match: IfNoneMatch = None
) -> Response:
    """Answer PUT /v1/projects/{name}."""
    definition, _ = await read_object(request)
    service, content = service_of(request), project_content(definition)
    outcome, entry = await service.database.write(
        _put, client(request), name, content, _bounds(service.settings), _condition(match, none_match)
    )
    if outcome in {"added", "replaced"}:
        audit(request, f"project_{outcome}", name)
    elif outcome != "same":
        await _refuse(request, outcome, name)
    headers = {"ETag": _tag(content.digest)}
    if outcome != "added":
        return Answer([entry], HTTPStatus.OK, "application/json", headers)
    location = {"Location": f"/v1/projects/{quote(name, safe='')}"}
    return Answer([entry], HTTPStatus.CREATED, "application/json", headers | location)


@router.delete(
    "/v1/projects/{name}",
    summary="Delete a project of the page.",
    description="Projects of other clients cannot be deleted.",
    status_code=204,
    dependencies=[needs("projects:write")],
    responses=returns(
        None,
        codes=("invalid_request", "unknown_project", "project_changed", "project_of_another", *DATABASE_CODES),
        status=204,
    ),
)
async def delete_project(request: Request, name: ProjectName, match: IfMatch = None) -> Response:
    """Answer DELETE /v1/projects/{name}."""
    sender = client(request)
    outcome = await service_of(request).database.write(
        PROJECTS.delete, sender.namespace, name, sender.changes_of, _condition(match, None)
    )
    if outcome != "deleted":
        await _refuse(request, outcome, name)
    audit(request, "project_deleted", name)
    return Response(status_code=HTTPStatus.NO_CONTENT)


def _put(
    connection: Connection,
    sender: Client,
    name: str,
    content: ProjectContent,
    bounds: Bounds,
    is_expected: Callable[[str | None], bool],
) -> tuple[str, bytes]:
    """Save a project, and return what became of it, and its entry in the list of projects."""
    outcome = PROJECTS.put(
        connection, sender.namespace, name, content, sender.name, sender.changes_of, bounds, is_expected
    )
    return outcome, PROJECTS.entry_of(connection, sender.namespace, name) or b""


def _condition(match: str | None, none_match: str | None) -> Callable[[str | None], bool]:
    """Make the condition of a request on the digest of the earlier content; None: there is none (RFC 9110, 13.1).

    A weak tag counts as the strong one: a proxy that compresses answers makes the tags weak, and the digests are those
    of the project.
    """

    def is_met(digest: str | None, header: str) -> bool:
        return digest is not None and (is_named("*", header) or is_named(_tag(digest), header))

    def is_expected(digest: str | None) -> bool:
        return (match is None or is_met(digest, match)) and not (none_match is not None and is_met(digest, none_match))

    return is_expected


def _tag(digest: str) -> str:
    """Write the `ETag` of a project."""
    return f'"{digest}"'


def _bounds(settings: Settings) -> Bounds:
    """Find the bounds on projects."""
    return Bounds(
        settings.max_projects,
        settings.max_projects_per_client,
        settings.max_projects_bytes,
        settings.max_projects_bytes_per_client,
    )


async def _refuse(request: Request, outcome: str, name: str) -> NoReturn:
    """Refuse to change a project."""
    match outcome:
        case "unknown":
            raise _unknown()
        case "changed":
            found: dict[str, Any] = await service_of(request).database.read(
                PROJECTS.digests, client(request).namespace, {name}
            )
            if not found:
                raise ProjectChanged("There is no project of this name any more. Omit `If-Match` to save it anew.")
            message = "The project has another state than the request expects. `ETag` names the present one."
            raise ProjectChanged(message, headers={"ETag": _tag(found[name])})
        case "of_another":
            raise ProjectOfAnother(
                "Only the client that saved the project may change or delete it: the same key, or the same address. "
                "Save under another name."
            )
        case "full":
            raise TooManyProjects("The service keeps no more projects. Delete one first.")
        case _:
            raise TooManyProjects(
                "The service keeps no more projects of this client, or none as large. Delete one first."
            )


def _unknown() -> UnknownProject:
    return UnknownProject("No project has this name. GET /v1/projects lists them.")
