"""The evidence bundle, opened with `zipfile` and `cryptography`; what is changed in it is found."""

import base64
import hashlib
import io
import json
import zipfile
from dataclasses import replace

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from hypothesis import given, settings
from hypothesis import strategies as st
from keys import Key
from random_reports import reports
from reports import codes, report

from app.errors import ExportNotAvailable, MediaFailed, UnusableBundle
from app.reports.bundle import bundle
from app.reports.bundle.signing import fingerprint, read_fingerprint
from app.reports.bundle.verify import verify
from app.reports.formats import FORMATS
from app.reports.report import Extras
from app.reports.template import ReportTemplate
from vo_core import Track

KEY = Key()
SHORT = ReportTemplate(sections=["observations"])
"""Of the PDF and the page, which have tests of their own."""


def bundle_of(made):
    return b"".join(FORMATS["zip"].write(made).blocks())


@pytest.fixture(scope="module")
def evidence(tmp_path_factory):
    """A report with photos."""
    made = report(tmp_path_factory.mktemp("photos"), template=SHORT)
    return replace(made, signer=KEY)


@pytest.fixture(scope="module")
def content(evidence):
    return bundle_of(evidence)


@pytest.fixture
def file(content, tmp_path):
    path = tmp_path / "bundle.zip"
    path.write_bytes(content)
    return path


def rewritten(path, change):
    """The bundle with other members: `change` takes and gives pairs of name and content."""
    with zipfile.ZipFile(path) as old:
        members = [(info.filename, old.read(info)) for info in old.infolist()]
    with zipfile.ZipFile(path, "w") as new:
        for name, content in change(members):
            new.writestr(name, content)


def wrong(path, **options):
    """What is wrong, by what it is."""
    found = verify(path, **options).findings
    return {finding.what: finding.detail for finding in found if finding.is_right is False}


def test_it_holds_tables_photos_tracks_and_a_manifest_of_them(evidence, content):
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        assert archive.testzip() is None
        names = archive.namelist()
        manifest = json.loads(archive.read("manifest.json"))
        files = {name: archive.read(name) for name in manifest["files"]}
        signature = base64.b64decode(archive.read("manifest.json.sig"))
        signed = archive.read("manifest.json")
    assert {"defects.csv", "defects.json", "defects.xlsx", "track.csv", "track-raw.csv"} <= set(
        names
    )
    assert {f"photos/CUL-0041-{n:03d}.jpg" for n in range(1, 13)} <= set(names)
    assert names == [*manifest["files"], "manifest.json", "manifest.json.sig"]
    for name, listed in manifest["files"].items():
        assert listed == {
            "size": len(files[name]), "sha256": hashlib.sha256(files[name]).hexdigest(),
        }, name  # fmt: skip
    assert manifest["video"]["sha256"] == evidence.source.sha256
    assert (manifest["report_id"], manifest["revision"]) == (evidence.id, evidence.revision)
    assert manifest["made_at"] == "2026-09-14T09:42:00+00:00"
    public_key = base64.b64decode(manifest["public_key"])
    Ed25519PublicKey.from_public_bytes(public_key).verify(signature, signed)
    assert manifest["fingerprint"] == "SHA256:" + hashlib.sha256(public_key).hexdigest()
    rows = files["defects.csv"].decode("utf-8-sig").splitlines()
    assert all(f"CUL-0041-{n:03d}.jpg" in rows[n] for n in range(1, 13))
    for name, track in (("track.csv", evidence.track), ("track-raw.csv", evidence.raw_track)):
        read = Track.from_csv(files[name].decode())
        assert read.distance_mm == pytest.approx(track.distance_mm, abs=1e-3)


def test_exchange_files_are_in_it_and_one_that_cannot_be_made_is_named(evidence, content):
    header = {**evidence.header, "start_lat": None}
    for made, not_made in ((evidence, set()), (replace(evidence, header=header), {"geojson"})):
        archive = zipfile.ZipFile(io.BytesIO(content if made is evidence else bundle_of(made)))
        manifest = json.loads(archive.read("manifest.json"))
        assert set(manifest["not_made"]) == not_made
        found = {name for name in manifest["files"] if name.startswith("exchange/")}
        expected = {
            "en13508.txt",
            "en13508.xml",
            "ribx.ribx",
            "isybau.xml",
            "m150.xml",
            "map.geojson",
        }
        expected -= {"map.geojson"} if not_made else set()
        assert found == {f"exchange/{name}" for name in expected}
    text = archive.read("exchange/en13508.txt").decode("ascii")
    assert all(f"CUL-0041-{n:03d}.jpg" in text for n in (1, 2, 3))


def test_the_same_report_gives_the_same_bytes_in_which_all_is_right(evidence, file, content):
    assert bundle_of(evidence) == content
    verdict = verify(file, key=fingerprint(KEY.public_key))
    assert verdict.is_right
    rights = {finding.what for finding in verdict.findings if finding.is_right}
    assert {"signature", "key", "defects.csv", "photos/CUL-0041-001.jpg"} <= rights


@pytest.mark.parametrize(
    ("changed", "old", "new", "found"),
    [
        ("defects.csv", b"BAB", b"BAC", {"defects.csv"}),
        (None, b'"revision": 0', b'"revision": 1', {"signature", "defects.json"}),
    ],
)
def test_a_changed_file_or_list_is_found(file, changed, old, new, found):
    rewritten(file, lambda members: [
        (name, content.replace(old, new) if changed in (None, name) else content)
        for name, content in members
    ])  # fmt: skip
    assert set(wrong(file)) == found


def test_a_bundle_signed_anew_with_another_key_is_not_of_the_key_that_was_named(evidence, tmp_path):
    path = tmp_path / "other.zip"
    path.write_bytes(bundle_of(replace(evidence, signer=Key(8))))
    assert wrong(path) == {}
    assert set(wrong(path, key=fingerprint(KEY.public_key))) == {"key"}
    (open_,) = [f for f in verify(path).findings if f.what == "key"]
    assert open_.is_right is None


@pytest.mark.parametrize("name", ["../evil.txt", "/evil.txt", "a\\b.txt", "photos/../../x", ".ssh"])
def test_names_that_lead_out_are_reported(file, name):
    rewritten(file, lambda members: [*members, (name, b"x")])
    assert list(wrong(file)) == [name]
    assert "lead out" in wrong(file)[name]


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_extra_twofold_and_missing_files_are_reported(file):
    rewritten(file, lambda members: [
        *(m for m in members if m[0] != "track.csv"), ("extra.txt", b"x"), ("defects.csv", b"y"),
    ])  # fmt: skip
    found = wrong(file)
    assert found["track.csv"] == "is missing in the archive"
    assert found["extra.txt"] == "is in the archive, but not in manifest.json"
    assert "defects.csv" in found


def test_the_film_is_compared(evidence, tmp_path):
    film, other = tmp_path / "film.mp4", tmp_path / "other.mp4"
    film.write_bytes(b"film")
    other.write_bytes(b"other")
    sha256 = hashlib.sha256(b"film").hexdigest()
    path = tmp_path / "bundle.zip"
    path.write_bytes(
        bundle_of(replace(evidence, source=replace(evidence.source, sha256=sha256, size=4)))
    )
    assert wrong(path, video=film) == {}
    assert list(wrong(path, video=other).values()) == [
        "other.mp4 is another film: its SHA-256 differs"
    ]


def test_a_photo_that_is_gone_or_changed_is_reported(tmp_path):
    made = replace(report(tmp_path, template=SHORT), signer=KEY)
    made.entries[0].photo.jpeg.unlink()
    made.entries[1].photo.jpeg.write_bytes(b"another")
    written = FORMATS["zip"].write(made)
    assert {"photo_gone 1", "photo_changed 2"} <= codes(written.losses)
    path = tmp_path / "bundle.zip"
    path.write_bytes(b"".join(written.blocks()))
    verdict = verify(path)
    assert verdict.is_right
    assert verdict.manifest.missing == ["photos/CUL-0041-001.jpg", "photos/CUL-0041-002.jpg"]
    with zipfile.ZipFile(path) as archive:
        assert "photos/CUL-0041-002.jpg" not in archive.namelist()


def test_a_clip_that_cannot_be_cut_is_reported_and_the_others_are_there():
    made = report()

    def cut(entry_id):
        if entry_id == made.entries[0].id:
            raise MediaFailed("The film is damaged there.")
        return b"a clip"

    written = bundle.write(replace(made, signer=KEY, extras=Extras(clip_of=cut)), {}, {})
    assert codes(written.losses) == {"no_clip 1", "failure.media_failed"}
    with zipfile.ZipFile(io.BytesIO(b"".join(written.blocks()))) as archive:
        clips = [name for name in archive.namelist() if name.startswith("clips/")]
    assert clips == [f"clips/CUL-0041-{e.seq:03d}.mp4" for e in made.entries[1:]]


def test_without_a_key_there_is_no_bundle():
    with pytest.raises(ExportNotAvailable):
        FORMATS["zip"].write(report())


@pytest.mark.parametrize("content", [b"", b"PK\x05\x06" + bytes(18), b"no zip", bytes(100)])
def test_other_files_are_no_bundle(tmp_path, content):
    path = tmp_path / "x.zip"
    path.write_bytes(content)
    with pytest.raises(UnusableBundle):
        verify(path)


@pytest.mark.parametrize(
    ("method", "name"),
    [(zipfile.ZIP_LZMA, "manifest.json"), (zipfile.ZIP_BZIP2, "report.pdf")],
)
def test_a_member_of_another_method_is_in_no_bundle(file, method, name):
    with zipfile.ZipFile(file) as old:
        members = {info.filename: old.read(info) for info in old.infolist()}
    assert name in members
    with zipfile.ZipFile(file, "w") as new:
        for member, content in members.items():
            new.writestr(member, content, method if member == name else zipfile.ZIP_DEFLATED)
        at = new.getinfo(name).header_offset + 30 + len(name) + 20
    damaged = bytearray(file.read_bytes())
    damaged[at : at + 40] = bytes(40)
    file.write_bytes(damaged)
    with pytest.raises(UnusableBundle, match=f"{name} is compressed with a method"):
        verify(file)


@given(data=st.data())
def test_a_damaged_bundle_is_wrong_or_none(content, tmp_path_factory, data):
    damaged = bytearray(content)
    at = data.draw(st.integers(0, len(damaged) - 1))
    damaged[at] ^= data.draw(st.integers(1, 255))
    path = tmp_path_factory.getbasetemp() / "damaged.zip"
    path.write_bytes(damaged)
    try:
        verdict = verify(path)
    except UnusableBundle:
        return
    if verdict.is_right:  # a byte that says nothing, such as of a time: all files are as they were
        with zipfile.ZipFile(path) as read, zipfile.ZipFile(io.BytesIO(content)) as whole:
            for name in verdict.manifest.files:
                assert read.read(name) == whole.read(name)


@settings(max_examples=max(1, settings().max_examples // 5))
@given(made=reports())
def test_any_report_makes_a_bundle_that_is_right(made, tmp_path_factory):
    path = tmp_path_factory.getbasetemp() / "any.zip"
    path.write_bytes(bundle_of(replace(made, signer=KEY)))
    assert verify(path).is_right


def test_fingerprints_are_read_as_people_write_them():
    own = fingerprint(KEY.public_key)
    assert read_fingerprint(own) == own
    assert read_fingerprint(own.upper().removeprefix("SHA256:")) == own
    assert read_fingerprint(f" {own[:20]} {own[20:]}\n") == own
    assert read_fingerprint(own[:-1]) is None
    assert read_fingerprint("signing-key.pem") is None
