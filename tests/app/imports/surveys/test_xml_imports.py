"""RIBX, ISYBAU, DWA-M 150 and EN 13508-2 XML as other programs write them."""

from __future__ import annotations

import pytest
from reports import ENGLISH

from app.errors import InvalidImport
from app.imports import any_file
from app.imports.surveys.survey import ImportedFile, ImportedSurvey
from app.survey.places import grids


def read(text: str, encoding: str = "utf-8") -> ImportedFile:
    file = any_file.read(text.encode(encoding))
    assert isinstance(file, ImportedFile)
    return file


def told(*surveys: ImportedSurvey) -> str:
    return " ".join(ENGLISH.caveat(caveat) for survey in surveys for caveat in survey.warnings)


RIBX = """<?xml version="1.0" encoding="ISO-8859-1"?>
<DATA xmlns:gml="http://www.opengis.net/gml"><ZA><A2>nl</A2><A6>RIBX 1.3</A6></ZA>
<ZB_C><CAA>P1</CAA></ZB_C>
<ZB_A><AAA>S-1</AAA><AAB>P2</AAB><AAD>P1</AAD>
<AAE><gml:Point><gml:pos>155000 463000</gml:pos></gml:Point></AAE><AAF>P2</AAF>
<AAG><gml:Point><gml:pos>155040 463000</gml:pos></gml:Point></AAG>
<AAK>B</AAK><ABF>2026-09-14</ABF><ACA>A</ACA><ACB>300</ACB><ACD ADE="hout \u00eb">Z</ACD>
<ABP ADE="?">Q</ABP><BXA>1,5</BXA>
<ZC><I>0,0</I><A>BCD</A><B>XP</B><D>P2</D><N>film 1.mpg|00:00:07</N></ZC>
<ZC><I>3.25</I><A>bab</A><B>Y</B><C>YY</C><J>0</J><G>00</G><M>foto.jpg</M></ZC>
<ZC><I>4</I><A>BAB</A><J>01</J><O>x</O></ZC>
<ZC><A>BAC</A></ZC></ZB_A>
<ZB_A/>
<ZB_A><AAA>S-2</AAA></ZB_A></DATA>"""


def test_ribx_is_read_tolerantly() -> None:
    file = read(RIBX, "latin-1")
    survey, empty = file.surveys
    assert [ENGLISH.caveat(it) for it in file.warnings] == [
        "Line 3: The block ZB_C is no pipe but a manhole or another structure; it is left out.",
        "Line 13: This inspection is left out: its header is empty.",
    ]
    header = dict(survey.header)
    places = [header.pop(name) for name in ("start_lon", "start_lat", "end_lon", "end_lat")]
    start, end = grids.metres(grids.DUTCH, *places[:2]), grids.metres(grids.DUTCH, *places[2:])
    assert start == pytest.approx((155_040, 463_000), abs=1e-3), "P2, where it began"
    assert end == pytest.approx((155_000, 463_000), abs=1e-3)
    assert header == {
        "asset_id": "S-1", "start_node": "P2", "end_node": "P1", "direction": "against_flow",
        "date": "2026-09-14", "shape": "circular", "height_mm": 300.0, "material": "hout \u00eb",
        "video_files": "film 1.mpg", "en13508_abp": "Q", "ribx_abp": "?", "en13508_bxa": "1,5",
    }  # fmt: skip
    begin, crack, other = survey.observations
    assert (begin.distance_m, begin.quant1, begin.time_s) == (0.0, None, 7.0)
    assert (crack.code, crack.char1, crack.char2, crack.photo) == ("BAB", "Y", "YY", "foto.jpg")
    assert (crack.clock_from, crack.stretch, crack.remark) == (None, None, "stretch 0")
    assert other.remark == "stretch 01, O x"
    for sentence in ("Purpose: 'Q' is not known", "Line 10: '0' is not a stretch", "No distance"):
        assert sentence in told(survey)
    assert (empty.header["asset_id"], empty.observations) == ("S-2", ())


def test_what_the_xml_of_the_standard_repeats_is_kept() -> None:
    file = read(
        "<DATA><ZB><AAA>T-1</AAA><AAL>Z</AAL><ADE>sous trottoir</ADE><ACA>Z</ACA>"
        "<ADE>profil tunnel</ADE><ACD>Z</ACD><ADE>tôle</ADE><ADE>à revoir</ADE>"
        "<ZC><I>3.40</I><A>BAB</A><F>fissure</F><F>large</F><X><Y>2</Y></X></ZC></ZB></DATA>"
    )
    (survey,) = file.surveys
    assert survey.header == {
        "asset_id": "T-1", "shape": "other", "material": "tôle", "remarks": "à revoir",
        "en13508_aal": "Z", "ribx_aal": "sous trottoir", "ribx_aca": "profil tunnel",
    }  # fmt: skip
    assert survey.observations[0].remark == "fissure, large"
    assert told(survey) == "These elements are not read and are left out: Y."


@pytest.mark.parametrize("encoding", ["iso-8859-1", "windows-1252", "IBM850", "UTF-16", "UTF-8"])
def test_xml_is_read_by_the_encoding_that_it_names(encoding: str) -> None:
    text = f'<?xml version="1.0" encoding="{encoding}"?><DATA><ZB><AAA>DL-Ä41</AAA></ZB></DATA>'
    file = read(text, encoding)
    assert file.surveys[0].header["asset_id"] == "DL-Ä41"
    assert file.warnings == ()


ISYBAU = """<?xml version="1.0" encoding="ISO-8859-1"?>
<Identifikation xmlns="NAMESPACE"><Version>2013-02</Version><Datenkollektive>
<Stammdatenkollektiv><Kennung>S</Kennung>
<AbwassertechnischeAnlage><Objektbezeichnung>H1</Objektbezeichnung><Baujahr>1961</Baujahr>
<Entwaesserungsart>KX</Entwaesserungsart>
<Kante><KnotenZulauf>S1</KnotenZulauf><KnotenAblauf>S2</KnotenAblauf><Laenge>41,5</Laenge>
<Material>B</Material><Profil><Profilart>0</Profilart><Profilhoehe>500</Profilhoehe></Profil></Kante>
<Geometrie><Geometriedaten><Kanten><Kante>
<Start><Rechtswert>3500000</Rechtswert><Hochwert>5700000</Hochwert></Start>
<Ende><Rechtswert>32500041.5</Rechtswert><Hochwert>5700000</Hochwert></Ende>
</Kante></Kanten></Geometriedaten></Geometrie></AbwassertechnischeAnlage></Stammdatenkollektiv>
<Zustandsdatenkollektiv><Kennung>Z</Kennung>
<Auftraege><Auftrag><Auftragsbezeichnung>Los 1</Auftragsbezeichnung>
<Auftragskennung>7</Auftragskennung><Kodiersystem>10</Kodiersystem></Auftrag></Auftraege>
<InspizierteAbwassertechnischeAnlage><Objektbezeichnung>S1</Objektbezeichnung>
<OptischeInspektion><Knoten/></OptischeInspektion></InspizierteAbwassertechnischeAnlage>
<InspizierteAbwassertechnischeAnlage><Objektbezeichnung>H1</Objektbezeichnung>
<OptischeInspektion><Auftragskennung>7</Auftragskennung><Inspektionsdatum>2026-09-14</Inspektionsdatum>
<NameUntersucher>M\u00fcller</NameUntersucher><Wetter>9</Wetter><Videoablagereferenz>3</Videoablagereferenz>
<Rohrleitung><Inspektionsrichtung>U</Inspektionsrichtung><Inspektionslaenge>40.00</Inspektionslaenge>
<ArtVideoreferenz>1</ArtVideoreferenz><Inspektionsdaten>
<RZustand><Station>0.00</Station><Timecode>00010512</Timecode><InspektionsKode>BCD</InspektionsKode><Charakterisierung1>XP</Charakterisierung1></RZustand>
<RZustand><Station>7,25</Station><Timecode>01020304</Timecode><InspektionsKode>BAF</InspektionsKode><Verbindung>1</Verbindung><Quantifizierung1Text>&gt;5</Quantifizierung1Text><Streckenschaden>A</Streckenschaden><StreckenschadenLfdNr>01</StreckenschadenLfdNr><PositionVon>11</PositionVon><PositionBis>00</PositionBis><Fotodatei>b.jpg</Fotodatei><Kommentar>n\u00e4sse</Kommentar></RZustand>
<RZustand><Station>weit</Station><InspektionsKode>BAC</InspektionsKode></RZustand>
<RZustand><Station>30</Station><InspektionsKode>BDC</InspektionsKode><GrundAbbruch>AV</GrundAbbruch></RZustand>
</Inspektionsdaten></Rohrleitung></OptischeInspektion></InspizierteAbwassertechnischeAnlage>
<Filme><Film><Filmname>f.mpg</Filmname><Videoablagereferenz>3</Videoablagereferenz></Film></Filme>
</Zustandsdatenkollektiv></Datenkollektive></Identifikation>"""


@pytest.mark.parametrize(
    "namespace",
    ["http://www.ofd-hannover.la/Identifikation", "http://www.bfr-abwasser.de", "http://of.2006"],
)
def test_isybau_is_read_in_any_of_its_namespaces(namespace: str) -> None:
    file = read(ISYBAU.replace("NAMESPACE", namespace), "latin-1")
    (survey,) = file.surveys
    assert [ENGLISH.caveat(it).partition(": ")[2] for it in file.warnings] == [
        "The inspection of S1 is of no pipe; it is left out."
    ]
    header = dict(survey.header)
    assert header.pop("end_lat") == pytest.approx(51.4346, abs=0.001), "Gauss-Kruger, zone 3"
    assert header.pop("start_lon") == pytest.approx(9.0006, abs=0.0005), "UTM, zone 32"
    assert header.pop("start_lat") == pytest.approx(51.4512, abs=0.001)
    assert header.pop("end_lon") == pytest.approx(9.0, abs=0.002)
    assert header == {
        "asset_id": "H1", "start_node": "S2", "end_node": "S1", "direction": "against_flow",
        "date": "2026-09-14", "operator": "M\u00fcller", "shape": "circular", "height_mm": 500.0,
        "material": "concrete", "standard": "EN 13508-2", "end_condition": "abandoned",
        "abandon_reason": "client waives", "video_files": "f.mpg", "job_ref": "Los 1",
        "known_length_m": 41.5, "year": 1961.0, "isybau_wetter": "9",
        "isybau_entwaesserungsart": "KX",
    }  # fmt: skip
    assert survey.surveyed_m == 40.0
    first, wet, _ = survey.observations
    assert first.time_s == 65.0
    assert (wet.distance_m, wet.time_s, wet.at_joint, wet.stretch) == (7.25, 3723.0, True, "A1")
    assert (wet.clock_from, wet.clock_to, wet.photo) == (11, None, "b.jpg")
    assert wet.remark == "n\u00e4sse, quantity >5"
    for sentence in ("Weather: '9' is not known", "No distance can be read from 'weit'"):
        assert sentence in told(survey)


def test_an_asset_without_a_name_has_that_of_its_ends() -> None:
    pipe = "<HG003>23021</HG003><HG004>22369</HG004><HG107>1.25</HG107>"
    run = "<HI104>2014-04-22</HI104><HI101>{}</HI101><HI117>x</HI117>"
    rows = "<HZ><HZ001>9.8</HZ001><HZ002>BBA</HZ002><HZ999>by station 12 m</HZ999></HZ>"
    runs = "".join(f"<HI>{run.format(letter)}{rows}</HI>" for letter in "IG")
    one, other = read(f"<DATA><HG>{pipe}{runs}</HG></DATA>").surveys
    assert one.name == other.name == "23021-22369 2014-04-22"
    assert (one.header["start_node"], other.header["start_node"]) == ("23021", "22369")
    assert (one.observations[0].distance_m, one.observations[0].remark) == (9.8, "by station 12 m")
    assert [ENGLISH.caveat(caveat) for caveat in one.warnings] == [
        "These elements are not read and are left out: HG107, HI117.",
    ]
    (nameless,) = read("<DATA><ZB><AAD>R1</AAD><AAF>R2</AAF></ZB></DATA>").surveys
    assert nameless.header["asset_id"] == "R1-R2"


def test_cells_and_fields_that_cannot_be_parsed_are_words() -> None:
    m150 = (
        "<DATA><HG><HG001>H1</HG001><HG306>wide</HG306><HI><HI104>May 2014</HI104><HI103>9</HI103>"
        "<HI107>X</HI107><HZ><HZ001>1</HZ001><HZ002>BAB</HZ002><HZ003>&gt;5</HZ003>"
        "<HZ006>6.5</HZ006><HZ008>late</HZ008></HZ></HI></HG></DATA>"
    )
    isybau = (
        "<Identifikation><Datenkollektive><Zustandsdatenkollektiv>"
        "<InspizierteAbwassertechnischeAnlage><Objektbezeichnung>H1</Objektbezeichnung>"
        "<OptischeInspektion><Inspektionsdatum>May 2014</Inspektionsdatum><Rohrleitung>"
        "<RGrunddaten><Profilbreite>wide</Profilbreite></RGrunddaten><Inspektionsdaten><RZustand>"
        "<Station>1</Station><InspektionsKode>BAB</InspektionsKode><Timecode>late</Timecode>"
        "<Quantifizierung1Text>&gt;5</Quantifizierung1Text><PositionVon>6.5</PositionVon>"
        "<Gruppe>3</Gruppe></RZustand></Inspektionsdaten></Rohrleitung></OptischeInspektion>"
        "</InspizierteAbwassertechnischeAnlage></Zustandsdatenkollektiv></Datenkollektive>"
        "</Identifikation>"
    )
    for text in (m150, isybau):
        (survey,) = read(text).surveys
        assert survey.observations[0].remark == "quantity >5, clock 6.5, video late"
        assert {"date: May 2014", "width_mm: wide"} <= {*survey.header["remarks"].split(", ")}
        keys = [caveat.key for caveat in survey.warnings]
        assert {"no_hour", "no_video_time", "impossible_field"} <= {*keys}
    assert read(m150).surveys[0].header["m150_hi103"] == "9"
    assert "left out: Gruppe." in told(survey)


def test_every_film_of_a_survey_is_kept() -> None:
    rows = "".join(
        f"<ZC><I>{n}</I><A>BAB</A><N>{name}|00:00:0{n}</N></ZC>" for n, name in enumerate("aab")
    )
    (survey,) = read(f"<DATA><ZB_A><AAA>S-1</AAA>{rows}</ZB_A></DATA>").surveys
    assert survey.header["video_files"] == "a"
    assert [row.remark for row in survey.observations] == ["", "", "film b"]
    film = "<Film><Filmname>f.mpg</Filmname><Videoablagereferenz>3</Videoablagereferenz></Film>"
    more = ISYBAU.replace(film, film + film.replace("f.mpg", "g.mpg"))
    assert read(more, "latin-1").surveys[0].header["video_files"] == "f.mpg, g.mpg"


def test_parts_that_are_no_inspection_are_named() -> None:
    bare = "<HG><HG001>H2</HG001></HG>"
    file = read(f"<DATA><FD/><ST><ST001>1</ST001></ST>{bare}{bare}</DATA>")
    assert [ENGLISH.caveat(it) for it in file.warnings] == [
        "These elements are not read and are left out: ST.",
        "2 pipes have no inspection and are left out.",
    ]
    other = read("<DATA><ZA/><ZB><AAA>1</AAA></ZB><ZX><A>1</A></ZX></DATA>")
    assert ENGLISH.caveat(other.warnings[0]).endswith("left out: ZX.")


M150 = """<?xml version="1.0" encoding="ISO-8859-1"?>
<DATA><FD><FD001>04-2010</FD001></FD><KG><KG001>K1</KG001><KI/></KG>
<HG><HG001>H9</HG001><HG003>K1</HG003><HG004>K2</HG004><HG302>M</HG302><HG307>800</HG307>
<GO><GP><GP001>K1</GP001><GP002>UTM</GP002><GP005>32500000,0</GP005><GP006>5700000</GP006></GP>
<GP><GP001>K2</GP001><GP003>7</GP003><GP004>8</GP004></GP></GO>
<HI><HI101>LETTER</HI101><HI104>14.09.2026</HI104><HI106>3</HI106><HI116>d.mpg</HI116>
<HZ><HZ001>9.8</HZ001><HZ002>BAJ</HZ002><HZ003>18.0</HZ003><HZ008>00:02:01</HZ008>
<HZ010>l\u00e4ngs</HZ010><HZ011>A</HZ011><HZ206>3</HZ206>
<HZ999>station 9.75 m, quantity 1 18.04</HZ999></HZ>
<HZ><HZ001>12,5</HZ001><HZ002>BAB</HZ002><HZ999>breit 2 m</HZ999></HZ></HI><HI/></HG></DATA>"""


@pytest.mark.parametrize(
    ("letter", "direction"),
    [("I", "with_flow"), ("O", "with_flow"), ("G", "against_flow"), ("U", "against_flow")],
)
def test_m150_is_read_with_all_four_letters_of_the_direction(letter: str, direction: str) -> None:
    file = read(M150.replace("LETTER", letter), "latin-1")
    survey, empty = file.surveys
    assert "manholes (KI)" in ENGLISH.caveat(file.warnings[0])
    assert survey.header["direction"] == direction
    node = "start" if direction == "with_flow" else "end"
    assert survey.header[f"{node}_node"] == "K1"
    assert survey.header[f"{node}_lon"] == pytest.approx(9.0)
    assert "names no known zone" in told(survey)
    joint, later = survey.observations
    assert (joint.distance_m, joint.quant1, joint.time_s) == (9.75, 18.04, 121.0)
    assert (joint.at_joint, joint.remark) == (True, "l\u00e4ngs, class 3")
    assert (later.distance_m, later.remark) == (12.5, "breit 2 m")
    known = {name: survey.header[name] for name in ("date", "weather", "asset_type", "video_files")}
    assert known == {
        "date": "2026-09-14", "weather": "frost", "asset_type": "combined", "video_files": "d.mpg",
    }  # fmt: skip
    assert empty.observations == ()


def test_letters_are_read_whatever_the_file_declares() -> None:
    plain = "<DATA><ZB><AAA>Gro\u00df</AAA></ZB></DATA>"
    for declared, encoding in (
        ("", "utf-8"), ("", "latin-1"), ("UTF-8", "latin-1"), ("ISO-8859-1", "utf-8"),
        ("windows-1252", "cp1252"), ("UTF-16", "utf-16"),
    ):  # fmt: skip
        head = f'<?xml version="1.0" encoding="{declared}"?>' if declared else ""
        assert read(head + plain, encoding).surveys[0].header["asset_id"] == "Gro\u00df", declared


@pytest.mark.parametrize(
    "hostile",
    [
        b'<!DOCTYPE DATA SYSTEM "file:///etc/passwd"><DATA><ZB><AAA>C</AAA></ZB></DATA>',
        b'<!DOCTYPE d [<!ENTITY x SYSTEM "file:///etc/passwd">]><DATA><HG>&x;</HG></DATA>',
        '<!DOCTYPE d [<!ENTITY a "ha">]><DATA><HG>&a;</HG></DATA>'.encode("utf-16"),
    ],
    ids=["another file", "an entity of another file", "in UTF-16"],
)
def test_xml_that_defines_anything_is_refused_with_its_line(hostile: bytes) -> None:
    with pytest.raises(InvalidImport, match=r"Line 1: .* document type or entities"):
        any_file.read(hostile)


@pytest.mark.parametrize(
    ("odd", "why"),
    [
        (b"<DATA><ZB>" + b"<A>" * 100, "nested too deeply"),
        (b"<DATA>" + b" " * 33 * any_file.MIB + b"</DATA>", "may have 32"),
        (b"<DATA><ZB></DATA>", "mismatched tag in line 1"),
        (b"<html></html>", "begins with html"),
        (b'<?xml version="1.0" encoding="nonsense"?><DATA>\xff</DATA>', "cannot be read|encoding"),
    ],
    ids=["deep", "large", "torn", "another kind", "unknown letters"],
)
def test_xml_that_is_no_survey_is_refused_in_a_sentence(odd: bytes, why: str) -> None:
    with pytest.raises(InvalidImport, match=why):
        any_file.read(odd)


@pytest.mark.parametrize(
    "text",
    ["<Identifikation/>", "<DATA><HG/></DATA>", "<DATA><ZB_C><CAA>x</CAA></ZB_C></DATA>"],
)
def test_a_file_without_an_inspection_of_a_pipe_has_no_survey(text: str) -> None:
    assert read(text).surveys == ()
