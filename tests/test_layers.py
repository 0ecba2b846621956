"""The map of the code as rules: who may import what, and no path of somebody's machine."""

import ast
import re
import subprocess
import sys
from functools import cache
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


@cache
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
    only_in = {
        "av": {
            f"vo_core.{name}"
            for name in ("containers", "decoding", "seeking", "sources", "timeline")
        },
        "pydantic": {"vo_core.rig"},
    }
    everywhere = {"vo_core", "numpy", "cv2"} | sys.stdlib_module_names
    strangers = {
        (name, package)
        for name, path in modules("vo_core").items()
        for package in {imported.partition(".")[0] for imported in imports(path)}
        if package not in everywhere and name not in only_in.get(package, set())
    }
    assert not strangers


def test_modules_form_no_cycle():
    known = modules("vo_core", "app")
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
    [
        ("viser", "app.viewer"),
        ("sqlalchemy", "app.storage"),
        ("alembic", "app.storage"),
        ("obstore", "app.storage"),
    ],
)
def test_a_library_is_known_in_one_place_only(package, home):
    users = importers(package, "app", "vo_core")
    assert {name for name in users if not is_within(name, home)} == set()
    assert users, f"nobody imports {package}"


ROOMS = (
    ("back_off", "errors", "logs", "pictures", "services", "settings", "tracker", "watched"),
    ("survey",),
    ("burnt_in", "imports", "lab", "storage"),
    ("jobs", "access"),
    ("tracking",),
    ("inspections",),
    ("alerts", "archive", "meter_counter", "reports", "search"),
    ("viewer",),
    ("ops",),
    ("data_folder",),
    ("container",),
    ("web",),
    ("main",),
    ("cli",),
)
"""From the foundation upward: a room imports only itself and rooms of the floors below."""


def test_each_room_imports_only_what_lies_below():
    floors = {room: floor for floor, rooms in enumerate(ROOMS) for room in rooms}
    found = {
        (name, imported)
        for name, path in modules("app").items()
        if (room := room_of(name))
        for imported in imports(path)
        if imported.startswith("app.") and (other := room_of(imported)) not in (room, *ROOMS[0])
        if floors.get(other, len(ROOMS)) >= floors[room]
    }
    assert found == set()


def test_every_room_has_a_floor():
    assert {room_of(name) for name in modules("app")} - {""} == {
        room for rooms in ROOMS for room in rooms
    }


def room_of(name):
    return (name.split(".") + [""])[1]


@pytest.mark.parametrize(
    ("room", "strangers"),
    [
        ("errors", ["fastapi", "starlette", "sqlalchemy", "pydantic"]),
        ("survey", ["fastapi", "starlette", "sqlalchemy", "threading", "asyncio", "sqlite3"]),
        ("imports", ["fastapi", "starlette", "sqlalchemy", "threading"]),
        ("storage", ["fastapi", "starlette", "viser"]),
        ("tracking", ["fastapi", "starlette", "viser"]),
        ("inspections", ["fastapi", "starlette", "viser"]),
        ("archive", ["fastapi", "starlette", "viser"]),
        ("reports", ["fastapi", "starlette", "viser"]),
        ("search", ["fastapi", "starlette", "viser"]),
    ],
)
def test_a_room_does_not_bring_strangers_along(room, strangers):
    """Through whatever its modules import of us, however far."""
    known = modules("app", "vo_core")
    reached = {name for name in known if is_within(name, f"app.{room}")}
    waiting = list(reached)
    while waiting:
        for imported in imports(known[waiting.pop()]):
            target = imported if imported in known else imported.rpartition(".")[0]
            if target in known and target not in reached:
                reached.add(target)
                waiting.append(target)
    found = {
        (name, imported)
        for name in reached
        for imported in imports(known[name])
        if any(is_within(imported, stranger) for stranger in strangers)
    }
    assert found == set()


FORMS = {
    "pdf": set(),
    "html": set(),
    "tables": {"exchange"},
    "exchange": {"bundle"},
    "bundle": set(),
}
"""The formats of the report, each with those that are made of it."""


def test_what_several_formats_of_the_report_say_lies_in_their_content():
    for kind, made_of in FORMS.items():
        others = {"content", "collection", *FORMS} - {kind, *made_of}
        found = importers(f"app.reports.{kind}", *(f"app/reports/{folder}" for folder in others))
        assert found == set(), kind


def test_routers_reach_the_database_and_the_children_through_services_only():
    found = importers("app.storage", "app/web/routers") | importers("app.jobs", "app/web/routers")
    assert found == set()


def test_no_test_imports_another():
    """What tests share lies in modules beside them, so that each file of tests runs alone."""
    found = {
        (name, imported)
        for name, path in modules("tests").items()
        for imported in imports(path)
        if any(part.startswith("test_") for part in imported.split(".")[:-1])
        or imported.startswith("test_")
    }
    assert found == set()


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


def test_a_server_starts_without_what_few_requests_need():
    heavy = {"alembic", "av", "cryptography", "cv2", "matplotlib", "pyproj", "typst", "viser"}
    loaded = subprocess.check_output(
        [sys.executable, "-c", "import sys, app.main; print(*sys.modules)"], text=True
    )
    assert not heavy & set(loaded.split())
