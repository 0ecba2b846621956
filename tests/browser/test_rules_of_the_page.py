"""Rules that keep the page safe and its parts where they belong."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Page
from steps import Server, log_in

from vo_core import Rig

STATIC = Path(__file__).parents[2] / "static"


def _occurrences(pattern: str, suffixes: tuple[str, ...] = (".js", ".html")) -> Iterator[str]:
    for path in STATIC.rglob("*"):
        if path.suffix in suffixes and re.search(pattern, path.read_text("utf-8")):
            yield path.relative_to(STATIC).as_posix()


@pytest.mark.parametrize(
    ("pattern", "places"),
    [
        (r"\.(inner|outer)HTML|insertAdjacentHTML|document\.write", ["core/page/html.js"]),
        (r"(?<!#)\bfetch\(", ["core/server/api.js", "service-worker.js"]),
        (r"new WebSocket\b", ["core/server/live.js"]),
        (r"\blocalStorage\.", ["core/page/remembered.js"]),
        (r"\bstyle=", []),
        (r"<script(?![^>]*\bsrc=)", []),
        (r"\bon(click|load|error|submit|input)=", []),
        (r"\beval\(|new Function\b", []),
        (r"https?://(?!www\.w3\.org/|tus\.io/)", []),
    ],
)
def test_only_there(pattern: str, places: list[str]) -> None:
    assert sorted(_occurrences(pattern)) == places


def test_core_imports_nothing_from_the_page() -> None:
    module = re.compile(r"\.(/|\./[a-z]+/)[a-z0-9-]+\.js")
    for path in (STATIC / "core").rglob("*.js"):
        imports = re.findall(r"from '([^']+)'", path.read_text("utf-8"))
        assert all(map(module.fullmatch, imports)), path.name


def test_only_the_shell_imports_a_page_or_what_only_a_page_has() -> None:
    """A part of a page is also shown elsewhere: what it shares with the page has its own folder."""
    main = STATIC / "main.js"
    names = re.findall(r", '([a-z-]+)'\],", main.read_text("utf-8"))
    pages = {path for path in _imports(main) if path.stem in names}
    assert len(pages) == len(names)
    parts = ("desk", "film", "distance", "defects", "shared")
    for path in (path for part in parts for path in (STATIC / "components" / part).rglob("*.js")):
        of_page = [other for other in _imports(path) if other.match("desk/page/*")]
        assert not pages & set(_imports(path)), path
        assert not of_page or path.match("desk/page/*"), path


def _imports(path: Path) -> list[Path]:
    names = re.findall(
        r"^(?:import|\} from|import .* from) '(\.[^']+)'", path.read_text("utf-8"), re.M
    )
    return [(path.parent / name).resolve() for name in names]


def test_every_style_sheet_is_in_the_shell() -> None:
    shell = (STATIC / "index.html").read_text("utf-8")
    sheets = {f"/static/{path.relative_to(STATIC).as_posix()}" for path in STATIC.rglob("*.css")}
    assert sheets - {"/static/login.css"} == set(re.findall(r'href="([^"]+\.css)"', shell))


def test_a_class_has_its_look_from_one_style_sheet() -> None:
    lone = re.compile(r"(?<!,\n)^ *(\.[a-z][\w-]*) \{", re.MULTILINE)
    sheets = sorted(set(STATIC.rglob("*.css")) - {STATIC / "login.css"})  # of a page of its own
    homes = [
        (name, path.name)
        for path in sheets
        for name in sorted(set(lone.findall(path.read_text("utf-8"))))
    ]
    counts = Counter(name for name, _ in homes)
    assert counts
    assert [home for home in homes if counts[home[0]] > 1] == []


def test_rig_form_has_the_fields_and_bounds_of_the_rig_file(page: Page, server: Server) -> None:
    log_in(page, server)
    fields = page.evaluate(
        "async () => (await import('/static/components/intake/rig-form/fields.js')).ALL_FIELDS"
    )
    schema = Rig.model_json_schema()
    known = dict(_numbers_in(schema, schema))
    offered = {field["path"]: _bounds_of(field) for field in fields}
    assert offered == {path: _bounds_in(number) for path, number in known.items()}


def _numbers_in(schema: dict, model: dict, path: str = "") -> Iterator[tuple[str, dict]]:
    """Path and schema of every field below a model, those of its parts included."""
    for name, field in model["properties"].items():
        kinds = [field, *field.get("anyOf", [])]
        part = next((kind["$ref"] for kind in kinds if "$ref" in kind), None)
        if part is None:
            yield path + name, field
        else:
            yield from _numbers_in(
                schema, schema["$defs"][part.rsplit("/", 1)[1]], f"{path}{name}."
            )


def _bounds_of(field: dict) -> dict:
    if field["kind"] == "choice":
        return {"enum": [value for value, _ in field["options"]]}
    names = {"min": "minimum", "above": "exclusiveMinimum", "max": "maximum"}
    return {names[key]: value for key, value in field.items() if key in names}


def _bounds_in(schema: dict) -> dict:
    kinds = [schema, *schema.get("anyOf", []), schema.get("items", {})]
    names = ("enum", "minimum", "exclusiveMinimum", "maximum")
    return {name: kind[name] for kind in kinds for name in names if name in kind}
