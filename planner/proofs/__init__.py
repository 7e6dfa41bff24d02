"""Proof files: a plan with evidence for its certificate, which a stand-alone program checks."""

from planner.proofs.checker import Rejected
from planner.proofs.writer import check_proof, proof_of

__all__ = ["Rejected", "check_proof", "proof_of"]
