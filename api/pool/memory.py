"""The memory of a worker: kept between the steps of a task, and given back after a task that took much of it."""

from __future__ import annotations

import ctypes
import resource

KEEPING = {"MALLOC_MMAP_THRESHOLD_": str(32 * 2**20), "MALLOC_TRIM_THRESHOLD_": str(256 * 2**20)}
"""The environment variables by which the C library keeps freed memory. Without them it returns the arrays of every step
to the system. Every next step then waits for zeroed pages: a tenth of the time of a long contour."""

FEW_PAGES = 2**13
"""Pages that a task may touch before its freed memory is given back: 32 MiB."""


class Memory:
    """The memory of this process."""

    def __init__(self) -> None:
        self._trim = getattr(ctypes.CDLL(None), "malloc_trim", None)  # the GNU C library's
        self._faults = _faults()

    def give_back(self) -> None:
        """Give freed memory back to the system if much of it was touched since the last time."""
        if self._trim is not None and _faults() - self._faults > FEW_PAGES:
            self._trim(0)
            self._faults = _faults()


def _faults() -> int:
    """Count the pages that this process has touched first."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_minflt
