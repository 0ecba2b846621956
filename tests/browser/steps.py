"""Common steps of the browser tests: run a server, log in, start an inspection."""

from __future__ import annotations

import base64
import json
import os
import re
import urllib.request
from collections.abc import Mapping
from http.client import HTTPResponse
from pathlib import Path
from time import monotonic, sleep
from typing import Protocol, Self
from urllib.parse import urlsplit

from forks import Fork
from playwright.sync_api import CDPSession, Locator, Page, expect
from ports import free_port

TOKEN = "a-token-for-browser-tests-0123456789"  # noqa: S105
TRACK_LIMIT_S = 120
ASK_AGAIN_S = 0.05
"""Polling without a pause would take the polled server's time."""


class HasUrl(Protocol):
    """A server, or a line to one."""

    url: str


class Server:
    """A server process that can be killed and started again on the same port and data."""

    def __init__(self, data: Path, **settings: str) -> None:
        """Use a data folder; settings as in the environment, without their prefix."""
        self.data = data
        settings = {"find_defects": "false"} | settings  # each search is a process more
        self._settings = {f"CHAINAGE_{name.upper()}": value for name, value in settings.items()}
        self._settings["CHAINAGE_TOKEN"] = TOKEN
        self._process: Fork | None = None
        self._port = free_port()

    @property
    def url(self) -> str:
        return f"http://127.0.0.1:{self._port}"

    @property
    def pid(self) -> int:
        assert self._process is not None
        return self._process.pid

    def __enter__(self) -> Self:
        self.start()
        return self

    def __exit__(self, *_: object) -> None:
        self.kill()

    def make_token(self, name: str, role: str) -> str:
        """Make a named token; return its secret."""
        made = json.load(self.ask("POST", "/api/tokens", {"name": name, "role": role}))
        return str(made["secret"])

    def start(self) -> None:
        """Start it and wait until it answers; what it says is added to a file beside its data."""
        log = self.data.with_name(f"{self.data.name}.log")
        words = ["serve", "--port", str(self._port), "--data", str(self.data)]
        self._process = Fork(words, os.environ | self._settings, log)
        assert self._process.stdout.readline().startswith("Open http"), log.read_text()

    def kill(self) -> None:
        """Kill it without a chance to tidy up."""
        assert self._process is not None
        self._process.end()

    def ask(
        self,
        method: str,
        path: str,
        body: object = None,
        headers: Mapping[str, str] | None = None,
        timeout_s: float = 60,
    ) -> HTTPResponse:
        """Send a request with the token; bytes are sent unchanged, the rest as JSON."""
        content = body if isinstance(body, bytes) or body is None else json.dumps(body).encode()
        all_headers = {"Authorization": f"Bearer {TOKEN}", "Content-Type": "application/json"}
        request = urllib.request.Request(  # noqa: S310
            self.url + path, content, all_headers | dict(headers or {}), method=method
        )
        response: HTTPResponse = urllib.request.urlopen(request, timeout=timeout_s)  # noqa: S310
        return response

    def track(self, video: Path, rig: Path, *, has_counter: bool = False) -> str:
        """Upload, track and wait for the end, like a program; return the inspection's id.

        A counter is searched only where there is one: it takes longer than to track a short film.
        """
        content = video.read_bytes()
        tus = {"Tus-Resumable": "1.0.0"}
        name = base64.b64encode(video.name.encode()).decode()
        length = {"Upload-Length": str(len(content)), "Upload-Metadata": f"filename {name}"}
        place = self.ask("POST", "/api/uploads", headers=tus | length).headers["Location"]
        upload = urlsplit(place).path
        piece = {"Content-Type": "application/offset+octet-stream", "Upload-Offset": "0"}
        self.ask("PATCH", upload, content, tus | piece)
        source = {"kind": "upload", "upload_id": upload.rsplit("/", 1)[1]}
        wanted = {
            "name": video.stem,
            "source": source,
            "rig": json.loads(rig.read_text()),
            "counter": {"is_present": has_counter},
        }
        made = json.load(self.ask("POST", "/api/inspections", wanted))
        deadline = monotonic() + TRACK_LIMIT_S
        while (now := json.load(self.ask("GET", f"/api/inspections/{made['id']}")))[
            "status"
        ] not in ("done", "failed"):
            assert monotonic() < deadline, "Tracking did not end in time."
            sleep(ASK_AGAIN_S)
        assert now["status"] == "done", now["error"]
        return str(made["id"])

    def state_no_counter(self, inspection: str) -> None:
        """State it of a film that was uploaded on the page: a search takes longer than a test."""
        self.ask("PUT", f"/api/inspections/{inspection}/counter", {"is_present": False})


def log_in(page: Page, server: HasUrl, path: str = "/", token: str = TOKEN) -> None:
    """Start a session and open a page; the log-in page has its own tests."""
    # The server may close an idle connection just when it is used again.
    headers = {"Origin": server.url, "Connection": "close"}
    answer = page.context.request.post(
        f"{server.url}/api/login", data={"token": token}, headers=headers
    )
    expect(answer).to_be_ok()
    page.goto(server.url + path)


def limit_upload(page: Page, bytes_per_s: int) -> CDPSession:
    """Send no more than that until the session is detached: another one lifts no limit."""
    network = page.context.new_cdp_session(page)
    network.send("Network.enable")
    network.send(
        "Network.emulateNetworkConditions",
        {
            "offline": False, "latency": 0, "downloadThroughput": -1,
            "uploadThroughput": bytes_per_s,
        },
    )  # fmt: skip
    return network


def start_inspection(page: Page, server: Server, video: Path, rig: Path, name: str) -> str:
    """Upload a video, load its rig file, start tracking; return the id of the inspection."""
    if page.url != server.url + "/new":
        page.goto(server.url + "/new")
    page.locator("input[type=file]").first.set_input_files(video)
    page.get_by_label("Name", exact=True).fill(name)
    page.locator("rig-form input[type=file]").set_input_files(rig)
    page.get_by_role("button", name="Start tracking").click()
    page.wait_for_url("**/inspections/*")
    inspection = page.url.rsplit("/", 1)[1]
    server.state_no_counter(inspection)
    return inspection


def wait_until_done(page: Page, timeout_s: float = 120) -> None:
    """Wait until the page shows the end and has fetched the last rows of the track."""
    expect(page.locator(".chip")).to_contain_text("Done", timeout=timeout_s * 1000)
    page.wait_for_function(
        """() => {
          const { track, inspection } = document.querySelector('inspection-page').desk;
          return track.length === inspection.value.progress.frames_done;
        }"""
    )


def open_format(page: Page, name: str) -> Locator:
    """Open the dialog of an export format, by the menu."""
    page.get_by_text("Export", exact=True).click()
    menu = page.locator(".menu__list--exports")
    wanted = menu.get_by_role("button", name=re.compile(f"^{name}(?! XML)"))
    if not wanted.first.is_visible():  # folded away
        menu.get_by_text("More formats").click()
    wanted.first.click()
    return page.get_by_role("dialog", name=f"Export: {name}")


def export(page: Page, name: str) -> bytes:
    """Export the report in a format, by the menu and its dialog."""
    dialog = open_format(page, name)
    with page.expect_download() as download:
        dialog.get_by_role("button", name="Download").click()
    expect(page.get_by_role("dialog")).to_have_count(0)
    return Path(download.value.path()).read_bytes()


def export_track(page: Page) -> bytes:
    """Export the distance of every frame, by the menu."""
    page.get_by_text("Export", exact=True).click()
    track = page.get_by_role("link", name=re.compile("^Track, CSV"))
    if not track.is_visible():  # folded away
        page.get_by_text("More formats").click()
    with page.expect_download() as download:
        track.click()
    return Path(download.value.path()).read_bytes()
