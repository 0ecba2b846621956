"""Writes what the type check of the page is made from, into the folder `generated` beside it.

openapi.json   the API's own document, for openapi-typescript
page.d.ts      the custom elements, and the named elements of each module (`data-part`)
"""

import json
import re
import tempfile
from pathlib import Path

from app.main import create_app
from app.settings import Settings

HERE = Path(__file__).parent
STATIC = HERE.parent.parent / "static"
GENERATED = HERE / "generated"
NAMED = re.compile(
    r"""<([a-z][\w-]*)\b(?:(?!<[a-z])[\s\S])*?\bdata-part="((?:\$\{\w+\})?[\w-]+)\""""
)
PLACEHOLDER = re.compile(r"\$\{\w+\}")
DEFINED = re.compile(r"customElements\.define\('([\w-]+)', (\w+)\)")


def openapi() -> str:
    """The document of an application that is never started."""
    with tempfile.TemporaryDirectory() as folder:
        return json.dumps(create_app(Settings(data=Path(folder))).openapi())


def page() -> str:
    """Which class a custom element has, and which element a named part of a template is."""
    elements, parts = [], []
    for path in sorted(STATIC.rglob("*.js")):
        text = path.read_text("utf-8")
        name = "/".join(path.relative_to(STATIC).with_suffix("").parts[-2:])
        for tag, of in DEFINED.findall(text):
            elements.append(
                f"    '{tag}': import('../../../static/{path.relative_to(STATIC)}').{of};"
            )
        tags: dict[str, set[str]] = {}
        for tag, part in NAMED.findall(text):
            tags.setdefault(part, set()).add(f"'{tag}'")
        if tags:
            members = (
                f"{_key(part)}: Tagged<{' | '.join(sorted(of))}>" for part, of in tags.items()
            )
            parts.append(f"    '{name}': {{ {'; '.join(members)} }};")
    return "\n".join(
        (
            "declare global {",
            "  interface HTMLElementTagNameMap {",
            *elements,
            "  }",
            "  interface PartsOf {",
            *parts,
            "  }",
            "}",
            "export {};",
            "",
        )
    )


def _key(part: str) -> str:
    """The member for a part; `${side}Video` stands for every name with that end."""
    return f"[name: `{re.sub(PLACEHOLDER, '${string}', part)}`]" if "$" in part else f"'{part}'"


GENERATED.mkdir(exist_ok=True)
(GENERATED / "openapi.json").write_text(openapi(), "utf-8")
(GENERATED / "page.d.ts").write_text(page(), "utf-8")
