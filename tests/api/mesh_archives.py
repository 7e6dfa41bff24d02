"""Meshes and zip archives of them, as clients send them with robots."""

from __future__ import annotations

import base64
import io
import zipfile

from tests.planner.shapes.mesh_files import bodies, box, stl

CUBE = stl(box((0, 0, 0), (0.1, 0.2, 0.3)))
DUMBBELL = stl(bodies()["dumbbell"])


def archive(files: dict[str, bytes]) -> str:
    """Return a zip archive of files by their paths, in base64."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as writer:
        for name, content in files.items():
            writer.writestr(name, content)
    return base64.b64encode(packed.getvalue()).decode()
