"""Known failures among the jobs of the suite, by cause; remove an entry after its repair.

An entry is a job, for all back ends, or a job and a back end.
"""

KNOWN_FAILURES: dict[str, tuple[str, ...]] = {}
