"""The titles and units of the certificate's quantities as the page reads them: `python -m web.quantities`."""

from __future__ import annotations

import json
import runpy
import sys
from pathlib import Path


def document(root: Path) -> str:
    """Write the table of planner/quantities.py as JSON, without importing the package, which may not be installed."""
    measures = runpy.run_path(str(root / "planner/quantities.py"))["MEASURES"]
    return json.dumps({quantity: measure._asdict() for quantity, measure in measures.items()}, indent=2)


if __name__ == "__main__":
    sys.stdout.write(document(Path(__file__).parent.parent))
