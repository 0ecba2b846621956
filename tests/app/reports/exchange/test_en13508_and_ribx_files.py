"""EN 13508-2 text and RIBX, read back field by field: rows, letters of lists, names."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from brought_in import reported
from exchange_files import in_words, write
from pyproj import Transformer
from reports import EVERY_FIELD, HEADER, OBSERVATIONS, codes, report

from app.imports import any_file
from app.reports.formats import FORMATS


def test_en13508_holds_every_field_of_every_observation(tmp_path: Path) -> None:
    read, _ = write("en13508", report(tmp_path))
    for number, (row, fields) in enumerate(zip(read.rows, OBSERVATIONS, strict=True)):
        assert float(row["I"]) == fields["distance_m"]
        assert row["A"] == (fields["code"] or "BDB")
        assert row["B"] == fields.get("char1", "")
        assert row["C"] == fields.get("char2", "")
        role = {"start": "A", "change": "C", "finish": "B"}.get(fields.get("cont_role", ""), "")
        assert row["J"] == (f"{role}{fields['cont_id']}" if role else "")
        assert row["G"] == str(fields.get("clock_from", ""))
        assert row["H"] == str(fields.get("clock_to", ""))
        assert row["K"] == ("A" if fields.get("at_joint") else "")
        assert row["M"] == f"CUL-0041-{number + 1:03d}.jpg"
        assert in_words(number) in row["F"]
        seconds = int(100 * fields["distance_m"]) // 30
        assert row["N"] == f"00:{seconds // 60:02d}:{seconds % 60:02d}"
    quantities = {n: row["D"] for n, row in enumerate(read.rows) if row["D"]}
    assert quantities == {0: "HW-UP", 1: "10", 2: "2", 3: "4", 4: "4", 5: "18", 11: "HW-DN"}
    assert read.rows[6]["F"].startswith('dripping; text with "quote", and comma, ')


def test_en13508_has_the_header_of_the_published_example() -> None:
    read, _ = write("en13508", report())
    stated = {name: value for name, value in read.header.items() if value}
    assert stated == {
        "AAA": "CUL-0041", "AAB": "HW-UP", "AAD": "HW-UP", "AAF": "HW-DN", "AAK": "A",
        "AAM": "Road authority", "ABA": "EN 13508-2:2003+A1:2011", "ABC": "A", "ABE": "B",
        "ABF": "2026-09-14", "ABG": "09:42", "ABH": "Operator 1", "ABI": "JOB-77", "ABM": "A",
        "ABQ": "24.6", "ABS": "CUL-0041_20260914_0942.mp4", "ACA": "A", "ACB": "900",
        "ACC": "900", "ACD": "AG", "ACG": "1.5", "AAE": "51.4525000 9.0000000",
        "AAG": "51.4525000 9.0003541", "ACJ": "A", "ACK": "E",
        "ADE": "known length source: tape",
    }  # fmt: skip
    always = {"ACM", "ADA"}  # of the fields that every file has, those that are empty here
    assert read.header.keys() == stated.keys() | always


REMARK = "Größe ±5 cm – 45° naïve кирпич 钢"


def test_texts_of_en13508_are_transliterated_and_never_lost_to_a_question_mark() -> None:
    made = report(observations=[{"distance_m": 1.0, "code": "BDB", "remark": REMARK}])
    read, losses = write("en13508", made)
    assert read.rows[0]["F"].startswith("Groesse +/-5 cm - 45 deg naive kirpich Gang")
    assert "?" not in read.rows[0]["F"]
    assert "ascii" in codes(losses)


@pytest.mark.parametrize("kind", ["en13508xml", "ribx"])
def test_xml_keeps_every_letter(kind: str) -> None:
    made = report(observations=[{"distance_m": 1.0, "code": "BDB", "remark": REMARK}])
    read, losses = write(kind, made)
    assert read.rows[0]["F"].startswith(REMARK)
    assert "ascii" not in codes(losses)


@pytest.mark.parametrize("kind", ["en13508", "en13508xml", "ribx"])
def test_names_by_which_assets_are_found_again_keep_their_letters(kind: str) -> None:
    names = {"asset_id": "DL-Ä41", "start_node": "Südkopf", "end_node": "钢"}
    read, losses = write(kind, report(header={**HEADER, **names}))
    assert [read.header[code] for code in ("AAA", "AAB", "AAD", "AAF")] == [
        "DL-Ä41", "Südkopf", "Südkopf", "钢",
    ]  # fmt: skip
    assert (read.rows[0]["D"], read.rows[-1]["D"]) == ("Südkopf", "钢")
    assert "renamed" not in codes(losses)
    (survey,) = any_file.read(
        FORMATS[kind].write(report(header={**HEADER, **names})).content
    ).surveys
    assert {name: survey.header[name] for name in names} == names


def test_ribx_holds_every_field_of_every_observation(tmp_path: Path) -> None:
    read, losses = write("ribx", report(tmp_path))
    assert read.header["ABA"] == "EN 13508-2+A1:2011"
    assert read.header["ABG"] == "09:42:00"
    assert read.more["explained"]["ABK"] == "file on disk"
    film = "CUL-0041_20260914_0942.mp4"
    assert read.rows[6] == {
        "A": "BBF", "B": "B", "F": f'dripping; text with "quote", and comma, {in_words(6)}',
        "G": "03", "I": "9.75", "K": "A", "M": "CUL-0041-007.jpg", "N": f"{film}|00:00:32",
    }  # fmt: skip
    assert read.rows[2]["J"] == "A1"
    assert (read.rows[8]["G"], read.rows[8]["H"]) == ("09", "02")
    (required,) = [loss.values["missing"] for loss in losses if loss.key == "ribx_requires"]
    assert [one.values["code"] for one in required] == ["ABJ", "ACM"]


def test_ribx_writes_dutch_ends_in_the_dutch_grid() -> None:
    dutch = {"start_lat": 52.155, "start_lon": 5.387, "end_lat": 52.155, "end_lon": 5.3874}
    read, _ = write("ribx", report(header={**HEADER, **dutch}))
    back = Transformer.from_crs(28992, 4326, always_xy=True)
    lon, lat = back.transform(*read.more["points"]["AAE"])
    assert (lon, lat) == pytest.approx((5.387, 52.155), abs=1e-6)  # 0.1 m
    assert read.more["points"]["AAG"][0] > read.more["points"]["AAE"][0]


@pytest.mark.parametrize("kind", ["en13508", "ribx"])
def test_lists_of_the_standard_hold_letters_and_words_stand_beside_them(kind: str) -> None:
    listed = {
        "purpose": "routine", "temperature_c": 12.5, "flow_control": "upstream shut",
        "lining_type": "sprayed", "lining_material": "concrete", "asset_type": "storm",
    }  # fmt: skip
    read, _ = write(kind, report(header={**EVERY_FIELD, **listed}))
    letters = ("ABP", "ADB", "ADC", "ACE", "ACF", "ACJ", "ACK")
    assert [read.header[code] for code in letters] == ["C", "A", "B", "B", "AG", "A", "B"]
    assert "temperature: 12.5" in read.header["ADE"]
    other, _ = write(kind, report(header=EVERY_FIELD))
    assert [other.header[code] for code in ("ABP", "ADC", "ACE")] == ["Z", "Z", "Z"]


LETTERS: Sequence[tuple[str, str, Mapping[Any, str]]] = (
        ("AAK", "direction", {"with_flow": "A", "against_flow": "B", "unknown": "C"}),
        ("ABC", "reference_point", {
            "inner face of the headwall": "A", "crown of the pipe": "B",
            "centre of the manhole": "C", "half way along the channel": "D", "fence": "Z"}),
        ("ABE", "method", {"walk_through": "A", "camera": "B", "from_end_only": "C"}),
        ("ABP", "purpose", {
            "acceptance": "A", "end_of_warranty": "B", "routine": "C", "after_repair": "G",
            "follow_up": "Z"}),
        ("ACD", "material", {"cast iron": "AM", "grey cast iron": "AN", "ductile iron": "AO"}),
        ("ACE", "lining_type", {
            "factory": "A", "sprayed": "B", "cured in place": "C", "segments": "D",
            "discrete pipes": "E", "continuous pipe": "F", "close fit": "G", "spiral": "H"}),
        ("ACK", "asset_type", {
            "foul": "A", "storm": "B", "combined": "C", "culvert": "E", "drain": "Z"}),
        ("ACM", "cleaned", {True: "A", False: "B"}),
        ("ADA", "weather", {"dry": "A", "rain": "B", "snow": "C"}),
        ("ADB", "temperature_c", {12.5: "A", -3: "B"}),
        ("ADC", "flow_control", {"none": "A", "upstream shut": "B", "partly": "C", "x": "Z"}),
)  # fmt: skip
"""Code, header field, and the letter of each of its values."""


@pytest.mark.parametrize("kind", ["en13508", "ribx"])
def test_letters_are_those_of_the_standard(kind: str) -> None:
    """A file has a value of each field: they do not interact."""
    wrong = []
    for number in range(max(len(meanings) for _, _, meanings in LETTERS)):
        chosen = [
            (code, field, *[*meanings.items()][number % len(meanings)])
            for code, field, meanings in LETTERS
        ]
        header = {**HEADER} | {field: value for _, field, value, _ in chosen}
        read, _ = write(kind, report(header=header, observations=[]))
        wrong += [
            (field, value, read.header.get(code))
            for code, field, value, letter in chosen
            if read.header.get(code) != letter
        ]
    assert not wrong


@pytest.mark.parametrize("kind", ["en13508", "ribx"])
def test_the_name_of_a_film_is_no_path_in_latin_letters(kind: str) -> None:
    made = report()
    names = [
        write(kind, replace(made, source=replace(made.source, filename=name)))[0].header["ABS"]
        for name in ("Film \u00be.mp4", "DL-Ä41.mp4", "DL-Ö41.mp4", "DL-Ae41.mp4")
    ]
    assert all(re.fullmatch(r"[\w.-]+\.mp4", name, re.ASCII) for name in names)
    assert len(set(names)) == 4


def test_en13508_writes_back_what_an_import_kept_of_a_code() -> None:
    read, _ = write("en13508", report(header={**HEADER, "en13508_aaq": "C", "en13508_abe": "D"}))
    assert (read.header["AAQ"], read.header["ABE"]) == ("C", "D")


@pytest.mark.parametrize("kind", ["en13508", "en13508xml", "ribx"])
def test_words_of_a_letter_come_back_with_their_field(kind: str) -> None:
    """Those that have a field of ours, and others; beside them the remark of the survey."""
    header = {
        **HEADER, "shape": "other", "width_mm": 1200, "en13508_aal": "Z", "ribx_aal": "trottoir",
        "ribx_aca": "profil tunnel", "flow_control": "by hand", "remarks": "mind the dog",
    }  # fmt: skip
    written = FORMATS[kind].write(report(header=header))
    assert "ribx_aal" not in codes(written.losses)
    (survey,) = any_file.read(written.content).surveys
    for name in ("shape", "en13508_aal", "ribx_aal", "ribx_aca", "flow_control"):
        assert survey.header[name] == header[name], name
    assert str(survey.header["remarks"]).startswith("mind the dog")
    again = FORMATS[kind].write(reported(report(header=header), survey))
    assert again.content == written.content


@pytest.mark.parametrize("kind", ["en13508", "en13508xml", "ribx"])
def test_letters_of_an_import_come_back(kind: str) -> None:
    rows = [{"distance_m": 1.0, "code": "BDB", "remark": REMARK, "time_s": 61.0}]
    made = report(observations=rows, header={**HEADER, "video_files": "Größe 1.mpg"})
    made = replace(made, source=replace(made.source, kind="import"))
    read, losses = write(kind, made)
    assert read.rows[0]["F"].startswith(REMARK)
    assert read.rows[0]["N"].rpartition("|")[2] == "00:01:01"
    assert read.header["ABS"] == "Größe 1.mpg"
    assert not {"ascii", "film_renamed"} & codes(losses)


def test_what_changes_along_the_pipe_and_dutch_measurements_are_codes() -> None:
    rows = [
        {"distance_m": 1.0, "code": "AED", "char1": "STZ"},
        {"distance_m": 2.0, "code": "BXA", "char1": "J", "quant1": -1.0},
    ]
    written = {kind: write(kind, report(observations=rows)) for kind in ("en13508", "ribx")}
    for read, losses in written.values():
        assert (read.rows[0]["A"], read.rows[0]["B"]) == ("AED", "STZ")
        assert "foreign_code 1" not in codes(losses)
    ribx, text = written["ribx"][0].rows[1], written["en13508"][0].rows[1]
    assert (ribx["A"], ribx["B"], ribx["D"], text["A"]) == ("BXA", "J", "-1", "BDB")
