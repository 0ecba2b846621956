"""The fields of the header, in their groups."""

from __future__ import annotations

from collections.abc import Sequence

from app.reports.content.translator import Translator
from app.reports.report import Report
from app.survey.fields.header import is_empty, required_to_issue

GROUPS: Sequence[tuple[str, Sequence[str]]] = (
    ("asset", (
        "asset_id", "asset_type", "start_node", "end_node", "upstream_node", "downstream_node",
        "shape", "height_mm", "width_mm", "material", "lining_type", "lining_material",
        "unit_length_m", "known_length_m", "known_length_source", "expected_length_m", "year",
    )),
    ("place", (
        "road", "road_chainage", "road_chainage_end", "location_text", "start_lat", "start_lon",
        "end_lat", "end_lon",
    )),
    ("survey", (
        "date", "time", "purpose", "method", "direction", "reference_point", "camera_offset_m",
        "end_condition", "abandon_reason", "reverse_of", "standard", "edition", "code_pack",
    )),
    ("people", (
        "project", "client", "client_job_ref", "contractor", "job_ref", "operator",
        "operator_certificate", "reviewer",
    )),
    ("state", (
        "cleaned", "cleaned_on", "weather", "temperature_c", "flow_control", "water_level_pct",
    )),
    ("equipment", ("camera", "lens", "tether", "rig_id", "calibration_id", "video_files")),
    ("remarks", ("remarks",)),
)  # fmt: skip
"""Every field of the header, and the project, grouped under headings."""


def header_groups(report: Report, t: Translator) -> list[tuple[str, list[tuple[str, str]]]]:
    """Return the groups that have a field, each with its title; of empty fields those that a report
    must have to be issued.
    """
    missing = set(required_to_issue(dict(report.header)))
    others = [name for name in report.header if all(name not in names for _, names in GROUPS)]
    groups = []
    for group, names in (*GROUPS, ("others", others)):
        rows = []
        for name in names:
            value = report.header.get(name)
            if not is_empty(value):
                rows.append((t.field(name), t.value(name, value)))
            elif name in missing:
                rows.append((t.field(name), t("header.missing")))
        if rows:
            groups.append((t(f"header.{group}"), rows))
    return groups
