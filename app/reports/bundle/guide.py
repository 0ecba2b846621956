"""The guide of a delivery, for people who open its folder: a page, and a plain text."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from jinja2 import Environment, PackageLoader, StrictUndefined

from app.reports.content.translator import Translator
from app.reports.content.words import LANGUAGES
from app.reports.report import Loss
from app.reports.text.ascii import one_line
from app.reports.text.legible import legible


@dataclass(frozen=True)
class Film:
    """The film of an inspection."""

    name: str
    """What the exchange file calls it."""
    original: str
    """Its name where it came from."""
    size: int
    sha256: str
    """Empty where this server does not have the film."""
    is_there: bool
    """Whether it is in the delivery."""


@dataclass(frozen=True)
class Exchange:
    """The exchange file."""

    name: str
    kind: str
    """Name of its format in `FORMATS`."""
    inspections: int
    """How many inspections it has."""

    def sentence(self, t: Translator) -> str:
        """Say what it is."""
        kind = t.one_of("format", self.kind)
        if self.inspections == 1:
            return t("delivery.exchange", kind=kind)
        return t("delivery.exchange_of_all", kind=kind, n=self.inspections)


@dataclass(frozen=True)
class Delivered:
    """One inspection of a delivery, and the names of its files."""

    name: str
    asset: str
    report: str
    """Path of the report; that of the page follows."""
    page: str
    photos: int
    """Number of photos and drawings."""
    film: Film | None
    losses: tuple[Loss, ...]
    """What the files of the inspection could not hold."""

    @property
    def title(self) -> str:
        """Asset and inspection, on one line."""
        names = dict.fromkeys((self.asset, self.name))
        return one_line(legible(" · ".join(names)))


_TEMPLATES = Environment(
    loader=PackageLoader("app.reports.html"),
    autoescape=True,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
)


def page(exchange: Exchange | None, delivered: Sequence[Delivered]) -> str:
    """Return the page, in every language of the reports."""
    template = _TEMPLATES.get_template("guide.html")
    return template.render(
        exchange=exchange, delivered=delivered, guides=_translators(), sentence=film_sentence
    )


def text(exchange: Exchange | None, delivered: Sequence[Delivered]) -> str:
    """Return the plain text, in every language of the reports; lines end as Windows wants it."""
    lines: list[str] = []
    for t in _translators():
        lines += [t("delivery.title"), "", t("delivery.exchange_help"), t("delivery.check"), ""]
        if exchange is not None:
            lines += [f"{exchange.name}: {exchange.sentence(t)}", ""]
        for one in delivered:
            lines += [*_lines(one, t), ""]
        lines += ["-" * 70, ""]
    return "\r\n".join(lines)


def film_sentence(film: Film, t: Translator) -> str:
    """Say where the film is."""
    if film.is_there:
        return t("delivery.film_there", name=film.name)
    if not film.sha256:
        return t("delivery.film_unknown", name=film.name)
    return t(
        "delivery.film_away",
        name=film.name,
        original=one_line(legible(film.original)),
        size=f"{film.size:,}".replace(",", " "),
        sha256=film.sha256,
    )


def _lines(one: Delivered, t: Translator) -> Iterator[str]:
    yield one.title
    for name, file in (("report", one.report), ("page", one.page)):
        yield f"  {file}: {t(f'delivery.{name}')}"
    yield f"  {t('delivery.photos', n=one.photos)}"
    if one.film is not None:
        yield f"  {film_sentence(one.film, t)}"
    if one.losses:
        yield f"  {t('delivery.losses', n=len(one.losses))}:"
        yield from (f"    {one_line(t.loss(loss))}" for loss in one.losses)


def _translators() -> list[Translator]:
    return [Translator(language, "m") for language in LANGUAGES]
