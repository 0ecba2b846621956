"""`chainage track --joints` and `chainage correct`: files in, files out, and what is said."""

import json
import sys
from dataclasses import replace

import numpy as np
import pytest
from textures import rig_fields

from app.cli.main import main
from app.lab.simulation import SCENARIOS, simulate
from app.survey.distances.correct_track import parse_length
from vo_core import Rig, Track
from vo_core.joints.sightings import Sighting, from_csv, to_csv
from vo_core.scale.evidence import KnownLength

SEGMENT_MM = 300.0
RIG = rig_fields(
    camera={"width": 320, "height": 240, "fx": 597.0, "fy": 597.0, "cx": 159.5, "cy": 119.5},
    pipe={"segment_length_mm": SEGMENT_MM},
)
SHORT = replace(
    SCENARIOS["nominal"].shortened(1600),
    rig=Rig.parse(RIG),
    first_joint_mm=200.0,
    speed_mm_s=900.0,
    acceleration_mm_s2=3600.0,
)


@pytest.fixture
def chainage(chainage):
    """The command, its outputs with their lines joined."""

    def run(*words):
        done = chainage(*words)
        return replace(done, out=" ".join(done.out.split()), err=" ".join(done.err.split()))

    return run


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return simulate(SHORT, tmp_path_factory.mktemp("run"))


@pytest.fixture(scope="module")
def true_mm(run):
    lines = run.truth.read_text().splitlines()
    return np.array([float(line.split(",")[2]) for line in lines[1:]])


@pytest.fixture(scope="module")
def folder(run, tmp_path_factory):
    """rig.json with a height 1 % too large, and what `track` makes with it."""
    folder = tmp_path_factory.mktemp("tracked")
    wrong = RIG | {"mount": RIG["mount"] | {"height_mm": 1.01 * 230}}
    (folder / "rig.json").write_text(json.dumps(wrong))
    words = ["chainage", "track", run.video, "--rig", folder / "rig.json"]
    words += ["--out", folder / "track.csv", "--joints", folder / "joints.csv"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", [str(word) for word in words])
        with pytest.raises(SystemExit) as end:
            main()
    assert end.value.code == 0
    return folder


def read(path):
    return Track.from_csv(path.read_text("utf-8"))


def test_track_writes_the_joints_that_it_saw(folder):
    text = (folder / "joints.csv").read_text("utf-8")
    assert text.startswith("# video: video.mp4\n# rig: rig.json\n# method: chainage\njoint,frame,")
    raw, sightings = read(folder / "track.csv"), from_csv(text)
    at_mm = [raw.distance_mm[s.frame] + s.ahead_mm for s in sightings]
    assert np.array(at_mm) / 1.0099 == pytest.approx([200, 500, 800, 1100, 1400], abs=1)


def test_joints_put_a_wrong_height_right(chainage, folder, true_mm, tmp_path):
    out = tmp_path / "out.csv"
    raw = (folder / "track.csv").read_bytes()
    done = chainage(
        "correct", folder / "track.csv", "--joints", folder / "joints.csv",
        "--rig", folder / "rig.json", "--out", out,
    )  # fmt: skip
    assert done.code == 0
    corrected = read(out)
    assert np.abs(read(folder / "track.csv").distance_mm - true_mm).max() > 14
    assert np.abs(corrected.distance_mm - true_mm).max() < 2
    assert "joint 4 in frame" in done.out
    assert "by 5 joints 300 mm apart" in done.out
    assert "the rig says 232.3 mm" in done.out
    assert (folder / "track.csv").read_bytes() == raw


@pytest.fixture
def silted(tmp_path):
    """A function that writes what a run over silt leaves: rig, track and joints, by its scale."""

    def write(first, last):
        true_mm = np.linspace(0, 6000, 599)
        scale = np.linspace(first, last, 599)
        raw_mm = np.concatenate([[0], np.cumsum(np.diff(true_mm) / (scale[1:] + scale[:-1]) * 2)])
        still = np.zeros(599)
        track = Track(
            np.arange(599), np.arange(599) / 30, raw_mm, still, still, raw_mm, 0.01 * raw_mm,
            still + 1, np.array(["ok"] * 599), still, still, still, still, still,
        )  # fmt: skip
        rings_mm = np.interp([400, 1900, 3400, 4900], true_mm, raw_mm)
        frames = np.searchsorted(raw_mm, rings_mm)
        sightings = [
            Sighting(int(frame), float(at - raw_mm[frame]), 0.3, -0.2)
            for frame, at in zip(frames, rings_mm, strict=True)
        ]
        (tmp_path / "rig.json").write_text(json.dumps(rig_fields()))
        (tmp_path / "track.csv").write_text(track.to_csv())
        (tmp_path / "joints.csv").write_text(to_csv(track, sightings))
        words = ["correct", tmp_path / "track.csv", "--joints", tmp_path / "joints.csv"]
        return [*words, "--rig", tmp_path / "rig.json", "--out", tmp_path / "out.csv"], true_mm

    return write


def test_over_silt_the_joints_are_believed_and_the_rig_is_not(chainage, silted, tmp_path):
    words, true_mm = silted(0.89, 0.89)
    done = chainage(*words)
    assert done.code == 0
    assert np.abs(read(tmp_path / "out.csv").distance_mm - true_mm).max() < 0.002 * 6000
    assert "check height and lens; silt or water in the invert is a likely cause" in done.out
    assert "# rig_doubted: " in (tmp_path / "out.csv").read_text("utf-8")


def test_a_scale_that_changes_along_the_run_is_given_stretch_by_stretch(chainage, silted, tmp_path):
    words, true_mm = silted(1.0, 0.89)
    done = chainage(*words)
    assert done.code == 0
    corrected = read(tmp_path / "out.csv")
    assert np.abs(corrected.distance_mm - true_mm).max() < 0.002 * 6000
    assert corrected.sigma_distance_mm[-1] < 0.005 * 6000
    assert "it changes along the run from 0.979 to 0.924" in done.out
    head = (tmp_path / "out.csv").read_text("utf-8").split("frame,")[0]
    assert head.count("_m: 0.9") == 3


def test_a_length_and_the_rig_correct_together_and_the_file_says_so(chainage, folder, tmp_path):
    out, last = tmp_path / "out.csv", len(read(folder / "track.csv")) - 1
    done = chainage(
        "correct", folder / "track.csv", "--length", f"0:{last}=1.6+-2",
        "--rig", folder / "rig.json", "--height-sigma-mm", "3", "--out", out,
    )  # fmt: skip
    assert done.code == 0
    assert read(out).distance_mm[-1] == pytest.approx(1600, abs=0.3)
    assert read(out).sigma_distance_mm[-1] == pytest.approx(2, abs=0.1)
    metadata = [line for line in out.read_text("utf-8").splitlines() if line[0] == "#"]
    assert metadata[:4] == [
        "# video: video.mp4", "# rig: rig.json", "# method: chainage", "# raw_track: track.csv"
    ]  # fmt: skip
    assert metadata[4].startswith("# scale: 0.99")
    assert metadata[5].endswith(f"from 1.6 m ± 2 mm between frames 0 and {last}")
    assert metadata[6].endswith("from the rig, to 1.4 %")
    assert metadata[7].startswith("# height_mm: 230.")


def test_without_a_correction_the_height_widens_the_interval(chainage, folder, tmp_path):
    out = tmp_path / "out.csv"
    done = chainage(
        "correct", folder / "track.csv", "--rig", folder / "rig.json",
        "--height-sigma-mm", "2.3", "--focal-sigma-px", "0.1", "--out", out,
    )  # fmt: skip
    assert done.code == 0
    raw, wider = read(folder / "track.csv"), read(out)
    assert wider.distance_mm == pytest.approx(raw.distance_mm, abs=0.01)
    assert wider.sigma_distance_mm[-1] == pytest.approx(0.0098 * 1616, rel=0.03)


def test_a_corrected_track_is_not_corrected_again(chainage, folder, tmp_path):
    out = tmp_path / "out.csv"
    last = len(read(folder / "track.csv")) - 1
    assert chainage("correct", folder / "track.csv", "--length", f"0:{last}=1.6", "--out", out)
    done = chainage("correct", out, "--length", f"0:{last}=1.6", "--out", tmp_path / "two.csv")
    assert done.code == 1
    assert "out.csv was corrected before" in done.err
    assert not (tmp_path / "two.csv").exists()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--length", "0:9999=1.6"], "no frame 9999 in the track"),
        (["--length", "0:40=0"], "must be above 0"),
        (["--length", "0:40=16"], "cannot be right"),
        (["--joints", "track.csv", "--rig", "rig.json"], "no column ahead_mm"),
        (["--joints", "none.csv", "--rig", "rig.json"], "none.csv"),
        (["--joints", "joints.csv", "--rig", "unsegmented.json"], "pipe.segment_length_mm"),
        (["--joints", "joints.csv", "--rig", "other.json"], "Segments of 170 mm cannot be counted"),
        (["--joints", "empty.csv", "--rig", "rig.json"], "No joints were seen"),
    ],
)
def test_what_cannot_correct_ends_with_1_and_its_reason(chainage, folder, tmp_path, words, said):
    for name, segment_mm in (("unsegmented.json", None), ("other.json", 170.0)):
        (folder / name).write_text(
            json.dumps(RIG | {"pipe": RIG["pipe"] | {"segment_length_mm": segment_mm}})
        )
    (folder / "empty.csv").write_text("frame,ahead_mm,sigma_mm,contrast\n")
    files = [folder / word if "." in word and "=" not in word else word for word in words]
    out = tmp_path / "out.csv"
    done = chainage("correct", folder / "track.csv", *files, "--out", out)
    assert done.code == 1
    assert done.err.startswith("chainage: ")
    assert said in done.err
    assert not out.exists()


@pytest.mark.parametrize(
    "words",
    [
        ["--out", "out.csv"],
        ["--length", "0:40", "--out", "out.csv"],
        ["--length", "0:40=1.2.3", "--out", "out.csv"],
        ["--joints", "joints.csv", "--out", "out.csv"],
        ["--height-sigma-mm", "2", "--out", "out.csv"],
        ["--length", "0:40=1.0", "--out", "track.csv"],
        ["--length", "0:40=1.0", "--out", "none/out.csv"],
        ["--length", "0:40=1.0"],
    ],
)
def test_wrong_usage_ends_with_2(chainage, monkeypatch, folder, words):
    monkeypatch.chdir(folder)
    assert chainage("correct", "track.csv", *words).code == 2


@pytest.mark.parametrize("words", ["3:80=12.5±7", "3:80=12.5+-7", " 3 : 80 = 12.5 ± 7 "])
def test_a_length_is_read_with_its_uncertainty(words):
    assert parse_length(words) == KnownLength(3, 80, 12_500.0, 7.0)


def test_a_length_without_uncertainty_has_that_of_a_tape():
    assert parse_length("0:80=12.5") == KnownLength(0, 80, 12_500.0, 5.0)


@pytest.mark.parametrize("words", ["", "0=1", "0:1=", "-1:4=2", "0:1=2±", "0:1=1e3", "0:1=.", "x"])
def test_other_words_are_no_length(words):
    with pytest.raises(ValueError, match="is not FRAME:FRAME=METRES"):
        parse_length(words)
