"""The modules and style sheets of the page, put together for one request each."""

from __future__ import annotations

import re
from itertools import pairwise
from pathlib import Path

from app.web.joined_files import script_of, style_of, with_joined_files
from app.web.routers.server.pages import static_folder

STATIC = static_folder()
UNDERSTOOD = re.compile(
    r"import (?:\{[^}]*\} from )?'\.[^']+';"
    r"|export (?:async function|function\*?|class|const) \w+"
)


def test_every_import_and_export_of_a_module_can_be_put_together() -> None:
    texts = {path: path.read_text("utf-8") for path in STATIC.rglob("*.js")}
    odd = [
        (path.name, text[found.start() : found.start() + 80])
        for path, text in texts.items()
        for found in re.finditer(r"^(?:import|export)\b", text, re.MULTILINE)
        if not UNDERSTOOD.match(text, found.start())
    ]
    assert len(texts) > 100
    assert not odd


def test_the_script_of_the_page_has_every_module_once_and_after_those_it_imports() -> None:
    names = re.findall(r"^// ([\w./-]+\.js)$", script_of(STATIC, "main.js"), re.MULTILINE)
    assert len(names) == len(set(names)) > 100
    assert names[-1] == "main.js"
    place = {name: number for number, name in enumerate(names)}
    for name in names:
        for imported in re.findall(r"^(?:import|.* from) '(\.[^']+)';$", _text(name), re.MULTILINE):
            target = (STATIC / name).parent.joinpath(imported).resolve().relative_to(STATIC)
            assert place[target.as_posix()] < place[name]


def test_a_module_keeps_its_own_names_and_gets_those_it_imports(tmp_path: Path) -> None:
    (tmp_path / "parts").mkdir()
    (tmp_path / "main.js").write_text(
        "import {\n  far as distant,\n  near,\n} from './parts/places.js';\nconst own = near;\n"
    )
    (tmp_path / "parts/places.js").write_text(
        "const own = 1;\nexport const near = own;\nexport async function far() {}\n"
        "const words = await import('../words/en.json');\n"
    )
    script = script_of(tmp_path, "main.js")
    assert "return { near, far };" in script
    assert re.search(r"const \{\s*far: distant,\s*near,\s*\} = module0;", script)
    assert "import('./words/en.json')" in script
    assert "export" not in script


def test_a_page_asks_for_one_script_and_one_style_sheet() -> None:
    shell = (STATIC / "index.html").read_text("utf-8")
    page = with_joined_files(shell, "main.js", script="page.js", style="page.css")
    assert re.findall(r'rel="stylesheet" href="([^"]+)"', page) == ["/static/page.css"]
    assert re.findall(r'<script[^>]* src="([^"]+)"', page) == ["/static/page.js"]


def test_the_style_sheets_stay_in_their_order() -> None:
    shell = (STATIC / "index.html").read_text("utf-8")
    style = style_of(STATIC, shell)
    sheets = re.findall(r'rel="stylesheet" href="/static/([^"]+)"', shell)
    assert len(sheets) > 30
    places = [style.index((STATIC / name).read_text("utf-8")) for name in sheets]
    assert all(one < other for one, other in pairwise(places))


def _text(name: str) -> str:
    return (STATIC / name).read_text("utf-8")
