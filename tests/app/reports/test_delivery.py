"""The delivery, read with `zipfile`, `hashlib`, `lxml` and `cryptography`."""

import base64
import hashlib
import io
import json
import re
import subprocess
import tracemalloc
import zipfile
from dataclasses import replace
from datetime import UTC, datetime

import pytest
from cryptography.hazmat.primitives.asymmetric.ed25519 import Ed25519PublicKey
from keys import Key
from lxml import etree, html
from pypdf import PdfReader
from reports import codes, film_source, report, said

from app.errors import ExportNotAvailable
from app.reports.bundle.delivery import Delivery, losses
from app.reports.bundle.signing import fingerprint
from app.reports.bundle.verify import verify
from app.reports.content.translator import Translator
from app.reports.formats import EXCHANGE, FORMATS
from app.reports.report import Extras, VoiceNote
from app.reports.template import ReportTemplate
from app.storage.blobs.blobs import StoredBlob
from app.storage.blobs.folder import FolderBlobs

KEY = Key()
FILM = b"a film " * 1000


@pytest.fixture(scope="module")
def surveyed(tmp_path_factory):
    """A report with photos and its film."""
    folder = tmp_path_factory.mktemp("delivered")
    (folder / "film.mp4").write_bytes(FILM)
    made = report(folder, template=ReportTemplate(sections=["observations", "photos"]))
    source = replace(made.source, size=len(FILM), sha256=hashlib.sha256(FILM).hexdigest())
    film = StoredBlob(FolderBlobs(folder), "film.mp4")
    return replace(made, signer=KEY, source=source, film=film)


def delivered(made, **extras):
    written = FORMATS["delivery"].write(replace(made, extras=Extras(**extras)))
    return zipfile.ZipFile(io.BytesIO(b"".join(written.blocks())))


def cited(name, content):
    """The names of photos and film in an exchange file."""
    if name.endswith(".txt"):
        return set(re.findall(r"[^;|\s\"]+\.(?:jpg|mp4)", content.decode("ascii")))
    texts = etree.fromstring(content).itertext()
    return {part for text in texts for part in re.findall(r"[^|\s]+\.(?:jpg|mp4)", text)}


def test_every_cited_file_is_beside_the_exchange_file_under_its_name(surveyed):
    short = replace(surveyed, template=ReportTemplate(sections=[]))
    for kind in EXCHANGE:
        archive = delivered(short, exchange=kind, film=True)
        assert archive.testzip() is None
        name = f"CUL-0041{FORMATS[kind].suffix}"
        names = cited(name, archive.read(name))
        assert len(names) == 13
        assert names <= set(archive.namelist())
        film = "CUL-0041_20260914_0942.mp4"
        assert archive.read(film) == FILM
        assert archive.getinfo(film).compress_type == zipfile.ZIP_STORED
        by_photo = {photo.name: photo.jpeg for entry in surveyed.entries for photo in entry.photos}
        for cited_name in names - {film}:
            assert archive.read(cited_name) == by_photo[cited_name].read_bytes()


def test_checksums_and_signature_are_right_for_other_programs_and_our_own(surveyed, tmp_path):
    archive = delivered(surveyed)
    archive.extractall(tmp_path)
    checked = subprocess.run(
        ["sha256sum", "-c", "--strict", "SHA256SUMS"], cwd=tmp_path, capture_output=True, text=True
    )
    assert checked.returncode == 0, checked.stdout
    sums = archive.read("SHA256SUMS").decode().splitlines()
    listed = {line[66:]: line[:64] for line in sums}
    assert set(listed) == set(archive.namelist()) - {
        "SHA256SUMS", "manifest.json", "manifest.json.sig",
    }  # fmt: skip
    manifest = json.loads(archive.read("manifest.json"))
    for name, sha256 in listed.items():
        assert hashlib.sha256(archive.read(name)).hexdigest() == sha256
        assert manifest["files"][name]["sha256"] == sha256
    signature = base64.b64decode(archive.read("manifest.json.sig"))
    key = Ed25519PublicKey.from_public_bytes(base64.b64decode(manifest["public_key"]))
    key.verify(signature, archive.read("manifest.json"))
    path = tmp_path / "delivery.zip"
    path.write_bytes(archive.fp.getvalue())
    film = tmp_path / "film"
    film.write_bytes(FILM)
    verdict = verify(path, key=fingerprint(KEY.public_key), video=film)
    assert [one for one in verdict.findings if not one.is_right] == []


def test_the_guide_leads_to_every_file_and_says_where_the_film_is(surveyed):
    archive = delivered(surveyed)
    assert "CUL-0041_20260914_0942.mp4" not in archive.namelist()
    page = html.fromstring(archive.read("index.html"))
    links = set(page.xpath("//a/@href"))
    away = "CUL-0041_20260914_0942.mp4"
    assert links - {away} <= set(archive.namelist())
    assert {"CUL-0041.txt", "CUL-0041-report.pdf", "CUL-0041-report.html", away} == links
    assert {"en", "ms"} <= set(page.xpath("//section/@lang"))
    text = archive.read("README.txt").decode()
    for found in (page.text_content(), text):
        assert f"under the name {away}" in found
        assert surveyed.source.sha256 in found
    assert "Serahan pemeriksaan pembetung" in text


def test_the_guide_says_what_the_files_could_not_hold(surveyed):
    archive = delivered(surveyed)
    page = html.fromstring(archive.read("index.html"))
    text = archive.read("README.txt").decode()
    for language in ("en", "ms", "de"):
        t = Translator(language, "m")
        said = [t.loss(loss) for loss in losses(replace(surveyed, extras=Extras()), FORMATS)]
        assert said
        section = page.xpath(f"//section[@lang='{language}']")[0]
        assert [one.text for one in section.xpath(".//details//li")] == said
        assert all(one in text for one in said)


def test_times_of_the_page_lead_into_a_film_that_is_beside_it(surveyed):
    archive = delivered(surveyed, film=True)
    page = html.fromstring(archive.read("CUL-0041-report.html"))
    links = {link for link in page.xpath("//a/@href") if "#t=" in link}
    assert "./CUL-0041_20260914_0942.mp4#t=41.333" in links
    assert {link[2:].partition("#")[0] for link in links} <= set(archive.namelist())
    assert addresses(archive) <= links
    assert addresses(archive)
    alone = delivered(surveyed)
    without = html.fromstring(alone.read("CUL-0041-report.html"))
    assert not [link for link in without.xpath("//a/@href") if "#t=" in link]
    assert not addresses(alone)


def test_a_film_that_is_lost_is_named_and_costs_nothing_else(surveyed, tmp_path):
    lost = StoredBlob(FolderBlobs(tmp_path), "gone.mp4")
    written = FORMATS["delivery"].write(replace(surveyed, film=lost, extras=Extras(film=True)))
    assert "film_elsewhere" in codes(written.losses)
    archive = zipfile.ZipFile(io.BytesIO(b"".join(written.blocks())))
    assert "CUL-0041-report.pdf" in archive.namelist()
    assert not addresses(archive)


def test_what_has_changed_since_it_was_stored_is_left_out_and_named(surveyed, tmp_path):
    first, *others = surveyed.entries
    (tmp_path / "other.jpg").write_bytes(others[0].photo.jpeg.read_bytes())
    (tmp_path / "film.mp4").write_bytes(FILM.swapcase())
    (tmp_path / "said.webm").write_bytes(b"other words")
    changed = replace(
        first,
        photo=replace(first.photo, jpeg=tmp_path / "other.jpg", of=first.id),
        voice_notes=(VoiceNote("said.webm", tmp_path / "said.webm", "0" * 64, "note"),),
    )
    made = replace(
        surveyed,
        film=StoredBlob(FolderBlobs(tmp_path), "film.mp4"),
        entries=(changed, *others),
        extras=Extras(film=True, photos=True),
    )
    file_losses = {"file_changed 1"}
    for kind, named in {
        "delivery": {"photo_changed 1", "voice_changed 1", "film_changed"},
        "archive": file_losses | {"file_changed"},
        "json": file_losses,
    }.items():
        written = FORMATS[kind].write(made)
        assert named <= codes(written.losses)
        content = b"".join(written.blocks())
        if kind == "json":
            assert base64.b64encode(b"other words") not in content
        else:
            names = zipfile.ZipFile(io.BytesIO(content)).namelist()
            assert not [name for name in names if name.endswith(("001.jpg", ".webm", ".mp4"))]


def test_losses_are_known_without_a_file_and_are_those_of_the_file(surveyed, tmp_path):
    lost = StoredBlob(FolderBlobs(tmp_path), "gone.mp4")
    first, *others = surveyed.entries
    gone = replace(first, photo=replace(first.photo, jpeg=tmp_path / "gone.jpg"))
    elsewhere = replace(others[0], photo=replace(others[0].photo, jpeg=None))
    made = replace(
        surveyed,
        film=lost,
        entries=(gone, elsewhere, *others[1:]),
        extras=Extras(exchange="ribx", film=True),
    )
    form = FORMATS["delivery"]
    written = form.write(made)
    written.file.close()
    assert said(form.losses(made)) == said(written.losses)
    assert {"photo_gone 1", "photo_elsewhere 2"} <= codes(form.losses(made))


def test_the_film_of_an_import_is_not_taken_for_the_file_that_was_imported(surveyed):
    source = replace(surveyed.source, kind="import", filename="old.xml")
    header = {**surveyed.header, "video_files": "survey.mp4"}
    archive = delivered(replace(surveyed, source=source, film=None, header=header))
    text = archive.read("README.txt").decode()
    assert "The film survey.mp4 is not on the server that made this delivery." in text
    assert "old.xml" not in text


def addresses(archive):
    """What the PDF links to outside itself."""
    reader = PdfReader(io.BytesIO(archive.read("CUL-0041-report.pdf")))
    links = [link.get_object() for page in reader.pages for link in page.get("/Annots", [])]
    return {link["/A"]["/URI"] for link in links if "/A" in link}


def test_an_inspection_that_its_format_refuses_leaves_nothing(surveyed):
    out = io.BytesIO()
    forms = dict(FORMATS)

    def refuse(_file, _report):
        raise ExportNotAvailable("It lacks something.")

    class Refusing:
        add = refuse

    forms["m150"] = replace(forms["m150"], survey_file=Refusing)
    with zipfile.ZipFile(out, "w") as archive:
        delivery = Delivery(archive, datetime.now(UTC), KEY, forms)
        with pytest.raises(ExportNotAvailable):
            delivery.add(replace(surveyed, extras=Extras(exchange="m150")), "001-a/")
        delivery.close()
    assert set(archive.namelist()) == {
        "index.html", "README.txt", "SHA256SUMS", "manifest.json", "manifest.json.sig",
    }  # fmt: skip


def test_a_film_is_not_held_in_memory(surveyed, tmp_path):
    large = tmp_path / "large.mp4"
    with large.open("wb") as file:
        file.truncate(100 * 2**20)
    source = film_source(surveyed.source, large)
    film = StoredBlob(FolderBlobs(tmp_path), "large.mp4")
    tracemalloc.start()
    try:
        written = FORMATS["delivery"].write(
            replace(surveyed, source=source, film=film, scratch=tmp_path, extras=Extras(film=True))
        )
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert written.size > 100 * 2**20
    written.file.close()
    assert peak < 50 * 2**20
