"""The report as one HTML file that opens from the disk, without a network.

Photos are data URIs in the file; the 3D view is a nested page, drawn on demand.  The policy in its
head forbids every request, and the templates escape all text.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from importlib import resources

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from app.reports.content import (
    condition,
    cover,
    measurement,
    pictures,
    sections,
    shown_photos,
    summary,
)
from app.reports.content.header import header_groups
from app.reports.content.translator import NOTHING, Translator
from app.reports.drawings import along, glance, pipe_graphic, survey_plan, svg
from app.reports.drawings.seen_wall import remarks_on, wall_of
from app.reports.drawings.unrolled_wall import wall_scale, wall_strips
from app.reports.report import Loss, Report, Written, failure
from app.reports.template import Section
from app.reports.text.legible import iso, legible
from vo_core.errors import ChainageError

ENOUGH_PX = 1280
"""Sufficient length of the longer side of a photo; a photo twice as large is reduced."""
MOST_WALL_BYTES = 6 * 2**20
"""Bytes of all pictures of the wall together, before base64, above which they are reduced."""

_POLICY = (
    "default-src 'none'",
    "style-src 'unsafe-inline'",
    "img-src data: blob:",
    "base-uri 'none'",
)
_SCENE_POLICY = (
    # A nested page inherits the policy of the outer one; viser's own is unpacked by inline scripts,
    # so that hashes cannot name them.
    "script-src 'unsafe-inline' 'wasm-unsafe-eval' blob: data:",
    "font-src data:",
    "worker-src blob: data:",
    "connect-src data: blob:",
    "frame-src 'self'",
)

_LOGO_PX = 480
_TITLES: Mapping[Section, str] = {"scene": "web.scene", "checks": "sign.title"}
"""Keys of the titles that are not called after their section."""

Rows = Sequence[tuple[str, str]]


def _legible(value: object) -> object:
    """Clean text printed by a template for any browser; markup stays unchanged."""
    return value if isinstance(value, Markup) else legible(str(value))


TEMPLATES = Environment(
    loader=PackageLoader("app.reports.html"),
    autoescape=True,
    finalize=_legible,
    undefined=StrictUndefined,
    trim_blocks=True,
    lstrip_blocks=True,
    keep_trailing_newline=True,
)


TEMPLATES.globals |= {
    module.__name__.rpartition(".")[2]: module
    for module in (
        condition, cover, measurement, pictures, summary,
        along, glance, pipe_graphic, survey_plan, svg, shown_photos,
    )
}  # fmt: skip
"""What the templates take from: the content of every format, and the drawings."""


def _base64(content: bytes) -> Markup:
    """Encode in base64, which cannot end the element or attribute that contains it."""
    return Markup(base64.b64encode(content).decode())  # noqa: S704


TEMPLATES.globals |= {
    "NOTHING": NOTHING,
    "content": sections,
    "ENOUGH_PX": ENOUGH_PX,
    "LOGO_PX": _LOGO_PX,
    "iso": iso,
    "base64": _base64,
}


def write(report: Report) -> Written:
    """Write the report in its language and units."""
    t, is_marked = Translator.of(report), report.extras.for_acceptance
    chosen = report.template.sections
    scene, losses = _scene(report) if "scene" in chosen else (None, ())
    shown = shown_photos.shown_photos(report) if "photos" in chosen else []
    page = TEMPLATES.get_template("web_page.html").render(
        report=report,
        t=t,
        policy=_policy(has_scene=scene is not None, has_form=is_marked),
        mark=mark_over(t) if is_marked else None,
        style=style(),
        script=_asset("web_page.js"),
        sections=[(section, t(_TITLES.get(section, f"{section}.title"))) for section in chosen],
        wall=_wall(report, t) if "wall" in chosen else None,
        shown=shown,
        photos_of=shown_photos.photos_by_entry(shown),
        scene=scene,
        header=header_groups(report, t),
        measured=_measured(report, t),
    )
    return Written(page.encode(), losses)


def mark_over(t: Translator) -> Markup:
    """Return the picture, in base64, that repeats "for acceptance" over a page."""
    text = escape(t("acceptance.mark"))
    return _base64(
        '<svg xmlns="http://www.w3.org/2000/svg" width="420" height="300"><text x="30" y="230" '
        'transform="rotate(-25 210 150)" font-family="sans-serif" font-size="34" '
        f'font-weight="600" fill="#17212b" fill-opacity=".09">{text}</text></svg>'.encode()
    )


def _policy(*, has_scene: bool, has_form: bool) -> str:
    form = "form-action 'self'" if has_form else "form-action 'none'"
    return "; ".join((*_POLICY, form, *(_SCENE_POLICY if has_scene else ())))


def losses(report: Report) -> tuple[Loss, ...]:
    """Return what the page lacks, without writing it."""
    return _scene(report)[1] if "scene" in report.template.sections else ()


def style() -> Markup:
    """Return the style sheet of the page."""
    return _asset("web_page.css")


def _asset(name: str) -> Markup:
    return Markup(resources.files("app.reports.html").joinpath(name).read_text("utf-8"))  # noqa: S704


def _measured(report: Report, t: Translator) -> list[tuple[str, Rows]]:
    parts = {
        "result": measurement.result_rows(report, t),
        "corrections": measurement.correction_rows(report, t),
        "counter": measurement.counter_rows(report, t),
        "rig": measurement.rig_rows(report, t),
        "video": measurement.video_rows(report, t),
    }
    return [(t(f"measurement.{name}"), rows) for name, rows in parts.items() if rows]


def _wall(report: Report, t: Translator) -> tuple[str, list[svg.Drawing]] | None:
    """Return what to say about the unrolled wall, and its strips; None if nothing was seen."""
    wall = wall_of(report)
    if wall is None:
        return None
    total = sum(tile.size for tile in wall.tiles)
    times = max(1, math.ceil(math.sqrt(total / MOST_WALL_BYTES)))
    sentences = [t("web.wall_help"), *remarks_on(report, wall, t)]
    if times > 1:
        sentences.insert(1, t("web.wall_reduced", times=times))
    full = wall.layout.width_px * wall_scale(report, wall) / wall.layout.tile_mm
    return " ".join(sentences), [*wall_strips(report, t, wall, px_per_mm=full / times)]


def _scene(report: Report) -> tuple[Markup | None, tuple[Loss, ...]]:
    """Return the page of the 3D view in base64, or the loss that says why there is none."""
    if report.draw_scene is None:
        return None, ()
    try:
        return _base64(report.draw_scene(report).encode()), ()
    except ChainageError as error:
        return None, (Loss("no_scene", reason=failure(error)),)
