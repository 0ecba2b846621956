"""The PDF as other programs read it: pypdf its structure, PDFium its text and pictures."""

import io
import re
from dataclasses import replace

import numpy as np
import pypdfium2
import pytest
from hypothesis import given, settings
from pypdf import PdfReader
from random_reports import reports
from reports import HEADER, advised, entry, full_report, measured, page_of, remarked, report

from app.reports import pdf as document
from app.reports.content.grades import grade_of
from app.reports.content.marked_photo import MarkedPhoto
from app.reports.content.translator import Translator
from app.reports.pdf.characters import missing_glyphs
from app.reports.pdf.model import about
from app.reports.pdf.typesetter import NotTypeset, workshop
from app.reports.report import Extras
from app.reports.tables.table import rows
from app.reports.template import DEFAULT_TEMPLATE
from app.reports.text import fonts
from app.survey.observations.attachments import Stroke

TEAL_BGR = (0xE0, 0xF2, 0x5F)
"""Colour of what was measured."""

LONG = "Retak memanjang. 钢筋外露。 ظاهر تسرب. தமிழ் சாலை. ถนนสุขุมวิท " * 160


@pytest.fixture(scope="module")
def full(tmp_path_factory):
    return full_report(tmp_path_factory.mktemp("report"))


@pytest.fixture(scope="module")
def english(full):
    return document.write(full).content


def only(*sections, **chosen):
    """The template of a report with these sections."""
    return DEFAULT_TEMPLATE.model_copy(update={"sections": list(sections), **chosen})


def pages_of(content):
    with pypdfium2.PdfDocument(content) as pdf:
        return [" ".join(page.get_textpage().get_text_range().split()) for page in pdf]


def text_of(content):
    return " ".join(pages_of(content))


def pictures_of(content, scale=0.5):
    with pypdfium2.PdfDocument(content) as pdf:
        return [page.render(scale=scale).to_numpy() for page in pdf]


def test_every_entry_is_listed_with_code_and_distance_as_in_the_table(full, english):
    text = text_of(english)

    for row in rows(full):
        assert f"{row['distance_m']:.2f} m ±" in text
        if row["code"]:
            code = " ".join(part for part in (row["code"], row["char1"], row["char2"]) if part)
            assert code in text


def test_the_worst_defect_comes_first(english):
    summary = pages_of(english)[1]

    assert "Worst defect: Broken wall: fallen in, at 12.40 m ± 0.06 m" in summary
    assert summary.index("17.12 ±") < summary.index("3.20 ±")


def test_every_part_has_a_bookmark_on_its_page(english):
    reader = PdfReader(io.BytesIO(english))
    found = {item.title: reader.get_destination_page_number(item) for item in reader.outline}

    assert list(found) == [
        "Summary", "Header sheet", "Pipe graphic", "Observations", "Photos", "Unrolled wall",
        "Condition", "Measurement", "Checks and sign-off",
    ]  # fmt: skip
    pages = pages_of(english)
    assert all(title in pages[number] for title, number in found.items())
    assert list(found.values()) == sorted(found.values())


def test_every_page_states_its_number_of_all_and_the_report(full, english):
    pages = pages_of(english)

    for number, page in enumerate(pages, 1):
        assert f"Page {number} / {len(pages)}" in page
        assert full.id in page


def test_no_page_is_empty_and_nothing_is_drawn_outside_the_margins(full, english):
    word = 600 * "W"
    said = {name: word if isinstance(value, str) else value for name, value in full.header.items()}
    entries = tuple(remarked(one, word) for one in full.entries)
    company = replace(full.company, name=word, address=word)
    template = DEFAULT_TEMPLATE.model_copy(update={"introduction": word, "closing": word})
    long = replace(full, header=said, entries=entries, company=company, template=template)
    for picture in pictures_of(english) + pictures_of(document.write(long).content):
        dark = picture.min(axis=2) < 200
        height, width = dark.shape
        assert dark[int(0.09 * height) : int(0.9 * height)].any()
        margin = int(0.04 * width)
        assert not dark[:, :margin].any()
        assert not dark[:, -margin:].any()


def test_photos_are_embedded_and_one_that_is_missing_broken_or_changed_says_so(full, tmp_path):
    broken = tmp_path / "broken.jpg"
    broken.write_bytes(b"\xff\xd8\xff no picture")
    entries = list(full.entries)
    entries[1] = replace(entries[1], photo=replace(entries[1].photo, jpeg=tmp_path / "gone.jpg"))
    kept = replace(entries[2].photo, jpeg=broken, sha256=None)
    entries[2] = replace(entries[2], photo=kept)
    entries[3] = replace(entries[3], photo=replace(entries[3].photo, jpeg=entries[4].photo.jpeg))
    made = replace(full, entries=tuple(entries), template=only("photos"))
    content = document.write(made).content

    text = text_of(content)
    assert "CUL-0041-002.jpg is missing" in text
    assert "CUL-0041-003.jpg cannot be read" in text
    photos = [len(page.images) for page in PdfReader(io.BytesIO(content)).pages]
    assert "CUL-0041-004.jpg has changed since it was taken" in text
    assert sum(photos) == len(entries) - 3 + 1  # and the logo


def test_what_was_measured_stands_in_the_table_and_is_drawn_on_the_photo(tmp_path):
    made = report(
        tmp_path, [{"distance_m": 1.0, "code": "BAB"}], template=only("observations", "photos")
    )
    content = document.write(replace(made, entries=tuple(map(measured, made.entries)))).content

    assert text_of(content).count("Width 23 ± 2 mm") == 2
    assert "Depth 42 ± 4 mm (14.0 ± 1.0 %)" in text_of(content)
    apart = [
        abs(page[..., :3].astype(int) - TEAL_BGR).max(axis=2) for page in pictures_of(content, 2)
    ]
    assert max((page < 40).sum() for page in apart) > 200


def test_links_lead_from_a_defect_to_its_photo_and_back_and_to_the_film_beside_it(full):
    made = replace(full, template=only("observations", "photos"))
    assert b"/URI" not in document.write(made).content
    content = document.write(replace(made, extras=Extras(film_path="./my film.mp4"))).content
    films, led = set(), set()
    reader = PdfReader(io.BytesIO(content))
    for n, page in enumerate(reader.pages):
        for link in (one.get_object() for one in page.get("/Annots", [])):
            if "/Dest" in link:
                led.add((n, page_of(reader, link["/Dest"])))
            else:
                films.add(link["/A"]["/URI"])
    assert {f"./my%20film.mp4#t={one.time_s:g}" for one in full.entries if one.photo} == films
    rows = {n for n, page in enumerate(pages_of(content)) if "outlet headwall" in page}
    photos = {n for n, page in enumerate(pages_of(content)) if "Photo 12" in page}
    assert led >= {(row, photo) for row in rows for photo in photos}
    assert led >= {(photo, row) for row in rows for photo in photos}


def test_a_drawing_is_not_called_a_photo(full):
    arrow = Stroke(kind="arrow", colour="red", points=[[10, 10], [90, 90]])
    photo = full.entries[0].photo
    drawn = replace(photo, marked=MarkedPhoto(photo.jpeg, [arrow], None))
    entries = (replace(full.entries[0], photo=drawn), *full.entries[1:])
    text = text_of(document.write(replace(full, entries=entries, template=only("photos"))).content)

    assert "Drawing 1" in text
    assert "Photo 2" in text


@settings(max_examples=max(1, settings().max_examples // 5))
@given(reports())
def test_any_report_is_written_and_keeps_the_rules_of_the_standards(made):
    """Typst refuses a document that breaks a rule of PDF/UA-1 or PDF/A-2a."""
    content = document.write(made).content
    t, text = Translator.of(made), text_of(content)
    for one in made.entries:
        assert one.distance_m is None or t.number(one.distance_m) in text
    xmp = PdfReader(io.BytesIO(content)).xmp_metadata
    assert xmp.pdfaid_part == "2"
    assert xmp.pdfaid_conformance == "A"


def test_a_fault_of_a_template_is_an_error_that_names_it(full):
    with workshop(None) as shop, pytest.raises(NotTypeset, match="single"):
        shop.set_document("single", about(full, "Report"), io.BytesIO())  # which has no report


def test_malay_and_feet(full):
    made = replace(full, language="ms", units="ft", template=only("summary", "observations"))
    text = text_of(document.write(made).content)

    assert "Laporan pemeriksaan pembetung" in text
    assert "Dinding pecah: runtuh" in text
    assert "40.7 ft ± 0.2 ft" in text
    assert not re.search(r"\d m ±", text)


def test_names_in_every_script_are_drawn_and_can_be_searched(full, english):
    text = text_of(english)

    for name in ("陈伟明", "தமிழ்", "Ключ", "Ωμέγα", "über 0,3 m"):
        assert name in text
    company = replace(full.company, logo=None)
    empty = document.write(replace(full, header={}, company=company, template=only()))
    cover, blank = (pictures_of(content)[0] for content in (english, empty.content))
    assert np.count_nonzero(cover < 128) > np.count_nonzero(blank < 128)


def test_names_in_every_script_stand_in_drawings_too(full):
    for start, end in (("قرية-1", "陈伟明-北"), ("क्षत्रिय-1", "x̄-2"), ("e\u0301\u0301-1", "陈-2")):
        header = {**full.header, "start_node": start, "end_node": end}
        made = replace(full, header=header, template=only("summary", "header", "graphic"))
        text = text_of(document.write(made).content)

        assert end in text
        assert "1-" in text or "-1" in text


def test_a_remark_of_ten_thousand_characters_is_printed_in_full(full):
    entries = (remarked(full.entries[0], LONG[:9996] + "END."), *full.entries[1:])
    content = document.write(replace(full, entries=entries, template=only("observations"))).content

    assert "END." in text_of(content)


def test_characters_that_no_font_shows_are_reported(full):
    assert missing_glyphs(full) == ()
    entries = (remarked(full.entries[0], "smile \U0001f642, again \U0001f642"), *full.entries[1:])
    for made, named in (
        (replace(full, entries=entries), ("U+1F642",)),
        (advised(full, {1: {"recommendation": "\u0d94\u0db6"}}), ("U+0D94", "U+0DB6")),
    ):
        (loss,) = missing_glyphs(made)
        assert (loss.key, loss.values) == ("no_glyph", {"named": named})


def test_fields_to_sign_and_charts_are_on_the_page_of_their_heading(full, is_long):
    """Wherever on a page they come; they are higher than five rows."""
    t = Translator("en", "m")
    together = {
        "checks": (t("sign.signatures"), t("sign.signature")),
        "measurement": (t("measurement.along"), t("measurement.along_help")[:40]),
    }
    for section, (heading, below) in together.items():
        for count in range(1, 40, 1 if is_long else 5):
            notes = tuple(entry(n, distance_m=0.3 * n) for n in range(1, count + 1))
            made = replace(full, entries=notes, issues=(), template=only("observations", section))
            (page,) = (p for p in pages_of(document.write(made).content) if f"{heading} " in p)
            assert below in page.split(f"{heading} ")[1], (section, count)


def test_the_project_is_named_in_the_language_of_the_report(full):
    header = {**full.header, "project": "Klang"}
    made = replace(full, header=header, language="de", template=only("header"))

    text = text_of(document.write(made).content)

    assert "Projekt Klang" in text
    assert Translator("de", "m")("header.others") not in text


def test_a_long_company_name_and_a_grade_in_words_are_not_cut(full):
    name = "Ingenieurbüro für Kanalinspektion und Bauwerksprüfung Müller-Lüdenscheidt GmbH & Co. KG"
    template = only("summary", grade="structural")
    company = replace(full.company, name=name, address="Straße 1")
    made = replace(full, company=company, template=template, language="de")

    cover, summary, *_ = pages_of(document.write(made).content)

    t = Translator("de", "m")
    grade = t(grade_of(made).word)
    assert name in cover
    assert f"{grade} {t('summary.overall')}" in summary
    assert len(grade.split()) > 2


def test_a_quantity_has_all_the_digits_that_the_tables_have():
    made = report(None, [{"distance_m": 1.0, "code": "BAB", "char1": "B", "char2": "A",
                          "quant1": 12345.67}])  # fmt: skip
    assert Translator("en", "m").quantities(made.entries[0]) == ["12345.67 mm"]


def test_without_the_extra_fonts_other_scripts_stand_as_numbers(full, monkeypatch):
    always = tuple(face for face in fonts.FACES if not face.package.startswith("justmytype"))
    try:
        with monkeypatch.context() as without:
            without.setattr(fonts, "FACES", always)
            for known in (fonts.installed, fonts.face_of):
                known.cache_clear()
            entries = (remarked(full.entries[0], "陈 über"),)
            made = document.write(replace(full, entries=entries, template=only("observations")))
    finally:
        for known in (fonts.installed, fonts.face_of):
            known.cache_clear()

    assert "[U+9648] über" in text_of(made.content)
    assert [loss.key for loss in made.losses] == ["no_glyph"]


def test_hostile_text_is_shown_as_it_is(full):
    hostile = "<b>&amp; <para> {0} %s \x00\x07\ud800 \U0001f642 =1+1"
    entries = (remarked(full.entries[0], hostile), *full.entries[1:])
    header = dict.fromkeys(full.header, hostile)
    template = only("header", "observations")
    made = replace(full, entries=entries, header=header, template=template)
    text = text_of(document.write(made).content)

    assert "<b>&amp; <para> {0} %s [U+1F642] =1+1" in text


def test_nothing_but_an_empty_inspection_makes_a_report():
    bare = report(
        observations=(), header={}, distance_m=None, u95_m=None, raw_distance_m=None,
    )  # fmt: skip
    bare = replace(bare, track=bare.track.from_estimates([]), raw_track=bare.track, events=())
    text = text_of(document.write(bare).content)

    assert "Nothing was observed." in text
    assert "cannot be rated" in text


def test_the_same_report_makes_the_same_file_dated_when_it_was_made(full, english):
    assert document.write(full).content == english
    assert PdfReader(io.BytesIO(english)).metadata.creation_date == full.made_at


def test_an_uncertainty_is_never_shown_as_zero():
    t = Translator("en", "m")

    assert t.place(entry(1, distance_m=1.0, u95_m=0.001)) == "1.00 m ± 0.01 m"
    assert t.place(entry(1, distance_m=-0.001, u95_m=0.03)) == "0.00 m ± 0.03 m"


def test_the_known_length_of_the_cover_is_not_denied_on_the_page_of_the_measurement():
    template = only("measurement")
    text = text_of(document.write(report(template=template)).content)  # its header knows 24.6 m

    assert "No known length was stated" not in text
    assert "The header states 24.60 m" in text
    header = {k: v for k, v in HEADER.items() if k != "known_length_m"}
    without = report(header=header, template=template)
    assert "No known length was stated" in text_of(document.write(without).content)


def test_no_half_width_is_zero_in_feet():
    sure = replace(report().track, sigma_distance_mm=np.full(500, 1.0))
    made = report(track=sure, units="ft", template=only("measurement"))
    text = text_of(document.write(made).content)

    assert re.search(r"half-width\s+0\.1 ft", text)
