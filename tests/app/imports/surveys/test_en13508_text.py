"""EN 13508-2 text as other programs write it: odd separators, commas, broken blocks."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from reports import ENGLISH

from app.imports.surveys.en13508_text import looks_like, read

FOREIGN = """#A1=ISO-8859-1
#A2=de
#A3=,
#A4=.
#A5="
#B01=ACC,ACB,ABC,ABA,ABQ,AAD,AAB,AAK,AAF,ABF,ABG,ABH,AAA,AEA
400,400,A,EN 13508-2:2003+A1:2011,49.1,8,8,B,7,19.07.2007,9:05,"Clean, Mr. \"\"X\"\"",3,odd
#C=I,N,A,B,C,D,G,H,K,F,M,J,Q
0,5316,BCD,XP,,8,,,,,,,q
1.6,01:02:03,bab,Y,YY,"0,5",03,,A,"line, with comma",4,A01,
3.6,film.mp4|00:04:05,BAJ,B,,15,6.5,,,,,0,
14,,BBA,A,Z,3,0,12,,,x.jpg,B1,
not a number,,BAC,A,,,,,,,,,
49.1,5225,BCE,XP,,7,,,,,,,
#Z
#B01=AAA,AAB
#C=I,A
0,BCD
#Z
#B01=AAA,AAB,AAF
9,N1,N2
#C=A,F
BCD,no distance column
#B01=AAA
10
#C=I,A
2.5,BAC"""


def test_a_file_of_another_program_is_read_field_by_field() -> None:
    survey, last = read(FOREIGN.encode("latin-1")).surveys
    assert survey.header == {
        "asset_id": "3", "start_node": "8", "end_node": "7", "direction": "against_flow",
        "date": "2007-07-19", "time": "09:05", "operator": 'Clean, Mr. "X"', "height_mm": 400.0,
        "width_mm": 400.0, "expected_length_m": 49.1, "standard": "EN 13508-2:2003+A1:2011",
        "reference_point": "inner face of the wall at the start", "end_condition": "complete",
        "en13508_aea": "odd", "video_files": "film.mp4",
    }  # fmt: skip
    start, crack, offset, roots, _ = survey.observations
    assert (start.code, start.char1, start.quant1, start.time_s) == ("BCD", "XP", None, 3196.0)
    assert (crack.code, crack.char1, crack.char2) == ("BAB", "Y", "YY")
    assert (crack.quant1, crack.clock_from, crack.clock_to) == (0.5, 3, None)
    assert (crack.stretch, crack.at_joint, crack.time_s) == ("A1", True, 3723.0)
    stated = crack.tag(0).to_json()
    assert (stated["remark"], stated["at_joint"]) == ("line, with comma", True)
    assert stated["photo_name"] == "4"
    assert (offset.clock_from, offset.time_s, offset.stretch) == (None, 245.0, None)
    assert offset.remark == "clock 6.5, stretch 0"
    assert (roots.clock_from, roots.clock_to, roots.photo) == (None, 12, "x.jpg")
    assert [it.distance_m for it in survey.observations] == [0, 1.6, 3.6, 14, 49.1]
    assert [it.distance_m for it in last.observations] == [2.5]


def test_what_is_odd_is_reported_with_its_line() -> None:
    file = read(FOREIGN.encode("latin-1"))
    assert [ENGLISH.caveat(caveat) for caveat in file.surveys[0].warnings] == [
        "Line 9: The column Q is unknown; its values are kept in the remarks.",
        "Line 11: Clock '6.5' is not a whole hour; it is kept in the remark.",
        "Line 11: '0' is not a stretch such as A1; it is kept in the remark.",
        "Line 13: No distance can be read from 'not a number'; it is left out.",
    ]


def test_a_bad_block_fails_alone_with_its_line() -> None:
    file = read(FOREIGN.encode("latin-1"))
    assert len(file.surveys) == 2
    assert [ENGLISH.caveat(caveat) for caveat in file.warnings] == [
        "Line 16: This inspection is left out: there is no line of values below its list of "
        "fields.",
        "Line 22: This inspection is left out: its observations have no column I.",
    ]


@pytest.mark.parametrize("separator", [";", ",", "\t", "|", " "])
@pytest.mark.parametrize("end", ["\r\n", "\n", "\r"])
def test_any_separator_and_any_line_end_is_read(separator: str, end: str) -> None:
    lines = [
        f"#A3={separator}", "#A4=,", separator.join(["#B01=AAA", "AAB", "AAF"]),
        separator.join(["C1", "N1", "N2"]), "#C=" + separator.join("IAD"),
        separator.join(['"3,25"', "BAB", '"1,5"']), "#Z", "",
    ]  # fmt: skip
    (survey,) = read(end.join(lines).encode()).surveys
    (row,) = survey.observations
    assert (survey.header["start_node"], survey.header["end_node"]) == ("N1", "N2")
    assert (row.distance_m, row.quant1) == (3.25, 1.5)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "cp1252", "utf-16"])
def test_letters_are_read_whatever_the_file_says_of_its_encoding(encoding: str) -> None:
    text = "#A1=ISO-8859-1\n#B01=AAA;ABH\nC1;Jürgen Größe\n#C=I;A;F\n1;BDB;naß\n#Z\n"
    assert looks_like(text.encode(encoding))
    (survey,) = read(text.encode(encoding)).surveys
    assert survey.header["operator"] == "Jürgen Größe"
    assert survey.observations[0].remark == "naß"


@pytest.mark.parametrize(
    ("named", "encoding"),
    [
        ("ISO-8859-1:1998", "latin-1"), ("IBM850", "cp850"), ("IBM437", "cp437"),
        ("CP1252", "cp1252"),
        ("windows-1250", "cp1250"), ("ISO-8859-15", "iso8859-15"), ("ANSI", "cp1252"),
        ("UTF-8", "utf-8"),
    ],
)  # fmt: skip
def test_a_file_is_read_by_the_encoding_that_it_names(named: str, encoding: str) -> None:
    text = f"#A1={named}\n#B01=AAA;ABH\nDL-Ä41;Jürgen\n#C=I;A;F\n1;BDB;Wölbung\n#Z\n"
    file = read(text.encode(encoding))
    (survey,) = file.surveys
    assert (survey.header["asset_id"], survey.header["operator"]) == ("DL-Ä41", "Jürgen")
    assert survey.observations[0].remark == "Wölbung"
    assert (file.warnings, survey.warnings) == ((), ())


def test_letters_that_may_be_wrong_are_reported() -> None:
    text = "#A1={}\n#B01=AAA\nM\x81ller\n#C=I;A\n1;BDB\n#Z\n"
    for named, said in (("ISO-8859-1", "1 letters are none of cp1252"), ("EBCDIC", "'EBCDIC'")):
        file = read(text.format(named).encode("latin-1"))
        assert any(said in ENGLISH.caveat(caveat) for caveat in file.warnings), named


FRENCH = """#A1=ISO-8859-1:1998
#A2=fr
#B01=AAA;AAD;AAF;AAL;ADE;AAN
T1;R1;R2;Z;"sous trottoir privé";Ville
#B02=ABF;ABP;ADE;ABH;ABH
2024-05-06;Z;avant cession;Anne;Paul
#B03=ACA;ADE;ACB;ACC;ACD;ADE;ACK;ADE;ADE
Z;profil tunnel;900;1200;Z;tôle galvanisée;Z;ruisseau busé;à revoir
#C=I;A;F;F;M;M
0.00;BCD;a;b;1.jpg;2.jpg
10.00;BCE;;;;
#Z
"""


def test_every_repeated_remark_is_kept_with_the_field_before_it() -> None:
    (survey,) = read(FRENCH.encode("latin-1")).surveys
    header = survey.header
    assert (header["material"], header["shape"]) == ("tôle galvanisée", "other")
    words = {"aal": "sous trottoir privé", "abp": "avant cession", "aca": "profil tunnel",
             "ack": "ruisseau busé"}  # fmt: skip
    assert {code: header[f"ribx_{code}"] for code in words} == words
    assert (header["operator"], header["remarks"]) == ("Anne", "ABH Paul, à revoir")
    assert survey.observations[0].remark == "a, b, M 2.jpg"
    assert [caveat.key for caveat in survey.warnings] == ["repeated_field", "repeated_column"]


def test_the_remark_behind_its_own_group_is_of_the_survey() -> None:
    """Files in alphabetical order have it there, whatever the letter before."""
    for codes, values in (("ADA;ADC;ADE", "A;Z;all dry"), ("ADC;ADE", "A;all dry")):
        (survey,) = read(f"#B01=AAA;{codes}\nC;{values}\n#C=I;A\n1;BDB\n".encode()).surveys
        assert survey.header["remarks"] == "all dry"


def test_a_text_over_several_lines_is_one_cell() -> None:
    text = (
        '#A3=;\n#A4=,\n#B01=AAA;AAJ\nC;"Hauptstr.\r\n12"\n#C=I;A;F;G\n'
        '3,40;BAB;"Riss, siehe auch\r\n\r\nzweite ""Zeile""";12\n'
        '5;BAB;"12 Zoll;3\n6;BAC;"Rohr" neu;4\n7;BAA;a\x0bb;5\n8;BAO;;6\n#Z\n'
    )
    (survey,) = read(text.encode()).surveys
    assert survey.header["location_text"] == "Hauptstr. 12"
    assert [(row.remark, row.clock_from) for row in survey.observations] == [
        ('Riss, siehe auch zweite "Zeile"', 12), ('"12 Zoll', 3), ('"Rohr" neu', 4), ("a b", 5),
        ("", 6),
    ]  # fmt: skip
    assert survey.warnings == ()


def test_what_stands_in_no_list_or_is_no_time_is_reported() -> None:
    text = "#A3=;\nlost\n#B01=AAA;ABM\nC;B\nmore\n#D=x\n1;2\n#C=I;A;N\n1;BAB;5316\n2;BAC;f.mp4\n#Z"
    file = read(text.encode())
    (survey,) = file.surveys
    assert [row.remark for row in survey.observations] == ["video 5316", "video f.mp4"]
    assert survey.header["en13508_abm"] == "B"
    said = [ENGLISH.caveat(caveat) for caveat in (*file.warnings, *survey.warnings)]
    assert [sentence.partition(":")[0] for sentence in said] == [
        "Line 2", "Line 6", "Line 7", "Line 5", "Line 9", "Line 10",
    ]  # fmt: skip


def test_fields_over_two_lists_are_put_together() -> None:
    text = "#B01=AAA\nC1\n#B02=AAB;AAF;ACA\nN1;N2;E\n#C=I;A\n1;BDB\n#Z\n"
    (survey,) = read(text.encode()).surveys
    assert survey.header == {
        "asset_id": "C1", "start_node": "N1", "end_node": "N2", "shape": "arch",
    }  # fmt: skip


def test_a_value_that_a_field_may_not_hold_goes_to_the_remarks() -> None:
    text = "#B01=AAA;ABF;ACB\nC1;31.02.2020;-5\n#C=I;A\n1;BDB\n#Z\n"
    (survey,) = read(text.encode()).surveys
    assert survey.header == {"asset_id": "C1", "remarks": "date: 31.02.2020, height_mm: -5.0"}
    assert len(survey.warnings) == 2


@pytest.mark.parametrize("content", [b"", b"#B01=AAA\n", b"\x00\xff" * 100, b"#A1=x\n#C=I;A\n1;2"])
def test_a_file_without_an_inspection_has_no_survey(content: bytes) -> None:
    assert read(content).surveys == ()


@given(st.binary(max_size=2000).map(lambda noise: b"#A3=;\n#B01=AAA;AAB\nC;N\n#C=I;A;F\n" + noise))
def test_noise_is_read(content: bytes) -> None:
    assert looks_like(content)
    for survey in read(content).surveys:
        for row in survey.observations:
            assert all(ord(letter) >= 32 for letter in row.tag(0).to_json().get("remark", ""))


def test_a_remark_that_is_too_long_is_cut_with_a_warning() -> None:
    columns = f"#C=I;A;F\n1;BDB;{'r' * 40_500}\n2;BDB;{'s' * 30_000}\n#Z\n"
    (survey,) = read(f"#B01=AAA;ADE\nC1;{'h' * 20_500}\n{columns}".encode()).surveys
    assert [len(row.tag(0).to_json()["remark"]) for row in survey.observations] == [40_000, 30_000]
    assert [ENGLISH.caveat(caveat) for caveat in survey.warnings] == [
        "Line 4: The remark has 40500 characters; the first 40000 are kept.",
        "Only 20000 characters of the header field Remarks are kept.",
    ]
