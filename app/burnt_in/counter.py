"""Reads the burnt-in distance counter of a film, and its date."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import chain
from pathlib import Path

import cv2
import numpy as np

from app.burnt_in.box import Box
from app.burnt_in.consistency import Candidate, Stretch, consistent
from app.burnt_in.distance_text import Distance, read_distance
from app.burnt_in.fields import combs, field_of
from app.burnt_in.film_date import shown_date
from app.burnt_in.finder import CounterPlace, find_counter, joined
from app.burnt_in.readings import BurntIn, CounterReadings
from app.burnt_in.text_model import TextDetector, TextReader
from vo_core import VideoFile
from vo_core.errors import UnreadableVideo
from vo_core.frames_at import read_frame
from vo_core.types import ByteImage

PICTURES = 10
"""Number of pictures in which the counter is searched."""

EVERY = 3
"""Lines of text are detected in every third of these pictures, and read in all of them: detection
takes a hundred times as long as reading a line."""

LEAST_CONFIDENCE = 0.6
"""Readings that are less certain are left out."""

SURE_AT_ONCE = 0.9
"""Probability from which a crop is not read in other ways too."""

MOST_CANDIDATES = 3
"""Number of possible readings of a crop that are kept."""

UNSEEN_POINT = 0.5
"""Factor of the probability of a reading whose decimal point was not seen."""

MOST_TICKS = 3
"""Ticks of the counter from one field to the next, at most."""

CHANGED = 0.2
"""Share of the contrast by which 3 by 3 pixels differ where a digit has changed."""


def burnt_in(video: Path, within: Box | None = None) -> BurntIn:
    """Find the counter and the date of a film.

    Args:
        video: The film.
        within: A part of the picture that holds the counter; without it, it is found.
    Raises:
        UnreadableVideo: The video cannot be opened or holds no picture.
    """
    pictures, read, detect = list(_pictures(video)), TextReader(), TextDetector()
    some = pictures[::EVERY]
    lines = [joined(detect(picture)) for picture in some]
    height, width = pictures[0].shape[:2]
    place = find_counter(pictures, lines, read, within)
    return BurntIn(place, shown_date(some, lines, read), width, height)


def read_counter(
    video: Path,
    place: CounterPlace | None,
    on_progress: Callable[[int, int | None], None] | None = None,
) -> CounterReadings:
    """Read the counter of a film in every frame.

    Args:
        video: The film.
        place: Where the counter stands; without it, no frame has a reading.
        on_progress: Called after each frame with frames done and the total, if known.
    Raises:
        UnreadableVideo: The video cannot be opened or holds no picture.
    """
    reader = None if place is None else _CounterReader(place, TextReader())
    times_s: list[float] = []
    with VideoFile(video) as frames:
        for frame in frames.read_ahead():
            times_s.append(frame.t_s)
            if reader is not None:
                reader.add(frame.index, frame.t_s, frame.image, frame.to_bgr)
            if on_progress is not None:
                on_progress(len(times_s), frames.info.frames)
    reading, confidence = np.full(len(times_s), np.nan), np.zeros(len(times_s))
    if reader is not None:
        for stretch, candidate in reader.chosen():
            if candidate is not None and candidate.sure >= LEAST_CONFIDENCE:
                reading[stretch.first : stretch.last + 1] = candidate.value
                confidence[stretch.first : stretch.last + 1] = candidate.sure
    return CounterReadings(np.array(times_s), reading, confidence, place, frames.problem)


def _pictures(video: Path) -> Iterator[ByteImage]:
    """Some pictures from the whole film, (H, W, 3) BGR."""
    with VideoFile(video) as file:
        duration_s = file.info.duration_s or float(PICTURES)
        first = next(iter(file))
        yield first.to_bgr()
    for n in range(1, PICTURES):
        with suppress(UnreadableVideo):  # the film is shorter than its container states
            yield read_frame(video, first.t_s + duration_s * n / PICTURES).to_bgr()


class _CounterReader:
    """Reads the counter frame by frame; a crop that has not changed is not read again."""

    def __init__(self, place: CounterPlace, read: TextReader) -> None:
        self._place, self._read = place, read
        self._shown: ByteImage | None = None
        """The crop that was read last, grey."""
        self._stretches: list[Stretch] = []
        self._is_legible = False
        """Whether the last crop gave a reading."""

    def add(self, index: int, t_s: float, grey: ByteImage, to_bgr: Callable[[], ByteImage]) -> None:
        """Read the next frame: grey (H, W), and a function that returns it in colour."""
        crop = self._place.box.cut_from(grey)
        if self._shown is not None and not _has_changed(self._shown, crop):
            if self._is_legible:
                self._stretches[-1].last, self._stretches[-1].last_s = index, t_s
            return
        self._shown = crop.copy()
        candidates = self._candidates(to_bgr())
        continues = self._is_legible
        self._is_legible = bool(candidates)
        if not candidates:
            return
        last = self._stretches[-1] if continues else None
        if last is not None and _agree(last.candidates[0], candidates[0]):
            last.last, last.last_s, last.readings = index, t_s, last.readings + 1
        else:
            self._stretches.append(Stretch(index, index, t_s, t_s, candidates))

    def chosen(self) -> Iterator[tuple[Stretch, Candidate | None]]:
        """The stretches and their consistent readings."""
        found = consistent(self._stretches, 10.0**-self._place.decimals)
        return zip(self._stretches, found, strict=True)

    def _candidates(self, picture: ByteImage) -> tuple[Candidate, ...]:
        """Possible readings of a picture, (H, W, 3) BGR, the most probable first.

        A tick between the two fields of an interlaced picture draws two digits on top of each
        other, such as an 8 from a 5 and a 6; each field shows one of them.
        """
        crop = self._place.box.cut_from(picture)
        ticks = combs(crop)
        if self._place.has_fields or ticks:
            first = self._as_counter(field_of(crop, 0))
            if _sure(first) >= SURE_AT_ONCE and not ticks:
                return first
            second = self._as_counter(field_of(crop, 1))
            surer = max(first, second, key=_sure)
            if _sure(surer) >= SURE_AT_ONCE:
                return surer if self._follow(first, second) else _mean([first, second])
            whole = self._as_counter(crop)
        elif _sure(whole := self._as_counter(crop)) >= SURE_AT_ONCE:
            return whole
        views = [self._as_counter(box.cut_from(picture)) for box in self._other_views(picture)]
        return _mean([whole, *views])

    def _follow(self, first: Sequence[Candidate], second: Sequence[Candidate]) -> bool:
        """Whether the counter can tick from one field to the other, or one of them is unsure."""
        if min(_sure(first), _sure(second)) < SURE_AT_ONCE:
            return True
        change = abs(first[0].value - second[0].value)
        return change < (MOST_TICKS + 0.5) * 10.0**-self._place.decimals

    def _other_views(self, picture: ByteImage) -> list[Box]:
        """Crops that are a little higher and lower; a misread digit often changes with the crop."""
        box = self._place.box
        rim = max(1, box.height // 10)
        higher = Box(
            box.left, max(box.top - rim, 0), box.right, min(box.bottom + rim, len(picture))
        )
        return [higher, Box(box.left, box.top + rim // 2 + 1, box.right, box.bottom)]

    def _as_counter(self, crop: ByteImage) -> tuple[Candidate, ...]:
        found = (self._in_its_form(distance) for distance in read_distance(self._read(crop)))
        return tuple(candidate for candidate in found if candidate is not None)

    def _in_its_form(self, distance: Distance) -> Candidate | None:
        """The reading with as many decimals as the counter has."""
        if distance.decimals == self._place.decimals:
            return Candidate(distance.value, distance.sure)
        if distance.decimals == 0 and distance.digits > self._place.decimals:
            value = round(distance.value * 10.0**-self._place.decimals, self._place.decimals)
            return Candidate(value, UNSEEN_POINT * distance.sure)
        return None


def _sure(candidates: Sequence[Candidate]) -> float:
    return candidates[0].sure if candidates else 0.0


def _agree(one: Candidate, other: Candidate) -> bool:
    return one.value == other.value and min(one.sure, other.sure) >= SURE_AT_ONCE


def _mean(views: Sequence[Sequence[Candidate]]) -> tuple[Candidate, ...]:
    """The candidates of several views of one crop, each with its mean probability."""
    total: defaultdict[float, float] = defaultdict(float)
    for candidate in chain.from_iterable(views):
        total[candidate.value] += candidate.sure / len(views)
    means = sorted((Candidate(*item) for item in total.items()), key=lambda c: -c.sure)
    return tuple(means[:MOST_CANDIDATES])


def _inner(crop: ByteImage) -> ByteImage:
    """The part of a crop where every digit has some of its strokes; the wall may show around it."""
    rim = min(crop.shape) // 5
    return crop[rim : len(crop) - rim, rim : crop.shape[1] - rim]


def _has_changed(before: ByteImage, now: ByteImage) -> bool:
    """Whether a digit differs between two crops, (H, W) grey each."""
    contrast = float(np.ptp(np.percentile(before, (5, 98))))
    differences = cv2.blur(cv2.absdiff(_inner(before), _inner(now)), (3, 3))
    return bool(differences.max() > CHANGED * contrast)
