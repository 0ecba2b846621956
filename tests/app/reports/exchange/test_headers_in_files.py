"""Every field of a header in every exchange format: written, read back, or among the losses."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import pytest
from exchange_files import (
    STANDARD,
    assert_comes_back,
    each,
    each_of_the_standard,
    survey_in,
    write,
)
from hypothesis import assume, given
from pyproj import Transformer
from random_reports import STORED_HEADERS, reports
from reports import EVERY_FIELD, HEADER, LENGTH_M, codes, report

from app.imports import any_file
from app.reports.formats import FORMATS
from app.reports.report import Report, Source
from app.survey.fields.header import FIELDS

WRITTEN_AS = {
    "direction": {"B", "U", "G"}, "shape": {"B", "3", "shape: rectangular"},
    "cleaned": {"A", "1", "J"}, "tether": {"tether: yes"}, "road_chainage": {"12+340"},
    "purpose": {"1", "purpose: first_survey"}, "method": {"A", "1", "method: walk_through"},
    "start_lat": {"51.4525000 9.0000000", "500000.000"}, "time": {"09:42", "09:42:00"},
    "end_lon": {"51.4525000 9.0003541", "500024.6"}, "asset_type": {"asset type: drain"},
    "standard": {"EN 13508-2", "EN13508", "8"}, "end_condition": {"BDC", "survey abandoned"},
    "temperature_c": {"12.5", "13"}, "water_level_pct": {"17", "water level: 17 %"},
}  # fmt: skip
WRITTEN_AS |= {"start_lon": WRITTEN_AS["start_lat"], "end_lat": WRITTEN_AS["end_lon"]}
"""What stands for a field whose value is not written as it is."""


@each
def test_a_field_is_in_the_file_or_among_the_losses(kind: str) -> None:
    read, losses = write(kind, report(header=EVERY_FIELD, observations=[]))
    lost = codes(loss for loss in losses if loss.key in ("no_place", "dutch_grid"))
    more = (read.more.get(name, []) for name in ("easting", "nodes"))
    texts = [*map(str, read.header.values()), *(str(one) for some in more for one in some)]

    def is_written(field: str) -> bool:
        wanted = WRITTEN_AS.get(field, {str(EVERY_FIELD[field])})
        return any(
            text == one or (len(one) > 2 and one in text) for one in wanted for text in texts
        )

    both_or_neither = [
        field.name for field in FIELDS if is_written(field.name) == (f"field.{field.name}" in lost)
    ]
    assert not both_or_neither


VALUES: Mapping[str, Sequence[Any]] = {
    field.name: [meaning.value for meaning in field.values.meanings]
    for field in FIELDS
    if field.values
}
"""The values of each field that has a list, in any format."""


@each
@pytest.mark.parametrize("number", range(max(map(len, VALUES.values()))))
def test_every_value_of_every_list_comes_back(kind: str, number: int) -> None:
    """A file has a value of each field: they do not interact."""
    chosen = {name: values[number % len(values)] for name, values in VALUES.items()}
    header = assert_comes_back(kind, report(header={**EVERY_FIELD, **chosen})).header
    apart = {"end_condition", "material", "lining_material"}  # of the rows; of rough codes
    wanted = {name: value for name, value in chosen.items() if name not in apart}
    assert {name: header.get(name) for name in wanted} == wanted


@each
@pytest.mark.parametrize(
    "changes",
    [
        {"video_files": "", "edition": ""},
        {"end_condition": "complete", "material": "", "remarks": "a, year: 1987"},
        {"reference_point": "the old bridge", "material": "bamboo", "weather": "fog"},
        {"method": "walk_through", "shape": "other", "start_lat": None},
        {"start_node": "", "end_node": "", "date": "", "time": ""},
    ],
)  # fmt: skip
def test_any_header_comes_back(kind: str, changes: Mapping[str, Any]) -> None:
    stated = {**EVERY_FIELD, **changes}
    found = assert_comes_back(kind, report(header=stated)).header
    for name in (
        "reviewer", "operator_certificate", "cleaned_on", "known_length_source", "road_chainage",
        "water_level_pct", "asset_type", "contractor", "reference_point", "flow_control",
        "upstream_node",
    ):  # fmt: skip
        assert found.get(name) == stated[name], name
    assert str(found["remarks"]).startswith(stated["remarks"])
    assert "Rita" not in str(found["remarks"]), "words that are fields again"


@given(made=reports(), header=STORED_HEADERS)
def test_anything_comes_back(made: Report, header: Mapping[str, Any]) -> None:
    assume(made.distance_m is not None or not made.entries)
    made = replace(made, header=header)
    for kind in (*STANDARD, "isybau", "m150"):
        survey = survey_in(FORMATS[kind].write(made).content)
        if not survey.warnings:  # a sign of one letter may take several in ASCII, and be too long
            assert_comes_back(kind, made)


DUTCH = {"start_lat": 52.155, "start_lon": 5.387, "end_lat": 52.156, "end_lon": 5.3874}


@each
@pytest.mark.parametrize("direction", ["with_flow", "against_flow", "unknown"])
def test_the_ends_come_back_to_their_places(kind: str, direction: str) -> None:
    places = DUTCH if kind == "ribx" else {name: HEADER[name] for name in DUTCH}
    made = report(header={**HEADER, **places, "direction": direction})
    header = assert_comes_back(kind, made).header
    for name, degrees in places.items():
        assert header[name] == pytest.approx(degrees, abs=1e-7), name
    read, _ = write(kind, made)
    is_against = direction == "against_flow"
    upstream = {"isybau": "KnotenZulauf", "m150": "HG003"}.get(kind, "AAD")
    assert read.header[upstream] == ("HW-DN" if is_against else "HW-UP")
    if kind == "ribx":
        back = Transformer.from_crs(28992, 4326, always_xy=True)
        first = DUTCH["end_lon" if is_against else "start_lon"]
        assert back.transform(*read.more["points"]["AAE"])[0] == pytest.approx(first, abs=1e-6)
    elif kind not in STANDARD:
        first_m, second_m = map(float, read.more["easting"])
        along_m = -LENGTH_M if is_against else LENGTH_M
        assert second_m - first_m == pytest.approx(along_m, abs=0.02)


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
        ("ACF", "lining_material", {"concrete": "AG", "granite sets": "Z"}),
        ("ACK", "asset_type", {
            "foul": "A", "storm": "B", "combined": "C", "culvert": "E", "drain": "Z"}),
        ("ACM", "cleaned", {True: "A", False: "B"}),
        ("ADA", "weather", {"dry": "A", "rain": "B", "snow": "C"}),
        ("ADB", "temperature_c", {12.5: "A", -3: "B"}),
        ("ADC", "flow_control", {"none": "A", "upstream shut": "B", "partly": "C", "x": "Z"}),
)  # fmt: skip
"""Code, header field, and the letter of each of its values, by Annex C."""


@pytest.mark.parametrize("number", range(8))
def test_letters_are_those_of_the_standard(number: int) -> None:
    chosen = {
        code: (field, *[*meanings.items()][number % len(meanings)])
        for code, field, meanings in LETTERS
    }
    header = {**HEADER} | {field: value for field, value, _ in chosen.values()}
    read, _ = write("en13508", report(header=header, observations=[]))
    assert {code: read.header[code] for code in chosen} == {
        code: letter for code, (_, _, letter) in chosen.items()
    }
    assert f"temperature: {header['temperature_c']}" in read.header["ADE"]


GERMAN: Mapping[str, Mapping[str, str]] = {
    "isybau": {
        "Inspektionsrichtung": "U", "Profilhoehe": "900", "Profilart": "3", "Uhrzeit": "09:42:00",
        "Auftrag": "JOB-77", "Inspektionslaenge": "24.60", "Strassenname": "Dorfstrasse",
        "Baujahr": "1987", "Auftragsnummer": "ORDER-12", "Inspektionszweck": "1",
    },
    "m150": {
        "HG001": "CUL-0041", "HG003": "HW-DN", "HG306": "1500", "HG307": "900", "HG310": "24.600",
        "HG314": "2.440", "HG102": "Dorfstrasse", "HG303": "1987", "HG308": "tiles",
        "HG309": "granite sets", "HI002": "JOB-77", "HI004": "4", "HI005": "EN13508",
        "HI006": "Eyeball, 6 mm", "HI101": "G", "HI108": "12.5", "HI112": "Olga",
    },
}  # fmt: skip


@pytest.mark.parametrize("kind", GERMAN)
def test_german_formats_hold_a_field_in_its_element(kind: str) -> None:
    read, _ = write(kind, report(header=EVERY_FIELD))
    assert {name: read.header.get(name) for name in GERMAN[kind]} == GERMAN[kind]


def test_isybau_of_2024_differs_in_its_version_alone_and_comes_back() -> None:
    made = report(header=EVERY_FIELD)
    old, new = (FORMATS[kind].write(made).content for kind in ("isybau", "isybau2024"))
    version = (b"<Version>2017-07<", b"<Version>2024-06<")
    assert new == old.replace(*version).replace(b"<Regelwerk>6<", b"<Regelwerk>7<") != old
    before, after = (any_file.read(content).surveys for content in (old, new))
    assert before == after


def test_ribx_states_its_media_and_what_it_lacks() -> None:
    read, losses = write("ribx", report())
    assert (read.header["ABA"], read.header["ABG"]) == ("EN 13508-2+A1:2011", "09:42:00")
    assert read.more["explained"]["ABK"] == "file on disk"
    (required,) = [loss.values["missing"] for loss in losses if loss.key == "ribx_requires"]
    assert [one.values["code"] for one in required] == ["ABJ", "ACM"]


@pytest.mark.parametrize(
    ("kind", "kept"),
    [
        ("m150", {"m150_hg304": "BETON", "m150_hi106": "9", "m150_hi103": "7", "m150_hg302": "X"}),
        ("isybau", {"isybau_material": "OB", "isybau_wetter": "9", "isybau_profilart": "8",
                    "isybau_inspektionszweck": "8", "isybau_inspektionsverfahren": "3"}),
        ("en13508", {"en13508_aaq": "C", "en13508_abe": "D", "en13508_acd": "QQ"}),
    ],
)  # fmt: skip
def test_values_outside_the_lists_of_a_format_come_back(kind: str, kept: dict[str, str]) -> None:
    header = {**HEADER, **kept, "material": "", "shape": "", "asset_type": ""}
    written = FORMATS[kind].write(report(header=header))
    assert not {*kept} & codes(written.losses)
    found = survey_in(written.content).header
    assert {name: found.get(name) for name in kept} == kept


@each_of_the_standard
def test_words_of_a_letter_come_back_with_their_field(kind: str) -> None:
    """Those that have a field of ours, and others; beside them the remark of the survey."""
    header = {
        **HEADER, "shape": "other", "width_mm": 1200, "en13508_aal": "Z", "ribx_aal": "trottoir",
        "ribx_aca": "profil tunnel", "flow_control": "by hand", "remarks": "mind the dog",
    }  # fmt: skip
    assert "ribx_aal" not in codes(FORMATS[kind].write(report(header=header)).losses)
    found = assert_comes_back(kind, report(header=header)).header
    for name in ("shape", "en13508_aal", "ribx_aal", "ribx_aca", "flow_control"):
        assert found[name] == header[name], name
    assert str(found["remarks"]).startswith("mind the dog")


@pytest.mark.parametrize(
    ("kind", "rounded"),
    [
        ("en13508", ["900.4 as 900"]),
        ("isybau", ["900.4 as 900", "24.605 as 24.61", "12.25 as 12"]),
        ("m150", ["900.4 as 900", "12.25 as 12.3", "17.5 as 18"]),
    ],
)
def test_a_field_that_a_format_rounds_is_among_the_losses(kind: str, rounded: list[str]) -> None:
    finer = {"height_mm": 900.4, "water_level_pct": 17.5}
    finer |= {"known_length_m": 24.605, "temperature_c": 12.25}
    _, losses = write(kind, report(header={**EVERY_FIELD, **finer}))
    (fields,) = [loss.values["fields"] for loss in losses if loss.key == "rounded_fields"]
    assert [f"{one.values['stated']} as {one.values['written']}" for one in fields] == rounded
    _, losses = write(kind, report(header={**EVERY_FIELD, "temperature_c": 12}))
    assert "rounded_fields" not in codes(losses)


@pytest.mark.parametrize(("kind", "longest"), [("isybau", 30), ("m150", 16)])
def test_long_names_are_cut_and_stay_apart(kind: str, longest: int) -> None:
    long = "Headwall of Jalan Kampung Baru, "
    made = report(header={**HEADER, "start_node": f"{long}north", "end_node": f"{long}south"})
    read, losses = write(kind, made)
    up, down = ("KnotenZulauf", "KnotenAblauf") if kind == "isybau" else ("HG003", "HG004")
    assert read.header[up] != read.header[down]
    assert len(read.header[up]) <= longest
    renamed = [loss.values for loss in losses if loss.key == "renamed"]
    assert {"name": f"{long}north", "written": read.header[up]} in renamed


@each_of_the_standard
def test_names_by_which_assets_are_found_again_keep_their_letters(kind: str) -> None:
    names = {"asset_id": "DL-Ä41", "start_node": "Südkopf", "end_node": "钢"}
    made = report(header={**HEADER, **names})
    read, losses = write(kind, made)
    assert [read.header[code] for code in ("AAA", "AAB", "AAD", "AAF")] == [
        "DL-Ä41", "Südkopf", "Südkopf", "钢",
    ]  # fmt: skip
    assert (read.rows[0]["D"], read.rows[-1]["D"]) == ("Südkopf", "钢")
    assert "renamed" not in codes(losses)
    found = survey_in(FORMATS[kind].write(made).content).header
    assert {name: found[name] for name in names} == names


@each
def test_an_empty_header_and_no_observations_still_make_a_file(kind: str) -> None:
    read, losses = write(kind, report(header={}, observations=[], distance_m=None))
    assert read.rows == []
    (nameless,) = [loss for loss in losses if loss.key == "no_start_node"]
    assert nameless.values == {"written": "START"}
    if kind in STANDARD:
        assert read.header["AAF"] == "END", "without it a reader sees a lateral"


@each
def test_the_name_of_a_film_is_one_word_and_another_name_is_reported(kind: str) -> None:
    made = report()
    film = {"isybau": "film", "m150": "HI116"}.get(kind, "ABS")
    names = []
    for filename in ("Bach 7 (left).mp4", "Film \u00be.mp4", "DL-Ä41.mp4", "DL-Ö41.mp4"):
        read, losses = write(kind, replace(made, source=replace(made.source, filename=filename)))
        name = read.more["film"][0] if film == "film" else read.header[film]
        names.append(name)
        renamed = [loss.values for loss in losses if loss.key == "film_renamed"]
        assert renamed == ([] if name == filename else [{"name": filename, "written": name}])
    is_plain = re.ASCII if kind in STANDARD else 0
    assert all(re.fullmatch(r"[\w.-]+\.mp4", name, is_plain) for name in names)
    assert len(set(names)) == 4
    imported = report(source=Source("import", "old.txt", 10, "ab", {}))
    read, _ = write(kind, imported)
    assert not read.header.get({"isybau": "Videoablagereferenz"}.get(kind, film)), "names none"
