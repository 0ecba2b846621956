"""Tables as owners of pipes keep them: what their columns hold, in which units."""

from __future__ import annotations

import pytest

from app.errors import InvalidTable
from app.survey.assets.register_table import columns_of, read_table


def meanings(text: str, encoding: str = "utf-8") -> list[str]:
    """What the columns hold, as `columns_of` takes it."""
    columns = [named.column for named in read_table(text.encode(encoding)).columns]
    return [
        "" if column is None else ":".join(filter(None, (column.field, column.unit)))
        for column in columns
    ]


PIPE = "asset_id start_node end_node diameter_mm:{0} material known_length_m:{1}"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (
            "Haltung;Von Schacht;Bis Schacht;DN;Material;Länge\nH1;S1;S2;300;Steinzeug;33,90\n",
            PIPE.format("mm", "m"),
        ),
        (
            "Pipe ID,US MH,DS MH,Dia (in),Matl,Length (ft)\nP-1,MH1,MH2,12,VCP,162.9\n",
            PIPE.format("in", "ft"),
        ),
        # A unit that no name states: by the numbers, and feet go with inches.
        (
            "FACILITYID,FROM_MH,TO_MH,DIAMETER,PIPETYPE,LEN\nP-1,M1,M2,12,PVC,162.9\n",
            PIPE.format("in", "ft"),
        ),
        (
            "Nama;Dari;Ke;Garis pusat;Bahan;Panjang\nG1;A;B;0,6;konkrit;12,5\n",
            PIPE.format("m", "m"),
        ),
        # Names that say nothing: by the cells.
        (
            "a;b;c;d;e;f\nP1;N1;N2;300;Beton;12,3\nP2;N2;N3;250;PVC;45,6\nP3;N3;N4;400;Stz;3,1\n",
            PIPE.format("mm", "m"),
        ),
        (
            "Profilart;Breite [cm];Höhe [cm];Baujahr;Kanalart;Bemerkung\n"
            "Kreisprofil;30;30;1998-05-01;Regenwasser;x\nEi;40;60;1960;Mischwasser;x\n",
            "shape width_mm:cm height_mm:cm year asset_type -",
        ),
        # Exchange formats name their columns by codes.
        (
            "HG001;HG307;HG310;HG304\nH1;300;12,5;B\n",
            "asset_id height_mm:mm known_length_m:m material",
        ),
        (
            "FACILITYID,FROMMH,TOMH,UPELEV,SLOPE,MAINSHAPE,LININGTYPE,OWNEDBY\n"
            "P-1,M1,M2,101.25,0.45,Circular,CIPP,City\n",
            "asset_id start_node end_node - - shape lining_type client",
        ),
        (
            "haltnam;schoben;schunten;hoehe;laenge;profilnam;entwart\n"
            "H1;S1;S2;0,3;12,5;Kreisquerschnitt;Regenwasser\n",
            "asset_id start_node end_node height_mm:m known_length_m:m shape asset_type",
        ),
        ("PLR,MH from,MH to,Spalte 4,Spalte 5\nP1,M1,M2,1998,300\n",
         "asset_id start_node end_node year diameter_mm:mm"),
        # SW is foul in one country and storm in another: nobody guesses.
        ("Haltung;Kanalart\nH1;SW\nH2;RW\nH3;MW\n", "asset_id -"),
        # A name that its cells contradict, and an id that is none.
        ("OBJECTID,Pipe,Length,Matl\n1,A-1,long,4\n2,A-2,short,5\n", "- asset_id - -"),
    ],
)  # fmt: skip
def test_what_columns_hold_is_guessed_by_names_and_cells(text: str, expected: str) -> None:
    assert " ".join(name or "-" for name in meanings(text)) == expected


@pytest.mark.parametrize("encoding", ["utf-8-sig", "cp1252", "utf-16"])
def test_lengths_are_read_in_their_units(encoding: str) -> None:
    text = 'Rohr;Größe (in);Länge (ft)\nA;12;100\nB;DN 300 mm;1.234,5\nC;18";30 m\n'
    table = read_table(
        text.encode(encoding), columns_of(["asset_id", "diameter_mm:in", "known_length_m:ft"])
    )
    assert [(each.asset_id, dict(each.values)) for each in table.stated] == [
        ("A", {"height_mm": 304.8, "shape": "circular", "known_length_m": 30.48}),
        ("B", {"height_mm": 300, "shape": "circular", "known_length_m": 376.2756}),
        ("C", {"height_mm": 457.2, "shape": "circular", "known_length_m": 30}),
    ]  # fmt: skip


def test_a_quoted_comma_is_a_decimal_one_unless_it_may_separate_thousands() -> None:
    columns = columns_of(["asset_id", "known_length_m"])
    table = read_table(b'pipe,length\nA,"12,5"\nB,"1,234.5"\nC,"1,200"\n', columns)
    assert [each.values["known_length_m"] for each in table.stated] == [12.5, 1234.5]
    assert [(fault.row, fault.column) for fault in table.faults] == [(4, "known_length_m")]


def test_a_stated_shape_counts_before_that_of_a_diameter() -> None:
    text = "id;dn;form\nA;300;\nB;300;Ei\nC;;Ei\n"
    table = read_table(text.encode(), columns_of(["asset_id", "diameter_mm", "shape"]))
    assert [(each.values["shape"], each.values["height_mm"]) for each in table.stated] == [
        ("circular", 300), ("egg", 300), ("egg", None),
    ]  # fmt: skip


def test_a_title_may_stand_above_the_names() -> None:
    table = read_table(b"Haltungsliste Au;;\n\n;2026;\nHaltung;DN;Material\nH1;300;PVC\n")
    assert [(each.row, each.asset_id, each.values["height_mm"]) for each in table.stated] == [
        (5, "H1", 300)
    ]
    (only,) = read_table(b"Haltung\nH1\n").stated
    assert only.asset_id == "H1"


def test_a_section_without_an_id_is_named_by_its_nodes() -> None:
    table = read_table(b"Von Schacht;Bis Schacht;DN\nS1;S2;300\nS2;;300\n")
    assert [each.asset_id for each in table.stated] == ["S1-S2", "S2"]


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        (["asset_id", "colour"], "cannot hold 'colour'"),
        (["asset_id", "year:in"], "cannot hold 'year:in'"),
        (["asset_id", "height_mm:yd"], "cannot hold 'height_mm:yd'"),
        (["shape", "shape"], "Two columns hold shape"),
        (["asset_id"], "1 columns are stated, the table has 2"),
    ],
)
def test_columns_that_are_not_those_of_the_table_are_refused(columns: list[str], said: str) -> None:
    with pytest.raises(InvalidTable, match=said):
        read_table(b"a,b\nA,1\n", columns_of(columns))
