"""How the distances were measured and corrected, and how reliable they are, row by row."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence

import numpy as np

from app.inspections.counters import CounterView
from app.reports.content.translator import NOTHING, Translator
from app.reports.report import Report
from app.survey.adjustment.adjusted_track import SOURCES, Adjusted
from app.survey.adjustment.joints import FittedJoint
from app.survey.distances.interval import LEAST_M, U95, half_width_m
from app.survey.distances.stated import Length
from app.survey.distances.uncertainty_budget import budget_of
from app.survey.fields.header import number_of
from app.survey.rounding import metres, signed
from vo_core.scale.counter import Fault

_MOST_FAULTS = 20
"""Faults of a counter that are named one by one; the JSON has all."""


Rows = list[tuple[str, str]]


def _named(t: Translator, *found: tuple[str, str | None]) -> Rows:
    """Return rows, given the keys of their names, without those that have nothing to say."""
    return [(t(f"measurement.{key}"), text) for key, text in found if text]


def result_rows(report: Report, t: Translator) -> Rows:
    """Return the rows about distance and uncertainty."""
    met = report.adjusted.distance_class() if report.adjusted else None
    if report.distance_m is None or met is None:
        return _named(t, ("far_end", t("entry.not_tracked")))
    half = "" if report.u95_m is None else f" ± {t.half_width(report.u95_m)} {t.units}"
    said = [
        t("measurement.class_not_met")
        if met.percent is None
        else t("measurement.class_met", percent=t.figure(met.percent)),
        t("measurement.class_half", half=f"{t.half_width(met.half_width_m)} {t.units}"),
    ]
    if met.residual_mm is None:
        said.append(t("measurement.class_open"))
    return _named(
        t,
        ("far_end", f"{t.length(report.distance_m)}{half}"),
        *_budget(report, t),
        ("raw", t.length(report.raw_distance_m)),
        ("class", " ".join(said)),
        ("closure", _closure(report, t)),
        ("frames", _frames(report, t)),
        ("sources", _sources(report, t)),
    )


def _sources(report: Report, t: Translator) -> str | None:
    """Return which share of the frames has its distance from where, unless all are the camera's."""
    if report.adjusted is None or report.adjusted.carried is None:
        return None
    counts = np.bincount(report.adjusted.sources, minlength=len(SOURCES))
    return ", ".join(
        f"{t.source(source)} {t.figure(100 * int(count) / int(counts.sum()), 1)} %"
        for source, count in zip(SOURCES, counts, strict=True)
        if count
    )


def _frames(report: Report, t: Translator) -> str | None:
    total = len(report.track)
    if not total:
        return None
    weak, lost = (
        t.figure(100 * int((report.track.status == name).sum()) / total, 1)
        for name in ("weak", "lost")
    )
    return t("measurement.frames_of", total=total, weak=weak, lost=lost)


def _budget(report: Report, t: Translator) -> list[tuple[str, str]]:
    """Return the sources of the interval at the far end, and what would reduce it most."""
    if not report.adjusted or not len(report.track):
        return []
    farthest = int(report.track.distance_mm.argmax())
    budget = budget_of(report.adjusted, report.raw_track, farthest)
    if budget is None or not budget.parts:
        return []

    def half(half_m: float) -> str:
        return f"± {t.half_width(half_m)} {t.units}"

    parts = [f"{t(f'cause.{part.name}')} {half(part.half_width_m)}" for part in budget.parts]
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
        advice = t("measurement.shrink_part", part=t(f"cause.{budget.parts[0].name}"))
    return [("made_of", ", ".join(parts)), ("shrink", advice)]


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


def correction_rows(report: Report, t: Translator) -> Rows:
    """Return what was stated about distances, and the result."""
    stated, adjusted = report.corrected.stated, report.adjusted
    zero, sigma, error = stated.zero, stated.rig_sigma, report.corrected.error
    zero_text = t("measurement.zero_first")
    if adjusted is not None and adjusted.is_read:
        zero_text = t(f"measurement.zero_{adjusted.carrier}")
    if zero is not None:
        zero_text = t("measurement.zero_at", frame=zero.frame, offset=t.length(zero.offset_m))
    return _named(
        t,
        ("zero", zero_text),
        *((f"length_{one.kind}", _known_length(one, t)) for one in stated.lengths),
        ("joints", _joints(report, t)),
        ("marks_off", _uncounted_marks(adjusted, t) if adjusted else None),
        ("rig_sigma", t("measurement.rig_sigma_of", height=t.figure(sigma.height_mm),
                        focal=t.figure(sigma.focal_px)) if sigma else None),
        ("forced", stated.forced),
        *(_scale(report, adjusted, t) if adjusted and not adjusted.is_read else ()),
        ("error", error["detail"] if error else None),
    )  # fmt: skip


def _known_length(length: Length, t: Translator) -> str:
    return t(
        "measurement.length_of",
        length=t.length(length.length_m),
        sigma=t.figure(length.sigma_mm),
        first=length.first_frame,
        last=length.last_frame,
    )


def _joints(report: Report, t: Translator) -> str | None:
    adjusted = report.adjusted
    if adjusted and (found := adjusted.by_joints) is not None:
        segment_mm = found.spacing.segment_mm
        if found.ruler == "crests":
            return t("measurement.crests_of", n=found.joints, pitch=t.figure(segment_mm, 1))
        segment = t.length(segment_mm / 1000)
        return t("measurement.joints_of", n=found.joints, segment=segment)
    if report.corrected.stated.joints.use is False:
        return t("measurement.joints_off")
    refusal = adjusted.joints_refusal if adjusted else None
    return None if refusal is None else t.refusal(refusal)


def _uncounted_marks(adjusted: Adjusted, t: Translator) -> str | None:
    places = [t.length(metres(mark.distance_mm)) for mark in adjusted.uncounted_marks]
    return t("measurement.marks_off_at", places=", ".join(places)) if places else None


def _scale(report: Report, adjusted: Adjusted, t: Translator) -> Iterator[tuple[str, str]]:
    if adjusted.correction is not None and adjusted.correction.doubts_rig:
        yield "rig", t("measurement.rig_doubted")
    sigma = "" if adjusted.scale_sigma is None else f" ± {adjusted.scale_sigma:.6f}"
    yield "scale", t.local(f"{adjusted.scale:.6f}{sigma}")
    if height := adjusted.height:
        yield (
            "height",
            t(
                "measurement.height_of",
                implied=t.figure(height.height_mm, 1),
                u95=t.figure(U95 * height.sigma_mm, 1),
                stated=t.figure(report.rig.mount.height_mm),
            ),
        )


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


def counter_rows(report: Report, t: Translator) -> Rows:
    """Return the readings of the burnt-in counter, its length beside the camera's, and its faults;
    nothing if the film shows none.
    """
    counter, found = report.counter, report.counter.comparison
    if counter.state == "illegible":
        return _named(t, ("readings", t("measurement.illegible")))
    if counter.readings is None:
        return []
    said = None
    if found is not None and found.length is not None and found.scale is not None:
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
        said = f"{text} {t('measurement.agrees' if found.agrees else 'measurement.disagrees')}"
    faults = None if found is None else _faults(found.faults, report, t)
    return _named(
        t,
        ("readings", _readings(counter, t)),
        ("counter_and_camera", said),
        ("counter_faults", faults),
    )


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


def rig_rows(report: Report, t: Translator) -> Rows:
    """Return the rows about camera, mount and wall."""
    camera, mount, pipe = report.rig.camera, report.rig.mount, report.rig.pipe
    places = {name: t.figure(getattr(camera, name), 1) for name in ("fx", "fy", "cx", "cy")}
    lens = t(
        "measurement.lens",
        model=t(f"lens.{camera.model}"),
        width=camera.width,
        height=camera.height,
        **places,
    )
    if camera.distortion:
        numbers = ", ".join(t.local(f"{value:.5g}") for value in camera.distortion)
        lens += " " + t("measurement.distortion", numbers=numbers)
    wall = (
        t("measurement.flat")
        if pipe.diameter_mm is None
        else t("measurement.circular", diameter=t.figure(pipe.diameter_mm))
    )
    if pipe.corrugation is not None:
        wave = {name: t.figure(mm) for name, mm in pipe.corrugation.model_dump().items()}
        wall += " " + t("measurement.corrugated", pitch=wave["pitch_mm"], depth=wave["depth_mm"])
    if pipe.segment_length_mm is not None:
        wall += " " + t("measurement.segment", length=t.length(pipe.segment_length_mm / 1000))
    place = t(
        "measurement.mount",
        view=t(f"view.{mount.view}"),
        height=t.figure(mount.height_mm),
        lateral=t.figure(mount.lateral_mm),
        rotation=t.figure(mount.rotation_deg),
        pitch=t.figure(mount.pitch_deg),
        roll=t.figure(mount.roll_deg),
    )
    calibration = str(report.header.get("calibration_id") or t("measurement.no_calibration"))
    return _named(
        t, ("camera", lens), ("place", place), ("wall", wall), ("calibration", calibration)
    )


def video_rows(report: Report, t: Translator) -> Rows:
    """Return the rows about the film and its faults."""
    source, video = report.source, report.source.video
    picture = f"{video['width']} × {video['height']} px" if "width" in video else NOTHING
    facts = [picture, str(video.get("codec") or "")]
    frames, duration_s = video.get("frames"), video.get("duration_s")
    if frames and duration_s:
        rate = t.local(f"{frames / duration_s:.3g}")
        facts += [t("measurement.rate", frames=frames, rate=rate), t.time(duration_s)]
    size = f"{source.size:,}".replace(",", " ")
    return [
        *_named(
            t,
            ("file", source.filename or NOTHING),
            ("size", t("measurement.bytes", n=size)),
            ("pictures", " · ".join(fact for fact in facts if fact)),
        ),
        ("SHA-256", source.sha256 or t("measurement.no_hash")),
        *_named(
            t,
            ("tracked_with", report.tracked_with and f"Chainage {report.tracked_with}"),
            ("warning", report.warning),
            ("failure", report.error),
        ),
    ]
