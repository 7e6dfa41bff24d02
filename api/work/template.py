"""The process that workers are forked from: importing this makes one ready to work.

Python's fork server imports this module once. A worker, forked from it, has all modules and values of this one,
and shares their memory with the others until it writes there.
"""

import gc
import math
import warnings

from api.pool.left_out import leave_out
from api.pool.messages import Caps

leave_out()
with warnings.catch_warnings(action="ignore"):  # there is no log yet
    from api.work.execution import warm_up

    warm_up(Caps(max_deadline=math.inf, max_waypoints=1000, max_samples=1_000_000, memory_mib=0))
gc.collect()
gc.freeze()
