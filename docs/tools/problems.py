"""Makes docs/problems.md from the problem codes of the service and the planner."""

from __future__ import annotations

from typing import NamedTuple

from api.base.errors import STATUS_OF_CODE, ServiceError
from planner.errors import PlanningError

HEADER = """\
# Problem codes

Generated from `api/base/errors.py` and `planner/errors.py` by `python -m docs.tools.problems > docs/problems.md`.

A refused request gets a problem document (RFC 9457). Its `type` is `urn:trajectory-planner:problem:CODE`; its `code` is
stable. `detail` has the cause in this request. `remedies` has changes to the request that the planner has proved by a
plan, where it found any. [The exceptions of the library](reference/errors.md) have the same codes and fields.
"""


class Advice(NamedTuple):
    """The usual cause of a problem, and what to do about it."""

    cause: str
    remedy: str


REQUEST = "Requests"
PLANNING = "Planning"
ACCESS = "Access"
STORED = "Stored robots, scenes, projects and batches"
LOAD = "Load and bounds"

ADVICE: dict[str, dict[str, Advice]] = {
    PLANNING: {
        "unreachable_waypoint": Advice(
            "A pose is farther than the arm reaches, or its orientation cannot be had there.",
            "Take the nearest pose of the answer, open directions with `free`, or move the work object.",
        ),
        "joint_position_limit": Advice(
            "A joint would have to leave its range on a tool motion or between waypoints.",
            "Take a remedy, choose another `configuration` of the waypoint, or move the path.",
        ),
        "configuration_change": Advice(
            "A tool motion ends in another configuration than the waypoint requests.",
            "Leave the configuration open, or move there with a `joint` motion.",
        ),
        "singular_path": Advice(
            "A tool motion passes a joint position where some direction of the tool is lost.",
            "Take a `joint` motion, move the path, or open a rotation of the tool with `free`.",
        ),
        "missing_dynamics": Advice(
            "The request needs torques, and the robot's model has no masses.",
            "Add masses to the model, or leave out torque limits and `min_effort`.",
        ),
        "payload_exceeded": Advice(
            "The payload is heavier than the maker's rating.",
            "Carry less, or take another robot. `limit` has the largest mass.",
        ),
        "infeasible_duration": Advice(
            "A given `duration` is shorter than the limits allow.",
            "Take the duration of a remedy, or leave `duration` out.",
        ),
        "limits_unsatisfiable": Advice(
            "No duration keeps a limit: gravity alone needs more torque, or a waypoint's given velocity is too high.",
            "Widen the limit that `detail` names, reduce the payload, or choose another joint position.",
        ),
        "start_in_collision": Advice(
            "The robot is closer to an object or to itself at the first waypoint than the margin allows.",
            "Correct the scene or the start, reduce the `margin`, or allow the pair in `allowed_pairs`.",
        ),
        "collision": Advice(
            "A motion or a waypoint comes closer to an object than the margin allows.",
            "Take a remedy: usually the motion becomes `free`, or the margin smaller.",
        ),
        "clearance_unproved": Advice(
            "The budget of the proof ended before the clearance was proved; the motion stays very close to something.",
            "Keep a larger distance, or simplify the shapes.",
        ),
        "no_path_found": Advice(
            "The search for a `free` motion ended without a collision-free path.",
            "Add a waypoint on the way, raise `most_checks`, or change what `enclosed_by` names.",
        ),
        "unsupported_format": Advice(
            "A format cannot carry the plan: a program for six joints, or a plan that does not end at rest.",
            "Choose a format of [this table](formats.md).",
        ),
    },
    REQUEST: {
        "invalid_request": Advice(
            "A field is missing, unknown or out of its range. `errors` lists each with its JSON pointer.",
            "Correct the fields; the OpenAPI document at `/docs` describes them.",
        ),
        "malformed_request": Advice(
            "The bytes on the connection are not HTTP, for example TLS on the plain port.",
            "Check the scheme and the port of the address.",
        ),
        "invalid_robot_model": Advice(
            "An uploaded model cannot be used. `errors` lists the reasons.",
            "Correct the model as the `findings` say ([robots](robots.md)).",
        ),
        "not_found": Advice("No operation has this path.", "Check the path against `/docs`."),
        "method_not_allowed": Advice("The path has other methods.", "Use a method of the header `Allow`."),
        "not_acceptable": Advice(
            "`format` or `Accept` names no format of the operation.", "Choose a format of [this table](formats.md)."
        ),
        "unsupported_media_type": Advice(
            "The body is not declared as JSON.", "Send `Content-Type: application/json` (`curl --json`)."
        ),
    },
    ACCESS: {
        "unauthorized": Advice(
            "The request has no key, or an unknown or revoked one.",
            "Send `Authorization: Bearer KEY` ([keys](how_to/keys.md)).",
        ),
        "forbidden": Advice(
            "The key lacks the scope that the operation needs.", "Make a key with this scope ([keys](how_to/keys.md))."
        ),
        "foreign_origin": Advice(
            "A web page of another site sent the request.", "Add its origin to `PLANNER_CORS_ORIGINS`."
        ),
        "misdirected_request": Advice(
            "The header `Host` has a name that is not the service's.",
            "Add the name to `PLANNER_ALLOWED_HOSTS` ([nginx](how_to/proxy.md)).",
        ),
    },
    STORED: {
        "unknown_robot": Advice("No robot has this id, or it belongs to another key.", "`GET /v1/robots` lists yours."),
        "robot_exists": Advice(
            "Another robot of yours, or a public one, has the id.", "Choose another id, or delete the robot."
        ),
        "catalogue_robot": Advice("The id belongs to the catalogue.", "Choose another id, or derive a robot from it."),
        "robot_of_another": Advice("Another client added the robot.", "Use the key or address that added it."),
        "too_many_robots": Advice("The service keeps no more robots.", "Delete one, or raise `PLANNER_MAX_ROBOTS`."),
        "unknown_scene": Advice("No scene has this id, or it belongs to another key.", "`GET /v1/scenes` lists yours."),
        "scene_exists": Advice("Another scene has the id.", "Change it by `PATCH`, or choose another id."),
        "scene_of_another": Advice("Another client added the scene.", "Use the key or address that added it."),
        "too_many_scenes": Advice("The service keeps no more scenes.", "Delete one, or raise `PLANNER_MAX_SCENES`."),
        "unknown_project": Advice(
            "No project has this name, or it belongs to another key.", "`GET /v1/projects` lists yours."
        ),
        "project_changed": Advice(
            "The project has another state than `If-Match` or `If-None-Match` expects.",
            "Read the present state, then save with its `ETag`.",
        ),
        "project_of_another": Advice("Another client saved the project.", "Save under another name."),
        "too_many_projects": Advice(
            "The service keeps no more projects.", "Delete one, or raise `PLANNER_MAX_PROJECTS`."
        ),
        "unknown_roadmap": Advice(
            "The scene has no roadmap of the robot.", "`GET /v1/scenes/{id}/roadmap` lists the scene's roadmaps."
        ),
        "too_many_roadmaps": Advice(
            "The scene has as many roadmaps, or bytes of roadmaps, as it may have.",
            "Lower `samples`, delete one, or raise `PLANNER_MAX_ROADMAPS_PER_SCENE`.",
        ),
        "unknown_batch": Advice(
            "No batch has this id, or its retention has ended.", "Send it again; raise `PLANNER_BATCH_RETENTION_DAYS`."
        ),
        "too_many_batches": Advice(
            "The service keeps no more batches.", "Delete ended ones, or raise `PLANNER_MAX_BATCHES`."
        ),
        "conflict": Advice(
            "Two requests change the same thing at once, or an `Idempotency-Key` has another body.",
            "Read the present state, then send the request again.",
        ),
    },
    LOAD: {
        "deadline_exceeded": Advice(
            "The request needed more time than its `deadline`.",
            "Raise it ([how](how_to/deadline.md)), or send fewer waypoints or samples.",
        ),
        "overloaded": Advice(
            "The queue or the memory for bodies is full, or the wait would exceed the deadline.",
            "Retry after the seconds of `Retry-After`.",
        ),
        "too_many_requests": Advice(
            "The key or address has used its allowance, or has too many connections.",
            "Retry after the seconds of `Retry-After`.",
        ),
        "payload_too_large": Advice(
            "The body exceeds a bound.", "Send less at once, or raise `PLANNER_MAX_BODY_BYTES`."
        ),
        "header_too_large": Advice("The head of the request exceeds its bound.", "Send fewer or shorter headers."),
        "request_timeout": Advice(
            "The request did not arrive in time.", "Check the network, or raise `PLANNER_BODY_TIMEOUT`."
        ),
        "memory_exceeded": Advice(
            "The worker reached `PLANNER_WORKER_MEMORY_MIB`.", "Request fewer samples, or simplify meshes and scenes."
        ),
        "database_unavailable": Advice("The database does not answer.", "Retry; the operator checks the database."),
        "internal_error": Advice("The service has a defect.", "Report it with the `instance` and the log."),
    },
}
"""Cause and remedy of each code, by subject."""


def titles_of_codes() -> dict[str, str]:
    """Return the titles of the problem codes of service and library."""
    found: dict[str, str] = {}
    bases: list[type[ServiceError] | type[PlanningError]] = [ServiceError, PlanningError]
    for base in bases:  # grows by the classes derived from its members
        bases += base.__subclasses__()
        if hasattr(base, "code"):
            found[base.code] = base.title
    return found


def document() -> str:
    """Write the page: one table for each subject."""
    titles = titles_of_codes()
    parts = [HEADER]
    for subject, advice in ADVICE.items():
        rows = [f"\n## {subject}\n\n| code | meaning | cause | remedy |\n|---|---|---|---|\n"]
        for code, (cause, remedy) in advice.items():
            rows.append(f"| `{code}` | {STATUS_OF_CODE[code]}: {titles[code]}. | {cause} | {remedy} |\n")
        parts.append("".join(rows))
    return "".join(parts)


if __name__ == "__main__":
    print(document(), end="")
