"""The compiled library of the kernels: found, loaded once, and called with arrays."""

from __future__ import annotations

import ctypes
import platform
import subprocess
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from planner.kernels.build import COMPILER, LIBRARIES, SOURCES, build, library_names

N = TypeVar("N", bound=np.generic)
"""The type of the numbers of an array."""

HOW_TO_BUILD = f"run `pip install {COMPILER}` and then `python -m planner.kernels.build`"
"""What mends a library that is not there in a checkout."""

HOW_TO_INSTALL = "install the package trajectory-planner again with pip, on this machine"
"""What mends one that is not there in an installed package, which has no sources."""

ARGUMENTS: dict[type, type[ctypes._SimpleCData[Any]]] = {
    int: ctypes.c_int64,
    float: ctypes.c_double,
    np.ndarray: ctypes.c_void_p,
    type(None): ctypes.c_void_p,
}
"""The types of C for types of arguments."""

_NOTHING = ctypes.c_char * 0
"""The type of an array of no bytes, which stands for an address."""

NO_MEMORY = 1
"""The code that a kernel returns when there is no memory left for it."""

TOO_MANY = 2
"""The code that a kernel returns when its answer would take too many samples."""


class TooManySamples(Exception):
    """A kernel would need more samples than it may take."""


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
    """Return the folder of the libraries; in a checkout, compile them first if the sources have changed."""
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
        remedy = HOW_TO_BUILD if SOURCES.is_dir() else HOW_TO_INSTALL
        raise ImportError(f"the compiled kernels cannot be loaded ({error}): {remedy}") from error


def doubles(values: ArrayLike, *shape: int) -> NDArray[np.float64]:
    """Return an array as a kernel reads it: of doubles, one row behind the other.

    Raises:
        ValueError: It has another shape.
    """
    return _checked(np.ascontiguousarray(values, dtype=np.float64), shape)


def indices(values: ArrayLike, below: int, *shape: int) -> NDArray[np.int64]:
    """Return an array of indices from 0 on and below a number, as a kernel reads it.

    Raises:
        ValueError: It has another shape, or an index is out of range.
    """
    array = _checked(np.ascontiguousarray(values, dtype=np.int64), shape)
    if isinstance(values, np.ndarray) and values.dtype.kind == "b" and below > 1:
        return array
    if array.size and array.view(np.uint64).max() >= below:  # as unsigned numbers, negative ones are the largest
        raise ValueError(f"an index is not from 0 to {below - 1}")
    return array


def _checked(array: NDArray[N], shape: tuple[int, ...]) -> NDArray[N]:
    if array.shape != shape:
        raise ValueError(f"an array of shape {shape} was expected, not {array.shape}")
    return array


def call(name: str, *arguments: int | float | NDArray[np.float64] | NDArray[np.int64] | None) -> None:
    """Call a kernel with numbers and with arrays that it reads or fills; None: an array that is not there.

    Raises:
        MemoryError: There is no memory left for it.
        TooManySamples: Its answer would take too many samples.
    """
    kernel = _kernel(name, tuple(map(type, arguments)))
    pointers = [_address(value) if isinstance(value, np.ndarray) else value for value in arguments]
    code = kernel(*pointers)
    if code == NO_MEMORY:
        raise MemoryError(f"no memory left for {name}")
    if code == TOO_MANY:
        raise TooManySamples


def _address(array: NDArray[np.float64] | NDArray[np.int64]) -> ctypes.Array[ctypes.c_char] | int:
    """Return the address of an array for ctypes; for a writable array in a fifth of the time."""
    try:
        return _NOTHING.from_buffer(array.data)
    except (TypeError, ValueError):
        return array.ctypes.data


@cache
def _kernel(name: str, types: tuple[type, ...]) -> Callable[..., int]:
    """Return the function of a kernel that takes arguments of these types."""
    kernel = ctypes.CFUNCTYPE(ctypes.c_int, *(ARGUMENTS[kind] for kind in types))
    return kernel((name, library()))
