"""The map of the code as rules: who may import what, and no path of somebody's machine."""

import ast
import re
import sys
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
IMAGES = {".png", ".jpg", ".ico", ".webp"}


def modules(*folders):
    """Dotted name and path of every module below the folders."""
    paths = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    assert paths, folders
    parts = {path: path.relative_to(ROOT).with_suffix("").parts for path in paths}
    return {
        ".".join(names[:-1] if names[-1] == "__init__" else names): path
        for path, names in parts.items()
    }


def imports(path):
    """Every dotted name that a module imports anywhere; a.b.c for `from a.b import c`."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text("utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path} imports relatively"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def is_within(name, package):
    return name == package or name.startswith(f"{package}.")


def importers(package, *folders):
    """Modules that import something of a package."""
    return {
        name
        for name, path in modules(*folders).items()
        if any(is_within(imported, package) for imported in imports(path))
    }


def test_vo_core_imports_only_the_standard_library_numpy_and_opencv():
    only_in = {"av": {"vo_core.sources"}, "pydantic": {"vo_core.rig"}}
    everywhere = {"vo_core", "numpy", "cv2"} | sys.stdlib_module_names
    strangers = {
        (name, package)
        for name, path in modules("vo_core").items()
        for package in {imported.partition(".")[0] for imported in imports(path)}
        if package not in everywhere and name not in only_in.get(package, set())
    }
    assert not strangers


@pytest.mark.parametrize("package", ["vo_core", "app"])
def test_modules_form_no_cycle(package):
    known = modules(package)
    graph = {name: set() for name in known}
    for name, path in known.items():
        for imported in imports(path):
            # `from a.b import c` reads module a.b.c if there is one, and a.b if not.
            target = imported if imported in known else imported.rpartition(".")[0]
            if target in known:
                graph[name].add(target)
    TopologicalSorter(graph).prepare()  # raises CycleError, which names the modules


@pytest.mark.parametrize(
    ("package", "home"),
    [("viser", "app.viewer"), ("sqlalchemy", "app.storage"), ("alembic", "app.storage")],
)
def test_a_library_is_known_in_one_place_only(package, home):
    users = importers(package, "app", "vo_core")
    assert {name for name in users if not is_within(name, home)} == set()
    assert users, f"nobody imports {package}"


ROOMS_ABOVE_STORAGE = ["app.tracking", "app.inspections", "app.reports.reports"]


@pytest.mark.parametrize(
    ("below", "above"),
    [
        ("app/storage", [*ROOMS_ABOVE_STORAGE, "app.web", "app.main", "fastapi", "starlette"]),
        ("app/jobs", [*ROOMS_ABOVE_STORAGE, "app.web", "app.main", "fastapi", "starlette"]),
        ("app/tracking", ["app.inspections", "app.viewer", "app.web", "app.main", "fastapi"]),
        ("app/inspections", ["app.viewer", "app.web", "app.main", "fastapi", "starlette"]),
        ("app/viewer", ["app.web", "app.main"]),
        ("app/web/routers", ["app.storage", "app.jobs", "app.main"]),
    ],
)
def test_dependencies_point_down(below, above):
    assert {package: importers(package, below) for package in above} == {
        package: set() for package in above
    }


def test_no_file_names_a_path_of_a_machine():
    path_of_a_machine = re.compile(
        r"(?<![\w.])(?:/(?:home|root|Users|work|tmp|usr|opt|mnt|srv|etc|var)/|[A-Z]:\\)"
    )
    found = [
        f"{path.relative_to(ROOT)}: {line.strip()}"
        for folder in ("app", "static", "vo_core")
        for path in sorted((ROOT / folder).rglob("*"))
        if path.is_file() and path.suffix not in {*IMAGES, ".pyc"}
        for line in path.read_text("utf-8").splitlines()
        if path_of_a_machine.search(line)
    ]
    assert found == []
