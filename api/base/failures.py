"""The place in the code of an unexpected exception, for the log, without its values."""

from __future__ import annotations

import traceback
from pathlib import PurePath


def where_from(error: BaseException) -> str:
    """Name the type of an exception and the lines it passed, without paths, and without its text: a caller's values."""
    frames = traceback.extract_tb(error.__traceback__)
    lines = [f"{f.name} ({PurePath(f.filename).name}:{f.lineno})" for f in reversed(frames)]
    return " < ".join([type(error).__name__, *lines])
