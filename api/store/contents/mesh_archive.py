"""The zip archive with meshes that comes with a robot: nothing in it is trusted, nothing is written to a disk."""

from __future__ import annotations

import base64
import binascii
import stat
import struct
import zlib
from collections.abc import Mapping
from io import BytesIO
from pathlib import PurePosixPath
from typing import TYPE_CHECKING
from zipfile import ZIP_DEFLATED, ZIP_STORED, BadZipFile, ZipFile

from typing_extensions import override

from api.base.errors import invalid_at

if TYPE_CHECKING:
    from collections.abc import Iterator
    from zipfile import ZipInfo

    from api.base.errors import InvalidRequest

POINTER = "/meshes"
"""Where a request has the archive."""

MOST_FILES = 512
"""The most entries of an archive."""

MOST_BYTES = 2**25
"""The most bytes of all files that are read, unpacked: a finely meshed robot, 32 MiB of a worker's memory."""

BROKEN = (
    BadZipFile,
    EOFError,
    NotImplementedError,
    OSError,
    OverflowError,
    RuntimeError,
    ValueError,
    struct.error,
    zlib.error,
)
"""What Python's reader raises for archives that are broken, or packed in a way that it does not know."""


class MeshArchive(Mapping[str, bytes]):
    """The files of an archive by their paths with `/`, each unpacked when it is first read.

    Only files that are read count towards `MOST_BYTES`: an archive may have visual meshes, which nobody reads.

    Args:
        meshes: The archive in base64.

    Raises:
        InvalidRequest: It is no archive, has too many entries, or entries that lead elsewhere; when a file is read: it
            is broken or too large.
    """

    def __init__(self, meshes: str) -> None:
        try:
            self._archive = ZipFile(BytesIO(base64.b64decode(meshes, validate=True)))
        except binascii.Error:
            raise _refused("must be base64") from None
        except BROKEN:
            raise _refused("must be a zip archive") from None
        entries = [entry for entry in self._archive.infolist() if not entry.is_dir()]
        if len(entries) > MOST_FILES:
            raise _refused(f"must have at most {MOST_FILES} files; got {len(entries)}")
        self._entries: dict[str, ZipInfo] = {}
        for entry in entries:
            name = _checked_name(entry)
            if name in self._entries:
                raise _refused(f"must have one file {_shown(name)}; got two")
            self._entries[name] = entry
        self._read: dict[str, bytes] = {}

    @override
    def __getitem__(self, name: str) -> bytes:
        if name not in self._read:
            left = MOST_BYTES - sum(map(len, self._read.values()))
            self._read[name] = _content(self._archive, self._entries[name], left)
        return self._read[name]

    @override
    def __iter__(self) -> Iterator[str]:
        return iter(self._entries)

    @override
    def __len__(self) -> int:
        return len(self._entries)


def _checked_name(entry: ZipInfo) -> str:
    """Return the path of an entry, which has to stay inside the archive and to be an ordinary file."""
    name = entry.orig_filename
    parts = PurePosixPath(name).parts
    if name.startswith("/") or ".." in parts or "\\" in name or ":" in name or "\0" in name:
        raise _refused(f"must have no file outside the archive; got {_shown(name)}")
    mode = entry.external_attr >> 16
    if mode and not stat.S_ISREG(mode) and stat.S_IFMT(mode):
        raise _refused(f"must have regular files only; {_shown(name)} is a link or a device")
    if entry.flag_bits & 0x1:
        raise _refused(f"must have no encrypted file; got {_shown(name)}")
    if entry.compress_type not in (ZIP_STORED, ZIP_DEFLATED):
        raise _refused(f"must have stored or deflated files only; {_shown(name)} is neither")
    return str(PurePosixPath(name))


def _content(archive: ZipFile, entry: ZipInfo, left: int) -> bytes:
    """Unpack a file, whatever size it says it has."""
    try:
        with archive.open(entry) as file:
            content = file.read(left + 1)
    except BROKEN:
        raise _refused(f"must have no broken file; got {_shown(entry.orig_filename)}") from None
    if len(content) > left:
        raise _too_large()
    return content


def _too_large() -> InvalidRequest:
    return _refused(f"must have at most {MOST_BYTES} bytes once unpacked")


def _shown(name: str) -> str:
    return repr(name if len(name) <= 100 else f"{name[:20]}...{name[-77:]}")


def _refused(message: str) -> InvalidRequest:
    return invalid_at(POINTER, message)
