"""One schema a back end, built from the library's registry; none is written by hand.

They are built when a request is first validated or described, in a worker: the server never loads the back ends.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import MISSING, fields
from functools import cache, reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, Literal, get_type_hints

from pydantic import Field, Strict, create_model
from typing_extensions import TypeAliasType

from api.contract.parts.common import LARGEST, Schema

if TYPE_CHECKING:
    from pydantic import GetCoreSchemaHandler
    from pydantic_core import CoreSchema

    from planner.backends import BackEnd


Array = Annotated[tuple[float, ...], Strict(False)]
"""A tuple of a back end; JSON has lists only, which strict validation does not take for one."""


@cache
def backend_schemas() -> dict[str, type[Schema]]:
    """Collect every back end's schema by its kind."""
    from planner.backends import BACKENDS

    return {kind: _backend_schema(backend) for kind, backend in BACKENDS.items()}


@cache
def _any_backend() -> Any:
    description = "What puts time on the path, with its options."
    union: Any = Annotated[
        reduce(or_, backend_schemas().values()), Field(discriminator="kind", description=description)
    ]
    return TypeAliasType("Backend", union)


class _BuiltLater:
    """A schema that pydantic asks for when it is first needed."""

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        return handler.generate_schema(_any_backend())


Backend = Annotated[Any, _BuiltLater]
"""Any back end with its options."""


def _backend_schema(backend: type[BackEnd]) -> type[Schema]:
    """Make the schema of a back end's options, as `CubicBackend`: dataclass fields, described and bounded."""
    hints = get_type_hints(backend, localns={"Mapping": Mapping})  # which back ends import for type checkers only
    options: dict[str, Any] = {}
    for field in fields(backend):  # type: ignore[arg-type] # implementations are dataclasses: see the protocol
        default = ... if field.default is MISSING else field.default
        bounds = {"le": LARGEST, **field.metadata} if _is_number(hints[field.name]) else dict(field.metadata)
        hint = Array | None if hints[field.name] == tuple[float, ...] | None else hints[field.name]
        options[field.name] = (hint, Field(default, **bounds))
    name = backend.kind.replace("_", " ").title().replace(" ", "") + "Backend"
    return create_model(
        name,
        __base__=Schema,
        __doc__=backend.summary,
        **{"kind": (Literal[backend.kind], Field(description=f"The back end: {backend.kind}.")), **options},
    )


def _is_number(hint: Any) -> bool:
    return hint in (int, float, int | None, float | None)
