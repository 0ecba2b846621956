"""A language is added by its file: the page offers it, and what it lacks is English."""

from __future__ import annotations

import json
import shutil
from importlib import import_module, resources
from pathlib import Path

import pytest
from lxml import html

from app.web.languages import languages_of, with_languages
from app.web.routers.server.pages import static_folder, version_of

FRENCH = {
    "language": {"name": "Français", "needs_script": "Chainage a besoin de « JavaScript »."},
    "page": {"close": "Fermer"},
    "progress": {"frames": {"one": "{n} image", "many": "{n} d’images", "other": "{n} images"}},
}


@pytest.fixture
def static(tmp_path: Path) -> Path:
    """A copy of the words of the page with one more language."""
    shutil.copytree(static_folder() / "words", tmp_path / "words")
    (tmp_path / "words" / "fr.json").write_text(json.dumps(FRENCH), "utf-8")
    return tmp_path


def test_a_file_beside_the_others_is_one_more_language_of_the_page(static: Path) -> None:
    languages = languages_of(static, version_of(static))
    assert next(iter(languages)) == "en"
    assert languages["fr"].name == "Français"
    shell = "<html>\n  <head>\n  </head>\n<body><noscript></noscript></body></html>"
    page = html.fromstring(with_languages(shell, languages))
    links = {link.get("hreflang"): link for link in page.iter("link")}
    assert links.keys() == languages.keys()
    assert links["fr"].get("title") == "Français"
    assert links["fr"].get("href") == "/static/words/fr.json"
    assert FRENCH["language"]["needs_script"] in page.findtext(".//noscript/p[@lang='fr']")


def test_what_a_language_lacks_is_sent_in_english(static: Path) -> None:
    sent = json.loads(languages_of(static, version_of(static))["fr"].words)
    english = json.loads((static / "words" / "en.json").read_text("utf-8"))
    assert sent["page"] == {**english["page"], "close": "Fermer"}
    assert sent["list"] == english["list"]
    assert sent["header"]["choice"] == english["header"]["choice"]
    assert sent["progress"]["frames"] == FRENCH["progress"]["frames"]


def test_a_file_beside_the_others_is_one_more_language_of_the_reports(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with resources.as_file(resources.files("app.reports.content.words")) as folder:
        copy = tmp_path / "copied_words"
        shutil.copytree(folder, copy)
    (copy / "fr.json").write_text(json.dumps({"cover": {"title": "Rapport"}}), "utf-8")
    monkeypatch.syspath_prepend(tmp_path)
    words = import_module("copied_words")
    assert "fr" in words.LANGUAGES
    assert words.words_of("fr")["cover.title"] == "Rapport"
    assert words.words_of("fr")["cover.client"] == words.words_of("en")["cover.client"]
