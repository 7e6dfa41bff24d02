"""Jobs of the suite that are known to fail, by cause: whoever mends one strikes it out.

An entry is a job, for all back ends, or a job and a back end.
"""

KNOWN_FAILURES: dict[str, tuple[str, ...]] = {}
