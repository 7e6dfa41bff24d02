"""Batches: what workers do with their bodies, their items and their results; the server keeps them."""

from __future__ import annotations

import itertools
import math
import pickle
from base64 import b64encode
from dataclasses import replace
from typing import TYPE_CHECKING, Any, NamedTuple

import orjson

from api.base.errors import PayloadTooLarge, invalid_at
from api.base.size import parse_json
from api.contract.parts.common import DEFAULT_DEADLINE
from api.contract.parts.free_motions import may_have_free_motions
from api.contract.requests import PlanRequest
from api.pool.messages import Reply
from api.store.items import PLANNED, NewItem, Result, compressed, decompressed
from api.work.answers.formats import FORMATS
from api.work.answers.negotiation import negotiated
from api.work.answers.problem_documents import problem_document
from api.work.answers.saved_plans import OF_THE_PATH, load_plan, save_plan
from api.work.conversion.problems import to_backend, to_planning_problem
from api.work.conversion.time_budgets import attempts_until, within_deadline
from api.work.tasks.batch_bodies import of_document, of_lines
from api.work.tasks.context import in_scene, robot_of, task, validated
from api.work.tasks.remedies import acceptable_remedies
from api.work.tasks.trajectories import export_options, figures_of, refuse_too_many_rows, with_roadmap
from planner.errors import PlanningError
from planner.planning import plan

if TYPE_CHECKING:
    from collections.abc import Generator, Iterable, Iterator

    from api.work.answers.formats import Format
    from api.work.tasks.context import TaskContext
    from planner.backends.base import BackEnd
    from planner.plans.result import Plan
    from planner.problems.problem import PlanningProblem

CHUNK = 500
"""The number of requests that go into the database at once."""

PROBLEM_SUFFIX = ".problem.json"
"""How the name of a file in an archive ends that has a problem document in place of a plan."""

PAGE_BYTES = 4 * 2**20
"""The bytes after which a page of results ends."""


@task("create_batch")
def read_items(context: TaskContext) -> Reply:
    """Take the requests out of a body of POST /v1/batches, or out of a piece with one a line.

    They come back in `result`, as pickled chunks. The server puts these into the database one by one, and its event
    loop does not wait for them. Planning a request checks whether it follows the schema.
    """
    first, most = context.arguments.get("first", 0), context.arguments.get("most_items", CHUNK)
    with context.stage("validate"):
        found = of_lines(context.task.body, first) if context.arguments.get("lines") else of_document(context, most)
        contents = _contents(itertools.islice(found, most + 1 - first), context)
        items = [_item(request, content, context) for request, content in contents]
    if first + len(items) > most:
        raise invalid_at("/requests", f"must have at most {most} requests. Send several batches.")
    chunks = [pickle.dumps(items[start : start + CHUNK]) for start in range(0, len(items), CHUNK)]
    return Reply(200, "application/octet-stream", b"", context.timings, result=chunks)


def _contents(found: Iterable[tuple[Any, str]], context: TaskContext) -> Iterator[tuple[dict[str, Any], bytes]]:
    """Write requests as JSON, and yield each with its text.

    Raises:
        InvalidRequest: One is no object, or larger than it might be by itself.
        PayloadTooLarge: They are too large together.
    """
    most_of_one = context.arguments.get("most_bytes_of_one", math.inf)
    most_of_all = context.arguments.get("most_bytes_of_all", math.inf)
    size = 0
    for number, (request, pointer) in enumerate(found, 1):
        if not isinstance(request, dict):
            raise invalid_at(pointer, "must be an object")
        content = orjson.dumps(request)
        if len(content) > most_of_one:
            raise invalid_at(pointer, f"must have at most {most_of_one} bytes; got {len(content)}")
        size += len(content)
        if size > most_of_all:
            raise PayloadTooLarge(
                f"The requests of a batch must have at most {most_of_all} bytes, with each request of a grid counted; "
                f"the first {number} have {size}. Send them as several batches."
            )
        yield request, content


def _item(request: dict[str, Any], content: bytes, context: TaskContext) -> NewItem:
    """Make the item of a request for the database."""
    robot, scene, deadline = (request.get(name) for name in ("robot", "scene", "deadline"))
    if isinstance(deadline, bool) or not isinstance(deadline, int | float) or not deadline > 0.0:
        deadline = DEFAULT_DEADLINE  # it is omitted, or will be refused
    deadline = min(float(deadline), context.caps.max_deadline)
    robot, scene = (named if isinstance(named, str) else None for named in (robot, scene))
    return NewItem(compressed(content), robot, scene, deadline, may_have_free_motions(request))


def item_steps(context: TaskContext) -> Generator[None, None, Reply]:
    """Plan one request of a batch in three steps: read it, plan it, write the plan.

    Returns:
        The reply; its body is the saved plan, its result the plan's duration and worst ratio.
    """
    definition = context.arguments.get("definition")
    with context.stage("validate"):
        request: PlanRequest = context.request(PlanRequest)
        asked, backend = _problem_of(request, definition)
        asked = with_roadmap(asked, context.arguments.get("roadmap"))
    yield
    with context.stage("plan"), acceptable_remedies(context, request, asked.robot.dof):
        solved = plan(within_deadline(asked, context.task.deadline), backend, attempts_until(context.task.deadline))
    yield
    refuse_too_many_rows(solved.trajectory.duration, request.sample_period, solved.path.robot.dof, context)
    with context.stage("serialise"):
        if "torque" in request.include:  # refused without inertias
            solved.samples(solved.trajectory.duration, request.include)
        saved = save_plan(solved)
    figures = figures_of(solved)
    result = (solved.trajectory.duration, max(figures.ratios.values(), default=None))
    return Reply(200, "application/octet-stream", saved, context.timings, result=result, plan=figures)


def _problem_of(request: PlanRequest, definition: bytes | None) -> tuple[PlanningProblem, BackEnd]:
    """Make the problem and back end of a request, which may name an added robot with a definition."""
    return to_planning_problem(request, robot_of(request.robot, definition)), to_backend(request.backend)


@task("get_batch_results")
def render_results(context: TaskContext) -> Reply:
    """Write results as GET /v1/batches/{id}/results does, up to so many bytes; the result is how many they are.

    Arguments: `results`, each a `Result`. `form`, the name of a format, or None. `definitions` of added robots and of
    scenes by their digests. `shape`: `page`, with `next_cursor`; `lines`, one result a line; or `files`, a file for
    each plan or problem in place of a body. `last`: whether nothing comes behind them.
    """
    asked = context.arguments
    form = negotiated(asked["form"], "*/*", FORMATS)
    if asked["shape"] == "files":
        return _as_files(form, context)
    entries: list[bytes] = []
    size = 0
    with context.stage("serialise"):
        for result in asked["results"]:
            entries.append(_rendered(result, form, context))
            size += len(entries[-1])
            if size > PAGE_BYTES:
                break
        if asked["shape"] == "lines":
            body = b"".join(entry + b"\n" for entry in entries)
            return Reply(200, "application/x-ndjson", body, context.timings, result=len(entries))
        is_last = asked["last"] and len(entries) == len(asked["results"])
        cursor = asked["results"][len(entries) - 1].position if entries else asked["behind"]
        page = {"results": list(map(orjson.Fragment, entries)), "next_cursor": None if is_last else str(cursor)}
    return replace(context.reply(page), result=len(entries))


def _as_files(form: Format, context: TaskContext) -> Reply:
    """Write results as files of an archive: the result is how many they are, and their names and contents, pickled."""
    files: list[tuple[str, bytes]] = []
    size = 0
    with context.stage("serialise"):
        for result in context.arguments["results"]:
            name = f"{result.position:06d}"
            try:
                planned = result.outcome == PLANNED
                content = _written(result, form, context) if planned else decompressed(result.result)
                suffix = form.suffix if planned else PROBLEM_SUFFIX
            except PlanningError as refusal:  # the form cannot carry it
                _, content = problem_document(refusal, context.task.instance)
                suffix = PROBLEM_SUFFIX
            files.append((name + suffix, content))
            size += len(content)
            if size > PAGE_BYTES:
                break
    return Reply(200, "application/zip", pickle.dumps(files), context.timings, result=len(files))


def _rendered(result: Result, form: Format, context: TaskContext) -> bytes:
    """Write one result."""
    entry: dict[str, Any] = {"index": result.position, "status": result.outcome}
    if result.outcome != PLANNED:
        entry["problem"] = orjson.Fragment(decompressed(result.result))
        return orjson.dumps(entry)
    entry["duration"] = result.duration
    try:
        content = _written(result, form, context)
    except PlanningError as refusal:  # the form cannot carry it
        _, document = problem_document(refusal, context.task.instance)
        return orjson.dumps(entry | {"status": refusal.code, "problem": orjson.Fragment(document)})
    if form.name == "json":
        return orjson.dumps(entry | {"trajectory": orjson.Fragment(content)})
    is_text = form.media_type.startswith("text/") or form.media_type.endswith("json")
    text = (content if is_text else b64encode(content)).decode()
    encoding = "text" if is_text else "base64"
    return orjson.dumps(entry | {"media_type": form.media_type, "encoding": encoding, "content": text})


def _written(result: Result, form: Format, context: TaskContext) -> bytes:
    """Write a saved plan as the request alone would be answered."""
    loaded = loaded_plan(result, context)
    return form.render(loaded.plan, export_options(loaded.request, loaded.definition, loaded.roadmap))


class LoadedPlan(NamedTuple):
    """A plan of a batch that has been read again.

    Attributes:
        plan: The plan.
        request: The request, with its scene in place of the scene's id.
        definition: The definition of the added robot that it names; None: one of the catalogue.
        roadmap: The roadmap on which its free motions were searched; None: there was none.
    """

    plan: Plan
    request: PlanRequest
    definition: bytes | None
    roadmap: bytes | None


def loaded_plan(result: Result, context: TaskContext) -> LoadedPlan:
    """Read the saved plan of a result; the argument `definitions` has added robots, scenes and roadmaps by digest."""
    digests = result.robot, result.scene, result.roadmap
    definition, scene, roadmap = (context.arguments["definitions"].get(digest) for digest in digests)
    request: PlanRequest = in_scene(
        validated(PlanRequest, parse_json(decompressed(result.request)), context.caps), scene
    )
    asked, backend = _problem_of(request, definition)
    asked = with_roadmap(asked, roadmap)
    with_groups = not OF_THE_PATH.isdisjoint(request.include)
    quoted = None if asked.roadmap is None else roadmap
    return LoadedPlan(load_plan(result.result, asked, backend, with_groups), request, definition, quoted)
