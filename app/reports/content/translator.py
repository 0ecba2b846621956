"""Formats figures, places and fields in the language and units of the report."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from decimal import Decimal
from typing import Any

from app.imports.surveys.survey import Caveat
from app.reports.content.sizes import figure_text
from app.reports.content.words import Language, words_of
from app.reports.report import Entry, Loss, Phrase, Report, Taken, Units, says_source
from app.reports.text.typesetting import one_line
from app.survey.adjustment.adjusted_track import Refusal
from app.survey.distances.interval import half_width_text
from app.survey.observations.checks import Issue
from app.survey.observations.records import NOT_NOTIFIED, Event
from app.survey.observations.undelivered import Undelivered
from app.survey.rounding import decimals, rounded

FOOT_M = 0.3048
NOTHING = "–"
_ALL_ROUND = "12–12"
_DAY = re.compile(r"(?P<year>\d{4})-(?P<month>\d\d)-(?P<day>\d\d)")


class Translator:
    """The words and units of a report; a call with the key of a sentence returns it."""

    def __init__(self, language: Language, units: Units) -> None:
        self.language = language
        self.units = units
        self._words = words_of(language)

    @classmethod
    def of(cls, report: Report) -> Translator:
        """Make the translator for a report."""
        return cls(report.language, report.units)

    def __call__(self, key: str, /, **values: object) -> str:
        """Return the sentence of this key with its values."""
        written = {
            name: self.figure(value) if isinstance(value, float) else value
            for name, value in values.items()
        }
        return self._words[key].format_map(written)

    def one_of(self, area: str, name: object, otherwise: str | None = None) -> str:
        """Return the word for a value if there is one, else the value itself."""
        return self._words.get(f"{area}.{name}", str(name) if otherwise is None else otherwise)

    def refusal(self, refusal: Refusal) -> str:
        """Return why joints do not count."""
        key = f"refusal.{refusal.reason}"
        return self(key, **refusal.values) if key in self._words else refusal.sentence

    def remark(self, event: Event) -> str:
        """Return the remark of an event: what a person wrote, or the server's own in our words."""
        reason = Undelivered.read(event.remark) if event.action == NOT_NOTIFIED else None
        if reason is None:
            return event.remark or ""
        return self(f"undelivered.{reason.code}", **reason.values)

    def loss(self, loss: Loss) -> str:
        """Return the sentence about something that a format cannot hold."""
        number = {"seq": loss.entry.number} if loss.entry else {}
        return self(f"loss.{loss.key}", **number, **self._spoken(loss.values))

    def phrase(self, value: object) -> str:
        """Return the words of a phrase, a loss, several of them, or a plain value."""
        if isinstance(value, tuple):
            return ", ".join(map(self.phrase, value))
        if isinstance(value, Loss):
            return self.loss(value)
        if not isinstance(value, Phrase):
            return str(value)
        if value.key in self._words:
            return self(value.key, **self._spoken(value.values))
        return value.otherwise or value.key

    def _spoken(self, values: Mapping[str, object]) -> dict[str, str]:
        return {name: self.phrase(value) for name, value in values.items()}

    def caveat(self, caveat: Caveat) -> str:
        """Return the sentence about something odd in an imported file."""
        values: dict[str, object] = {
            name: value
            if isinstance(value, str | int)
            else ", ".join(self(f"brought.{one}") for one in value)
            for name, value in caveat.values.items()
        }
        if "field" in values:
            values["field"] = self._attribute_or_field(str(values["field"]))
        said = self(f"caveat.{caveat.key}", **values)
        if caveat.line is not None:
            said = self("caveat.at_line", line=caveat.line, said=said)
        if caveat.survey is not None:
            said = self("caveat.of_survey", survey=caveat.survey, said=said)
        return said

    def nothing_imported(self, caveats: Sequence[Caveat]) -> str:
        """Return why no survey of a file can be imported: the first caveat, if there is one."""
        said = [self("caveat.nothing_imported"), *map(self.caveat, caveats[:1])]
        return " ".join(said)

    @property
    def per_unit_m(self) -> float:
        """Metres in the unit of distances."""
        return FOOT_M if self.units == "ft" else 1.0

    def local(self, figures: str) -> str:
        """Return figures as the language writes them, given with a decimal point."""
        signs = {"point": ".", "group": ","}
        return figures.translate({ord(sign): self(f"figures.{k}") for k, sign in signs.items()})

    def figure(self, value: float, digits: int | None = None) -> str:
        """Format a number with so many decimals, or with those that it has."""
        # Six digits would round what the tables state.
        return self.local(f"{value:.10g}" if digits is None else decimals(value, digits))

    def amount(self, cost: float) -> str:
        """Format a cost without its currency."""
        return self.local(f"{Decimal(decimals(cost, 2)):,}")

    def money(self, cost: float, currency: str) -> str:
        """Format a cost with its currency."""
        return self("figures.money", amount=self.amount(cost), currency=currency)

    def date(self, stated: str) -> str:
        """Format a day that is stated as 2026-09-14; anything else stays as it is."""
        day = _DAY.fullmatch(stated)
        return self("figures.date", **day.groupdict()) if day else stated

    def number(self, metres: float) -> str:
        """Format a distance without its unit: metres with two decimals, feet with one."""
        return self.local(decimals(metres, self._digits, unit=self.per_unit_m))

    def length(self, metres: float | None) -> str:
        """Format a distance with its unit."""
        return NOTHING if metres is None else f"{self.number(metres)} {self.units}"

    def half_width(self, metres: float) -> str:
        """Format half of a 95 % interval, without its unit."""
        text = half_width_text(metres, unit_m=self.per_unit_m, digits=self._digits)
        return self.local(text)

    def cells(self, at: Entry) -> tuple[float | None, float | None]:
        """Return distance and half-width as numbers for a sheet, rounded as they are printed."""
        if at.distance_m is None:
            return None, None
        distance = rounded(at.distance_m / self.per_unit_m, self._digits)
        if at.u95_m is None:
            return distance, None
        half = half_width_text(at.u95_m, unit_m=self.per_unit_m, digits=self._digits)
        return distance, float(half)

    @property
    def _digits(self) -> int:
        return 1 if self.units == "ft" else 2

    def place(self, at: Entry | Taken) -> str:
        """Format the place of an entry or a photo: `12.40 m ± 0.05 m (by the counter)`.

        The camera as its source is not named, nor that of a survey without intervals, which came
        from elsewhere as a whole.
        """
        if at.distance_m is None:
            return self("entry.not_tracked")
        text = self.length(at.distance_m)
        if at.u95_m is not None:
            text += f" ± {self.half_width(at.u95_m)} {self.units}"
        return f"{text} ({self.source(at.source)})" if says_source(at) else text

    def source(self, source: str | None) -> str:
        """Name what a distance rests on; empty where it is not known."""
        return self(f"source.{source}") if source else ""

    def place_in_photo(self, entry: Entry, taken: Taken | None) -> str:
        """Format the place that a photo shows: the entry's, or where else it was taken."""
        return self.place(entry) if taken is None else self("photos.taken", at=self.place(taken))

    def short_place(self, entry: Entry) -> str:
        """Format the place with the unit once, for tables: `12.40 ± 0.05 m`."""
        return self.place(entry).replace(f" {self.units} ±", " ±")

    def number_of(self, entry: Entry) -> str:
        """Return the number of an entry."""
        return self("check.number", seq=entry.number)

    def code(self, entry: Entry) -> str:
        """Return the code with its characters."""
        parts = (entry.tag.code, entry.tag.char1, entry.tag.char2)
        return " ".join(one_line(str(part)) for part in parts if part) or self("entry.no_code")

    def burnt_in(self, entry: Entry, taken: Taken | None) -> str:
        """Return what is burnt into a photo: `12.40 m ± 0.05 m   BAB B A   at 12 o'clock`."""
        place = self.place_in_photo(entry, taken)
        parts = (place, self.code(entry), self.clock_in_words(entry))
        return "   ".join(part for part in parts if part)

    def label(self, entry: Entry) -> str:
        """Return the meaning of the code."""
        return entry.label(self.language) or (
            self("entry.unknown_code") if entry.tag.code else self("entry.to_complete")
        )

    def clock(self, entry: Entry) -> str:
        """Format the clock position, seen in the direction of travel."""
        if entry.clock_from is None:
            return ""
        if entry.tag.clock_to is None:
            return str(entry.clock_from)
        return f"{entry.clock_from}–{entry.tag.clock_to}"

    def clock_in_words(self, entry: Entry) -> str:
        """Format the clock position for a sentence."""
        if not (clock := self.clock(entry)):
            return ""
        return self("entry.all_round" if clock == _ALL_ROUND else "entry.clock", clock=clock)

    def quantities(self, entry: Entry) -> list[str]:
        """Return the quantities with units."""
        both = ((entry.tag.quant1, entry.unit1), (entry.tag.quant2, entry.unit2))
        return [self.with_unit(value, unit) for value, unit in both if value is not None]

    def with_unit(self, value: float, unit: str | None) -> str:
        """Format a quantity with its unit, such as `12 %`; degrees stand at the number."""
        number = self.figure(value)
        if unit == "deg":
            return f"{number}°"
        return number if unit in (None, "count") else f"{number} {unit}"

    def sizes(self, entry: Entry) -> list[str]:
        """Return what was measured on the wall: `Width 23 ± 2 mm`."""
        return [
            " ".join([self.one_of("measure", figure.kind), self.local(figure_text(figure))])
            for figure in entry.figures
            if figure
        ]

    def stretch(self, entry: Entry) -> str:
        """Format the stretch mark: `A1` for the start of stretch 1, C for a change, B for its
        finish.
        """
        if entry.cont_id is None or entry.cont_role is None:
            return ""
        letter = {"start": "A", "change": "C", "finish": "B"}[entry.cont_role]
        return f"{letter}{entry.cont_id}"

    def time(self, seconds: float | None) -> str:
        """Format a time in the film, down to tenths: `1:02:03.4`."""
        if seconds is None:
            return ""
        minutes, tenths = divmod(int(10 * seconds + 1e-6), 600)
        hours, minute = divmod(minutes, 60)
        second = self.local(f"{tenths / 10:04.1f}")
        return f"{hours}:{minute:02}:{second}" if hours else f"{minute}:{second}"

    def instant(self, at: datetime) -> str:
        """Format day and time in UTC."""
        day, time = f"{at.astimezone(UTC):%Y-%m-%d %H:%M}".split()
        return f"{self.date(day)} {time} UTC"

    def review(self, report: Report) -> str:
        """Return the state of the review, and who has set it when."""
        state = self(f"review.{report.review}")
        if report.reviewed_by is None or report.reviewed_at is None:
            return state
        return self(
            "review.by", state=state, who=report.reviewed_by, at=self.instant(report.reviewed_at)
        )

    def reference(self, report: Report) -> str:
        """Return the reference point of distances."""
        value = report.header.get("reference_point")
        return str(value) if value else self("observations.no_reference")

    def action(self, event: Event) -> str:
        """Return what an event did."""
        subject = "inspection" if event.observation_id is None else "observation"
        return self.one_of("action", f"{subject}_{event.action}")

    def severity(self, severity: int | None) -> str:
        """Return the word for a severity."""
        return self("severity.none") if severity is None else self.one_of("severity", severity)

    def field(self, name: str) -> str:
        """Return the name of a header field."""
        return self.one_of("field", name, one_line(name.replace("_", " ").capitalize()))

    def value(self, name: str, value: Any) -> str:
        """Format the value of a header field."""
        if isinstance(value, bool):
            return self("choice.yes" if value else "choice.no")
        if isinstance(value, int | float):
            return self._quantity(name, value)
        return self.one_of("choice", self.date(value)) if isinstance(value, str) else str(value)

    def issue(self, issue: Issue, numbers: dict[str, Entry]) -> str:
        """Describe an issue.

        Args:
            issue: An issue from the checks.
            numbers: Entries by their id; without its entry an observation has only its number.
        """
        values: dict[str, object] = dict(issue.params)
        entry = numbers.get(issue.observation_id or "")
        if entry is not None:
            values["name"] = self._name(entry)
        elif "seq" in values:
            values["name"] = self("check.number", seq=values["seq"])
        else:
            values["name"] = self("check.an_observation")
        if "field" in values:
            values["field"] = self._attribute_or_field(str(values["field"]))
        if "complaint" in values:
            values["complaint"] = self.one_of("complaint", values["complaint"])
        for name in ("short_m", "known_length_m"):
            if isinstance(length := values.get(name), int | float):
                values[name] = self.length(length)
        return self(f"check.{issue.code}", **values)

    def _attribute_or_field(self, name: str) -> str:
        """Return the word for an attribute of an observation, else for a header field."""
        return self.one_of("attribute", name, "") or self.field(name)

    def _name(self, entry: Entry) -> str:
        if entry.distance_m is None:
            return self.number_of(entry)
        return self("check.number_at", seq=entry.number, place=self.length(entry.distance_m))

    def _quantity(self, name: str, value: float) -> str:
        if not math.isfinite(value):
            return str(value)
        if name.endswith("_m"):
            return self.length(value)
        for ending, unit in (("_mm", "mm"), ("_pct", "%"), ("_c", "°C")):
            if name.endswith(ending):
                return self.with_unit(value, unit)
        if name.endswith(("_lat", "_lon")):
            return self.with_unit(float(f"{value:.7f}"), "deg")
        return f"{value:.10g}" if name == "year" else self.figure(value)
