"""The clients of the service, and whose robots, scenes and batches each may see and change."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from api.base.api_keys import SCOPES

if TYPE_CHECKING:
    from api.base.api_keys import Scope


@dataclass(frozen=True)
class Client:
    """Who sends a request.

    Attributes:
        name: The owner of its robots and batches in the database: the id of its key, or its address.
        scopes: Its scopes.
        has_key: Whether it has a key. Where no keys are required, all clients see the same robots and batches.
    """

    name: str
    scopes: frozenset[Scope] = frozenset(SCOPES)
    has_key: bool = False

    @property
    def namespace(self) -> str:
        """The namespace in which ids of its robots are looked up before the common one."""
        return self.name if self.has_key else ""

    @property
    def batches_of(self) -> str | None:
        """The client whose batches alone it sees; None: it sees all."""
        return self.name if self.has_key and "admin" not in self.scopes else None

    @property
    def changes_of(self) -> str | None:
        """The client whose robots and scenes alone it may change or delete; None: it may change all."""
        return None if self.has_key and "admin" in self.scopes else self.name
