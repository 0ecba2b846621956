"""Shared fixtures: clips made once, a server, a real Chromium."""

from __future__ import annotations

import gc
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator
from functools import partial
from pathlib import Path

# Three test processes share two cores.  The threads of OpenBLAS, which reads this when NumPy is
# imported, would wait for each other busily: calibrations of a film took 4 to 10 times as long.
# The same of OpenCV, here and in all servers and children of the tests.  (With `-n 0` this is too
# late for NumPy, which pytest-randomly has imported: say OPENBLAS_NUM_THREADS=1 before pytest.)
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OPENCV_FOR_THREADS_NUM", "1")

import pytest
from builders import PATIENCE_S, Client, make_clip, serving
from debian import found_or_installed
from hypothesis import HealthCheck, settings
from kinds import kind_of, nothing_is_started
from object_stores import ObjectStore, moto
from playwright.sync_api import Browser, sync_playwright
from postgres import PostgresServer, postgres_server
from surveys import Survey, made_once, served, tracked_once

# A browser test imports the product again in every server and child.  Where the environment asks
# for no bytecode, each would compile all of it anew.
sys.dont_write_bytecode = False
os.environ.pop("PYTHONDONTWRITEBYTECODE", None)

pytest_plugins = ["costs"]

settings.register_profile(
    "default",
    max_examples=10,
    derandomize=True,
    deadline=None,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile("long", settings.get_profile("default"), max_examples=300)

SEED = 30
"""Of the order of the tests."""
LONG_FRAMES = 1500
LONGEST_FIRST = ("browser", "server", "render", "unit")
"""Kinds of tests by the time that they take."""
CHROMIUM = ("chromium-headless-shell", "chromium", "chromium-browser", "google-chrome")
NOT_WANTED = (
    # The list below the address bar is a page of its own since Chromium 156.  It takes a second of
    # CPU for every window and now and then, mostly when a server goes away, a whole core for good.
    "WebUIOmniboxPopup", "WebUIOmniboxFullPopup", "WebUIOmniboxAimPopup",
    # Playwright's own list, of which only the last one counts.
    "AimEnabled", "AvoidCorsURLLoaderRestartOnRedirect", "AvoidUnnecessaryBeforeUnloadCheckSync",
    "DestroyProfileOnBrowserClose", "HttpsFirstBalancedModeAutoEnable", "HttpsUpgrades",
    "LensOverlay", "MediaRouter", "NetworkTimeServiceQuerying", "OptimizationHints", "PaintHolding",
    "PreconnectToSearch", "TcpPortRandomizationWin", "ThirdPartyStoragePartitioning",
    # One more process for every page, in case another one is opened.
    "SpareRendererForSitePerProcess",
)  # fmt: skip
"""Features of Chromium that are switched off."""
CHROMIUM_FLAGS = [
    "--no-sandbox",
    # WebGL in software: no other combination draws the 3D view everywhere.
    "--disable-gpu",
    "--enable-unsafe-swiftshader",
    f"--disable-features={','.join(NOT_WANTED)}",
    # The pages of a window share a process.
    "--process-per-site",
]


def runs_long(config: pytest.Config) -> bool:
    """Return whether this is the long run, `pytest -m long`."""
    return "long" in config.option.markexpr


@pytest.hookimpl(tryfirst=True)
def pytest_configure(config: pytest.Config) -> None:
    """Choose how many examples the properties are tried with, and one order for the default run:
    what passes once passes again.
    """
    settings.load_profile("long" if runs_long(config) else "default")
    if not runs_long(config) and getattr(config.option, "randomly_seed", None) == "default":
        config.option.randomly_seed = SEED


@pytest.fixture(scope="session")
def is_long(pytestconfig: pytest.Config) -> bool:
    """Whether to try the whole, not a share of it; a test that asks for it is in both runs."""
    return runs_long(pytestconfig)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark every test with its kind, choose those of this run, and put the files with the longest
    tests first.

    A file is run by one process: at the end of the tests only short ones are left, so that no
    process waits long for the other.
    """
    if runs_long(config):
        for item in items:
            if "is_long" in item.fixturenames or hasattr(item.obj, "hypothesis"):
                item.add_marker("long")
    else:
        left_out = [item for item in items if item.get_closest_marker("long")]
        config.hook.pytest_deselected(items=left_out)
        items[:] = [item for item in items if item not in left_out]
    first: dict[Path, int] = {}
    for item in items:
        kind = kind_of(item)
        item.add_marker(kind)
        first[item.path] = min(LONGEST_FIRST.index(kind), first.get(item.path, len(LONGEST_FIRST)))
    items.sort(key=lambda item: first[item.path])


def pytest_collection_finish() -> None:
    """Leave what is loaded by now out of the search for garbage, which is long then: a 3D view that
    closes searches at once.
    """
    gc.collect()
    gc.freeze()


@pytest.hookimpl(wrapper=True)
def pytest_runtest_protocol(item: pytest.Item) -> Generator[None, object, object]:
    """Fail a unit test that starts a process or a server, its fixtures included."""
    if item.get_closest_marker("unit") is None:
        return (yield)
    with nothing_is_started(item.name):
        return (yield)


@pytest.fixture(scope="session")
def clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A second and a half of driving forward."""
    return _clip_once(tmp_path_factory, "short", 40)


@pytest.fixture(scope="session")
def long_clip(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A clip long enough to be interrupted while it is tracked."""
    return _clip_once(tmp_path_factory, "long", LONG_FRAMES)


def _clip_once(temporary: pytest.TempPathFactory, name: str, frames: int) -> Path:
    def make(folder: Path) -> None:
        make_clip(folder / f"{name}.mp4", frames)

    return made_once(temporary, name, make) / f"{name}.mp4"


@pytest.fixture(scope="session")
def object_store() -> Iterator[ObjectStore]:
    """One S3 server for each test process."""
    with moto() as store:
        yield store


@pytest.fixture(scope="session")
def survey(clip: Path, tmp_path_factory: pytest.TempPathFactory) -> Survey:
    """`clip`, tracked and done."""

    def track(data: Path) -> str:
        with serving(data) as client:
            return client.tracked(clip)

    return tracked_once(tmp_path_factory, "clip", track)


@pytest.fixture(scope="session")
def done(survey: Survey) -> str:
    """Id of the tracked inspection of `clip` that lies on every server of the fixtures below."""
    return survey.id


@pytest.fixture(scope="session")
def postgres() -> Iterator[PostgresServer]:
    """One database server for each process, with a database of its own for each test."""
    with postgres_server() as running:
        yield running


@pytest.fixture(scope="module")
def database_kind(request: pytest.FixtureRequest) -> str:
    """Kind of the database; `postgres.ON_BOTH` sets it."""
    return str(getattr(request, "param", "sqlite"))


@pytest.fixture(scope="module")
def new_url(request: pytest.FixtureRequest, database_kind: str) -> Callable[[], str | None]:
    """Make an empty database of this kind; None stands for the file in the data folder."""
    if database_kind == "sqlite":
        return lambda: None
    running: PostgresServer = request.getfixturevalue("postgres")
    return running.new_database


@pytest.fixture
def photos_are_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who asks for a photo waits until it is made, also on a busy machine."""
    monkeypatch.setattr("app.tracking.pictures.photos._WAIT_FOR_PHOTO_S", PATIENCE_S)


@pytest.fixture(scope="module")
def shared(
    survey: Survey,
    new_url: Callable[[], str | None],
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[Client]:
    """One server for the tests of a file that do not disturb each other.

    They add to what is `done`, but do not change it.
    """
    with served(survey, tmp_path_factory.mktemp("data"), new_url()) as client:
        yield client


@pytest.fixture
def server(survey: Survey, new_url: Callable[[], str | None], tmp_path: Path) -> Iterator[Client]:
    """A server of a test's own, where it may do anything to what is `done`."""
    with served(survey, tmp_path / "data", new_url()) as client:
        yield client


def installed_chromium() -> str | None:
    """Return the program, which is installed if it may be."""

    def find() -> str | None:
        return next((path for name in CHROMIUM if (path := shutil.which(name))), None)

    # The first brings files and fonts that both need, the last is needed by Playwright.
    return found_or_installed(find, "chromium-common", "chromium-headless-shell", "libatomic1")


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    """One browser for each process: Playwright's loop does not start twice."""
    path = installed_chromium()
    with sync_playwright() as playwright:
        if path is None and not Path(playwright.chromium.executable_path).exists():
            subprocess.run([sys.executable, "-m", "playwright", "install", "chromium"], check=False)
            if not Path(playwright.chromium.executable_path).exists():
                pytest.fail(
                    "There is no Chromium. Install it with `apt-get install chromium` or "
                    "`playwright install chromium`, then run the browser tests again."
                )
        running = playwright.chromium.launch(executable_path=path, args=CHROMIUM_FLAGS)
        # What a service worker requests cannot be routed by a test.
        running.new_context = partial(running.new_context, service_workers="block")  # type: ignore[method-assign]
        running.new_page = partial(running.new_page, service_workers="block")  # type: ignore[method-assign]
        yield running
        running.close()
