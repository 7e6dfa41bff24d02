"""The report of a batch: one file that anyone can open, with what came of the requests and the worst of the plans."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import orjson

from api.base.version import service_version
from api.pool.messages import Reply
from api.store.contents.digests import request_hash
from api.store.items import PLANNED, decompressed
from api.work.answers.views import shown_plan, shown_robot, written_report
from api.work.tasks.batches import loaded_plan
from api.work.tasks.context import task

if TYPE_CHECKING:
    from api.store.items import Result
    from api.work.tasks.context import TaskContext

SAMPLES = 200
"""The number of samples that each plan is drawn with: a tenth of its own report."""

MOST_BYTES = 2_000_000
"""The most bytes of the plans and problems that a report shows as JSON; the others stand in figures only."""

MOST_WORDS = 500
"""The most characters of a problem document's text that a report repeats."""


@task("get_batch_report")
def report_batch(context: TaskContext) -> Reply:
    """Answer GET /v1/batches/{id}/report.

    Arguments: `batch`, as the schema `Batch` says. `figures` of its items as `Figures` of the report's program
    (`web/src/report/batch.ts`). `results`, the shown items, the worst first, each a `Result`. `definitions` of added
    robots and of scenes by their digests.
    """
    with context.stage("serialise"):
        shown = {
            "batch": context.arguments["batch"],
            "figures": context.arguments["figures"],
            **_shown_results(context),
            "version": service_version(),
        }
        return Reply(200, "text/html", written_report("batch", shown), context.timings)


def _shown_results(context: TaskContext) -> dict[str, Any]:
    """Write plans and texts of problems by index, as many as fit, and each robot once."""
    plans: dict[str, Any] = {}
    problems: dict[str, str] = {}
    arms: dict[bytes, int] = {}
    size = 0
    for result in context.arguments["results"]:
        if result.outcome != PLANNED:
            document = orjson.loads(decompressed(result.result))
            problems[str(result.position)] = str(document["detail"])[:MOST_WORDS]
            continue
        plan, arm = _shown_plan(result, context)
        added = len(plan) + (0 if arm in arms else len(arm))
        if size + added <= MOST_BYTES:
            size += added
            number = arms.setdefault(arm, len(arms))
            plans[str(result.position)] = {"plan": orjson.Fragment(plan), "arm": number}
    return {"plans": plans, "problems": problems, "arms": list(map(orjson.Fragment, arms))}


def _shown_plan(result: Result, context: TaskContext) -> tuple[bytes, bytes]:
    """Write the shown part of a saved plan, and of its robot, as JSON."""
    plan, request, definition, roadmap = loaded_plan(result, context)
    asked = request.model_dump(mode="json", by_alias=True, exclude_unset=True)
    shown = shown_plan(plan, asked, request_hash(request, definition, roadmap), SAMPLES)
    written, arm = (orjson.dumps(part, option=orjson.OPT_SERIALIZE_NUMPY) for part in (shown, shown_robot(plan)))
    return written, arm
