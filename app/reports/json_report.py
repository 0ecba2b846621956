"""The whole report as JSON, in a schema with a version."""

from __future__ import annotations

import json

from app.reports import table
from app.reports.report import Report, Written
from app.reports.table import iso
from app.services.corrections import result_of

SCHEMA = "chainage-report/1"


def write(report: Report) -> Written:
    """Everything, with the version of the schema."""
    source = report.source
    content = {
        "schema": SCHEMA,
        "exported_at": iso(report.made_at),
        "inspection": {
            "id": report.id,
            "name": report.name,
            "status": report.status,
            "header": report.header,
            "rig": report.rig.model_dump(mode="json"),
            "source": {
                "kind": source.kind,
                "filename": source.filename,
                "size": source.size,
                "sha256": source.sha256,
            },
            "video": source.video,
            "frames": len(report.track),
            "distance_m": report.distance_m,
            "distance_u95_m": report.u95_m,
            "distance_raw_m": report.raw_distance_m,
            "revision": report.revision,
            "warning": report.warning,
            "error": report.error,
            "created_at": iso(report.created_at),
            "finished_at": iso(report.finished_at),
        },
        "corrections": {
            "stated": report.corrected.stated.to_json(),
            "result": result_of(report.adjusted) if report.adjusted else None,
            "error": report.corrected.error,
        },
        "observations": table.rows(report),
        "events": [
            {
                "at": iso(event.at),
                "who": event.who,
                "action": event.action,
                "observation_id": event.observation_id,
                "before": event.before,
                "after": event.after,
                "remark": event.remark,
            }
            for event in report.events
        ],
    }
    return Written(json.dumps(content, ensure_ascii=False, allow_nan=False, indent=1).encode())
