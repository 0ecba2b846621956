"""Text of any script: fonts, characters that none has, and lines of texts on pictures."""

import unicodedata

import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.reports.text.fonts import FACES, face_of
from app.reports.text.typesetting import clean, lines_of, one_line, pieces_of, width_of

SCRIPTS = {
    "Latin": "Größe Việt Łódź", "Greek": "Ωμέγα", "Cyrillic": "Ключ", "Arabic": "قرية ڠ ڤ",
    "Hebrew": "שלום", "Tamil": "தமிழ்", "Devanagari": "क्षेत्र", "Bengali": "বাংলা",
    "Telugu": "తెలుగు", "Thai": "ถนนสุขุมวิท", "Khmer": "ភាសា", "Lao": "ພາສາ",
    "Myanmar": "မြန်မာ", "Chinese": "钢筋 臺灣", "Japanese": "カメラ ひらがな", "Korean": "한국어",
    "rare Chinese": "㐀 龘", "Armenian": "Հայ", "Georgian": "ქართული", "signs": "± ≤ → σ ½ °",
}  # fmt: skip
ANY_TEXT = st.text(st.characters(), max_size=60)


def test_every_script_has_a_font_and_the_first_that_has_a_character_shows_it():
    for text in SCRIPTS.values():
        assert clean(text) == unicodedata.normalize("NFC", text)
    assert face_of("A") is FACES[0]
    assert face_of("钢").family == "Noto Sans SC"
    assert face_of("\U0001f642") is None


def test_what_no_font_has_is_written_as_its_code_point():
    assert clean("road \U0001f642 above") == "road [U+1F642] above"
    assert clean("\uef00") == "[U+EF00]"  # of DejaVu's own; PDF/A forbids such characters


def test_control_characters_and_lone_surrogates_are_removed():
    assert clean("a\x00b\x1b\ud800c\u202ed\ufeff") == "abcd"
    assert clean("a\r\nb\rc\u2028d") == "a\nb\nc\nd"
    assert one_line("a\n b\t c") == "a b c"


@given(ANY_TEXT)
def test_pieces_of_a_line_are_all_of_it(text):
    shown = one_line(text)

    assert "".join(piece for _, piece in pieces_of(shown)) == shown


def test_a_text_that_one_font_shows_is_one_piece_so_that_its_direction_holds_for_all_of_it():
    assert [face.family for face, _ in pieces_of("شق 12.40 هنا")] == ["Noto Sans Arabic"]
    assert [face.family for face, _ in pieces_of("شق 钢")] == ["Noto Sans Arabic", "Noto Sans SC"]


@given(ANY_TEXT, st.floats(30, 300))
def test_lines_of_any_text_are_within_the_width_and_lose_nothing(text, width):
    lines = lines_of(text, 9, 400, width)

    assert all(width_of(line, 9, 400) <= width + 0.1 or len(line) <= 8 for line in lines)
    kept = "".join("".join(line.split()) for line in lines)
    assert kept == "".join(clean(text).split())


@pytest.mark.parametrize("weight", [400, 600])
def test_a_text_is_as_wide_as_its_letters_in_every_size(weight):
    assert width_of("12.40 m", 2.4, weight) == pytest.approx(width_of("12.40 m", 24, weight) / 10)
    assert width_of("mm", 9, 600) > width_of("mm", 9, 400)
