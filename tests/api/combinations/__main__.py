"""`python -m tests.api.combinations pairs 0 48 [URL]` tries rows, on a service that runs elsewhere if it is named."""

from __future__ import annotations

import sys
import traceback
from contextlib import nullcontext

import httpx

from tests.api.combinations import conversations
from tests.api.combinations.conversations import add_robots, is_planned
from tests.api.combinations.made import robots
from tests.api.made_up_service import made_up_service


def main() -> int:
    """Print each failure with the number of its row."""
    kind, first, last, *url = sys.argv[1:]
    chosen = {"pairs": conversations.pairs, "triples": conversations.triples}[kind](int(last))
    known, planned, failed = robots(), 0, []
    with nullcontext(httpx.Client(base_url=url[0], trust_env=False)) if url else made_up_service() as client:
        add_robots(client, known)
        for number in range(int(first), len(chosen)):
            try:
                planned += is_planned(client, known, chosen[number], [number])
            except AssertionError:
                failed.append(number)
                print(f"--- row {number}", traceback.format_exc(), sep="\n", flush=True)
    print(f"{planned} of {len(chosen) - int(first)} rows planned; failed: {failed}")
    return bool(failed)


if __name__ == "__main__":
    sys.exit(main())
