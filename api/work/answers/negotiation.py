"""Which form of an answer the caller wants: `?format=`, or the `Accept` header (RFC 9110, Section 12.5.1)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Protocol, TypeVar

from api.base.codings import weights_of
from api.base.errors import NotAcceptable

if TYPE_CHECKING:
    from collections.abc import Mapping


@dataclass(frozen=True)
class MediaType:
    """A form that is nothing but its media type."""

    media_type: str


class Named(Protocol):
    """What can be negotiated about: it has a media type."""

    @property
    def media_type(self) -> str:
        """The media type of a file of this form."""


Form = TypeVar("Form", bound=Named)


def negotiated(requested: str | None, accept: str, forms: Mapping[str, Form]) -> Form:
    """Choose the form to answer in.

    Args:
        requested: The name in the query, which goes before the header; None: there is none.
        accept: The `Accept` header.
        forms: The forms that there are, by their names; of equally welcome ones, the first is taken.

    Raises:
        NotAcceptable: None of the requested forms exists.
    """
    if requested is not None:
        if requested in forms:
            return forms[requested]
        raise _not_acceptable(forms)
    best = _preferred(accept, tuple(form.media_type for form in forms.values()))
    if best is None:
        raise _not_acceptable(forms)
    return list(forms.values())[best]


def _not_acceptable(forms: Mapping[str, Form]) -> NotAcceptable:
    there_are = ", ".join(f"{name} ({form.media_type})" for name, form in forms.items())
    return NotAcceptable(f"`format` or `Accept` must name an available format: {there_are}.", formats=list(forms))


@lru_cache(maxsize=256)
def _preferred(accept: str, media_types: tuple[str, ...]) -> int | None:
    """Find the index of the best media type by an `Accept` header, the first of equals; None: none is accepted."""
    weights = weights_of(accept)
    qualities = [_quality(media_type, weights) for media_type in media_types]
    return None if max(qualities) <= 0.0 else qualities.index(max(qualities))


def _quality(media_type: str, weights: Mapping[str, float]) -> float:
    """Weigh a media type by the ranges of an `Accept` header: the most specific one that covers it decides."""
    kind = media_type.partition("/")[0]
    for candidate in (media_type, f"{kind}/*", "*/*"):
        if candidate in weights:
            return weights[candidate]
    return 0.0
