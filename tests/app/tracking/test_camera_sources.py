"""Which live sources are opened: judged without opening any."""

from __future__ import annotations

import os
import socket
from collections.abc import Sequence
from ipaddress import ip_network
from pathlib import Path
from typing import Any

import pytest

from app.errors import LiveSourceRefused
from app.settings import Settings
from app.tracking.cameras import ListedSource, Sources

SIZE = (640, 480)
PRIVATE = Settings().camera_networks


def sources(*networks: str, watch: Path | None = None, **devices: Path) -> Sources:
    allowed = [ip_network(network) for network in networks] or PRIVATE
    return Sources(allowed, watch, **devices)


ELSEWHERE = (
    "rtsp://127.0.0.1/x",
    "http://localhost:8000/api/inspections",
    "http://[::1]/",
    "http://[::ffff:127.0.0.1]/",
    "http://0.0.0.0/",
    "http://169.254.169.254/latest/meta-data",
    "rtsp://169.254.3.4/x",
    "rtsp://[fe80::1]/x",
    "http://[fd00:ec2::254]/",
    "rtsp://224.0.0.1/x",
    "http://8.8.8.8/video",
    "http://2130706433/",
    "http://0x7f000001/",
    "http://0177.0.0.1/",
    "http://127.1/",
    "http://[::]/",
    "http://[0:0:0:0:0:ffff:a9fe:a9fe]/",
    "http://255.255.255.255/",
    "http://192.168.1.2\\@127.0.0.1/",
    "http://192.168.1.2@127.0.0.1/",
    "http://127.0.0.1/?@192.168.1.2/",
    "http://127.0.0.1#@192.168.1.2/",
    "http://100.100.100.200/",
    "http://user@127.0.0.1:80@127.0.0.1/",
)


def test_addresses_that_are_no_camera_of_this_network_are_refused() -> None:
    assert_refused(ELSEWHERE, "CHAINAGE_CAMERA_NETWORKS")


def assert_refused(urls: Sequence[str], words: str) -> None:
    """Each is refused in a sentence with these words."""
    opened = []
    for url in urls:
        try:
            opened.append(f"{url}: {sources().resolve(url, SIZE).camera.location}")
        except LiveSourceRefused as refused:
            if words not in str(refused) or not str(refused).endswith("."):
                opened.append(f"{url}: {refused}")
    assert not opened, "\n".join(opened)


NO_ADDRESS = (
    "ftp://192.168.1.2/x",
    "file:///etc/passwd",
    "concat:a|b",
    "/dev/video0",
    "udp://192.168.1.2:1234",
    "rtsp://",
    "rtsp://192.168.1.2:99999/x",
    "rtsp://192.168.1.2/a b",
    "http://192.168.1.2/\r\nHost: x",
    "http://\u2460\u2461\u2466.0.0.1/",
    "http://127%2e0%2e0%2e1/",
    "http://[fe80::1%25eth0",
    "gopher://192.168.1.2/",
    "http:///192.168.1.2/",
    "RTSP+http://192.168.1.2/",
    "usb:video0",
    "file:../../secret.ts",
    "pipe:x",
)


def test_what_is_no_address_of_a_camera_is_refused() -> None:
    assert_refused(NO_ADDRESS, "")


def test_everything_allowed_does_not_mean_the_server_itself() -> None:
    everything = sources("0.0.0.0/0", "::/0")
    for url in (
        "http://127.0.0.1/",
        "http://169.254.1.1/",
        "http://[::1]/",
        "http://[::ffff:127.0.0.1]/",
        "http://[::127.0.0.1]/",
        "http://[64:ff9b::a9fe:a9fe]/",
        "http://[2002:7f00:1::]/",
        "http://[2001:0:53aa:64c:0:fbff:80ff:fffe]/",
        "http://[fe80::1]/",
        "http://[ff02::1]/",
        "http://240.0.0.1/",
    ):
        with pytest.raises(LiveSourceRefused):
            everything.resolve(url, SIZE)
    assert everything.resolve("http://8.8.8.8/v", SIZE).camera.peer == "8.8.8.8"
    assert sources("127.0.0.0/8").resolve("http://127.0.0.1/", SIZE).camera.peer == "127.0.0.1"
    with pytest.raises(LiveSourceRefused):
        sources("169.254.0.0/16").resolve("http://169.254.169.254/", SIZE)


def test_a_name_is_resolved_once_and_its_password_is_not_shown() -> None:
    found = sources("127.0.0.0/8", "::1/128").resolve(
        "http://admin:s%20cret@localhost:8080/video?pwd=hidden#x", SIZE
    )
    assert found.shown == "http://localhost:8080/video?..."
    assert found.camera.location in (
        "http://admin:s%20cret@127.0.0.1:8080/video?pwd=hidden",
        "http://admin:s%20cret@[::1]:8080/video?pwd=hidden",
    )
    assert found.camera.options["headers"] == "Host: localhost:8080\r\n"
    assert found.camera.options["max_redirects"] == "0"
    with pytest.raises(LiveSourceRefused) as refused:
        sources().resolve("rtsp://admin:s3cret@127.0.0.1/x", SIZE)
    assert "s3cret" not in str(refused.value)


def test_usb_cameras_are_listed_by_the_name_that_the_system_gives(tmp_path: Path) -> None:
    for device, index, name in (("video0", 0, "HD camera"), ("video1", 1, "HD camera"),
                                ("video2", 0, "Boroscope")):  # fmt: skip
        (tmp_path / device).mkdir()
        (tmp_path / device / "index").write_text(f"{index}\n")
        (tmp_path / device / "name").write_text(f"{name}\n")
    found = sources(devices=tmp_path)
    assert found.listed() == [
        ListedSource("usb:video0", "usb", "HD camera"),
        ListedSource("usb:video2", "usb", "Boroscope"),
    ]
    camera = found.resolve("usb:video2", SIZE).camera
    assert (camera.kind, camera.location) == ("usb", "/dev/video2")
    assert camera.options["video_size"] == "640x480"
    with pytest.raises(LiveSourceRefused):
        found.resolve("usb:video1", SIZE)


def test_of_the_watched_folder_only_its_own_files_and_pipes_are_listed(tmp_path: Path) -> None:
    watch = tmp_path / "watch"
    watch.mkdir()
    outside = tmp_path / "outside.ts"
    outside.touch()
    (watch / "run.ts").touch()
    (watch / "notes.txt").touch()
    (watch / "link.ts").symlink_to(outside)
    (watch / "folder.ts").mkdir()
    os.mkfifo(watch / "recorder")
    found = sources(watch=watch, devices=tmp_path)
    assert found.listed() == [
        ListedSource("pipe:recorder", "pipe", "recorder"),
        ListedSource("file:run.ts", "folder", "run.ts"),
    ]
    for url in ("file:link.ts", "file:notes.txt", "file:../outside.ts", "pipe:run.ts"):
        with pytest.raises(LiveSourceRefused):
            found.resolve(url, SIZE)


def answers(monkeypatch: pytest.MonkeyPatch, *each: Sequence[str]) -> list[str]:
    """A resolver that says something else each time; the names that it was asked."""
    asked: list[str] = []

    def resolved(host: str, port: int, **_kind: object) -> list[Any]:
        asked.append(host)
        found = each[min(len(asked), len(each)) - 1]
        return [(socket.AF_INET, socket.SOCK_STREAM, 6, "", (text, port)) for text in found]

    monkeypatch.setattr(socket, "getaddrinfo", resolved)
    return asked


def test_a_name_that_leads_elsewhere_the_next_time_gains_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = answers(monkeypatch, ["192.168.1.2"], ["127.0.0.1"])
    camera = sources().resolve("rtsp://operator:secret@camera.test:8554/x", SIZE).camera
    assert asked == ["camera.test"]
    assert camera.location == "rtsp://operator:secret@192.168.1.2:8554/x"
    assert camera.peer == "192.168.1.2"
    with pytest.raises(LiveSourceRefused):
        sources().resolve("rtsp://camera.test:8554/x", SIZE)


def test_every_address_of_a_name_must_be_allowed(monkeypatch: pytest.MonkeyPatch) -> None:
    for second in ("127.0.0.1", "169.254.169.254", "8.8.8.8", "224.0.0.1"):
        for found in (["192.168.1.2", second], [second, "192.168.1.2"]):
            answers(monkeypatch, found)
            with pytest.raises(LiveSourceRefused, match=second):
                sources().resolve("http://camera.test/video", SIZE)


def test_a_name_that_cannot_be_looked_up_is_refused() -> None:
    assert_refused([f"http://{host}/" for host in ("x" * 64 + ".test", ".test", "a..test")], "")
