"""The command line: exit codes 0, 1 and 2, what is written, and what is said when it goes wrong."""

import json
import os
import socket
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import cv2
import httpx
import pytest
from boards import PINHOLE, Studio, checkerboard, poses
from builders import PATIENCE_S, make_clip, wait_until
from films import half_sized
from forks import Fork, become
from websockets.sync.client import connect

from app.inspections.films import samples
from app.lab.bench.choices import CHOICES
from app.lab.simulation import SCENARIOS, SimulatedRun, simulate
from vo_core import Rig, Track

COMMANDS = [
    "demo",
    "serve",
    "track",
    "counter",
    "simulate",
    "evaluate",
    "correct",
    "calibrate",
    "advise",
    "bench",
    "export",
    "verify",
    "archive",
]
CHECKERBOARD = ["--board", "checkerboard", "--columns", "9", "--rows", "6", "--square-mm", "20"]
HEADER = (
    "frame,time_s,x_mm,y_mm,yaw_deg,distance_mm,sigma_distance_mm,quality,status,"
    "sigma_registration_mm,z_mm,pitch_deg,roll_deg,looking_around"
)
SHORT = half_sized(SCENARIOS["nominal"].shortened(60))


@pytest.fixture(scope="module")
def sample(tmp_path_factory) -> SimulatedRun:
    return simulate(SHORT, tmp_path_factory.mktemp("sample"))


@pytest.fixture
def track(chainage, sample, tmp_path):
    """`chainage track` of the sample, with what differs; the outcome and the file."""

    def run(*words, video=sample.video, rig=sample.rig):
        out = tmp_path / "track.out"
        return chainage("track", video, "--rig", rig, "--out", out, *words), out

    return run


def changed_rig(sample, path, **camera):
    """The sample's rig file with another camera."""
    fields = json.loads(sample.rig.read_text())
    fields["camera"] |= camera
    path.write_text(json.dumps(fields))
    return path


def ros_camera(path, width, height, focal_px):
    path.write_text(
        f"image_width: {width}\nimage_height: {height}\ndistortion_model: plumb_bob\n"
        "camera_matrix:\n  rows: 3\n  cols: 3\n"
        f"  data: [{focal_px}, 0, {(width - 1) / 2}, 0, {focal_px}, {(height - 1) / 2}, 0, 0, 1]\n"
        "distortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n"
    )
    return path


def frames_in(sample):
    return len(sample.truth.read_text().splitlines()) - 1


def test_the_installed_command_runs_from_any_folder(tmp_path):
    command = Path(sys.executable).with_name("chainage")
    done = subprocess.run([command, "--help"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0
    assert all(name in done.stdout for name in COMMANDS)


def test_every_command_explains_itself(chainage):
    for command in COMMANDS:
        done = chainage(command, "--help")
        assert done.code == 0, command
        assert f"Usage: chainage {command}" in done.out


def test_wrong_usage_ends_with_2(chainage):
    tried = (
        [],
        ["survey"],
        ["track"],
        ["track", "v.mp4", "--rig", "rig.json"],
        ["track", "v.mp4", "--rig", "rig.json", "--out", "t.csv", "--format", "xls"],
        ["track", "v.mp4", "--rig", "rig.json", "--out", "t.csv", "--method", "guess"],
        ["counter", "v.mp4"],
        ["counter", "v.mp4", "--out", "c.csv", "--box", "1,2,3"],
        ["evaluate", "t.csv"],
        ["evaluate", "t.csv", "truth.csv", "t2.csv"],
        ["evaluate", "t.csv", "truth.csv", "--plot", "errors.doc"],
        ["bench", "--metres", "0.01"],
        ["bench", "--calibration", "intervals.txt"],
        ["bench", "--field", "--quick"],
        ["bench", "--field", "--calibration", "intervals.png"],
        ["bench", "--field", "--write", "no-such-file.md"],
        ["bench", "--field", "--forward"],
        ["bench", "--forward", "--calibration", "intervals.png"],
        ["bench", "--seed", "2"],
        ["serve", "--port", "70000"],
        ["advise"],
        ["advise", "--rig", "rig.json", "--move", "15"],
        ["advise", "--rig", "rig.json", "--move", "0,0"],
        ["advise", "--rig", "rig.json", "--move", "nan,5"],
        ["calibrate", "a.png", *CHECKERBOARD],
        ["calibrate", "a.png", *CHECKERBOARD, "--out", "c.json", "--board", "charuco"],
        ["calibrate", "a.png", *CHECKERBOARD, "--out", "c.json", "--marker-mm", "15"],
        ["calibrate", "--out", "c.json"],
        ["calibrate", "a.png", *CHECKERBOARD, "--out", "c.json", "--diameter-mm", "300"],
        ["calibrate", "--from-video", "a.mp4", "--out", "c.json"],
        ["calibrate", "--from-video", "a.mp4", "--diameter-mm", "300"],
        ["calibrate", "a.png", "--from-video", "a.mp4", "--diameter-mm", "300", "--out", "c.json"],
    )
    codes = [chainage(*words).code for words in tried]
    assert [words for words, code in zip(tried, codes, strict=True) if code != 2] == []


def test_track_writes_a_row_for_every_frame(track, sample):
    done, out = track()
    assert done.code == 0
    rows = [line for line in out.read_text().splitlines() if not line.startswith("#")]
    assert rows[0] == HEADER
    assert len(rows) == 1 + frames_in(sample)
    assert rows[1].startswith("0,0.000000,0.0000,0.0000,0.00000,0.0000,")
    measured = Track.from_csv(out.read_text())
    # 60 mm at the 0.1 % of the issue, and what a first frame at rest may add.
    assert measured.distance_mm[-1] == pytest.approx(60, abs=0.5)
    assert f"{frames_in(sample)} frames, 0.060 m, 0 frames without a lock" in done.out


def test_track_says_in_the_file_what_it_was_made_of(track):
    _, out = track("--method", "paper")
    metadata = [line for line in out.read_text().splitlines() if line.startswith("#")]
    assert metadata == ["# video: video.mp4", "# rig: rig.json", "# method: paper"]


def test_track_as_tum_and_as_json(track, sample):
    _, out = track("--format", "tum")
    rows = [[float(value) for value in line.split()] for line in out.read_text().splitlines()]
    assert len(rows) == frames_in(sample)
    assert rows[0] == [0, 0, 0, 0, 0, 0, 0, 1]
    assert rows[-1][1] == pytest.approx(0.060, abs=0.0005)
    _, out = track("--format", "json")
    content = json.loads(out.read_text())
    assert ",".join(content["columns"]) == HEADER
    assert {len(column) for column in content["columns"].values()} == {frames_in(sample)}
    assert content["metadata"]["video"] == "video.mp4"


def test_camera_file_replaces_the_camera_of_the_rig(track, sample, tmp_path):
    wrong = changed_rig(sample, tmp_path / "wrong.json", fx=1194.0, fy=1194.0)
    right = ros_camera(tmp_path / "camera.yaml", 320, 240, 597.0)
    _, out = track()
    expected = Track.from_csv(out.read_text())
    done, out = track("--camera", right, rig=wrong)
    assert done.code == 0
    assert Track.from_csv(out.read_text()).distance_mm.tolist() == expected.distance_mm.tolist()
    assert "# camera: camera.yaml" in out.read_text().splitlines()


def test_camera_file_of_another_camera_is_refused(track, tmp_path):
    done, out = track("--camera", ros_camera(tmp_path / "camera.yaml", 160, 120, 300.0))
    assert done.code == 1
    assert "160 x 120" in done.err
    assert "320 x 240" in done.err
    assert not out.exists()


def test_what_cannot_be_tracked_is_explained_and_nothing_written(track, sample, tmp_path):
    strange = changed_rig(sample, tmp_path / "strange.json", model="[/b]", fx=-1.0)
    in_mm = changed_rig(sample, tmp_path / "in_mm.json", fx=8.0, fy=8.0)
    for files, sentences in (
        ({"video": tmp_path / "none.mp4"}, ["none.mp4"]),
        ({"video": sample.truth}, ["chainage: truth.csv"]),
        ({"rig": tmp_path / "none.json"}, ["none.json cannot be read: No such file"]),
        (
            {"rig": strange},
            [
                "camera.model: Input should be 'pinhole' or 'fisheye' (found '[/b]')",
                "camera.fx: Input should be greater than 1 (found -1.0)",
            ],
        ),
        ({"rig": in_mm}, ["Is it the lens's focal length in mm?"]),
    ):
        done, out = track(**files)
        assert done.code == 1, files
        assert all(sentence in " ".join(done.err.split()) for sentence in sentences), done.err
        assert "Traceback" not in done.err
        assert not out.exists()


def test_damaged_video_is_tracked_as_far_as_it_goes(track, sample, tmp_path):
    cut = tmp_path / "cut.mp4"
    content = sample.video.read_bytes()
    cut.write_bytes(content[: len(content) * 3 // 4])
    done, out = track(video=cut)
    assert done.code == 0
    assert 0 < len(Track.from_csv(out.read_text())) < frames_in(sample)
    assert "warning: " in done.err


def test_folder_of_the_track_is_looked_for_before_the_work(chainage, sample, tmp_path):
    out = tmp_path / "none" / "track.csv"
    done = chainage("track", sample.video, "--rig", sample.rig, "--out", out)
    assert done.code == 2
    assert "--out" in done.err
    assert "tracking" not in done.err


def test_simulate_one_scenario_into_the_folder(chainage, monkeypatch, tmp_path):
    monkeypatch.setitem(SCENARIOS, "short", SHORT)
    done = chainage("simulate", tmp_path, "--scenario", "short")
    assert done.code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"video.mp4", "rig.json", "truth.csv"}


def test_simulate_draws_a_forward_rig_from_a_seed(chainage, monkeypatch, tmp_path):
    stream = half_sized(SCENARIOS["forward_stream"].shortened(5))
    monkeypatch.setitem(SCENARIOS, "forward_stream", stream)
    for folder, seed in (("one", "1"), ("again", "1"), ("two", "2")):
        words = ["simulate", tmp_path / folder, "--scenario", "forward_stream", "--seed", seed]
        assert chainage(*words).code == 0
    one, again, two = (
        (tmp_path / folder / "rig.json").read_text() for folder in ("one", "again", "two")
    )
    assert one == again != two
    refused = chainage("simulate", tmp_path / "x", "--scenario", "nominal", "--seed", "1")
    assert refused.code == 1
    assert "looks forward" in refused.err


def test_simulate_several_scenarios_into_a_folder_each(chainage, monkeypatch, tmp_path):
    monkeypatch.setitem(SCENARIOS, "short", SHORT.shortened(5))
    monkeypatch.setitem(SCENARIOS, "floor", SCENARIOS["tiled_floor"].shortened(5))
    done = chainage("simulate", tmp_path, "--scenario", "short", "--scenario", "floor")
    assert done.code == 0
    for name in ("short", "floor"):
        assert (tmp_path / name / "video.mp4").is_file()


def test_simulate_all_leaves_out_what_needs_scikit_image_where_it_is_not(
    chainage, monkeypatch, tmp_path
):
    monkeypatch.setitem(sys.modules, "skimage", None)
    short = {
        name: SCENARIOS[name].shortened(5) for name in ("nominal", "tiled_floor", "photo_wall")
    }
    monkeypatch.setattr("app.lab.simulation.SCENARIOS", short)
    done = chainage("simulate", tmp_path)
    assert done.code == 0
    assert {path.name for path in tmp_path.iterdir()} == {"nominal", "tiled_floor"}
    assert "left out: photo_wall" in done.err
    done = chainage("simulate", tmp_path / "one", "--scenario", "photo_wall")
    assert done.code == 1
    assert "pip install scikit-image" in done.err


def test_unknown_scenario_names_those_there_are(chainage, tmp_path):
    done = chainage("simulate", tmp_path / "run", "--scenario", "sunny")
    assert done.code == 2
    assert "'sunny'" in done.err
    assert "nominal" in done.err
    assert not (tmp_path / "run").exists()


def test_bench_draws_the_stated_interval_against_the_actual_error(chainage, monkeypatch, tmp_path):
    monkeypatch.setattr("app.lab.intervals.films", lambda: [SHORT])
    monkeypatch.setattr("app.lab.intervals.QUICK_RIGS", 2)
    picture = tmp_path / "intervals.png"
    done = chainage("bench", "--quick", "--calibration", picture)
    assert done.code == 0
    assert "| nominal | 2 |" in done.out
    assert picture.read_bytes().startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("options", "scenario", "columns"),
    [(["--field"], "climb", 7), (["--forward", "--seed", "3"], "forward_crooked", 5)],
)
def test_bench_writes_its_figures_into_a_file(
    chainage, monkeypatch, tmp_path, options, scenario, columns
):
    choice = CHOICES[options[0]]
    short = replace(choice, names=(scenario,), length_mm=60.0)
    monkeypatch.setitem(CHOICES, options[0], short)
    file, mark = tmp_path / "accuracy.md", choice.mark
    file.write_text(f"before\n<!-- {mark}:begin -->\nold\n<!-- {mark}:end -->\nafter\n")
    done = chainage("bench", *options, "--write", file)
    assert done.code == 0
    cells = done.out.strip().splitlines()[-1].split("|")
    assert cells[1].strip() == scenario
    assert len(cells) == 2 + columns
    written = file.read_text()
    assert done.out.strip() in written
    assert f"by `chainage bench {' '.join(options)}`." in written
    assert written.startswith("before\n")
    assert written.endswith(f"<!-- {mark}:end -->\nafter\n")


def test_bench_refuses_a_file_without_a_place_before_it_measures(chainage, tmp_path):
    file = tmp_path / "accuracy.md"
    file.write_text("<!-- bench:begin -->\n<!-- bench:end -->\n")
    done = chainage("bench", "--field", "--write", file)
    assert done.code == 2
    assert "<!-- bench-field:begin -->" in done.err


def test_evaluate_prints_the_errors_and_draws_them(chainage, track, sample, tmp_path):
    _, out = track()
    picture = tmp_path / "errors.png"
    done = chainage("evaluate", out, sample.truth, "--plot", picture)
    assert done.code == 0
    assert f"{frames_in(sample)}, of which 0 missing" in done.out
    assert "end error" in done.out
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_evaluate_of_several_runs_gives_a_line_each_and_one_picture(
    chainage, track, sample, tmp_path
):
    _, out = track()
    other = tmp_path / "monday.csv"
    other.write_text("\n".join(out.read_text().splitlines()[:-1]))
    done = chainage(
        "evaluate", out, sample.truth, other, sample.truth, "--plot", tmp_path / "a.svg"
    )
    assert done.code == 0
    lines = [line.split() for line in done.out.splitlines()]
    assert lines[1][:3] == ["track", "0", "0"]
    assert lines[2][:3] == ["monday", "1", "0"]
    assert "all runs together" in done.out
    assert "warning: monday: track and truth do not have the same frames (1 missing" in done.err
    assert (tmp_path / "a.svg").read_text().startswith("<?xml")


@pytest.mark.parametrize("name", ["none.csv", "rig.json"])
def test_evaluate_of_something_else_ends_with_1(chainage, sample, name):
    done = chainage("evaluate", sample.rig.with_name(name), sample.truth)
    assert done.code == 1
    assert done.err.startswith("chainage: ")
    assert "Traceback" not in done.err


@pytest.mark.parametrize("command", ["serve", "demo"])
def test_a_port_in_use_is_reported_before_anything_is_done(
    chainage, tmp_path, monkeypatch, command
):
    monkeypatch.setenv("CHAINAGE_DATA", str(tmp_path / "data"))
    with socket.create_server(("127.0.0.1", 0)) as other:
        port = other.getsockname()[1]
        done = chainage(command, "--port", port)
    assert done.code == 1
    assert done.err.strip() == (
        f"chainage: The server cannot listen: port {port} of 127.0.0.1 is in use; "
        "choose another with --host or --port."
    )
    assert done.out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "settings", "said"),
    [
        # TEST-NET-1 of RFC 5737: nobody has it
        (["--host", "192.0.2.1"], {}, "192.0.2.1"),
        (
            ["--port", "0"],
            {"CHAINAGE_MAX_JOBS": "99"},
            "chainage: CHAINAGE_MAX_JOBS: Input should be less than or equal to 16 (found '99').",
        ),
    ],
)
def test_a_server_that_cannot_start_says_why(chainage, monkeypatch, words, settings, said):
    for name, value in settings.items():
        monkeypatch.setenv(name, value)
    done = chainage("serve", *words)
    assert (done.code, done.out) == (1, "")
    assert said in done.err
    assert "Traceback" not in done.err


def short_demo(*command):
    """Become the command, in a process forked from one that has imported it."""
    samples.LENGTH_MM = 20
    become(*command)


TYPED_ADDRESS = {"Accept": "text/html", "Sec-Fetch-Site": "none"}
"""What a browser sends for an address that a person opens."""


def test_demo_serves_its_sample_from_a_small_folder_and_leaves_nothing(tmp_path):
    # The demo's own reserve counts: with this one nothing would fit on any disk.
    settings = {"TMPDIR": str(tmp_path / "made"), "CHAINAGE_DISK_RESERVE_BYTES": str(2**50)}
    (tmp_path / "made").mkdir()
    words, environment = ["demo", "--port", "0"], os.environ | settings
    demo = Fork(words, environment, tmp_path / "log", target=short_demo)
    # Where a journal may keep what is printed, there is no token.
    opened, _, file = demo.stdout.readline().strip().partition(" and log in with the token in ")
    token = Path(file).read_text()
    assert token not in opened
    opened = f"{opened.removeprefix('Open ')}&token={token}"
    with httpx.Client(follow_redirects=True, headers=TYPED_ADDRESS, timeout=PATIENCE_S) as browser:
        page = browser.get(opened)
        inspection = browser.get(page.url.join(f"/api{page.url.path}")).json()
        assert inspection["name"] == "Sample culvert"
        assert inspection["status"] == "queued"  # nobody watches yet
        watched = page.url.copy_with(scheme="ws", path=f"/api{page.url.path}/live", query=None)
        cookie = "; ".join(f"{name}={value}" for name, value in browser.cookies.items())
        origin = str(page.url.copy_with(path="/", query=None)).rstrip("/")
        with connect(str(watched), origin=origin, additional_headers={"Cookie": cookie}):
            api = page.url.join(f"/api{page.url.path}")
            wait_until(lambda: browser.get(api).json()["status"] != "queued")
    assert list((tmp_path / "made").iterdir()) != []
    assert demo.terminate(PATIENCE_S) == 0
    assert list((tmp_path / "made").iterdir()) == []


def test_advise_gives_figures_a_verdict_and_a_picture(chainage, sample, tmp_path):
    picture = tmp_path / "field.png"
    done = chainage("advise", "--rig", sample.rig, "--move", "-15,5", "--plot", picture)
    assert done.code == 0
    assert "-15 mm forward, 5 mm to the right" in done.out
    assert "verdict: fit\n" in done.out
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_advise_says_what_to_change(chainage, sample):
    done = chainage("advise", "--rig", sample.rig, "--move", "60,0", "--frame-rate", "10")
    assert done.code == 0
    assert "verdict: fit with care\n- After this motion 51% of the wall" in done.out


@pytest.fixture(scope="module")
def board_pictures(tmp_path_factory):
    folder, studio = tmp_path_factory.mktemp("boards"), Studio(PINHOLE)
    for n, pose in enumerate(poses(6, 345, 0.19)):
        cv2.imwrite(str(folder / f"{n}.png"), studio.shoot(checkerboard(), *pose))
    return sorted(folder.iterdir())


def test_calibrate_puts_the_camera_into_a_rig(chainage, sample, board_pictures, tmp_path):
    out, report = tmp_path / "rig.json", tmp_path / "coverage.png"
    done = chainage(
        "calibrate", *board_pictures, sample.truth, *CHECKERBOARD,
        "--rig", sample.rig, "--out", out, "--report", report,
    )  # fmt: skip
    assert done.code == 0
    before, after = Rig.load(sample.rig), Rig.load(out)
    assert (after.mount, after.pipe) == (before.mount, before.pipe)
    assert after.camera.fx == pytest.approx(PINHOLE.fx, rel=0.002)
    assert 0 < after.tolerance.focal_percent < before.tolerance.focal_percent
    assert "left out: not a picture that can be read" in done.out
    assert "only 6 pictures were used" in done.out
    assert report.read_bytes().startswith(b"\x89PNG")


def test_calibrate_alone_writes_the_camera_part_of_a_rig(
    chainage, sample, board_pictures, tmp_path
):
    out = tmp_path / "camera.json"
    assert chainage("calibrate", *board_pictures, *CHECKERBOARD, "--out", out).code == 0
    fields = json.loads(sample.rig.read_text())
    fields["camera"] = json.loads(out.read_text())
    assert Rig.parse(fields).camera.fx == pytest.approx(PINHOLE.fx, rel=0.002)


@pytest.mark.long
def test_calibrate_makes_a_rig_from_a_film(chainage, tmp_path):
    forward = half_sized(replace(SCENARIOS["forward"], length_mm=400.0))
    film = simulate(forward, tmp_path / "film").video
    out, report = tmp_path / "rig.json", tmp_path / "grid.png"
    done = chainage(
        "calibrate", "--from-video", film, "--diameter-mm", "300", "--segment-mm", "1500",
        "--out", out, "--report", report,
    )  # fmt: skip
    assert done.code == 0
    rig = Rig.load(out)
    assert (rig.mount.view, rig.pipe.diameter_mm) == ("forward", 300)
    assert rig.pipe.segment_length_mm == 1500
    assert "fewer than two joints were seen" in done.out
    assert "state the inspected length (--length-m)" in done.out
    assert report.read_bytes().startswith(b"\x89PNG")


def test_calibrate_of_a_film_without_a_pipe_says_so_and_writes_nothing(chainage, tmp_path):
    film = make_clip(tmp_path / "down.mp4", 20)  # a floor
    out = tmp_path / "rig.json"
    done = chainage("calibrate", "--from-video", film, "--diameter-mm", "300", "--out", out)
    assert done.code == 1
    assert "does not show the wall of a pipe" in done.err
    assert not out.exists()


def test_calibrate_of_too_few_pictures_says_so_and_writes_nothing(
    chainage, board_pictures, tmp_path
):
    out = tmp_path / "camera.json"
    done = chainage("calibrate", *board_pictures[:2], *CHECKERBOARD, "--out", out)
    assert done.code == 1
    assert "usable in 2 pictures; at least 5 are needed" in done.err
    assert not out.exists()
