"""Runs a script of this folder: `python tests/measure NAME [OPTIONS]`."""

import runpy
import sys
from importlib import import_module
from pathlib import Path

FOLDER = Path(__file__).resolve().parent
TESTS = FOLDER.parent


def names() -> list[str]:
    """Return the scripts' names, in order."""
    return sorted(path.stem for path in FOLDER.glob("[a-z]*.py") if "__main__" in path.read_text())


def main() -> None:
    """Run the script that is named; without a name, say what there is."""
    # Scripts use what the tests use.  This comes first, in place of this folder.
    sys.path[:1] = map(str, (TESTS, TESTS / "browser", TESTS / "app" / "viewer", TESTS.parent))
    if sys.argv[1:2] and sys.argv[1] in names():
        _, name, *sys.argv[1:] = sys.argv
        runpy.run_module(f"measure.{name}", run_name="__main__", alter_sys=True)
        return
    for name in names():
        sentence = (import_module(f"measure.{name}").__doc__ or "").partition("\n")[0]
        sys.stdout.write(f"{name:18} {sentence}\n")
    sys.exit(2)


if __name__ == "__main__":
    main()
