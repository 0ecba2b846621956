"""Shared builders of the tests: small real videos, their rig, a real server, its client."""

from __future__ import annotations

import base64
import contextlib
import os
import signal
import threading
import time
import uuid
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any, TypeVar
from urllib.parse import urlsplit

import av
import cv2
import httpx
import numpy as np
import uvicorn
from fastapi import FastAPI
from numpy.typing import NDArray
from websockets.sync.client import ClientConnection, connect

from app.main import create_app
from app.settings import Settings
from app.web.http_protocol import PromptProtocol
from vo_core import Rig

TOKEN = "a-token-for-tests-0123456789abcdef"  # noqa: S105
WIDTH, HEIGHT, RATE = 256, 160, 25
BLOCK = 16
STEP_PX = 2
"""The clip's wall moves this far to the left from frame to frame: the robot drives forward."""
HEIGHT_MM, FOCAL_PX = 200.0, 250.0
STEP_MM = STEP_PX * HEIGHT_MM / FOCAL_PX

PATIENCE_S = 120.0
"""For what happens at once on an idle machine: it ends a test that hangs and no slow one."""

T = TypeVar("T")

TUS = {"Tus-Resumable": "1.0.0"}


def clip_rig(**camera: object) -> dict[str, Any]:
    """The rig of `make_clip`: a camera above a flat floor with slabs of 400 mm."""
    return {
        "camera": {
            "model": "pinhole",
            "width": WIDTH,
            "height": HEIGHT,
            "fx": FOCAL_PX,
            "fy": FOCAL_PX,
            "cx": (WIDTH - 1) / 2,
            "cy": (HEIGHT - 1) / 2,
            **camera,
        },
        "mount": {"view": "down", "height_mm": HEIGHT_MM, "rotation_deg": 0.0},
        "pipe": {"shape": "flat", "segment_length_mm": 400.0},
    }


def half_size(rig: Rig) -> dict[str, Any]:
    """Return the fields of a rig whose camera sees the same in pictures of half the size."""
    fields = rig.model_dump(mode="json")
    camera = fields["camera"]
    for name in ("width", "height"):
        camera[name] //= 2
    camera |= {"fx": camera["fx"] / 2, "fy": camera["fy"] / 2}
    camera |= {"cx": (camera["width"] - 1) / 2, "cy": (camera["height"] - 1) / 2}
    return fields


def make_clip(
    path: Path,
    frames: int = 40,
    *,
    codec: str = "libx264",
    times_s: list[float] | None = None,
    **options: str,
) -> Path:
    """Write a film of a passing floor, with the frame number as 16 black or white blocks on top."""
    rng = np.random.default_rng(7)
    wall = cv2.GaussianBlur(
        rng.integers(0, 256, (HEIGHT, WIDTH + STEP_PX * frames), np.uint8), (0, 0), 2
    )
    wall = cv2.normalize(wall, None, 30, 225, cv2.NORM_MINMAX).astype(np.uint8)
    with av.open(str(path), "w") as container:
        stream = container.add_stream(codec, rate=RATE)
        stream.width, stream.height, stream.pix_fmt = WIDTH, HEIGHT, "yuv420p"
        stream.gop_size = 12
        if codec == "libx264":
            stream.options = {"preset": "ultrafast", "crf": "18"} | options
        if times_s is not None:
            stream.codec_context.time_base = Fraction(1, 1000)
        for n in range(frames):
            picture = wall[:, STEP_PX * n : STEP_PX * n + WIDTH].copy()
            picture[:BLOCK] = blocks(n)
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p")
            frame.pts = n if times_s is None else round(1000 * times_s[n])
            frame.time_base = Fraction(1, RATE if times_s is None else 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def frame_number(jpeg: bytes) -> int:
    """Return the number of the clip's frame that a picture shows."""
    picture = cv2.imdecode(np.frombuffer(jpeg, np.uint8), cv2.IMREAD_GRAYSCALE)
    row = picture[BLOCK // 2, BLOCK // 2 :: BLOCK][:16]
    return sum(1 << i for i, grey in enumerate(row) if grey > 127)


def blocks(n: int) -> NDArray[np.uint8]:
    """Draw the number of a frame as 16 black or white squares, one row of a clip's blocks."""
    row = np.array([255 * (n >> i & 1) for i in range(WIDTH // BLOCK)], np.uint8)
    return np.kron(row, np.ones((BLOCK, BLOCK), np.uint8)).astype(np.uint8)


class LiveServer:
    """The application behind a real uvicorn, in a thread of the test's process."""

    def __init__(self, app: FastAPI, http: type[PromptProtocol] = PromptProtocol) -> None:
        self.app = app
        config = uvicorn.Config(
            app,
            port=0,
            log_config=None,
            http=http,
            proxy_headers=False,
            ws_per_message_deflate=False,
            timeout_graceful_shutdown=1,
        )
        self._server = uvicorn.Server(config)
        self._thread = threading.Thread(target=self._server.run)
        self._thread.start()
        wait_until(lambda: self._server.started or not self._thread.is_alive())
        assert self._thread.is_alive(), "The server did not start."
        port = self._server.servers[0].sockets[0].getsockname()[1]
        self.url = f"http://127.0.0.1:{port}"
        self.websocket_url = f"ws://127.0.0.1:{port}"

    def stop(self) -> None:
        """Stop the server like Ctrl-C does."""
        self._server.should_exit = True
        self._thread.join()


@contextlib.contextmanager
def serving(
    data: Path, *, http: type[PromptProtocol] = PromptProtocol, **settings: Any
) -> Iterator[Client]:
    """Run a server over a data folder; yield a client that has its token."""
    # Each search of a wall is a process more; the tests of findings ask for it.
    settings = {"token": TOKEN, "disk_reserve_bytes": 0, "find_defects": False} | settings
    server = LiveServer(create_app(Settings(data=data, **settings)), http)
    try:
        with Client(server, settings["token"]) as client:
            client.data = data
            yield client
    finally:
        server.stop()


def results_of(folder: Path) -> dict[str, bytes]:
    """The files of a track, without the comments that name its inspection."""
    paths = [folder / f"{name}.csv" for name in ("track", "health", "joints")]
    paths += sorted((folder / "wall").iterdir())
    return {
        path.relative_to(folder).as_posix(): b"\n".join(
            line for line in path.read_bytes().splitlines() if line[:12] != b"# inspection"
        )
        for path in paths
    }


class Client(httpx.Client):
    """The API as a program uses it, with the common steps of tests."""

    data: Path
    """The server's data folder, to check what is on the disk."""

    def __init__(self, server: LiveServer, token: str | None) -> None:
        headers = {"Authorization": f"Bearer {token}"} if token else {}
        # To read the certificates of the machine takes longer than most requests.
        super().__init__(base_url=server.url, headers=headers, timeout=PATIENCE_S, verify=False)
        self.server = server

    @property
    def cookie_name(self) -> str:
        """Name of the cookie in which a browser keeps its session."""
        return f"chainage_session_{self.base_url.port}"

    def anonymous(self) -> Client:
        """Return another client of the same server, without a token."""
        return Client(self.server, None)

    def upload(self, content: bytes, name: str = "clip.mp4") -> str:
        """Upload a file completely; return the upload's id."""
        filename = base64.b64encode(name.encode()).decode()
        created = self.post(
            "/api/uploads",
            headers={
                **TUS,
                "Upload-Length": str(len(content)),
                "Upload-Metadata": f"filename {filename}",
            },
        )
        assert created.status_code == 201, created.text
        location = created.headers["Location"]
        if content:
            sent = self.patch_upload(location, 0, content)
            assert sent.status_code == 204, sent.text
        return location.rsplit("/", 1)[1]

    def patch_upload(
        self, location: str, offset: int, content: bytes, **headers: str
    ) -> httpx.Response:
        """Send one piece of an upload."""
        standard = {
            **TUS,
            "Upload-Offset": str(offset),
            "Content-Type": "application/offset+octet-stream",
        }
        return self.patch(location, content=content, headers=standard | headers)

    def create(self, video: Path, name: str = "Culvert 7", **fields: Any) -> httpx.Response:
        """Upload a video and request an inspection of it; no counter is searched in its pictures,
        which takes longer than to track a short film.
        """
        body = {
            "name": name,
            "source": {"kind": "upload", "upload_id": self.upload(video.read_bytes(), video.name)},
            "rig": clip_rig(),
            "header": {"asset_id": "CUL-0041"},
            "counter": {"is_present": False},
        }
        return self.post("/api/inspections", json=body | fields)

    def state_no_counter(self, inspection_id: str) -> None:
        """State it where no test looks at the counter: to search one takes a process more."""
        answer = self.put(f"/api/inspections/{inspection_id}/counter", json={"is_present": False})
        assert answer.status_code == 200, answer.text

    def inspect(self, video: Path, **fields: Any) -> str:
        """Start an inspection; return its id."""
        created = self.create(video, **fields)
        assert created.status_code == 201, created.text
        return str(created.json()["id"])

    def record(self, url: str) -> str:
        """Start a live inspection; return its id."""
        body = {"name": "Culvert 7", "source": {"kind": "live", "url": url}, "rig": clip_rig()}
        created = self.post("/api/inspections", json=body)
        assert created.status_code == 201, created.text
        inspection_id = str(created.json()["id"])
        self.state_no_counter(inspection_id)
        return inspection_id

    def frames_done(self, inspection_id: str) -> int:
        """Return how many frames are tracked."""
        return int(self.inspection(inspection_id)["progress"]["frames_done"])

    def results(self, inspection_id: str) -> dict[str, bytes]:
        """Return the files that tracking has made."""
        return results_of(self.data / "inspections" / inspection_id)

    def inspection(self, inspection_id: str) -> dict[str, Any]:
        """Return the present inspection."""
        return dict(self.get(f"/api/inspections/{inspection_id}").json())

    def wait(self, inspection_id: str, *states: str) -> dict[str, Any]:
        """Wait until it is in one of the states; `ended` means any final state."""
        wanted = states or ("done", "failed", "cancelled")
        return wait_until(lambda: self._in_state(inspection_id, wanted))

    def _in_state(self, inspection_id: str, wanted: tuple[str, ...]) -> dict[str, Any] | None:
        inspection = self.inspection(inspection_id)
        return inspection if inspection["status"] in wanted else None

    def tracked(self, video: Path) -> str:
        """Start an inspection and wait until it is tracked; return its id."""
        inspection_id = self.inspect(video)
        assert self.wait(inspection_id)["status"] == "done"
        return inspection_id

    def socket(self, path: str, **options: Any) -> ClientConnection:
        """Open a web socket like a logged-in browser."""
        browser = self.anonymous()
        browser.post("/api/login", json={"token": TOKEN})
        cookie = browser.cookies[self.cookie_name]
        return connect(
            self.server.websocket_url + path,
            origin=self.server.url,
            additional_headers={"Cookie": f"{self.cookie_name}={cookie}"},
            max_size=None,
            open_timeout=PATIENCE_S,
            **options,
        )

    def view_path(self, inspection_id: str, page: str | None = None) -> str:
        """Return the path of the 3D view, with this client's ticket; `page` is the page
        around it.
        """
        query = {} if page is None else {"page": page}
        door = self.get(f"/viewer/{inspection_id}/", params=query)
        assert door.status_code == 303, door.text
        return urlsplit(door.headers["Location"]).path

    def view(self, inspection_id: str, page: str | None = None) -> ClientConnection:
        """Open the socket of the 3D view like its page: with its ticket alone."""
        return connect(
            self.server.websocket_url + self.view_path(inspection_id, page).rstrip("/"),
            origin="null",  # type: ignore[arg-type]
            subprotocols=["viser-v1.1.1"],  # type: ignore[list-item]
            max_size=None,
            open_timeout=PATIENCE_S,
        )

    def tag(
        self, inspection_id: str, observation_id: str | None = None, **fields: Any
    ) -> httpx.Response:
        """PUT an observation."""
        name = observation_id or str(uuid.uuid4())
        return self.put(
            f"/api/inspections/{inspection_id}/observations/{name}", json={"frame": 10} | fields
        )


def wait_until(condition: Callable[[], T], timeout_s: float = PATIENCE_S) -> T:
    """Ask again until the answer is true; state behind HTTP has no event to wait for."""
    deadline, pause_s = time.monotonic() + timeout_s, 0.01
    while not (answer := condition()):
        assert time.monotonic() < deadline, "It did not happen in time."
        time.sleep(pause_s)
        # What takes long is waited for with little of the processor time that it needs.
        pause_s = min(1.2 * pause_s, 0.06)
    return answer


def assert_error(response: httpx.Response, status: int, code: str) -> str:
    """Check the common body of every failure; return its sentence."""
    assert response.status_code == status, (response.status_code, response.text)
    body = response.json()
    assert body.keys() == {"code", "detail"}
    assert body["code"] == code
    assert body["detail"][:1].isalnum() or body["detail"][:1] == "'"
    assert body["detail"].endswith(".")
    return str(body["detail"])


def children(module: str) -> list[int]:
    """Return the process ids of our children that run a module."""
    return [pid for pid, runs in children_of(os.getpid()).items() if runs == module]


def children_of(parent: int) -> dict[int, str]:
    """Return the modules that the children of a process run, by process id."""
    found = {}
    for task in Path(f"/proc/{parent}/task").iterdir():
        with contextlib.suppress(FileNotFoundError, ProcessLookupError):
            for pid in (task / "children").read_text().split():
                words = Path(f"/proc/{pid}/cmdline").read_text().split("\0")
                if "-m" in words:
                    found[int(pid)] = words[words.index("-m") + 1]
    return found


def send_signal(module: str, number: signal.Signals) -> None:
    """Send a signal to every child that runs a module, once there is one."""
    for pid in wait_until(lambda: children(module)):
        os.kill(pid, number)


def tag_until_it_fails(client: Client, inspection_id: str, acknowledged: set[str]) -> None:
    """Add the ids of new tags that the server has acknowledged, until it does not answer."""
    while True:
        name = str(uuid.uuid4())
        try:
            answer = client.tag(inspection_id, name, frame=len(acknowledged) % 40)
        except httpx.HTTPError:
            return
        if answer.status_code == 200:
            acknowledged.add(name)
