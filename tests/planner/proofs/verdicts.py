"""The verdict of the checker on proofs with new digests."""

from __future__ import annotations

from typing import Any

from benchmarks.proofs.tampering import with_digests
from planner.proofs import ProofRejected, check_proof


def is_rejected(proof: dict[str, Any]) -> bool:
    """Tell whether the checker rejects a proof, with digests of its content."""
    try:
        check_proof(with_digests(proof))
    except ProofRejected:
        return True
    return False
