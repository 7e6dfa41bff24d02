"""Proof files: a plan with evidence for its certificate, which a stand-alone program checks."""

from planner.proofs.checker import ProofRejected
from planner.proofs.writer import check_proof, write_proof

__all__ = ["ProofRejected", "check_proof", "write_proof"]
