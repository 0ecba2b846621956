"""`chainage export`: the same report as the server's, from a data folder that it leaves alone."""

import csv
import io
import json
import stat
import zipfile

import pypdf
import pytest
from builders import wait_until
from surveys import another

from app import main
from app.reports.bundle.signing import fingerprint
from app.storage.folder.signing_key import SigningKey


@pytest.fixture(scope="module")
def tagged(shared, survey):
    """An inspection with a tag that has its photo, and one that no exchange format holds whole."""
    header = {"asset_id": "CUL-7", "project": "Ring"}
    inspection_id = another(survey, shared, name="Jalan Besar", header=header)
    shared.tag(inspection_id, frame=20, code="BAB", char1="B", char2="A", severity=4)
    shared.tag(inspection_id, frame=5, remark="=look here")
    path = f"/api/inspections/{inspection_id}/observations"
    wait_until(lambda: all(o["photo"] for o in shared.get(path).json()["observations"]))
    return inspection_id


def files_of(folder, inspection_id):
    """Name, size and time of change of every file but SQLite's shared index.

    Folders of other inspections are left out: other tests of this file are still tracking there.
    """
    own = folder / "inspections" / inspection_id
    paths = [path for path in folder.rglob("*") if path.is_file()]
    return {
        path.relative_to(folder): (path.stat().st_size, path.stat().st_mtime_ns)
        for path in paths
        if not path.name.endswith(("-shm", "-wal"))
        and (path.is_relative_to(own) or not path.is_relative_to(own.parent))
    }


def export(chainage, shared, out, wanted, kind="csv", *words):
    return chainage("export", wanted, "--format", kind, "--out", out, "--data", shared.data, *words)


def test_it_is_what_the_server_exports(chainage, shared, tagged, tmp_path):
    before = files_of(shared.data, tagged)
    for kind in ("csv", "json"):
        out = tmp_path / f"report.{kind}"
        made = export(chainage, shared, out, tagged, kind, "--csv", "german")
        assert (made.code, "Jalan Besar" in made.out) == (0, True), made.err
        served = shared.get(f"/api/inspections/{tagged}/exports/{kind}?csv=german").content
        if kind == "csv":
            assert served.startswith(b"\xef\xbb\xbfreport_id;asset_id;")
            assert out.read_bytes() == served
        else:
            ours, theirs = json.loads(out.read_bytes()), json.loads(served)
            assert ours.pop("exported_at")
            assert theirs.pop("exported_at")
            assert ours == theirs
    assert files_of(shared.data, tagged) == before
    assert list(tmp_path.glob(".*")) == []


def test_an_inspection_is_named_by_id_its_beginning_or_its_name(chainage, shared, tagged, tmp_path):
    for number, wanted in enumerate((tagged, tagged[:10].upper(), "Jalan Besar")):
        out = tmp_path / f"{number}.csv"
        made = export(chainage, shared, out, wanted)
        assert made.code == 0, made.err
        rows = list(csv.DictReader(io.StringIO(out.read_text("utf-8-sig"))))
        assert [row["frame"] for row in rows] == ["5", "20"]


def test_what_a_format_cannot_hold_is_reported_in_the_language(chainage, shared, tagged, tmp_path):
    made = export(chainage, shared, tmp_path / "out.txt", tagged, "en13508", "--lang", "ms")
    assert made.code == 0
    path = f"/api/inspections/{tagged}/exports/en13508/losses"
    reported = shared.get(path, params={"lang": "ms"}).json()["losses"]
    assert any("Pemerhatian 1 tiada kod" in loss["detail"] for loss in reported)
    assert made.err.count("not in this format:") == len(reported) > 0
    assert all(" ".join(loss["detail"].split()) in " ".join(made.err.split()) for loss in reported)


def test_what_is_asked_wrongly_is_refused_in_a_sentence(chainage, shared, survey, tagged, tmp_path):
    twins = [another(survey, shared, name="Twin") for _ in range(2)]
    for wanted, kind, sentence in (
        ("Twin", "csv", min(twins)[:8]),
        ("Twin", "csv", max(twins)[:8]),
        ("nothing", "csv", "no inspection has the id or the name 'nothing'"),
        ("", "csv", "no inspection has the id or the name ''"),
        (tagged, "docx", "there is no 'docx'; there are pdf, html"),
        (tagged, "geojson", "coordinates"),
    ):
        made = export(chainage, shared, tmp_path / "out", wanted, kind)
        assert made.code == 2
        assert sentence in " ".join(made.err.replace("│", " ").split())
        assert list(tmp_path.iterdir()) == []
    none = ["--out", tmp_path / "o.csv", "--data", tmp_path / "none"]
    made = chainage("export", "x", "--format", "csv", *none)
    assert made.code == 2
    assert "There is no database in the folder" in " ".join(made.err.replace("│", " ").split())
    assert not (tmp_path / "none").exists()


def test_a_run_that_goes_on_is_reported_to_have_no_distances_yet(
    chainage, shared, survey, tmp_path
):
    running = another(survey, shared, name="Still running", status="running")
    made = export(chainage, shared, tmp_path / "out.csv", running)
    assert made.code == 0
    assert "its track is written to the disk when it ends" in " ".join(made.err.split())


def test_an_older_file_stays_when_it_fails(chainage, shared, tagged, tmp_path):
    out = tmp_path / "out.geojson"
    out.write_text("old")
    assert export(chainage, shared, out, tagged, "geojson").code == 2
    assert out.read_text() == "old"


@pytest.fixture(scope="module")
def evidence(shared, tagged, tmp_path_factory):
    """The bundle that the server gives."""
    path = tmp_path_factory.mktemp("evidence") / "bundle.zip"
    answer = shared.get(f"/api/inspections/{tagged}/exports/zip")
    assert answer.headers["Content-Type"] == "application/zip"
    assert int(answer.headers["Content-Length"]) == len(answer.content)
    path.write_bytes(answer.content)
    return path


def test_a_bundle_of_the_server_is_verified_with_its_key_and_film(chainage, shared, evidence, clip):
    for key in (shared.data / "signing-key.pem", fingerprint_of(evidence)):
        checked = chainage("verify", evidence, "--key", key, "--video", clip)
        assert checked.code == 0, checked.err
        assert "WRONG" not in checked.out
        assert "open" not in checked.out
        assert "photos/CUL-7-001.jpg" in checked.out


def fingerprint_of(bundle):
    with zipfile.ZipFile(bundle) as archive:
        return json.loads(archive.read("manifest.json"))["fingerprint"]


def test_a_project_is_one_pdf_or_an_archive(chainage, shared, tagged, tmp_path):
    out = tmp_path / "ring.pdf"
    words = ["export", "--project", "Ring", "--data", shared.data, "--out", out]
    made = chainage(*words, "--format", "pdf")
    assert (made.code, f"{out}: 1 inspections" in made.out) == (0, True), made.err
    titles = [one["/Title"] for one in pypdf.PdfReader(out).outline if isinstance(one, dict)]
    assert titles[-1] == "1 · CUL-7"
    assert chainage(*words, "--format", "pdf", "--project", "none").code == 2
    made = chainage(*words, "--format", "csv", "--csv", "german", "--lang", "de", tagged)
    assert made.code == 0, made.err
    with zipfile.ZipFile(out) as archive:
        (table,) = [name for name in archive.namelist() if name.startswith("001-CUL-7/")]
        served = shared.get(f"/api/inspections/{tagged}/exports/csv?csv=german").content
        assert archive.read(table) == served


def test_a_delivery_is_verified(chainage, shared, tagged, clip, tmp_path):
    out = tmp_path / "delivery.zip"
    made = export(chainage, shared, out, tagged, "delivery", "--exchange", "ribx", "--film")
    assert made.code == 0, made.err
    assert chainage("verify", out, "--video", clip).code == 0
    with zipfile.ZipFile(out) as archive:
        assert {"CUL-7.ribx", "CUL-7-001.jpg", clip.name} <= set(archive.namelist())


def test_what_is_wrong_in_a_bundle_is_reported_with_exit_code_1(chainage, evidence):
    checked = chainage("verify", evidence, "--video", evidence, "--key", "0" * 64)
    assert checked.code == 1
    assert checked.out.count("WRONG") == 2
    assert "is another film" in checked.out


def test_what_cannot_be_checked_is_reported_with_exit_code_2(chainage, evidence, tmp_path):
    (tmp_path / "x.zip").write_bytes(b"no zip")
    for words in (
        [tmp_path / "x.zip"],
        [tmp_path / "none.zip"],
        [evidence, "--key", "abc"],
        [evidence, "--key", tmp_path / "x.zip"],
        [evidence, "--video", tmp_path / "none.mp4"],
    ):
        checked = chainage("verify", *words)
        assert (checked.code, "Error" in checked.err) == (2, True)


def test_the_command_line_signs_with_the_same_key(chainage, shared, tagged, evidence, tmp_path):
    made = export(chainage, shared, tmp_path / "own.zip", tagged, "zip")
    assert made.code == 0, made.err
    assert fingerprint_of(tmp_path / "own.zip") == fingerprint_of(evidence)
    assert chainage("verify", tmp_path / "own.zip").code == 0


def test_the_key_is_backed_up_and_restored(chainage, shared, evidence, tmp_path):
    assert chainage("backup", tmp_path / "b.zip", "--data", shared.data).code == 0
    assert chainage("restore", tmp_path / "b.zip", "--data", tmp_path / "new").code == 0
    key = tmp_path / "new" / "signing-key.pem"
    assert key.read_bytes() == (shared.data / "signing-key.pem").read_bytes()
    assert stat.S_IMODE(key.stat().st_mode) == 0o600


def test_a_server_prints_the_fingerprint_of_its_key(chainage, tmp_path, monkeypatch):
    def listens(settings, host, port, announce):
        announce("http://127.0.0.1", None)

    monkeypatch.setattr(main, "serve", listens)
    printed = chainage("serve", "--data", tmp_path).out.split()
    assert fingerprint(SigningKey(tmp_path).public_key) in printed
