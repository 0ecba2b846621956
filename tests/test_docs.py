"""What an operator or a program meets is written where they look, and what is written is there."""

import re
import shlex
from pathlib import Path

import typer
import yaml

from app.cli.main import app
from app.errors import STATUS, code_of
from app.reports.formats import FORMATS
from app.settings import Settings

ROOT = Path(__file__).parent.parent
README = ROOT / "README.md"
PAGES = {
    str(path.relative_to(ROOT)): path.read_text("utf-8")
    for path in (README, ROOT / "ARCHITECTURE.md", *sorted((ROOT / "docs").glob("*.md")))
}
MOST_LINES = 120
"""Of the README: what is longer belongs to a page of docs/."""
BLOCK = re.compile(r"^```sh\n(.*?)^```", re.MULTILINE | re.DOTALL)
NAMED = re.compile(
    r"`((?:app|core|jobs|storage|survey|tracking|reports|vo_core|static|tests)/[a-z_/.-]+)`"
)
"""Parts of the code."""
ENDINGS = ("", ".py", ".js")
LINK = re.compile(r"\]\(([^)#]+)[^)]*\)")


def test_each_setting_error_code_and_format_is_in_its_page():
    wanted = {
        "docs/operating.md": [f"| `CHAINAGE_{name.upper()}` |" for name in Settings.model_fields],
        "docs/http_errors.md": [f"`{code_of(kind)}`" for kind in STATUS],
        "docs/reports.md": [f"| `{kind}` |" for kind in FORMATS],
    }
    missing = [
        (page, one) for page, some in wanted.items() for one in some if one not in PAGES[page]
    ]
    assert not missing


def test_the_readme_is_short():
    assert len(README.read_text("utf-8").splitlines()) <= MOST_LINES


def test_each_link_leads_to_a_file():
    missing = [
        (page, link)
        for page, text in PAGES.items()
        for link in LINK.findall(text)
        if not link.startswith("http") and not ((ROOT / page).parent / link).is_file()
    ]
    assert not missing


def test_each_part_of_the_code_that_is_named_exists():
    roots = ("", "app", "vo_core", "static", "tests")
    missing = [
        (page, name)
        for page, text in PAGES.items()
        for name in NAMED.findall(text)
        if "xx" not in name
        and not any(
            (ROOT / root / f"{name}{ending}").exists() for root in roots for ending in ENDINGS
        )
    ]
    assert not missing


def test_each_page_of_docs_is_linked_from_the_readme():
    linked = set(LINK.findall(PAGES["README.md"]))
    assert {page for page in PAGES if page.startswith("docs/")} <= linked


def test_each_command_of_a_code_block_exists():
    root = typer.main.get_command(app)
    blocks = [block for text in PAGES.values() for block in BLOCK.findall(text)]
    for line in "".join(blocks).replace("\\\n", " ").splitlines():
        program, *words = shlex.split(line, comments=True) or [""]
        if program != "chainage":
            continue
        command = root
        while words and words[0] in getattr(command, "commands", {}):
            command = command.commands[words.pop(0)]
        assert command is not root, line
        known = {flag for option in command.params for flag in option.opts}
        assert {word for word in words if word.startswith("--")} <= known, line


def test_a_commit_is_checked_by_the_linters_of_ci():
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))
    linters = [hook["entry"] for repo in config["repos"] for hook in repo["hooks"]]
    run = (ROOT / ".ci/run").read_text("utf-8").splitlines()
    after_tests = run[run.index("set -x") + 1 :]
    assert linters == [line for line in after_tests if "pip install" not in line]
