"""Text of any script, in lines and in visual order."""

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.reports.content.fonts import FACES, face_of, font_of
from app.reports.content.typesetting import clean, one_line, visual_runs
from app.reports.pdf.styles import BODY
from app.reports.pdf.text import lines_of, shortened, width_of

SCRIPTS = {
    "Latin": "Größe Việt Łódź", "Greek": "Ωμέγα", "Cyrillic": "Ключ", "Arabic": "قرية ڠ ڤ",
    "Hebrew": "שלום", "Tamil": "தமிழ்", "Devanagari": "क्षेत्र", "Bengali": "বাংলা",
    "Telugu": "తెలుగు", "Thai": "ถนนสุขุมวิท", "Khmer": "ភាសា", "Lao": "ພາສາ",
    "Myanmar": "မြန်မာ", "Chinese": "钢筋 臺灣", "Japanese": "カメラ ひらがな", "Korean": "한국어",
    "rare Chinese": "㐀 龘", "Armenian": "Հայ", "Georgian": "ქართული", "signs": "± ≤ → σ ½ °",
}  # fmt: skip
ANY_TEXT = st.text(st.characters(), max_size=60)


@pytest.mark.parametrize("text", SCRIPTS.values(), ids=SCRIPTS)
def test_every_letter_has_a_glyph(text):
    for run in visual_runs(clean(text), 400):
        chars = run.text if run.glyphs is None else [glyph.char for glyph in run.glyphs]
        assert all(run.font.face.charToGlyph.get(ord(char)) for char in chars), run


def test_every_font_file_is_there_and_open_in_both_weights():
    for face in FACES[:11]:
        regular, bold = font_of(face, 400), font_of(face, 600)
        assert regular.fontName != bold.fontName
        assert regular.stringWidth("A", 10) < bold.stringWidth("A", 10)


def test_what_no_font_has_is_written_as_its_code_point():
    assert clean("road \U0001f642 above") == "road [U+1F642] above"


def test_control_characters_and_lone_surrogates_are_removed():
    assert clean("a\x00b\x1b\ud800c\u202ed\ufeff") == "abcd"
    assert clean("a\r\nb\rc\u2028d") == "a\nb\nc\nd"
    assert one_line("a\n b\t c") == "a b c"


@given(ANY_TEXT, st.floats(30, 300))
def test_lines_of_any_text_are_within_the_width_and_lose_nothing(text, width):
    lines = lines_of(text, BODY, width)

    assert all(line.width <= width or len(line.text) <= 8 for line in lines)
    kept = "".join("".join(line.text.split()) for line in lines)
    assert kept == "".join(clean(text).split())


@given(ANY_TEXT)
def test_visual_order_moves_characters_but_keeps_them_all(text):
    shown = clean(text).replace("\n", " ")
    runs = visual_runs(shown, 400)

    assert sorted("".join(run.text for run in runs)) == sorted(shown)
    assert all(run.width >= 0 for run in runs)


@given(ANY_TEXT, st.floats(20, 200))
def test_shortened_text_fits_and_says_that_it_was_cut(text, width):
    cut = shortened(text, BODY, width)

    assert width_of(cut, BODY) <= width or len(cut) <= 9
    assert cut == one_line(text) or cut.endswith("…")


def test_arabic_runs_from_right_to_left_and_its_numbers_from_left_to_right():
    runs = visual_runs(clean("شق 12.40 هنا"), 400)

    assert [word for run in runs if (word := run.text.strip())] == ["هنا", "12.40", "شق"]


@pytest.mark.parametrize(
    ("text", "shown"),
    [
        ("شق 12.40 m (BAB B A) هنا", ["هنا", "m(BABBA)", "12.40", "شق"]),
        ("Remark: شق 12.40 (3 mm)", ["Remark:", "12.40", "شق", "(3mm)"]),
    ],
)
def test_brackets_stay_around_what_is_within_them(text, shown):
    drawn = "".join(run.text for run in visual_runs(clean(text), 400))

    assert "".join(drawn.split()) == "".join(shown)


def test_joiners_and_letters_newer_than_unicodedata_stand_in_text_from_right_to_left():
    for text in ("می\u200cخواهم", "ש \U00011b00 12"):  # Devanagari of Unicode 15
        runs = visual_runs(clean(text), 400)

        assert sorted("".join(run.text for run in runs)) == sorted(clean(text))


def test_arabic_letters_join():
    alone, joined = (visual_runs(text, 400)[0] for text in ("ب", "بب"))

    letters = [{glyph.char for glyph in run.glyphs} for run in (alone, joined)]
    assert len(letters[1] - letters[0]) >= 2  # an initial and a final form beside the dot of both


def test_chinese_breaks_between_characters_and_not_before_a_full_stop():
    lines = lines_of("钢筋混凝土管道裂缝，需要立即修复。" * 3, BODY, 60)

    assert len(lines) > 5
    assert not any(unicodedata.category(line.text[0]).startswith("P") for line in lines)


def test_a_character_is_drawn_by_the_first_font_that_has_it():
    assert face_of("A") is FACES[0]
    assert face_of("钢").name.startswith("NotoSansSC")
    assert face_of("\U0001f642") is None
