"""Text without case and accents, for searching."""

from __future__ import annotations

import re
import unicodedata

_MOST_WORDS = 10
_LONGEST_NORMALISED = 200
_UNSTORABLE = re.compile("[\x00\ud800-\udfff]")


def folded(*texts: object) -> str:
    """Return the texts as one, in lower case and without accents; None and "" are left out."""
    text = " ".join(str(text) for text in texts if text is not None)
    plain = unicodedata.normalize("NFKD", storable(text)).casefold()
    split = unicodedata.normalize("NFKD", plain)  # a letter may get its accent from casefold
    bare = "".join(letter for letter in split if not unicodedata.combining(letter))
    return " ".join(bare.split())


def normalised_id(asset_id: str) -> str:
    """Return what all ways of writing an asset's id have in common: CV-01, cv 01 and CV01.

    An id without a letter or digit stands for itself. A letter may become many ("ﷺ" is 18), so the
    normalised id is cut at 200: a database indexes no longer text.
    """
    bare = folded(asset_id)
    found = "".join(letter for letter in bare if letter.isalnum()) or bare
    return found[:_LONGEST_NORMALISED]


def words_of(text: str) -> list[str]:
    """Return the folded words of a query; more than ten would only cost time."""
    return folded(text).split()[:_MOST_WORDS]


def storable(text: str) -> str:
    """Replace what no database holds: a NUL, or half of a character of an imported file."""
    return _UNSTORABLE.sub("\ufffd", text)
