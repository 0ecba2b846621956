"""How the distances were measured and corrected, and how reliable they are, row by row."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from app.inspections.counters import CounterView
from app.reports.content.translator import NOTHING, Translator
from app.reports.report import Report
from app.survey.adjustment.joints import FittedJoint
from app.survey.fields.header import number_of
from app.survey.interval import LEAST_M, U95, half_width_m
from app.survey.rounding import metres, signed
from app.survey.uncertainty_budget import budget_of
from vo_core.scale.counter import Fault

_MOST_FAULTS = 20
"""Faults of a counter that are named one by one; the JSON has all."""


def result_rows(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return the rows about distance and uncertainty."""
    met = report.adjusted.distance_class() if report.adjusted else None
    if report.distance_m is None or met is None:
        return [(t("measurement.far_end"), t("entry.not_tracked"))]
    half = "" if report.u95_m is None else f" ± {t.half_width(report.u95_m)} {t.units}"
    if met.percent is None:
        text = t("measurement.class_not_met")
    else:
        text = t("measurement.class_met", percent=t.figure(met.percent))
    text += " " + t("measurement.class_half", half=f"{t.half_width(met.half_width_m)} {t.units}")
    if met.residual_mm is None:
        text += " " + t("measurement.class_open")
    rows = [
        (t("measurement.far_end"), f"{t.length(report.distance_m)}{half}"),
        *budget_rows(report, t),
        (t("measurement.raw"), t.length(report.raw_distance_m)),
        (t("measurement.class"), text),
        (t("measurement.closure"), _closure(report, t)),
    ]
    if len(report.track):
        counts = {name: int((report.track.status == name).sum()) for name in ("ok", "weak", "lost")}
        total = len(report.track)
        rows.append(
            (
                t("measurement.frames"),
                t(
                    "measurement.frames_of",
                    total=total,
                    weak=t.figure(100 * counts["weak"] / total, 1),
                    lost=t.figure(100 * counts["lost"] / total, 1),
                ),
            )
        )
    return rows


def budget_rows(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return the sources of the interval at the far end, and what would reduce it most."""
    track = report.track
    budget = (
        budget_of(report.adjusted, report.raw_track, int(track.distance_mm.argmax()))
        if report.adjusted and len(track)
        else None
    )
    if budget is None or not budget.parts:
        return []

    def half(half_m: float) -> str:
        return f"± {t.half_width(half_m)} {t.units}"

    causes = [t(f"cause.{part.name}") for part in budget.parts]
    widths = [half(part.half_width_m) for part in budget.parts]
    if budget.taped is not None:
        advice = t(
            "measurement.shrink_tape",
            length=t.length(budget.taped.length_m),
            now=half(budget.half_width_m),
            then=half(budget.taped.half_width_m),
        )
    elif budget.half_width_m <= LEAST_M:
        advice = t("measurement.shrink_nothing")
    else:
        advice = t("measurement.shrink_part", part=causes[0])
    return [
        (t("measurement.made_of"), ", ".join(map(" ".join, zip(causes, widths, strict=True)))),
        (t("measurement.shrink"), advice),
    ]


def _closure(report: Report, t: Translator) -> str:
    closure = report.adjusted.closure if report.adjusted else None
    if closure is None:
        known_m = number_of(report.header.get("known_length_m"))
        if known_m is None:
            return t("measurement.no_closure")
        return t("measurement.not_compared", known=t.length(known_m))
    return t(
        "measurement.closure_of",
        measured=t.length(metres(closure.measured_mm)),
        known=t.length(metres(closure.known_mm)),
        residual=t.local(signed(closure.residual_mm, 0)),
        percent=t.local(signed(closure.residual_percent, 2)),
    )


def correction_rows(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return what was stated about distances, and the result."""
    stated, adjusted = report.corrected.stated, report.adjusted
    zero = (
        t("measurement.zero_first")
        if stated.zero is None
        else t(
            "measurement.zero_at",
            frame=stated.zero.frame,
            offset=t.length(stated.zero.offset_m),
        )
    )
    rows = [(t("measurement.zero"), zero)]
    for length in stated.lengths:
        rows.append(
            (
                t(f"measurement.length_{length.kind}"),
                t(
                    "measurement.length_of",
                    length=t.length(length.length_m),
                    sigma=t.figure(length.sigma_mm),
                    first=length.first_frame,
                    last=length.last_frame,
                ),
            )
        )
    by_joints = adjusted.by_joints if adjusted else None
    if by_joints is not None:
        segment_mm = report.rig.pipe.segment_length_mm
        rows.append(
            (
                t("measurement.joints"),
                t(
                    "measurement.joints_of",
                    n=by_joints.joints,
                    segment=t.length(None if segment_mm is None else segment_mm / 1000),
                ),
            )
        )
    elif stated.joints.use is False:
        rows.append((t("measurement.joints"), t("measurement.joints_off")))
    elif adjusted is not None and adjusted.joints_refusal is not None:
        rows.append((t("measurement.joints"), t.refusal(adjusted.joints_refusal)))
    if adjusted is not None and adjusted.uncounted_marks:
        places = (t.length(metres(mark.distance_mm)) for mark in adjusted.uncounted_marks)
        text = t("measurement.marks_off_at", places=", ".join(places))
        rows.append((t("measurement.marks_off"), text))
    if stated.rig_sigma is not None:
        rows.append(
            (
                t("measurement.rig_sigma"),
                t(
                    "measurement.rig_sigma_of",
                    height=t.figure(stated.rig_sigma.height_mm),
                    focal=t.figure(stated.rig_sigma.focal_px),
                ),
            )
        )
    if stated.forced:
        rows.append((t("measurement.forced"), stated.forced))
    if adjusted is not None:
        if adjusted.correction is not None and adjusted.correction.doubts_rig:
            rows.append((t("measurement.rig"), t("measurement.rig_doubted")))
        sigma = "" if adjusted.scale_sigma is None else f" ± {adjusted.scale_sigma:.6f}"
        rows.append((t("measurement.scale"), t.local(f"{adjusted.scale:.6f}{sigma}")))
        if adjusted.height is not None:
            rows.append(
                (
                    t("measurement.height"),
                    t(
                        "measurement.height_of",
                        implied=t.figure(adjusted.height.height_mm, 1),
                        u95=t.figure(U95 * adjusted.height.sigma_mm, 1),
                        stated=t.figure(report.rig.mount.height_mm),
                    ),
                )
            )
    if report.corrected.error is not None:
        rows.append((t("measurement.error"), report.corrected.error["detail"]))
    return rows


def joint_table(
    joints: Iterable[FittedJoint], t: Translator
) -> tuple[list[str], Sequence[Sequence[str]]]:
    """Return heads and rows: number, place, residual, frame, how it was seen."""
    names = (
        "entry.joint", "entry.distance", "measurement.left_over", "measurement.frame",
        "measurement.seen",
    )  # fmt: skip
    rows = [
        (
            NOTHING if joint.number is None else str(joint.number),
            f"{t.number(metres(joint.distance_mm))} ± "
            f"{t.half_width(half_width_m(joint.sigma_mm))} {t.units}",
            NOTHING if joint.residual_mm is None else t.local(f"{signed(joint.residual_mm, 1)} mm"),
            str(joint.frame),
            t("measurement.by_hand" if joint.is_marked else "measurement.found"),
        )
        for joint in joints
    ]
    return [t(name) for name in names], rows


def counter_rows(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return the readings of the burnt-in counter, its length beside the camera's, and its faults;
    nothing if the film shows none.
    """
    counter = report.counter
    if counter.state == "illegible":
        return [(t("measurement.readings"), t("measurement.illegible"))]
    if counter.readings is None:
        return []
    rows = [(t("measurement.readings"), _readings(counter, t))]
    found = counter.comparison
    if found is None:
        return rows
    if found.length is not None and found.scale is not None:
        text = t(
            "measurement.counter_says",
            counter=t.length(metres(found.length.length_mm)),
            camera=t.length(metres(found.camera_mm)),
            half=f"{t.half_width(half_width_m(found.camera_sigma_mm))} {t.units}",
            scale=t.figure(found.scale, 3),
            sigma=t.figure(found.sigma, 3),
            first=found.length.first_frame,
            last=found.length.last_frame,
        )
        verdict = t("measurement.agrees" if found.agrees else "measurement.disagrees")
        rows.append((t("measurement.counter_and_camera"), f"{text} {verdict}"))
    return [*rows, (t("measurement.counter_faults"), _faults(found.faults, report, t))]


def _readings(counter: CounterView, t: Translator) -> str:
    reading_m = counter.reading_m
    legible_m = reading_m[~np.isnan(reading_m)]
    if counter.readings is None or not len(legible_m):
        return t("measurement.no_unit")
    return t(
        "measurement.readings_of",
        first=t.length(float(legible_m[0])),
        last=t.length(float(legible_m[-1])),
        legible=len(legible_m),
        frames=len(reading_m),
    )


def _faults(faults: Sequence[Fault], report: Report, t: Translator) -> str:
    """Name the faults and their places, at the corrected distances."""
    if not faults:
        return t("measurement.no_faults")

    def place(frame: int) -> str:
        is_tracked = frame < len(report.track)
        return t.length(metres(float(report.track.distance_mm[frame])) if is_tracked else None)

    named = [
        t(
            f"measurement.fault_{fault.kind}",
            first=place(fault.first_frame),
            last=place(fault.last_frame),
            counted=t.length(metres(fault.counter_mm)),
            driven=t.length(metres(fault.camera_mm)),
        )
        for fault in faults[:_MOST_FAULTS]
    ]
    if len(faults) > _MOST_FAULTS:
        named.append(t("measurement.more_faults", n=len(faults) - _MOST_FAULTS))
    return f"{len(faults)}: {'; '.join(named)}"


def rig_rows(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return the rows about camera, mount and wall."""
    camera, mount, pipe = report.rig.camera, report.rig.mount, report.rig.pipe
    lens = t(
        "measurement.lens",
        model=t(f"lens.{camera.model}"),
        width=camera.width,
        height=camera.height,
        fx=t.figure(camera.fx, 1),
        fy=t.figure(camera.fy, 1),
        cx=t.figure(camera.cx, 1),
        cy=t.figure(camera.cy, 1),
    )
    if camera.distortion:
        numbers = ", ".join(t.local(f"{value:.5g}") for value in camera.distortion)
        lens += " " + t("measurement.distortion", numbers=numbers)
    place = t(
        "measurement.mount",
        view=t(f"view.{mount.view}"),
        height=t.figure(mount.height_mm),
        lateral=t.figure(mount.lateral_mm),
        rotation=t.figure(mount.rotation_deg),
        pitch=t.figure(mount.pitch_deg),
        roll=t.figure(mount.roll_deg),
    )
    wall = (
        t("measurement.flat")
        if pipe.diameter_mm is None
        else t("measurement.circular", diameter=t.figure(pipe.diameter_mm))
    )
    if pipe.segment_length_mm is not None:
        wall += " " + t("measurement.segment", length=t.length(pipe.segment_length_mm / 1000))
    calibration = report.header.get("calibration_id")
    return [
        (t("measurement.camera"), lens),
        (t("measurement.place"), place),
        (t("measurement.wall"), wall),
        (
            t("measurement.calibration"),
            str(calibration) if calibration else t("measurement.no_calibration"),
        ),
    ]


def video_rows(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return the rows about the film and its faults."""
    source, video = report.source, report.source.video
    picture = f"{video['width']} × {video['height']} px" if "width" in video else NOTHING
    facts = [picture, str(video.get("codec") or "")]
    frames, duration_s = video.get("frames"), video.get("duration_s")
    if frames and duration_s:
        rate = t("measurement.rate", frames=frames, rate=t.local(f"{frames / duration_s:.3g}"))
        facts += [rate, t.time(duration_s)]
    rows = [
        (t("measurement.file"), source.filename or NOTHING),
        (
            t("measurement.size"),
            t("measurement.bytes", n=f"{source.size:,}".replace(",", " ")),
        ),
        (t("measurement.pictures"), " · ".join(fact for fact in facts if fact)),
        ("SHA-256", source.sha256 or t("measurement.no_hash")),
    ]
    if report.tracked_with:
        rows.append((t("measurement.tracked_with"), f"Chainage {report.tracked_with}"))
    if report.warning:
        rows.append((t("measurement.warning"), report.warning))
    if report.error:
        rows.append((t("measurement.failure"), report.error))
    return rows
