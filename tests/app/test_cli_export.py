"""`chainage export`: the same report as the server's, from a data folder that it leaves alone."""

import csv
import io
import json

import pytest
from builders import wait_until


@pytest.fixture(scope="module")
def tagged(shared, clip):
    """An inspection with a tag that has its photo, and one that no exchange format holds whole."""
    inspection_id = shared.inspect(clip, name="Jalan Besar", header={"asset_id": "CUL-7"})
    shared.wait(inspection_id)
    shared.tag(inspection_id, frame=20, code="BAB", char1="B", char2="A", severity=4)
    shared.tag(inspection_id, frame=5, remark="=look here")
    path = f"/api/inspections/{inspection_id}/observations"
    wait_until(lambda: all(o["photo"] for o in shared.get(path).json()["observations"]))
    return inspection_id


def files_of(folder):
    """Name, size and time of change of every file but SQLite's shared index."""
    return {
        path.relative_to(folder): (path.stat().st_size, path.stat().st_mtime_ns)
        for path in folder.rglob("*")
        if path.is_file() and not path.name.endswith(("-shm", "-wal"))
    }


def export(chainage, shared, out, wanted, kind="csv", *words):
    return chainage("export", wanted, "--format", kind, "--out", out, "--data", shared.data, *words)


def test_it_is_what_the_server_exports(chainage, shared, tagged, tmp_path):
    before = files_of(shared.data)
    for kind in ("csv", "json"):
        out = tmp_path / f"report.{kind}"
        made = export(chainage, shared, out, tagged, kind)
        assert (made.code, "Jalan Besar" in made.out) == (0, True), made.err
        served = shared.get(f"/api/inspections/{tagged}/exports/{kind}").content
        if kind == "csv":
            assert out.read_bytes() == served
        else:
            ours, theirs = json.loads(out.read_bytes()), json.loads(served)
            assert ours.pop("exported_at")
            assert theirs.pop("exported_at")
            assert ours == theirs
    assert files_of(shared.data) == before
    assert list(tmp_path.glob(".*")) == []


@pytest.mark.parametrize("wanted", ["id", "prefix", "name"])
def test_an_inspection_is_named_by_id_its_beginning_or_its_name(
    chainage, shared, tagged, tmp_path, wanted
):
    words = {"id": tagged, "prefix": tagged[:10].upper(), "name": "Jalan Besar"}
    made = export(chainage, shared, tmp_path / "out.csv", words[wanted])
    assert made.code == 0, made.err
    content = (tmp_path / "out.csv").read_text("utf-8-sig")
    rows = list(csv.DictReader(io.StringIO(content)))
    assert [row["frame"] for row in rows] == ["5", "20"]


def test_what_a_format_cannot_hold_is_told(chainage, shared, tagged, tmp_path):
    made = export(chainage, shared, tmp_path / "out.txt", tagged, "en13508")
    assert made.code == 0
    told = shared.get(f"/api/inspections/{tagged}/exports/en13508/losses").json()["losses"]
    assert made.err.count("not in this format:") == len(told) > 0
    assert all(" ".join(loss["detail"].split()) in " ".join(made.err.split()) for loss in told)


@pytest.mark.parametrize(
    ("wanted", "kind", "sentence"),
    [
        ("nothing", "csv", "no inspection has the id or the name 'nothing'"),
        ("", "csv", "no inspection has the id or the name ''"),
        ("Jalan Besar", "docx", "there is no 'docx'; there are csv, json"),
        ("Jalan Besar", "geojson", "coordinates"),
    ],
)
def test_what_is_asked_wrongly_is_told_in_a_sentence(
    chainage, shared, tagged, tmp_path, wanted, kind, sentence
):
    made = export(chainage, shared, tmp_path / "out", wanted, kind)
    assert made.code == 2
    assert sentence in " ".join(made.err.replace("│", " ").split())
    assert list(tmp_path.iterdir()) == []


def test_two_of_one_name_are_told_apart_by_id(chainage, shared, tagged, clip, tmp_path):
    twins = [shared.inspect(clip, name="Twin") for _ in range(2)]
    made = export(chainage, shared, tmp_path / "out.csv", "Twin")
    assert made.code == 2
    told = "".join(made.err.replace("│", " ").split())
    assert all(twin in told for twin in twins)


def test_a_folder_without_a_database_is_told(chainage, tmp_path):
    made = chainage(
        "export", "x", "--format", "csv", "--out", tmp_path / "o.csv", "--data", tmp_path / "none"
    )
    assert made.code == 2
    assert "There is no database in the folder" in " ".join(made.err.replace("│", " ").split())
    assert not (tmp_path / "none").exists()


def test_a_run_that_goes_on_is_told_to_have_no_distances_yet(chainage, shared, long_clip, tmp_path):
    running = shared.inspect(long_clip, name="Still running")
    shared.tag(running, frame=3)
    shared.wait(running, "running", "done")
    made = export(chainage, shared, tmp_path / "out.csv", running)
    assert made.code == 0
    rows = list(csv.DictReader(io.StringIO((tmp_path / "out.csv").read_text("utf-8-sig"))))
    if not rows[0]["distance_m"]:
        assert "its track is not on the disk" in made.err
    shared.post(f"/api/inspections/{running}/cancel")


def test_an_older_file_stays_when_it_fails(chainage, shared, tagged, tmp_path):
    out = tmp_path / "out.geojson"
    out.write_text("old")
    assert export(chainage, shared, out, tagged, "geojson").code == 2
    assert out.read_text() == "old"
