"""One schema a back end, built from the library's registry; none is written by hand."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import reduce
from operator import or_
from typing import Annotated, Any, Literal, get_type_hints

from pydantic import Field, create_model
from typing_extensions import TypeAliasType

from api.schemas.common import LARGEST, Schema
from planner.backends import BACKENDS, BackEnd


def _backend_schema(backend: type[BackEnd]) -> type[Schema]:
    """Options of a back end, as `CubicBackend`: the dataclass fields with their descriptions and bounds."""
    hints = get_type_hints(backend, localns={"Mapping": Mapping})  # which back ends import for type checkers only
    options: dict[str, Any] = {}
    for field in fields(backend):  # type: ignore[arg-type] # implementations are dataclasses: see the protocol
        default = ... if field.default is MISSING else field.default
        bounds = {"le": LARGEST, **field.metadata} if _is_number(hints[field.name]) else dict(field.metadata)
        options[field.name] = (hints[field.name], Field(default, **bounds))
    name = backend.kind.replace("_", " ").title().replace(" ", "") + "Backend"
    return create_model(
        name,
        __base__=Schema,
        __doc__=backend.summary,
        **{"kind": (Literal[backend.kind], Field(description="Which back end.")), **options},
    )


def _is_number(hint: Any) -> bool:
    return hint in (int, float, int | None, float | None)


BACKEND_SCHEMAS: dict[str, type[Schema]] = {kind: _backend_schema(backend) for kind, backend in BACKENDS.items()}
"""Every back end's schema by its kind."""

Backend: Any = TypeAliasType(
    "Backend",
    Annotated[
        reduce(or_, BACKEND_SCHEMAS.values()),
        Field(discriminator="kind", description="What puts time on the path, with its options."),
    ],
)
