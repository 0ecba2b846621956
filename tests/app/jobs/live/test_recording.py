"""The recording: whole at every byte, continued after a crash, quick to seek in."""

from __future__ import annotations

import subprocess
import sys
import threading
from fractions import Fraction
from pathlib import Path

import av
import cv2
import numpy as np
import pytest
from builders import PATIENCE_S, frame_number, make_clip
from numpy.typing import NDArray

from app.jobs.live import nal
from app.jobs.live.recording import Coding, Recording
from vo_core.errors import UnreadableVideo
from vo_core.frames_at import read_frame
from vo_core.sources import VideoFile

Packets = list[tuple[int, bool, bytes]]


def packets_of(path: Path) -> tuple[Coding, Packets]:
    """What a camera would send: stream form, times in ms."""
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        codec = stream.codec_context
        extradata = nal.configuration(codec.extradata or b"")
        assert extradata is not None
        packets = [
            (packet.pts, packet.is_keyframe, nal.file_form(bytes(packet)))
            for packet in container.demux(stream)
            if packet.size
        ]
        base = stream.time_base
    first = packets[0][0]
    return Coding(codec.name, codec.width, codec.height, extradata), [
        (round(1000 * (pts - first) * Fraction(base)), is_key, content)
        for pts, is_key, content in packets
    ]


@pytest.fixture(scope="module")
def sent(tmp_path_factory: pytest.TempPathFactory) -> tuple[Coding, Packets]:
    return packets_of(make_clip(tmp_path_factory.mktemp("sent") / "clip.ts", 60))


def record(path: Path, coding: Coding, packets: Packets) -> None:
    with Recording(path, coding) as recording:
        for packet in packets:
            recording.append(*packet)


def frames_of(path: Path) -> list[float]:
    with VideoFile(path) as video:
        return [frame.t_s for frame in video]


def test_a_recording_holds_every_frame_at_its_time_while_it_grows(
    tmp_path: Path, sent: tuple[Coding, Packets]
) -> None:
    coding, packets = sent
    path = tmp_path / "recording.mkv"
    with Recording(path, coding) as recording:
        for count, packet in enumerate(packets, 1):
            recording.append(*packet)
            if count % 20 == 0:
                assert frames_of(path) == [time_ms / 1000 for time_ms, *_ in packets[:count]]
        recording.finish()
    with VideoFile(path) as video:
        assert video.info.duration_s == packets[-1][0] / 1000
        assert len(list(video)) == 60
        assert video.problem is None
    for number in (0, 31, 59):
        picture = read_frame(path, packets[number][0] / 1000).to_bgr()
        assert frame_number(cv2.imencode(".png", picture)[1].tobytes()) == number


def test_cut_off_anywhere_it_is_gone_on_with_behind_the_last_whole_packet(
    tmp_path: Path, sent: tuple[Coding, Packets]
) -> None:
    coding, packets = sent
    whole, cut = tmp_path / "whole.mkv", tmp_path / "cut.mkv"
    record(whole, coding, packets)
    content = whole.read_bytes()
    begin = content.index(packets[0][2])
    for at in range(begin + len(packets[0][2]), len(content), (len(content) - begin) // 12):
        cut.write_bytes(content[:at])
        kept = len(frames_of(cut))
        with Recording.reopen(cut) as recording:
            assert recording.packets == kept
            assert recording.coding == coding
            for packet in packets[kept:]:
                recording.append(*packet)
        assert cut.read_bytes() == content


def test_what_is_no_recording_is_left_alone(tmp_path: Path) -> None:
    path = tmp_path / "recording.mkv"
    path.write_bytes(b"something else" * 1000)
    with pytest.raises(UnreadableVideo, match="not a recording"):
        Recording.reopen(path)
    assert path.read_bytes() == b"something else" * 1000


def test_cues_of_a_long_drive_thin_out_and_still_lead_to_every_frame(tmp_path: Path) -> None:
    jpegs = [cv2.imencode(".jpg", grey(n))[1].tobytes() for n in range(8)]
    path = tmp_path / "recording.mkv"
    with Recording(path, Coding("mjpeg", 64, 64, b"")) as recording:
        for n in range(4000):  # one a second, which is more than the room for cues holds
            recording.append(1000 * n, True, jpegs[n % 8])
    for n in (0, 1, 1899, 1901, 2503, 3999):
        assert float(read_frame(path, n).to_bgr().mean()) == pytest.approx(
            grey(n % 8).mean(), abs=2
        )


def grey(n: int) -> NDArray[np.uint8]:
    return np.full((64, 64), 20 + 25 * n, np.uint8)


_FILL = """
import resource, sys
sys.path.insert(0, sys.argv[2])
from pathlib import Path
from app.jobs.live.recording import Coding, Recording
resource.setrlimit(resource.RLIMIT_FSIZE, (400_000, 400_000))
with Recording(Path(sys.argv[1]), Coding("mjpeg", 64, 64, b"")) as recording:
    for n in range(1000):
        try:
            recording.append(40 * n, True, bytes(5000))
        except OSError:
            print(n)
            break
"""


def test_a_full_disk_takes_whole_packets_or_none(tmp_path: Path) -> None:
    path = tmp_path / "recording.mkv"
    root = str(Path(__file__).parents[4])
    written = subprocess.run(
        [sys.executable, "-c", _FILL, str(path), root], capture_output=True, check=True, text=True
    ).stdout
    with Recording.reopen(path) as recording:
        assert recording.packets == int(written) > 20
        assert recording.size == path.stat().st_size < 400_000


_WRITE_ON = """
import sys
sys.path.insert(0, sys.argv[2])
from pathlib import Path
from app.jobs.live.recording import Coding, Recording
with Recording(Path(sys.argv[1]), Coding("mjpeg", 64, 64, b"")) as recording:
    recording.append(0, True, bytes(5000))
    print("begun", flush=True)
    sys.stdin.readline()
    recording.append(40, True, bytes(5000))
"""


def test_it_is_gone_on_with_when_the_process_of_a_killed_server_writes_no_more(
    tmp_path: Path,
) -> None:
    path = tmp_path / "recording.mkv"
    packets: list[int] = []
    is_reopened = threading.Event()

    def go_on() -> None:
        with Recording.reopen(path) as recording:
            packets.append(recording.packets)
        is_reopened.set()

    with subprocess.Popen(
        [sys.executable, "-c", _WRITE_ON, str(path), str(Path(__file__).parents[4])],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
    ) as writer:
        assert writer.stdin is not None
        assert writer.stdout is not None
        assert writer.stdout.readline() == b"begun\n"
        thread = threading.Thread(target=go_on)
        thread.start()
        assert not is_reopened.wait(0.2)
        writer.stdin.write(b"write on\n")
        writer.stdin.flush()
        thread.join(PATIENCE_S)
    assert packets == [2]
