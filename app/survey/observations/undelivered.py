"""Why a notification did not reach the client: a code with values, and its English sentence.

The outbox and the history keep the sentence; the code is read from it again, for a page or a report
in another language.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field

_SENTENCES: Mapping[str, str] = {
    "answered": "It answered {status}.",
    "redirected": "It answered {status}, and redirects are not followed.",
    "no_answer": "It did not answer within {seconds} s.",
    "untrusted": "Its certificate is not trusted: {why}.",
    "tls_failed": "TLS failed: {why}.",
    "unknown_name": "Its name is not known.",
    "broken_off": "It has broken off.",
    "unreachable": "It cannot be reached: {why}.",
    "no_web_server": "It does not answer as a web server does.",
    "fault": "The message could not be made; the server's log says why.",
    "too_many": "{n} others wait already.",
    "stopping": "The server stops.",
}
CODES = tuple(_SENTENCES)


@dataclass(frozen=True)
class Undelivered:
    """The reason of one try."""

    code: str
    """One of CODES."""
    values: Mapping[str, str] = field(default_factory=dict)
    """What its sentence contains; `why` is English, as another program said it."""

    @property
    def sentence(self) -> str:
        """The reason in English."""
        return _SENTENCES[self.code].format_map(self.values)

    @classmethod
    def read(cls, sentence: str | None) -> Undelivered | None:
        """Return the reason of a sentence; None for another sentence, or none."""
        for code, pattern in _PATTERNS.items():
            if found := pattern.fullmatch(sentence or ""):
                return cls(code, found.groupdict())
        return None


def _pattern(sentence: str) -> re.Pattern[str]:
    """Return what matches the sentence with any values; a number has no words in it."""
    escaped = re.escape(sentence)
    with_reason = escaped.replace(re.escape("{why}"), "(?P<why>.+)")
    return re.compile(re.sub(r"\\\{(\w+)\\\}", r"(?P<\1>[0-9]+)", with_reason), re.DOTALL)


_PATTERNS = {code: _pattern(sentence) for code, sentence in _SENTENCES.items()}
