"""Reports with random content, for hypothesis."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta
from typing import Any

from hypothesis import strategies as st
from reports import LENGTH_M, entry, report, track_of

from app.reports.content.words import LANGUAGES
from app.reports.report import Entry, Report, Source
from app.survey.catalogue import built_in
from app.survey.fields.header import FIELDS, HeaderField, faults
from app.survey.observations.records import Event

TEXTS = st.one_of(
    st.none(),
    # Everything, control characters and halves of surrogate pairs too.
    st.text(st.characters(codec=None, categories=None), max_size=40),
    st.sampled_from(
        ["", " ", "=1+1", "-12", "@SUM(A1)", "\tx", 'a "b", c; d', "<b>&amp;</b>", "]]>", "%s{}",
         "two\nlines\r\n", "\x00\x07", "a\ud800b", "钢筋 ظاهر", "x" * 10_000]
    ),
)  # fmt: skip
METRES = st.floats(-20, 500, allow_nan=False).map(lambda value: round(value, 3))
CODES = st.sampled_from(
    [("BAB", "B", "A"), ("BAJ", "B", None), ("BCD", "Z", None), ("XYZ", None, None),
     (None, None, None)]
)  # fmt: skip
INSTANTS = st.datetimes(datetime(2000, 1, 1), datetime(2090, 1, 1), timezones=st.just(UTC))
HEADERS = st.dictionaries(
    st.sampled_from(
        ["asset_id", "start_node", "end_node", "direction", "date", "time", "operator", "client",
         "material", "known_length_m", "height_mm", "cleaned", "start_lat", "start_lon", "remarks",
         "of_another_program"]
    ),
    st.one_of(TEXTS, st.booleans(), st.integers(-(2**53), 2**53), METRES),
)  # fmt: skip


def _values_of(field: HeaderField) -> st.SearchStrategy[Any]:
    match field.kind:
        case "choice":
            return st.sampled_from(field.choices)
        case "bool":
            return st.booleans()
        case "date":
            return st.dates().map(lambda day: day.isoformat())
        case "time":
            return st.times().map(lambda time: time.isoformat("minutes"))
        case "number":
            return st.floats(field.minimum, field.maximum).map(lambda value: round(value, 3))
        case "text":
            return st.sampled_from(
                [
                    "concrete",
                    "rain",
                    "none",
                    "Gro\u00dfe \u00b15 mm, \u94a2",
                    "12+340",
                    "a: b, year: 1987",
                    "x;y",
                ]
            )


STORED_HEADERS = st.fixed_dictionaries(
    {}, optional={field.name: _values_of(field) for field in FIELDS if field.unit != "\u00b0"}
).filter(lambda header: not faults(header))
"""Headers that the API accepts: any fields but places, in the kinds of values that they allow."""


@st.composite
def entries(draw: st.DrawFn) -> tuple[Entry, ...]:
    """Entries in the order of a report."""
    drawn: list[dict[str, Any]] = draw(
        st.lists(st.fixed_dictionaries({"distance_m": st.one_of(st.none(), METRES)}), max_size=6)
    )
    drawn.sort(key=lambda fields: (fields["distance_m"] is None, fields["distance_m"] or 0.0))
    return tuple(draw(_entry(seq, fields)) for seq, fields in enumerate(drawn, 1))


@st.composite
def _entry(draw: st.DrawFn, seq: int, fields: dict[str, Any]) -> Entry:
    code, char1, char2 = draw(CODES)
    quant = st.one_of(st.none(), st.floats(-1e6, 1e6))
    clock = st.one_of(st.none(), st.integers(1, 12))
    return entry(
        seq,
        **fields,
        code=code, char1=char1, char2=char2, kind=built_in().named(code, char1, char2),
        quant1=draw(quant), quant2=draw(quant), clock_from=draw(clock), clock_to=draw(clock),
        severity=draw(st.one_of(st.none(), st.integers(0, 5))),
        cont_id=draw(st.one_of(st.none(), st.integers(1, 3))),
        cont_role=draw(st.sampled_from(["start", "change", "finish"])),
        at_joint=draw(st.booleans()), joint_no=draw(st.one_of(st.none(), st.integers(1, 300))),
        remark=draw(TEXTS), tagged_by=draw(st.text(max_size=20)), tagged_at=draw(INSTANTS),
    )  # fmt: skip


@st.composite
def reports(draw: st.DrawFn) -> Report:
    """Any report that can be written: empty header, no track, no observations, odd text."""
    rows = draw(st.sampled_from([0, 3]))
    track = track_of(LENGTH_M, rows)
    who = draw(TEXTS)
    events = tuple(
        Event(
            inspection_id="0" * 32, action="corrected", who=who or "", at=at,
            before={}, after={"zero": {"frame": 1, "offset_m": 0.5}}, remark=draw(TEXTS),
        )
        for at in draw(st.lists(INSTANTS, max_size=2))
    )  # fmt: skip
    name = draw(TEXTS) or "x"
    made_at = draw(INSTANTS)
    video = {"width": 256, "height": 160, "frames": draw(st.one_of(st.none(), st.just(rows)))}
    return report(
        source=Source("upload", draw(TEXTS) or "x", 1, "ab" * 32, video),
        entries=draw(entries()), header=draw(HEADERS), name=name, track=track, raw_track=track,
        events=events, made_at=made_at, created_at=made_at - timedelta(hours=1),
        finished_at=draw(st.one_of(st.none(), INSTANTS)), warning=draw(TEXTS), error=draw(TEXTS),
        distance_m=LENGTH_M if rows else None, u95_m=0.08 if rows else None,
        raw_distance_m=24.649 if rows else None,
        language=draw(st.sampled_from(LANGUAGES)), units=draw(st.sampled_from(["m", "ft"])),
    )  # fmt: skip
