"""One picture of several observations is shown once; what is burnt in can be read."""

import io
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image
from reports import measured, report

from app.reports.content.marked_photo import MarkedPhoto
from app.reports.content.shown_photos import shown_photos

START = [
    {"distance_m": 0.0, "code": "BCD", "char1": "Z"},
    {"distance_m": 0.0, "code": "BDD", "char1": "A"},
    {"distance_m": 3.0, "code": "BAB", "char1": "B"},
]


def shared(folder):
    """Return a report whose first two observations have the same picture."""
    made = report(folder, START)
    first, second, third = made.entries
    again = replace(second.photo, jpeg=first.photo.jpeg, sha256=first.photo.sha256)
    return replace(made, entries=(first, replace(second, photo=again), third))


def burnt(entry, caption):
    return replace(entry, photo=replace(entry.photo, marked=MarkedPhoto(
        entry.photo.jpeg, (), caption)))  # fmt: skip


def picture_of(photo):
    return Image.open(io.BytesIO(photo.shown.read_bytes()))


def test_a_picture_of_two_observations_is_shown_once_with_both(tmp_path):
    first, second = shown_photos(shared(tmp_path))
    assert [entry.seq for entry, _ in first.captions] == [1, 2]
    assert [photo.name for _, photo in first.captions] == ["CUL-0041-001.jpg", "CUL-0041-002.jpg"]
    assert [entry.seq for entry, _ in second.captions] == [3]


def test_other_frames_and_photos_elsewhere_are_no_shared_pictures(tmp_path):
    made = report(tmp_path, START)
    assert len(shown_photos(made)) == 3
    elsewhere = [
        replace(entry, photo=replace(entry.photo, jpeg=None, sha256=None)) for entry in made.entries
    ]
    assert shown_photos(replace(made, entries=tuple(elsewhere))) == []


def test_both_captions_are_burnt_into_a_shared_picture(tmp_path):
    made = shared(tmp_path)
    texts = ["0.00 m   BCD Z", "0.00 m   BDD A", "3.00 m   BAB B"]
    entries = tuple(map(burnt, made.entries, texts))
    both, one = shown_photos(replace(made, entries=entries))
    assert both.photo.marked.caption == "\n".join(texts[:2])
    line_px = picture_of(both.photo).height - picture_of(one.photo).height
    assert 24 <= line_px <= 40


@pytest.mark.parametrize("size_wh", [(160, 120), (480, 854), (1920, 1080)])
@pytest.mark.parametrize(
    "caption",
    [
        "12.40 m ± 0.05 m   BAB B A   at 12 o'clock",
        "1.0 ft   " + "LONGCODE" * 12,
        "٣ كود 裂缝 தமிழ்",
    ],
)
def test_a_caption_is_as_large_on_every_photo_and_whole(size_wh, caption, tmp_path):
    width, height = size_wh
    path = tmp_path / "grey.jpg"
    Image.new("RGB", size_wh, "#808080").save(path)
    copy = MarkedPhoto(path, (), caption)
    picture = np.asarray(Image.open(io.BytesIO(copy.read_bytes())).convert("L"))
    assert picture.shape[1] == width
    assert abs(picture[:height].astype(int) - 128).max() < 40  # the picture itself is untouched
    assert height / copy.picture_share(width, height) == pytest.approx(picture.shape[0])
    strip = picture[height + 4 :]
    inked = strip > 128
    letters = inked.any(axis=1).sum()
    assert letters >= max(6, width / 28 * 0.4)  # no caption shrinks to fit
    assert not inked[:, : max(2, width // 200)].any()
    assert not inked[:, -2:].any()


def test_measures_lie_on_the_same_place_above_a_caption(tmp_path):
    made = report(tmp_path, [{"distance_m": 1.0, "code": "BAB"}])
    (plain,) = map(measured, made.entries)
    (before,) = shown_photos(replace(made, entries=(plain,)))
    (after,) = shown_photos(replace(made, entries=(burnt(plain, "1.00 m   BAB"),)))
    high = picture_of(after.photo).height
    assert high > 480
    assert len(before.lines) == len(after.lines) == 2
    for one, other in zip(before.lines, after.lines, strict=True):
        for (x, y), (x_too, y_too) in zip(one.points, other.points, strict=True):
            assert x_too == x
            assert y_too * high == pytest.approx(y * 480)
