"""The compiled library of the kernels: found, loaded once, and called with arrays."""

from __future__ import annotations

import ctypes
import platform
import subprocess
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.kernels.build import COMPILER, LIBRARIES, SOURCES, build, library_names

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from numpy.typing import ArrayLike, NDArray

HOW_TO_BUILD = f"run `pip install {COMPILER}` and then `python -m planner.kernels.build`"
"""What mends a library that is not there."""

ARGUMENTS: dict[type, type[ctypes._SimpleCData[Any]]] = {
    int: ctypes.c_int64,
    float: ctypes.c_double,
    np.ndarray: ctypes.c_void_p,
}
"""The types of C by those of arguments."""

NO_MEMORY = 1
"""The code that a kernel returns when there is no memory left for it."""


@cache
def library() -> ctypes.CDLL:
    """Load the library for this processor, compiled first in a checkout whose sources have changed since.

    Raises:
        ImportError: There is none, or it cannot be loaded; the message says what to do.
    """
    fastest, *_, for_every_machine = [_folder() / name for name in library_names(platform.machine()).values()] * 2
    common = _load(for_every_machine)
    return _load(fastest) if common.runs_x86_64_v3() else common


def _folder() -> Path:
    """Return the folder of the libraries; in a checkout they are those of its sources, or are compiled now."""
    if not SOURCES.is_dir():
        return next((path for path in LIBRARIES.glob("*") if path.is_dir()), LIBRARIES)
    try:
        return build()
    except (OSError, subprocess.SubprocessError) as error:
        raise ImportError(f"the compiled kernels do not match the sources: {HOW_TO_BUILD} ({error})") from error


def _load(path: Path) -> ctypes.CDLL:
    try:
        return ctypes.CDLL(str(path))
    except OSError as error:
        raise ImportError(f"the compiled kernels cannot be loaded ({error}): {HOW_TO_BUILD}") from error


def doubles(values: ArrayLike, *shape: int) -> NDArray[np.float64]:
    """Return an array as a kernel reads it: of doubles, one row behind the other.

    Raises:
        ValueError: It has another shape.
    """
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.shape != shape:
        raise ValueError(f"an array of shape {shape} was expected, not {array.shape}")
    return array


def call(name: str, *arguments: int | float | NDArray[np.float64] | NDArray[np.int64]) -> None:
    """Call a kernel with numbers and with arrays that it reads or fills.

    Raises:
        MemoryError: There is no memory left for it.
    """
    kernel = _kernel(name, tuple(map(type, arguments)))
    pointers = [value.ctypes.data if isinstance(value, np.ndarray) else value for value in arguments]
    if kernel(*pointers) == NO_MEMORY:
        raise MemoryError(f"no memory left for {name}")


@cache
def _kernel(name: str, types: tuple[type, ...]) -> Callable[..., int]:
    """Return the function of a kernel that takes arguments of these types."""
    kernel = ctypes.CFUNCTYPE(ctypes.c_int, *(ARGUMENTS[kind] for kind in types))
    return kernel((name, library()))
