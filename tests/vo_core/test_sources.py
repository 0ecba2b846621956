"""Video files: every frame with its exact time, and what is said of files that are not whole."""

import re
from fractions import Fraction

import av
import cv2
import numpy as np
import pytest
from av.bitstream import BitStreamFilterContext
from av.stream import Disposition

from vo_core import UnreadableVideo, VideoFile, read_frame
from vo_core.frames_at import frames_between

TIMES_S = [0.0, 0.04, 0.06, 0.16, 0.2, 0.25, 0.31, 0.5, 0.52, 0.6] + [
    0.7 + 0.04 * n for n in range(50)
]


def write_video(path, times_s=TIMES_S, *, codec="libx264", size_wh=(64, 48), fmt="yuv420p"):
    """A video whose frame n has the grey level 40 + 3 n, up to frame 66."""
    with av.open(path, "w") as container:
        stream = container.add_stream(codec, rate=25)
        stream.width, stream.height, stream.pix_fmt = *size_wh, fmt
        if not codec.startswith("mpeg"):  # those know fixed rates only
            stream.codec_context.time_base = Fraction(1, 1000)
        stream.gop_size = 12
        for n, t_s in enumerate(times_s):
            level = np.full((size_wh[1], size_wh[0], 3), 40 + 3 * n % 200, np.uint8)
            frame = av.VideoFrame.from_ndarray(level, format="bgr24")
            frame.pts, frame.time_base = round(1000 * t_s), Fraction(1, 1000)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


@pytest.fixture(scope="module")
def video(tmp_path_factory):
    return write_video(tmp_path_factory.mktemp("video") / "uneven.mp4")


def test_every_frame_comes_in_order_with_its_exact_time(video):
    with VideoFile(video) as source:
        frames = list(source)
    assert [f.index for f in frames] == list(range(len(TIMES_S)))
    assert [f.t_s for f in frames] == pytest.approx(TIMES_S, abs=1e-9)
    assert source.problem is None
    levels = [float(f.image.mean()) for f in frames]
    assert np.all(np.diff(levels) > 1)


def test_what_the_container_states_is_reported(video):
    with VideoFile(video) as source:
        info = source.info
    assert (info.width, info.height, info.codec) == (64, 48, "h264")
    assert info.duration_s == pytest.approx(TIMES_S[-1], abs=0.2)


@pytest.mark.parametrize("n", [0, 1, 5, 13, 37, 59])
def test_one_frame_is_read_by_its_time(video, n):
    with VideoFile(video) as source:
        expected = next(f.to_bgr() for f in source if f.index == n)
    assert np.array_equal(read_frame(video, TIMES_S[n]).to_bgr(), expected)


@pytest.mark.parametrize(("name", "codec"), [("a.ts", "mpeg2video"), ("a.avi", "mpeg4")])
def test_one_frame_is_read_by_its_time_without_an_index_too(tmp_path, name, codec):
    path = write_video(tmp_path / name, [n / 25 for n in range(60)], codec=codec)
    with VideoFile(path) as source:
        frames = [(f.t_s, f.to_bgr()) for f in source]
    for t_s, picture in frames[::7]:
        assert np.array_equal(read_frame(path, t_s).to_bgr(), picture)


@pytest.mark.parametrize(
    ("name", "codec"), [("a.ts", "mpeg2video"), ("a.avi", "mpeg4"), ("a.mp4", "libx264")]
)
def test_the_frames_between_two_times_are_read_with_or_without_an_index(tmp_path, name, codec):
    path = write_video(tmp_path / name, [n / 25 for n in range(60)], codec=codec)
    with VideoFile(path) as source:
        frames = [(f.t_s, f.to_bgr()) for f in source]
    wanted = frames[17:32]
    found = list(frames_between(path, wanted[0][0], wanted[-1][0]))
    assert [f.t_s for f in found] == [t_s for t_s, _ in wanted]
    assert all(np.array_equal(f.to_bgr(), p) for f, (_, p) in zip(found, wanted, strict=True))
    before = frames_between(path, frames[0][0] - 3, frames[1][0])
    assert [f.t_s for f in before] == [t_s for t_s, _ in frames[:2]]
    assert list(frames_between(path, 99.0, 100.0)) == []


def test_a_time_after_the_end_is_refused(video):
    with pytest.raises(UnreadableVideo, match=r"no frame at 99\.000 s"):
        read_frame(video, 99.0)


@pytest.mark.parametrize(
    ("name", "codec"), [("a.avi", "mpeg4"), ("a.mkv", "libx264"), ("a.mpg", "mpeg2video")]
)
def test_old_containers_are_read(tmp_path, name, codec):
    with VideoFile(write_video(tmp_path / name, [n / 25 for n in range(30)], codec=codec)) as v:
        assert len(list(v)) == 30


OPEN = {"x264-params": "open-gop=1:keyint=30:bframes=3"}
REFRESHED = {"x264-params": "intra-refresh=1:keyint=30"}


def write_moving(
    path,
    *,
    codec="libx264",
    frames=230,
    gop=30,
    times_s=None,
    prepare=None,
    container=None,
    **options,
):
    """A film of a passing texture, of which no two pictures are alike."""
    texture = np.random.default_rng(5).integers(0, 256, (12, 4 * frames + 16), np.uint8)
    texture = cv2.resize(texture, None, fx=4, fy=4)
    ticks = 25 if times_s is None else 1000
    with av.open(path, "w", options=container or {}) as container:
        stream = container.add_stream(codec, rate=25, options=options)
        stream.width, stream.height, stream.pix_fmt = 64, 48, "yuv420p"
        stream.gop_size = gop
        if prepare is not None:
            prepare(stream)
        if times_s is not None:
            stream.codec_context.time_base = Fraction(1, ticks)
        for n in range(frames):
            picture = np.ascontiguousarray(texture[:, 5 * n : 5 * n + 64])
            frame = av.VideoFrame.from_ndarray(picture, format="gray").reformat(format="yuv420p")
            frame.pts = n if times_s is None else round(ticks * times_s[n])
            frame.time_base = Fraction(1, ticks)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    return path


def pictures(source):
    return [(frame.index, frame.t_s, frame.image.tobytes()) for frame in source]


@pytest.mark.parametrize(
    ("name", "options", "starts"),
    [
        ("a.mp4", {"bf": "3"}, 180),
        ("a.mkv", OPEN, 180),
        ("a.ts", OPEN, 180),
        ("a.mp4", REFRESHED, 180),
        (
            "uneven.mp4",
            {"bf": "3", "times_s": [0.05 * n - 0.02 * (n % 3) for n in range(230)]},
            180,
        ),
        ("a.ts", {"codec": "mpeg2video", "bf": "2"}, 180),
        ("a.mpg", {"codec": "mpeg2video", "bf": "2"}, 0),
        ("a.avi", {"codec": "mpeg4", "bf": "2"}, 210),
        ("one_key_frame.mp4", {"gop": 1000}, 60),
        ("reordered_without_times.avi", {"bf": "3"}, 0),
    ],
)
def test_frames_from_the_middle_are_those_of_the_whole_film(tmp_path, name, options, starts):
    path = write_moving(tmp_path / name, **options)
    with VideoFile(path) as source:
        whole = pictures(source)
        problem = source.problem
    for wanted in (40, 215):
        with VideoFile(path) as source:
            source.seek_frame(wanted)
            found = pictures(source.read_ahead())
        assert found == whole[found[0][0] :]
        assert found[0][0] <= wanted
        assert source.problem == problem
    # Where the packets tell the numbers, little is decoded that is not asked for.
    assert found[0][0] >= starts


def test_what_an_edit_list_hides_has_no_number(tmp_path):
    whole, cut = write_moving(tmp_path / "whole.mp4", bf="3"), tmp_path / "cut.mp4"
    with av.open(whole) as source, av.open(cut, "w") as target:
        given = source.streams.video[0]
        stream = target.add_stream_from_template(given)
        for packet in source.demux(given):
            if packet.dts is not None:
                packet.pts, packet.dts = packet.pts - 13 * 512, packet.dts - 13 * 512
                packet.stream = stream
                target.mux(packet)
    with VideoFile(cut) as source:
        shown = pictures(source)
    assert len(shown) < 230
    with VideoFile(cut) as source:
        source.seek_frame(150)
        found = pictures(source)
    assert found == shown[found[0][0] :]
    assert 60 < found[0][0] <= 150


@pytest.mark.parametrize("keep", [0.5, 0.9])
def test_a_cut_off_file_gives_what_is_there_and_says_so(tmp_path, keep):
    whole = write_video(tmp_path / "whole.mkv", [n / 25 for n in range(200)], size_wh=(320, 240))
    cut = tmp_path / "cut.mkv"
    cut.write_bytes(whole.read_bytes()[: int(whole.stat().st_size * keep)])
    with VideoFile(cut) as source:
        frames = list(source)
    assert 10 < len(frames) < 200
    assert "ends at" in source.problem


def test_a_damaged_middle_is_skipped_and_said(tmp_path):
    rng = np.random.default_rng(0)
    path = tmp_path / "damaged.avi"
    content = bytearray(
        write_video(
            path, [n / 25 for n in range(200)], codec="mpeg4", size_wh=(320, 240)
        ).read_bytes()
    )
    third = len(content) // 3
    content[third : third + 3000] = rng.bytes(3000)
    path.write_bytes(content)
    with VideoFile(path) as source:
        frames = list(source)
    assert len(frames) > 50
    assert np.all(np.diff([f.t_s for f in frames]) > 0)
    assert source.problem is not None or len(frames) == 200


CONCAT = b"ffconcat version 1.0\nfile neighbour.mp4\n"
PLAYLIST = b"#EXTM3U\n#EXTINF:1,\nhttp://127.0.0.1:9/secret\n"
SDP = b"v=0\no=- 0 0 IN IP4 127.0.0.1\ns=x\nc=IN IP4 127.0.0.1\nt=0 0\nm=video 9 RTP/AVP 96\n"


@pytest.mark.parametrize(
    "content",
    [b"", b"no video", CONCAT, PLAYLIST, SDP, bytes(range(256)) * 40],
    ids=["empty", "text", "concat", "playlist", "sdp", "noise"],
)
@pytest.mark.parametrize("name", ["x.mp4", "x.m3u8", "concat:x.mp4"])
def test_what_is_no_video_is_refused(tmp_path, name, content, video):
    (tmp_path / "neighbour.mp4").write_bytes(video.read_bytes())
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(UnreadableVideo, match=r"is empty|not a video"):
        VideoFile(path)


def test_a_missing_file_is_named(tmp_path):
    with pytest.raises(UnreadableVideo, match=r"nowhere\.mp4 is not there"):
        VideoFile(tmp_path / "nowhere.mp4")


def test_a_codec_off_the_list_is_named(tmp_path):
    path = write_video(tmp_path / "x.avi", codec="ffv1", fmt="bgr0")
    with pytest.raises(UnreadableVideo, match="ffv1"):
        VideoFile(path)


def test_sound_without_pictures_is_refused(tmp_path):
    path = tmp_path / "sound.mp4"
    with av.open(path, "w") as container:
        stream = container.add_stream("aac", rate=8000)
        frame = av.AudioFrame.from_ndarray(
            np.zeros((1, 1024), np.float32), format="fltp", layout="mono"
        )
        frame.sample_rate, frame.pts = 8000, 0
        container.mux(stream.encode(frame))
        container.mux(stream.encode())
    with pytest.raises(UnreadableVideo, match="no video stream"):
        VideoFile(path)


def test_no_more_frames_are_taken_than_a_server_can_keep(video, monkeypatch):
    monkeypatch.setattr("vo_core.sources.MAX_FRAMES", 25)
    monkeypatch.setattr("vo_core.containers.MAX_FRAMES", 25)
    with VideoFile(video) as source:
        assert source.info.frames is None, "what is stated is beyond it"
        assert len(list(source)) == 25
    assert "only the first 25 frames are taken" in source.problem.lower()


def test_a_file_that_cannot_be_sought_in_is_read_from_its_beginning(tmp_path):
    whole = write_video(tmp_path / "whole.webm", codec="libvpx-vp9", size_wh=(320, 240))
    cut = tmp_path / "cut.webm"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size // 2])
    with VideoFile(cut) as source:
        expected = next(frame.to_bgr() for frame in source if frame.index == 5)
    assert np.array_equal(read_frame(cut, TIMES_S[5]).to_bgr(), expected)


def test_films_of_the_nineties_are_read(tmp_path):
    path = write_video(tmp_path / "a.avi", [n / 25 for n in range(30)], codec="msmpeg4")
    with VideoFile(path) as video:
        assert (video.info.codec, len(list(video))) == ("msmpeg4", 30)


def joined(path, codec, **options):
    """A film of two parts, 30 and 40 pictures, each with time stamps from its own zero."""
    parts = [path.with_stem("first"), path.with_stem("second")]
    write_moving(parts[0], codec=codec, frames=30, **options)
    write_moving(parts[1], codec=codec, frames=40, **options)
    path.write_bytes(b"".join(part.read_bytes() for part in parts))
    return path, [shown for part in parts for shown in colours(part)]


def colours(path):
    with VideoFile(path) as source:
        return [frame.to_bgr() for frame in source]


@pytest.mark.parametrize(
    ("name", "codec"),
    [("a.ts", "libx264"), ("a.mpg", "mpeg2video"), ("a.mkv", "libx264"), ("a.webm", "libvpx")],
)
def test_of_a_film_whose_times_begin_anew_every_picture_is_used(tmp_path, name, codec):
    path, expected = joined(tmp_path / name, codec)
    with VideoFile(path) as source:
        frames = list(source)
    assert f"begin anew after {frames[29].t_s:.2f} s" in source.problem
    assert "not shown" in source.problem
    assert np.array_equal([frame.to_bgr() for frame in frames], expected)
    gaps_s = np.diff([frame.t_s for frame in frames])
    assert 10 <= gaps_s[29] < 10.2
    assert np.delete(gaps_s, 29) == pytest.approx(0.04, abs=0.001)
    # A time leads to its picture in either part.
    for n in (3, 28, 31, 68):
        assert np.array_equal(
            read_frame(path, frames[n].t_s, may_begin_anew=True).to_bgr(), expected[n]
        )
    clip = frames_between(path, frames[27].t_s, frames[33].t_s, may_begin_anew=True)
    assert np.array_equal([frame.to_bgr() for frame in clip], expected[27:34])
    with VideoFile(path) as source:
        source.seek_frame(66)
        assert all(frame.t_s == frames[frame.index].t_s for frame in source)


def problem_of(path):
    with VideoFile(path) as source:
        return len(list(source)), source.problem


def test_a_pause_that_hides_the_way_is_named(tmp_path):
    """A recorder paused, or its clock was set forward."""
    times_s = [n / 25 + 3600 * (n >= 20) for n in range(30)]
    path = write_moving(tmp_path / "a.mkv", frames=30, times_s=times_s)
    frames, problem = problem_of(path)
    assert frames == 30
    assert problem.startswith("Nothing is shown from 0.76 s to 3600.80 s,")


@pytest.mark.parametrize(
    "options",
    [
        {"mpegts_start_pid": "768"},
        {"mpegts_start_pid": "768", "mpegts_pmt_start_pid": "512", "mpegts_service_id": "7"},
    ],
)
def test_a_film_on_other_tracks_that_follows_in_the_file_is_named(tmp_path, options):
    """Chunks of different recorders were joined."""
    first = write_moving(tmp_path / "first.ts", frames=30)
    second = write_moving(tmp_path / "second.ts", frames=40, container=options)
    path = tmp_path / "joined.ts"
    path.write_bytes(first.read_bytes() + second.read_bytes())
    assert problem_of(path) == (30, "Another film follows in the file and is not read.")


def test_a_part_in_another_coding_is_named(tmp_path):
    """The track stays the same, and its decoder makes nothing of the second part."""
    first = write_moving(tmp_path / "first.ts", frames=30, codec="mpeg2video")
    second = write_moving(tmp_path / "second.ts", frames=60)
    path = tmp_path / "joined.ts"
    path.write_bytes(first.read_bytes() + second.read_bytes())
    _, problem = problem_of(path)
    assert re.search(r"; \d\d packets in a row show no picture\.$", problem)


def test_pictures_that_an_edit_list_hides_are_no_fault(tmp_path):
    """A phone cuts a film so, without coding it again."""
    path = tmp_path / "cut.mp4"
    with av.open(write_moving(tmp_path / "whole.mp4")) as source, av.open(path, "w") as target:
        stream = target.add_stream_from_template(source.streams.video[0])
        for packet in source.demux(source.streams.video[0]):
            if packet.size:
                packet.pts -= round(1 / packet.time_base)
                packet.dts -= round(1 / packet.time_base)
                packet.stream = stream
                target.mux(packet)
    assert problem_of(path) == (205, None)


def test_a_film_across_the_roll_over_of_its_clock_begins_at_zero(tmp_path):
    path = tmp_path / "a.ts"
    write_moving(path, codec="mpeg2video", frames=60, container={"output_ts_offset": "95442"})
    with VideoFile(path) as source:
        frames = list(source)
    assert [frame.t_s for frame in frames] == pytest.approx([n / 25 for n in range(60)], abs=1e-4)
    assert source.problem is None
    assert np.array_equal(read_frame(path, frames[1].t_s).to_bgr(), frames[1].to_bgr())


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.ts"])
def test_sound_that_is_longer_than_the_film_is_no_fault(tmp_path, name):
    path = tmp_path / name
    with av.open(path, "w") as container:
        film, sound = container.add_stream("libx264", rate=25), container.add_stream("aac", 8000)
        film.width, film.height = 64, 48
        for n in range(25):
            frame = av.VideoFrame(64, 48, "yuv420p")
            frame.pts = n
            container.mux(film.encode(frame))
        for n in range(40):
            silence = av.AudioFrame.from_ndarray(
                np.zeros((1, 1024), np.float32), format="fltp", layout="mono"
            )
            silence.sample_rate, silence.pts = 8000, 1024 * n
            container.mux(sound.encode(silence))
        container.mux(film.encode())
        container.mux(sound.encode())
    with VideoFile(path) as source:
        assert len(list(source)) == 25
    assert source.problem is None


TURNS = {
    "a quarter": ((90, False), lambda picture: np.rot90(picture)),
    "half": ((180, False), lambda picture: np.rot90(picture, 2)),
    "a quarter back": ((-90, False), lambda picture: np.rot90(picture, -1)),
    "mirrored": ((0, True), np.fliplr),
    "half and mirrored": ((180, True), np.flipud),
}


@pytest.mark.parametrize("turn", TURNS)
@pytest.mark.parametrize("suffix", ["mp4", "mkv"])
def test_pictures_are_turned_as_players_turn_them(tmp_path, turn, suffix):
    (degrees, is_mirrored), turned = TURNS[turn]
    plain = colours(write_moving(tmp_path / f"plain.{suffix}", frames=2))
    path = write_moving(
        tmp_path / f"turned.{suffix}",
        frames=2,
        prepare=lambda stream: stream.set_display_rotation(degrees, is_mirrored),
    )
    with VideoFile(path) as source:
        frame = next(iter(source))
    expected = turned(plain[0])
    assert np.array_equal(frame.to_bgr(), expected)
    assert frame.image.shape == expected.shape[:2] == (source.info.height, source.info.width)
    assert frame.image.flags.c_contiguous
    assert np.array_equal(read_frame(path, 0.0).to_bgr(), expected)


def test_a_turn_that_browsers_ignore_turns_nothing(tmp_path):
    plain, path = write_moving(tmp_path / "plain.mp4", frames=2), tmp_path / "stated_within.mp4"
    with av.open(plain) as source, av.open(path, "w") as target:
        given = source.streams.video[0]
        stream = target.add_stream_from_template(given)
        within = BitStreamFilterContext(
            "h264_metadata=display_orientation=insert:rotate=90", given, stream
        )
        for packet in source.demux(given):
            for changed in within.filter(packet if packet.size else None):
                changed.stream = stream
                target.mux(changed)
    assert np.array_equal(colours(path), colours(plain))


@pytest.mark.parametrize(("degrees", "aspect"), [(0, 16 / 15), (90, 15 / 16)])
def test_the_shape_of_the_pixels_is_reported(tmp_path, degrees, aspect):
    def prepare(stream):
        stream.codec_context.sample_aspect_ratio = Fraction(16, 15)
        stream.set_display_rotation(degrees)

    with VideoFile(write_moving(tmp_path / "a.mp4", frames=2, prepare=prepare)) as source:
        assert source.info.pixel_aspect == pytest.approx(aspect)


@pytest.mark.parametrize(
    ("name", "cover"),
    [
        ("marked_cover.mp4", Disposition.attached_pic),
        ("unmarked_cover.mkv", Disposition.default),
        ("two_films.mkv", None),
    ],
)
def test_the_film_is_read_and_not_its_cover_or_another_track(tmp_path, name, cover):
    path = tmp_path / name
    with av.open(path, "w") as container:
        other = container.add_stream("mjpeg", rate=25)
        other.width, other.height, other.pix_fmt = 32, 32, "yuvj420p"
        film = container.add_stream("libx264", rate=25)
        film.width, film.height = 64, 48
        other.disposition = cover or Disposition(0)
        film.disposition = Disposition(0) if cover == Disposition.default else Disposition.default
        for n in range(12):
            if n == 0 or cover is None:
                frame = av.VideoFrame(32, 32, "yuvj420p")
                frame.pts = n
                container.mux(other.encode(frame))
            frame = av.VideoFrame(64, 48, "yuv420p")
            frame.pts = n
            container.mux(film.encode(frame))
        container.mux(other.encode())
        container.mux(film.encode())
    with VideoFile(path) as source:
        assert (source.info.width, len(list(source))) == (64, 12)
