"""The schemas of the OpenAPI document: only workers know the back ends and the forms of a plan."""

from __future__ import annotations

import ast
import inspect
import pkgutil
import sys
from functools import cache
from importlib import import_module
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema
from typing_extensions import override

import api.contract
from api.base.errors import STATUS_OF_CODE
from api.base.size import CAPPED_LISTS
from api.contract.parts.problem_documents import ProblemDocument
from api.contract.ros import RosJointTrajectory
from api.work.answers.formats import FORMATS
from api.work.answers.views import VIEWS
from api.work.tasks.context import task
from api.work.tasks.kinematics import FORMS_OF_WORKSPACE
from api.work.tasks.robots import FORMS_OF_GEOMETRY

if TYPE_CHECKING:
    from collections.abc import Iterable

    from pydantic.json_schema import JsonSchemaValue
    from pydantic_core.core_schema import FloatSchema, ModelSchema, TaggedUnionSchema, WithDefaultSchema

    from api.pool.messages import Reply
    from api.work.tasks.context import TaskContext

REFERENCE = "#/components/schemas/{model}"
"""The place of a schema in the document."""

JSON_FORMS = {"ros2": RosJointTrajectory}
"""The schemas of the JSON forms of a plan besides `json`; the others are text or bytes."""


@task("get_schemas")
def get_schemas(context: TaskContext) -> Reply:
    """Answer the parts of the document that only a worker knows: schemas by their names, and forms."""
    with context.stage("plan"):
        parts = {
            "schemas": schemas_named(
                context.arguments["requests"], context.arguments["answers"], context.caps.max_waypoints
            ),
            "forms": forms_of_answers(),
            "formats": formats_of_plans(),
        }
    return context.reply(parts)


def schemas_named(requests: Iterable[str], answers: Iterable[str], max_waypoints: int) -> dict[str, Any]:
    """Collect the schemas with these names, and all that they refer to.

    Args:
        requests: Names of schemas of bodies of requests; their lists are as long as the service takes.
        answers: Names of schemas of answers.
        max_waypoints: The largest number of waypoints or poses in one request.
    """
    roots: list[Any] = [_schema(name) for name in dict.fromkeys((*requests, *answers))]
    inputs: Any = [(schema.__name__, "validation", TypeAdapter(schema)) for schema in (*roots, *JSON_FORMS.values())]
    _, definitions = TypeAdapter.json_schemas(inputs, ref_template=REFERENCE, schema_generator=_Schemas)
    schemas = dict(sorted(definitions["$defs"].items()))
    for name in requests:
        for field in CAPPED_LISTS & schemas[name].get("properties", {}).keys():
            schemas[name]["properties"][field]["maxItems"] = max_waypoints
    schemas[ProblemDocument.__name__]["properties"]["code"]["enum"] = sorted(STATUS_OF_CODE)
    return schemas


def forms_of_answers() -> dict[str, dict[str, Any]]:
    """List the further media types of answers that have several forms, each with its schema, by operation."""
    media_types = [*(form.media_type for form in FORMATS.values()), *(view.media_type for view in VIEWS.values())]
    plan: dict[str, Any] = {media_type: _text_or_bytes(media_type) for media_type in media_types}
    for name, schema in JSON_FORMS.items():
        plan[FORMATS[name].media_type] = {"$ref": REFERENCE.format(model=schema.__name__)}
    of_operations: dict[str, dict[str, Any]] = {"plan_trajectory": plan}
    of_kinds = {"get_robot_geometry": FORMS_OF_GEOMETRY, "workspace": FORMS_OF_WORKSPACE}
    for operation, forms in of_kinds.items():
        of_operations[operation] = {form.media_type: _text_or_bytes(form.media_type) for form in forms.values()}
    for further in of_operations.values():
        del further["application/json"]
    return of_operations


def formats_of_plans() -> dict[str, list[str]]:
    """List the names of forms of one plan, and of plans in the answers of batches."""
    return {"export_trajectory": [*FORMATS, *VIEWS], "batches": list(FORMATS)}


@cache
def _schema(name: str) -> Any:
    """Find a schema of the contract by its name."""
    for module in pkgutil.walk_packages(api.contract.__path__, "api.contract."):
        found = vars(import_module(module.name)).get(name)
        if found is not None:
            return found
    raise LookupError(f"no schema is called {name}")


def _text_or_bytes(media_type: str) -> dict[str, Any]:
    binary = {} if media_type.startswith("text/") else {"format": "binary"}
    return {"type": "string"} | binary


@cache
def _docstrings(module: str) -> dict[tuple[str, str], str]:
    """Read the docstrings after the fields of all classes of a module, by class and field."""
    return {
        (model.name, field.target.id): inspect.cleandoc(text.value.value)
        for model in ast.parse(inspect.getsource(sys.modules[module])).body
        if isinstance(model, ast.ClassDef)
        for field, text in pairwise(model.body)
        if isinstance(field, ast.AnnAssign) and isinstance(field.target, ast.Name)
        if isinstance(text, ast.Expr) and isinstance(text.value, ast.Constant) and isinstance(text.value.value, str)
    }


class _Schemas(GenerateJsonSchema):
    """JSON schemas from which generators for typed languages make code that compiles."""

    @override
    def model_schema(self, schema: ModelSchema) -> JsonSchemaValue:
        """Describe fields by the docstrings after them; pydantic would read them at the start of every process."""
        made = super().model_schema(schema)
        for model in reversed(schema["cls"].__mro__):
            for name in inspect.get_annotations(model).keys() & schema["cls"].model_fields.keys():
                described = _docstrings(model.__module__).get((model.__name__, name))
                if described:
                    made["properties"][schema["cls"].model_fields[name].alias or name]["description"] = described
        return made

    @override
    def float_schema(self, schema: FloatSchema) -> JsonSchemaValue:
        """Say that a number has double precision: generators take single precision otherwise."""
        return super().float_schema(schema) | {"format": "double"}

    @override
    def default_schema(self, schema: WithDefaultSchema) -> JsonSchemaValue:
        """Leave out a default that is an object, which generators write as text; descriptions state it."""
        made = super().default_schema(schema)
        if isinstance(made.get("default"), dict):
            del made["default"]
        return made

    @override
    def tagged_union_schema(self, schema: TaggedUnionSchema) -> JsonSchemaValue:
        """Write `anyOf` where no field tells the kinds apart: generators ask for one else."""
        made = super().tagged_union_schema(schema)
        return made if "discriminator" in made or "oneOf" not in made else {"anyOf": made.pop("oneOf")} | made
