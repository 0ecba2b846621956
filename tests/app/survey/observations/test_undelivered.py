"""Reasons why the client was not notified: a sentence leads back to its code."""

import pytest

from app.survey.observations.undelivered import CODES, Undelivered

VALUES = {"status": "503", "seconds": "5", "n": "1000", "why": "self-signed certificate: (x). No"}


@pytest.mark.parametrize("code", CODES)
def test_a_reason_is_read_from_its_sentence(code: str) -> None:
    read = Undelivered.read(Undelivered(code, VALUES).sentence)
    assert read is not None
    assert (read.code, read.values.items() <= VALUES.items()) == (code, True)


@pytest.mark.parametrize("sentence", [None, "", "It answered.", "It answered 200. Or not."])
def test_another_sentence_has_no_reason(sentence: str | None) -> None:
    assert Undelivered.read(sentence) is None
