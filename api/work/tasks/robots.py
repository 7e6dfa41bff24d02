"""Robots: the catalogue, and the models of uploaded ones, which the server keeps (`api/store/`)."""

from __future__ import annotations

from dataclasses import asdict
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import orjson

from api.base.errors import CatalogueRobot, invalid_at
from api.base.pages import first_page
from api.contract import robots as schemas
from api.pool.messages import Reply
from api.store.contents.digests import canonical, sha256
from api.store.contents.mesh_archive import MeshArchive
from api.store.contents.robots import RobotContent
from api.work.answers.gltf import collision_gltf, visual_gltf
from api.work.answers.negotiation import MediaType, negotiated
from api.work.answers.robots import describe, describe_collision_geometry
from api.work.conversion.kept_meshes import drawn_visuals, keep_meshes
from api.work.conversion.robots import to_robot
from api.work.tasks.context import JSON, model_of, robot_of, task, to_json
from planner.errors import UnknownRobot
from planner.robots import catalogue_ids, load_robot

if TYPE_CHECKING:
    from api.work.tasks.context import TaskContext

BINARY_GLTF = "model/gltf-binary"
"""The media type of the binary form of glTF."""


FORMS_OF_GEOMETRY = {
    "json": MediaType(JSON),
    "gltf": MediaType("model/gltf+json"),
    "glb": MediaType(BINARY_GLTF),
    "svg": MediaType("image/svg+xml"),
    "png": MediaType("image/png"),
}
"""The forms of what of a robot can collide, by the names that `?format=` has for them."""

MOST_DERIVATIONS = 8
"""The most robots that a robot is derived from one after the other."""


@task("list_robots")
def list_robots(context: TaskContext) -> Reply:
    """Answer GET /v1/robots; the argument `added` is a page of the uploaded ones that come after the `cursor`."""
    asked = context.arguments
    with context.stage("plan"):
        places = {f"catalogue.{robot_id}": robot_id for robot_id in catalogue_ids()}
        behind = ((place, _summarised(robot_id)) for place, robot_id in places.items() if place > asked["cursor"])
        robots = [*behind, *asked["added"]]  # their places come behind all of the catalogue
        page, has_more = first_page(robots, asked["limit"])
        more = has_more or asked["has_more"]
    answer = {"robots": [orjson.Fragment(robot) for _, robot in page], "next_cursor": page[-1][0] if more else None}
    return context.reply(answer)


@task("get_robot")
def get_robot(context: TaskContext) -> Reply:
    """Answer GET /v1/robots/{id} where the server keeps no robot of this id."""
    with context.stage("plan"):
        if context.arguments["id"] not in catalogue_ids():
            raise _no_such_robot()
        description = _described(context.arguments["id"])
    return context.reply(orjson.Fragment(description))


@task("add_robot")
def add_robot(context: TaskContext) -> Reply:
    """Answer POST /v1/robots: read the model. The server keeps the content that comes back in `result`."""
    with context.stage("validate"):
        named = context.request(schemas.RobotDefinition)
        if named.id in catalogue_ids():
            raise CatalogueRobot(f"{named.id} is a robot of the catalogue. Choose another id.")
        files = MeshArchive(named.meshes) if isinstance(named, schemas.UrdfRobot) and named.meshes else {}
        model = without_name(named, context.arguments.get("definition"))
    with context.stage("plan"):
        robot = to_robot(model, named.id or "added")
        remarks = robot.collision_findings if isinstance(model, schemas.DhModel) else ()
        visuals = b""
        if isinstance(model, schemas.UrdfModel):
            model, remarks = keep_meshes(model, robot, files)
            visuals, of_visuals = drawn_visuals(robot, files)
            model = model.model_copy(update={"visuals": sha256(visuals) if visuals else None})
            remarks = (*remarks, *of_visuals)
    definition = canonical(model, exclude={"id", "visibility"})
    digest = sha256(definition)
    robot_id = named.id or "dh_" + digest.removeprefix("sha256:")[:16]
    description = describe(robot) | {"id": robot_id, "content": digest}
    answer = description | {"findings": [asdict(finding) for finding in (*robot.findings, *remarks)]}
    del description["id"]
    content = RobotContent(digest, definition, to_json(description), to_json(_summary(description)), visuals)
    return context.reply(
        answer, 201, headers={"Location": f"/v1/robots/{robot_id}"}, result=(robot_id, named.visibility, content)
    )


def without_name(named: Any, base: bytes | None) -> Any:
    """Return the robot without its name; a derived one with the definition of the robot that it is made from.

    Args:
        named: The robot to add.
        base: The definition of the added robot that it names; None: it names none, or one of the catalogue.

    Raises:
        InvalidRequest: It is derived too many times over.
    """
    if isinstance(named, schemas.UrdfRobot):
        return schemas.UrdfModel(**{name: getattr(named, name) for name in schemas.UrdfDocument.model_fields})
    if not isinstance(named, schemas.DerivedRobot):
        return named
    changes: dict[str, Any] = {name: getattr(named, name) for name in schemas.Changes.model_fields}
    if base is None:
        return schemas.DerivedModel(**changes | {"from": named.base, "definition": None})
    definition = inner = model_of(base)
    for _ in range(MOST_DERIVATIONS):
        if not isinstance(inner, schemas.DerivedModel):
            return schemas.DerivedModel(**changes | {"from": None, "definition": definition})
        inner = inner.definition
    message = f"must be derived less than {MOST_DERIVATIONS} times over. Derive from a robot before {named.base}."
    raise invalid_at("/from", message)


@task("get_robot_geometry")
def get_robot_geometry(context: TaskContext) -> Reply:
    """Answer GET /v1/robots/{id}/geometry; the argument `definition` is that of an added robot."""
    robot_id, definition = context.arguments["id"], context.arguments.get("definition")
    with context.stage("plan"):
        form = negotiated(context.arguments.get("format"), context.arguments.get("accept", "*/*"), FORMS_OF_GEOMETRY)
        if definition is None and robot_id not in catalogue_ids():
            raise _no_such_robot()
        robot = robot_of(robot_id, definition)
        if form.media_type == JSON:
            answer = describe_collision_geometry(robot)
        elif form.media_type.startswith("image/"):
            from planner.plots.picture import draw_robot_at

            picture = draw_robot_at(robot)
            drawing = picture.png() if form.media_type == "image/png" else picture.svg()
        else:
            drawing = collision_gltf(robot, binary=form.media_type == BINARY_GLTF)
    if form.media_type == JSON:
        return context.reply(answer)
    return Reply(200, form.media_type, drawing, context.timings)


@task("get_robot_visuals")
def get_robot_visuals(context: TaskContext) -> Reply:
    """Answer GET /v1/robots/{id}/visuals where the server keeps none; `definition` is that of an added robot."""
    robot_id, definition = context.arguments["id"], context.arguments.get("definition")
    with context.stage("plan"):
        if definition is None and robot_id not in catalogue_ids():
            raise _no_such_robot()
        visuals = visual_gltf(robot_of(robot_id, definition))
    return Reply(200, BINARY_GLTF, visuals, context.timings)


@task("delete_robot")
def delete_robot(context: TaskContext) -> Reply:
    """Refuse DELETE /v1/robots/{id} where the server keeps no robot of this id."""
    if context.arguments["id"] in catalogue_ids():
        raise CatalogueRobot(f"{context.arguments['id']} is a robot of the catalogue, which cannot be deleted.")
    raise _no_such_robot()


def _no_such_robot() -> UnknownRobot:
    return UnknownRobot("No robot has this id. GET /v1/robots lists them.")


def _summary(description: dict[str, Any]) -> dict[str, Any]:
    return {name: description[name] for name in schemas.RobotSummary.model_fields if name in description}


@lru_cache(maxsize=1024)
def _summarised(robot_id: str) -> bytes:
    return to_json(_summary(orjson.loads(_described(robot_id))))


@lru_cache(maxsize=1024)
def _described(robot_id: str) -> bytes:
    return to_json(describe(load_robot(robot_id)) | {"content": None})
