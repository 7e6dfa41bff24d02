"""The log says where an unexpected exception came from, and nothing of what it holds."""

from __future__ import annotations

import traceback


def where_from(error: BaseException) -> str:
    """The type of an exception and the lines it passed, without its text, which may hold a caller's values."""
    frames = traceback.extract_tb(error.__traceback__)
    return type(error).__name__ + "".join(f" < {f.name} ({f.filename}:{f.lineno})" for f in reversed(frames))
