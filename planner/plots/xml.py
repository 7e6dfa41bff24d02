"""What makes text XML: characters that no XML document may have are replaced."""

from __future__ import annotations

import re

FORBIDDEN = re.compile("[^\t\n\r\x20-\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]")
"""A character that no document of XML 1.0 has, escaped or not (https://www.w3.org/TR/xml/#charsets, production 2)."""


def well_formed(document: str) -> str:
    """Return a document with U+FFFD for every character that XML has not, which names and titles may hold."""
    return FORBIDDEN.sub("\N{REPLACEMENT CHARACTER}", document)
