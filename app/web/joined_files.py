"""Joins the page's scripts and its style sheets, each kind into one answer.

In the tree every module and every style sheet is a separate file. Loading them one by one would
take two hundred requests at the first visit, so the server joins them: the modules in the order in
which a browser would run them, each in its own function, so that their names do not clash. The
modules use two forms of import and one of export, and no imports form a circle;
tests/app/web/test_joined_files.py checks that.
"""

from __future__ import annotations

import posixpath
import re
from pathlib import Path

_IMPORT = re.compile(r"^import (?:\{([^}]*)\} from )?'(\.[^']+)';$", re.MULTILINE)
_EXPORT = re.compile(r"^export (?=(?:async function|function\*?|class|const) (\w+))", re.MULTILINE)
_IMPORT_LATER = re.compile(r"(?<=\bimport\()([`'])(\.\.?/[^`'$]*)")
"""Imports of a module while it runs, relative to itself."""
_STYLE_SHEET = re.compile(r' *<link rel="stylesheet" href="/static/([^"]+)" />\n')


def script_of(folder: Path, first: str) -> str:
    """Return the module `first` of a folder and all that it imports, as one module."""
    modules = _in_order(folder, first)
    numbers = {name: number for number, name in enumerate(modules)}
    return "".join(
        f"// {name}\nconst module{number} = await (async () => {{\n"
        f"{_body(name, modules[name], numbers)}}})();\n"
        for name, number in numbers.items()
    )


def style_of(folder: Path, shell: str) -> str:
    """Return the style sheets of a page as one."""
    sheets = _STYLE_SHEET.findall(shell)
    return "\n".join(f"/* {name} */\n{(folder / name).read_text('utf-8')}" for name in sheets)


def with_joined_files(shell: str, first: str, *, script: str, style: str) -> str:
    """Replace the scripts and style sheets of a page by the two joined files."""
    linked = _STYLE_SHEET.sub("", shell)
    link = f'    <link rel="stylesheet" href="/static/{style}" />\n  </head>'
    return linked.replace(f"/static/{first}", f"/static/{script}").replace("  </head>", link, 1)


def _in_order(folder: Path, first: str) -> dict[str, str]:
    """Return the text of each module by name, in the order in which they run."""
    found: dict[str, str] = {}

    def visit(name: str) -> None:
        if name in found:
            return
        text = (folder / name).read_text("utf-8")
        for _, imported in _IMPORT.findall(text):
            visit(_resolved(name, imported))
        found[name] = text

    visit(first)
    return found


def _resolved(name: str, imported: str) -> str:
    """Resolve the name of an imported module, relative to the common folder."""
    return posixpath.normpath(posixpath.join(posixpath.dirname(name), imported))


def _body(name: str, text: str, numbers: dict[str, int]) -> str:
    def taken(statement: re.Match[str]) -> str:
        names, imported = statement.groups()
        if names is None:
            return ""
        fields = re.sub(r"\b(\w+) as (\w+)\b", r"\1: \2", names)
        return f"const {{{fields}}} = module{numbers[_resolved(name, imported)]};"

    def fetched(statement: re.Match[str]) -> str:
        quote, imported = statement.groups()
        return f"{quote}./{_resolved(name, imported)}{'/' if imported.endswith('/') else ''}"

    given = ", ".join(_EXPORT.findall(text))
    inside = _IMPORT_LATER.sub(fetched, _EXPORT.sub("", _IMPORT.sub(taken, text)))
    return f"{inside}return {{ {given} }};\n"
