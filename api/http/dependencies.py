"""The dependencies of routes: the client with its key and allowance, the body, the page, the form of the answer."""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Annotated, Any

from fastapi import Path, Query, Request, Security
from fastapi.security import HTTPBearer, SecurityScopes
from pydantic.json_schema import SkipJsonSchema
from typing_extensions import override

from api.base.errors import PayloadTooLarge, UnsupportedMediaType, invalid_at
from api.base.pages import MOST_ENTRIES
from api.base.size import parse_json, refuse_many_rows
from api.contract.cells import MOST_ROBOTS
from api.contract.parts.common import DEFAULT_DEADLINE
from api.contract.parts.free_motions import may_have_free_motions
from api.pool.jobs import queue_is_full
from api.store.clients import Client
from api.store.contents.digests import sha256
from api.store.named_contents import ROBOTS, SCENES
from api.store.roadmaps import find_roadmap

if TYPE_CHECKING:
    from fastapi.params import Security as Dependency

    from api.base.api_keys import Scope
    from api.http.access.access import Access
    from api.http.service import Service


def service_of(request: Request) -> Service:
    """Find the service that received the request."""
    service: Service = request.app.state.service
    return service


def client(request: Request) -> Client:
    """Find the client that sent the request."""
    sender: Client = request.state.client
    return sender


class Admission(HTTPBearer):
    """The scheme by which clients identify themselves, and the dependency that lets them in.

    A service on a loopback address asks for no key, so no operation requires one in the OpenAPI document.
    """

    def __init__(self) -> None:
        super().__init__(
            scheme_name="key",
            description="An API key, where the service requires one; every operation names the scope that its key "
            "needs.",
        )

    @override
    async def __call__(self, request: Request, needed: SecurityScopes) -> None:  # type: ignore[override]
        """Let the client in while its request is answered, or refuse it before the body is read.

        Raises:
            Unauthorized, Forbidden, DatabaseUnavailable: See `Access.key_of`.
            TooManyRequests: See `Allowance.enter` and `Quota.take`.
            Overloaded: Too many requests wait for a worker.
        """
        access: Access = service_of(request).access
        request.state.scope = needed.scopes[0]
        if not access.asks_for_keys:
            _refuse_if_full(request)
            return
        key = await access.key_of(request.headers, request.state.scope)
        request.state.client = Client(f"key:{key.id}", key.scopes, has_key=True)
        request.state.share.client = client(request).name
        allowance, quota = access.allowance_of(key), access.quota_of(key)
        request.state.quota = quota
        allowance.enter(time.monotonic())
        request.state.until_answered.append(allowance.leave)
        _refuse_if_full(request)
        if quota is not None:
            await quota.take(1)
        request.state.grants = [allowance, *([] if quota is None else [quota])]


ADMISSION = Admission()
"""What lets clients in."""


def needs(scope: Scope) -> Dependency:
    """Require a key with a scope, where the service requires keys."""
    dependency: Dependency = Security(ADMISSION, scopes=[scope])
    return dependency


def _refuse_if_full(request: Request) -> None:
    """Refuse a request with a body, before that is read, where there is no room for it."""
    if request.method in ("POST", "PATCH") and service_of(request).pool.is_full(client(request).name):
        raise queue_is_full()


@dataclass(frozen=True)
class Body:
    """The body of a request, with the fields that the server reads; a worker validates it.

    Attributes:
        content: The bytes as they came.
        document: The body as JSON, which need not follow any schema.
        deadline: The time that the answer may take from the arrival of the request, s.
        named: The ids of the robots to use, or to derive another `from`, that no client has added.
        contents: The definitions that the ids in the body stand for: `definition` of an added robot and `scene` of a
            scene. `definitions` has the added robots of a cell by their ids. With a free motion in a scene also the
            `roadmap` of the robot there.
    """

    content: bytes = b""
    document: Mapping[str, Any] = field(default_factory=dict)
    deadline: float = DEFAULT_DEADLINE
    named: frozenset[str] = frozenset()
    contents: Mapping[str, Any] = field(default_factory=dict)


async def read_body(request: Request) -> Body:
    """Read the body, within the bounds of the service, and the definitions that it names.

    Raises:
        UnsupportedMediaType: It is not declared to be JSON.
        PayloadTooLarge: It is larger than the service reads.
        Overloaded: There is no room for it now.
        InvalidRequest: It is no JSON object.
    """
    return await body_of(request, *await read_object(request))


async def read_object(request: Request) -> tuple[bytes, dict[str, Any]]:
    """Read the body as its bytes and as a JSON object; see `read_body` for the refusals."""
    content = await _content(request)
    return content, _parse(content, service_of(request).settings.max_body_bytes)


async def body_of(request: Request, content: bytes, document: Mapping[str, Any]) -> Body:
    """Find the contents that the ids in a body name.

    Args:
        request: The request.
        content: The bytes of the body.
        document: The body as JSON.
    """
    service = service_of(request)
    named, of_cell = document.get("robot", document.get("from")), _robots_of_cell(document)
    contents: dict[str, Any] = {}
    namespace, scene_id = client(request).namespace, document.get("scene")
    definitions: dict[str, bytes] = {}
    names = frozenset(name for name in (named, *of_cell) if isinstance(name, str))
    for name in sorted(names - service.catalogue):
        robot = await service.database.read(ROBOTS.find, namespace, name)
        definitions |= {} if robot is None else {name: robot.definition}
    if isinstance(named, str) and named in definitions:
        contents["definition"] = definitions[named]
    if of_cell and definitions:
        contents["definitions"] = definitions
    if isinstance(scene_id, str):
        scene = await service.database.read(SCENES.find, namespace, scene_id)
        contents |= {} if scene is None else {"scene": scene.definition}
        if scene is not None and isinstance(named, str) and may_have_free_motions(document):
            of_robot = sha256(definitions[named]) if named in definitions else ""
            roadmap = await service.database.read(find_roadmap, namespace, scene_id, scene.digest, named, of_robot)
            contents |= {} if roadmap is None else {"roadmap": roadmap}
    deadline = document.get("deadline")
    if isinstance(deadline, bool) or not isinstance(deadline, int | float) or deadline <= 0.0:
        deadline = DEFAULT_DEADLINE  # it is omitted, or the worker will refuse it
    of_catalogue = names - definitions.keys()
    return Body(content, document, min(deadline, service.settings.max_deadline), of_catalogue, contents)


def _robots_of_cell(document: Mapping[str, Any]) -> list[Any]:
    """Return the ids of the robots of a cell; a worker refuses too many robots, and ids of another type."""
    members = document.get("robots")
    rows = members[:MOST_ROBOTS] if isinstance(members, list) else []
    return [member.get("robot") for member in rows if isinstance(member, dict)]


class AdmittedBody(Admission):
    """The dependency that lets a client in, then reads the body of its request.

    It is one dependency: FastAPI takes as long to solve two as the server takes to parse a request.
    """

    @override
    async def __call__(self, request: Request, needed: SecurityScopes) -> Body:  # type: ignore[override]
        """Return the body; see `Admission` and `read_body` for the refusals."""
        await super().__call__(request, needed)
        return await read_body(request)


ADMITTED_BODY = AdmittedBody()
"""What lets clients in, with the bodies of their requests."""

PlannedBody = Annotated[Body, Security(ADMITTED_BODY, scopes=["plan"])]
"""The body of a request that a worker validates; it needs a key with the scope `plan`."""

RobotBody = Annotated[Body, Security(ADMITTED_BODY, scopes=["robots:write"])]
"""The same for the scope `robots:write`."""

SceneBody = Annotated[Body, Security(ADMITTED_BODY, scopes=["scenes:write"])]
"""The same for the scope `scenes:write`."""


def form_of_answer(request: Request) -> dict[str, Any]:
    """Read the requested form of the answer, `?format=` and `Accept`, as arguments of a task.

    It is no dependency: the document does not have it, and solving one takes a tenth of a millisecond.
    """
    return {"format": request.query_params.get("format"), "accept": request.headers.get("accept", "*/*")}


FormOfPlans = Annotated[
    str | SkipJsonSchema[None], Query(alias="format", description="Form of the plans; omitted: `json`.")
]
"""The form that the plans in the answer should have."""

Limit = Annotated[int, Query(ge=1, le=MOST_ENTRIES, description="Most entries of the page.")]
"""The number of entries that a page may have."""

Cursor = Annotated[
    str | SkipJsonSchema[None], Query(description="The `next_cursor` of the page before; omitted: the first page.")
]
"""The entry behind which a page begins."""

RobotId = Annotated[str, Path(alias="id", min_length=1, description="Id of a robot.")]
SceneId = Annotated[str, Path(alias="id", min_length=1, description="Id of a scene.")]
ProjectName = Annotated[
    str,
    Path(
        alias="name",
        min_length=1,
        max_length=100,
        pattern=r"^[^./\s][^/]*$",
        description="Name of a project: without `/`, and not beginning with a full stop or a space.",
    ),
]
BatchId = Annotated[str, Path(alias="id", min_length=1, description="Id of a batch.")]


def media_type_of(request: Request) -> str:
    """Read the media type of the body; without a header there is none, since any page may send that."""
    return request.headers.get("content-type", "").partition(";")[0].strip().lower()


def is_json(media_type: str) -> bool:
    """Tell whether a media type is that of JSON (RFC 6839)."""
    return media_type == "application/json" or (media_type.startswith("application/") and media_type.endswith("+json"))


async def _content(request: Request) -> bytes:
    """Read the bytes of the body, of no more than the allowed size, declared or not."""
    if not is_json(media_type_of(request)):
        raise UnsupportedMediaType("`Content-Type` must be `application/json`.")
    most = service_of(request).settings.max_body_bytes
    declared, body = request.headers.get("content-length", "0"), bytearray()
    size = int(declared) if declared.isdecimal() else 0
    if size <= most:
        async for chunk in request.stream():
            request.state.share.hold(len(chunk))
            body += chunk
            if len(body) > most:
                break
    if max(size, len(body)) > most:
        raise PayloadTooLarge(f"The body must have at most {most} bytes.", headers={"Connection": "close"})
    return bytes(body)


def _parse(body: bytes, max_body_bytes: int) -> dict[str, Any]:
    refuse_many_rows(body, max_body_bytes)
    document = parse_json(body)
    if not isinstance(document, dict):
        raise invalid_at("", "The body must be a JSON object.")
    return document
