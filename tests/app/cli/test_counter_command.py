"""`chainage counter`: the file, what is said about it, and wrong boxes."""

import json

import numpy as np
import pytest
from counter_films import CounterFilm, write
from tracks import make_track

pytestmark = pytest.mark.render
FILM = CounterFilm(frames=6, counter=None)


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    path = tmp_path_factory.mktemp("counter") / "film.mp4"
    write(FILM, path)
    return path


def test_a_film_without_a_counter_is_told_so(chainage, film, tmp_path):
    out = tmp_path / "counter.csv"
    done = chainage("counter", film, "--out", out)
    assert done.code == 0
    assert "no counter was found in film.mp4, so every reading is empty" in done.err
    assert all(row.endswith(",,,0.000") for row in out.read_text().splitlines()[1:])


def test_the_counter_of_a_film_is_written_and_compared_with_a_track(chainage, tmp_path):
    film, track, out, comparison = (
        tmp_path / name for name in ("film.mp4", "track.csv", "counter.csv", "found.json")
    )
    write(CounterFilm(frames=20, speed=1.8), film)
    driven_mm = np.arange(20) * 180 / 0.95
    track.write_text(make_track(driven_mm, np.sqrt(driven_mm) / 10).to_csv())
    done = chainage(
        "counter", film, "--box", "40,380,300,80", "--out", out,
        "--track", track, "--comparison", comparison,
    )  # fmt: skip
    assert done.code == 0
    assert "20 of 20 frames have a reading, from 12.3 to 15.7 m" in done.out
    header, *rows = out.read_text().splitlines()
    assert header == "frame,time_s,reading,unit,confidence"
    assert rows[0].startswith("0,0.000000,12.3,m,")
    assert len(rows) == 20
    assert "chainage correct --length 0:19=3.400±44" in done.out
    found = json.loads(comparison.read_text())
    assert found["scale"] == pytest.approx(0.95, abs=2 * found["sigma"])
    assert found["faults"] == []
    assert found["sentence"] in done.out


def test_a_comparison_needs_a_track(chainage, film, tmp_path):
    out = tmp_path / "counter.csv"
    done = chainage("counter", film, "--out", out, "--comparison", tmp_path / "found.json")
    assert done.code == 2
    assert not out.exists()


@pytest.mark.parametrize(
    "box", ["40,380,300", "a,b,c,d", "40,380,300,200", "-1,0,90,40", "0,0,5,5"]
)
def test_a_wrong_box_is_wrong_usage(chainage, film, tmp_path, box):
    done = chainage("counter", film, f"--box={box}", "--out", tmp_path / "counter.csv")
    assert done.code == 2
    assert "--box" in done.err


def test_a_file_that_is_no_film_is_refused(chainage, tmp_path):
    path = tmp_path / "film.mp4"
    path.write_text("not a film")
    done = chainage("counter", path, "--out", tmp_path / "counter.csv")
    assert done.code == 1
    assert "film.mp4 is not a video that can be opened" in done.err
