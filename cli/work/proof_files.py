"""Proof files checked: the work of `planner check`."""

from __future__ import annotations

import json

import typer

import planner
from cli.work.shared import read


def check_proof_file(file: str, statement: str | None, trajectory: str | None) -> None:
    """Check a proof file and print its claims; end with 1 if it is rejected."""
    try:
        content = json.loads(read(file, "PROOF"))
        proof = content.get("proof", content) if isinstance(content, dict) else content
        claims = planner.check_proof(proof, {"statement": statement, "trajectory": trajectory})
    except (planner.ProofRejected, ValueError, RecursionError) as error:
        typer.echo(f"rejected: {error}", err=True)
        raise typer.Exit(1) from None
    typer.echo(f"accepted: {', '.join(claims)}")
    for claim in proof["statement"]["not_covered"]:
        typer.echo(f"not covered: {claim}")
    for part, digest in proof["digests"].items():
        typer.echo(f"{part} {digest}")
