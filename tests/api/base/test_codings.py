"""The coding of an answer follows from `Accept-Encoding` as RFC 9110, Section 12.5.3, says."""

from __future__ import annotations

import gzip

import pytest
import zstandard

from api.base.codings import GZIP, LEAST_BYTES, NAMES, ZSTD, Coding, compress, negotiate_coding

LONG = b'{"position":[0.125,0.25]}' * 100


@pytest.mark.parametrize(
    ("header", "name"),
    [
        ("", ""),
        ("gzip", GZIP),
        ("GZip", GZIP),
        ("gzip, deflate", GZIP),
        ("gzip, deflate, br, zstd", ZSTD),
        ("compress, gzip", GZIP),
        ("compress;q=0.5, gzip;q=1.0", GZIP),
        ("gzip;q=1.0, identity; q=0.5, *;q=0", GZIP),
        ("gzip;q=1.0, zstd;q=0.9", GZIP),
        (" gzip ; q=0.8 ,zstd;q=0.9", ZSTD),
        ("gzip;q=0.001", GZIP),
        ("gzip;q=0", ""),
        ("gzip;q=0.000, zstd;q=0", ""),
        ("gzip;q=much", ""),
        ("br, deflate", ""),
        ("xgzip", ""),
        ("*", ZSTD),
        ("*;q=0.1", ZSTD),
        ("*;q=0", ""),
        ("zstd;q=0, *", GZIP),
        ("identity", ""),
        ("identity;q=1.0, gzip;q=0.5", ""),
        ("identity;q=0.5, gzip;q=0.5", GZIP),
        ("identity;q=0", ""),
        (",,", ""),
        (";q=1", ""),
    ],
)
def test_the_coding_is_the_one_that_the_client_prefers(header: str, name: str) -> None:
    assert negotiate_coding(header).name == name


@pytest.mark.parametrize("header", ["gzip, identity;q=0", "gzip, *;q=0", "gzip;q=0.1, IDENTITY;Q=0.0"])
def test_a_client_that_refuses_answers_as_they_are_gets_none(header: str) -> None:
    assert negotiate_coding(header) == Coding(GZIP, 0)
    for content in (b"", b"{}", b"\x89PNG", LONG):
        compressed = compress(content, negotiate_coding(header))
        assert compressed is not None
        assert gzip.decompress(compressed) == content


def test_only_the_codings_that_there_are_count() -> None:
    assert negotiate_coding("zstd, gzip;q=0.5", (GZIP,)).name == GZIP
    assert negotiate_coding("zstd", (GZIP,)).name == ""


@pytest.mark.parametrize("name", NAMES)
def test_what_gets_no_shorter_goes_out_as_it_is(name: str) -> None:
    short = b"x" * (LEAST_BYTES - 1)
    assert compress(short, Coding(name)) is None
    assert compress(short + b"x", Coding(name)) is not None
    for beginning in (b"\x89PNG\r\n\x1a\n", b"PK\x03\x04"):
        assert compress(beginning + LONG, Coding(name)) is None


def test_a_compressed_answer_is_read_by_other_programs_and_is_always_the_same() -> None:
    by_name = {GZIP: gzip.decompress, ZSTD: zstandard.decompress}
    assert set(by_name) == set(NAMES)
    for name, decompress in by_name.items():
        made = compress(LONG, Coding(name))
        assert made is not None
        assert decompress(made) == LONG
        assert len(made) < len(LONG) / 10
        assert made == compress(LONG, Coding(name))
