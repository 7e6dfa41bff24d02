"""Files of meshes: every written file is read, and other contents are refused with an explanation."""

from __future__ import annotations

import struct

import numpy as np
import pytest

from planner.shapes.meshes.files import mesh_pieces, read_mesh
from planner.shapes.meshes.mesh import InvalidMesh
from tests.planner.shapes.mesh_files import bodies, box, dae, obj, stl, stl_text
from tests.sizes import SIZE

BODIES = bodies()
BOX = box((0, 0, 0), (0.3, 0.2, 0.1))


@pytest.mark.long_table
@pytest.mark.parametrize("name", BODIES)
def test_what_is_written_is_read(name: str) -> None:
    triangles = BODIES[name]
    assert read_mesh("a.STL", stl(triangles)).triangles == pytest.approx(triangles, rel=1e-6, abs=1e-7)
    for file, data in (("a.stl", stl_text(triangles)), ("a.obj", obj(triangles)), ("b/c.dae", dae(triangles))):
        assert (read_mesh(file, data).triangles == triangles).all()
    assert (read_mesh("a.dae", dae(triangles, kind="polylist")).triangles == triangles).all()


def test_a_binary_stl_may_say_solid() -> None:
    assert len(read_mesh("a.stl", stl(BOX, b"solid vertex by an exporter")).triangles) == 12


def test_an_obj_may_have_polygons() -> None:
    quads = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4\nf -1 1 2\n"
    assert read_mesh("a.obj", quads).triangles.tolist() == [
        [[0, 0, 0], [1, 0, 0], [1, 1, 0]],
        [[0, 0, 0], [1, 1, 0], [0, 1, 0]],
        [[0, 0, 1], [0, 0, 0], [1, 0, 0]],
    ]


def test_nodes_of_a_dae_place_its_triangles() -> None:
    inches = dae(BOX, "<translate>1 2 3</translate><rotate>0 0 1 90</rotate><scale>2 2 2</scale>", unit="0.0254")
    expected = 0.0254 * (2.0 * BOX @ np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]) + [1, 2, 3])
    assert read_mesh("a.dae", inches).triangles == pytest.approx(expected, abs=1e-12)
    matrix = "<matrix>0 -2 0 1  2 0 0 2  0 0 2 3  0 0 0 1</matrix>"
    assert read_mesh("a.dae", dae(BOX, matrix, unit="0.0254")).triangles == pytest.approx(expected, abs=1e-12)


def spoiled(value: float) -> np.ndarray:
    triangles = BOX.copy()
    triangles[3, 1, 2] = value
    return triangles


DEEP = b"<COLLADA>" + b"<node>" * 100_000 + b"</node>" * 100_000 + b"</COLLADA>"
COUNTS = dae(BOX, kind="polylist")
HOSTILE = {
    "empty.stl": (b"", "0 bytes"),
    "short.stl": (b"x" * 83, "83 bytes"),
    "cut.stl": (stl(BOX)[:-1], "12 triangles"),
    "longer.stl": (stl(BOX) + b"x", "12 triangles"),
    "claims_100_MB.stl": (b"x" * 80 + struct.pack("<I", 2_000_000), "2000000 triangles"),
    "claims_all.stl": (b"x" * 80 + b"\xff" * 4, "4294967295 triangles"),
    "no_triangle.stl": (stl(BOX[:0]), "no triangle"),
    "nan.stl": (stl(spoiled(float("nan"))), "not finite"),
    "infinite.stl": (stl(spoiled(float("inf"))), "not finite"),
    "far.stl": (stl(spoiled(1e30)), "from the origin"),
    "text_nan.stl": (stl_text(spoiled(float("nan"))), "numbers"),
    "text_overflow.stl": (stl_text(BOX).replace(b"0.3", b"1e999"), "not finite"),
    "text_cut.stl": (stl_text(BOX)[:-200], "three"),
    "text_words.stl": (b"solid a\nfacet\nvertex a b c\nvertex 1 2 3\nvertex 1 2 3\nendsolid", "numbers"),
    "text_bad_number.stl": (stl_text(BOX).replace(b"0.3", b"0.3.3"), "numbers"),
    "text_none.stl": (b"solid vertexless\nendsolid\n" + b" " * 100, "no triangle|says"),
    "html.stl": (b"<html>not found</html>" * 10, "triangles"),
    "empty.obj": (b"", "no triangle"),
    "out_of_range.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "line 4"),
    "before_first.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf -4 1 2\n", "line 4"),
    "zero.obj": (b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "line 4"),
    "huge_index.obj": (b"v 0 0 0\nf 1 1 99999999999999999999999\n", "line 2"),
    "words.obj": (b"v a b c\n", "line 1"),
    "short_point.obj": (b"v 1 2\n", "line 1"),
    "two_corners.obj": (b"v 0 0 0\nv 1 1 1\nf 1 2\n", "line 3"),
    "nan.obj": (b"v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "not finite"),
    "points_alone.obj": (b"v 0 0 0\n" * 100, "no triangle"),
    "many_points.obj": (b"v 0 0 0\n" * 250_000, "more than 200000"),
    "fan.obj": (b"v 0 0 0\nf" + b" 1" * 300_000, "triangles"),
    "empty.dae": (b"", "XML"),
    "text.dae": (b"no xml", "XML"),
    "cut.dae": (dae(BOX)[:-30], "XML"),
    "other.dae": (b"<robot/>", "COLLADA"),
    "deep.dae": (DEEP, "nested"),
    "many.dae": (b"<COLLADA>" + b"<a/>" * 30_000 + b"</COLLADA>", "elements"),
    "laughs.dae": (b'<!DOCTYPE a [<!ENTITY b "c">]><COLLADA>&b;</COLLADA>', "DOCTYPE"),
    "out_of_range.dae": (dae(BOX).replace(b"<p>0 0 1 0", b"<p>0 0 99 0"), "not there"),
    "negative.dae": (dae(BOX).replace(b"<p>0 0 1 0", b"<p>0 0 -1 0"), "not there"),
    "huge_index.dae": (dae(BOX).replace(b"<p>0 0 1 0", b"<p>0 0 99999999999999999999 0"), "whole numbers"),
    "odd.dae": (dae(BOX).replace(b"<p>0 0 1 0", b"<p>0 0 1"), "not there"),
    "offset.dae": (dae(BOX).replace(b'offset="0"', b'offset="-7"'), "not there"),
    "large_offset.dae": (dae(BOX).replace(b'offset="1"', b'offset="1e9"'), "not there"),
    "overflowing_count.dae": (COUNTS.replace(b"<vcount>", b"<vcount>%d %d %d %d " % (*[2**62] * 4,)), "add up"),
    "long_count.dae": (COUNTS.replace(b"<vcount>3", b"<vcount>4"), "add up"),
    "negative_count.dae": (COUNTS.replace(b"<vcount>3", b"<vcount>-3"), "add up"),
    "nan.dae": (dae(BOX).replace(b"0.3", b"nan"), "not finite"),
    "overflow.dae": (dae(BOX, "<scale>1e200 1e200 1e200</scale><scale>1e200 1e200 1e200</scale>"), "finite|origin"),
    "stride.dae": (dae(BOX).replace(b'stride="3"', b'stride="4"'), "points"),
    "no_points.dae": (dae(BOX).replace(b'source="#p"', b'source="#q"'), "points"),
    "no_geometry.dae": (dae(BOX).replace(b'url="#g"', b'url="#h"'), "not there"),
    "nothing_shown.dae": (dae(BOX).replace(b"instance_geometry", b"instance_camera"), "no triangle"),
    "controller.dae": (dae(BOX, "<instance_controller/>"), "instance_controller"),
    "strips.dae": (dae(BOX, kind="tristrips"), "tristrips"),
    "matrix.dae": (dae(BOX, "<matrix>1 2 3</matrix>"), "16"),
    "unit.dae": (dae(BOX, unit="inch"), "numbers"),
    "mesh.blend": (b"BLENDER", ".blend"),
    "mesh": (stl(BOX), "without a kind"),
}


@pytest.mark.parametrize("name", HOSTILE)
def test_what_is_no_mesh_is_refused(name: str) -> None:
    data, says = HOSTILE[name]
    with pytest.raises(InvalidMesh, match=says):
        read_mesh(name, data)


def test_a_large_file_is_not_looked_into() -> None:
    with pytest.raises(InvalidMesh, match="bytes"):
        read_mesh("a.stl", bytes(2**24 + 1))


def test_scales_are_within_bounds() -> None:
    with pytest.raises(InvalidMesh, match="origin"):
        mesh_pieces("a.stl", stl(BOX), (1e6, 1.0, 1.0))
    assert mesh_pieces("a.stl", stl(BOX), (1.0, -2.0, 1.0)).size == pytest.approx([0.3, 0.4, 0.1])


@pytest.mark.sized
@pytest.mark.parametrize(
    ("name", "whole"), [("a.stl", stl(BOX)), ("b.stl", stl_text(BOX)), ("c.obj", obj(BOX)), ("d.dae", dae(BOX))]
)
def test_spoiled_files_are_read_or_refused(name: str, whole: bytes) -> None:
    """Changed, missing or doubled bytes raise only `InvalidMesh`, or leave pieces of the readable triangles."""
    rng = np.random.default_rng(3)
    for _ in range(SIZE.examples):
        data = bytearray(whole)
        for _ in range(rng.integers(1, 4)):
            at, to = sorted(rng.integers(0, len(data), 2).tolist())
            match rng.integers(3):
                case 0:
                    data[at] = int(rng.integers(256))
                case 1:
                    del data[at : min(to, at + 40)]
                case _:
                    data[at:at] = data[at : min(to, at + 40)]
        try:
            pieces = mesh_pieces(name, bytes(data))
        except InvalidMesh:
            continue
        assert all(np.isfinite(hull.vertices).all() for hull in pieces.hulls)
