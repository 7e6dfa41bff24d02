"""Hold so many conversations by hand, from a number on; print what fails, and go on."""

from __future__ import annotations

import sys
import time
import traceback
from collections import Counter

from tests.api.made_up_service import made_up_service
from tests.api.random_requests.conversation import Conversation


def main() -> int:
    """Print each failure with its number, and finally the number of answers of each kind."""
    first, count = int(sys.argv[1]), int(sys.argv[2])
    statuses, failed, start = Counter[tuple[str, str]](), [], time.process_time()
    with made_up_service() as client:
        for number in range(first, first + count):
            conversation = Conversation(client, number)
            try:
                conversation.hold()
            except Exception:  # noqa: BLE001 - whatever it is, it is told
                failed.append(number)
                print(f"--- conversation {number}", traceback.format_exc(), sep="\n", flush=True)
            statuses += conversation.statuses
    for kind, times in sorted(statuses.items()):
        print(f"{times:6d}  {' '.join(kind)}")
    spent = time.process_time() - start
    print(f"{statuses.total()} requests, {spent:.0f} s of processor time; failed: {failed}")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
