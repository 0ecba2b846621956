"""The stored properties of a video file: our file name, and how a browser can show it."""

from __future__ import annotations

from dataclasses import asdict
from typing import Any

from vo_core.video_info import VideoInfo

_KINDS = {
    # FFmpeg's name of the container: suffix of our file, media type for browsers
    "mp4": (".mp4", "video/mp4"),
    "webm": (".webm", "video/webm"),
    "matroska": (".mkv", "video/x-matroska"),
    "avi": (".avi", "video/x-msvideo"),
    "mpegts": (".ts", "video/mp2t"),
    "mpeg": (".mpg", "video/mpeg"),
}
_WEBM_CODECS = {"vp8", "vp9", "av1", "libdav1d"}
_BROWSERS_PLAY = {"mp4": {"h264", *_WEBM_CODECS}, "webm": _WEBM_CODECS}
_BROWSERS_SHOW = {"yuv420p", "yuvj420p"}

NO_FILM = "This survey was imported without its film, so there is no picture."
"""Shown in place of a picture."""


def file_name(info: VideoInfo) -> str:
    """Return the file name within the inspection's folder."""
    return f"video{_KINDS[_kind_of(info)][0]}"


def video_columns(info: VideoInfo) -> dict[str, Any]:
    """Return the column `video` of an inspection."""
    kind = _kind_of(info)
    return asdict(info) | {
        "media_type": _KINDS[kind][1],
        "playable": _is_playable(kind, info),
    }


def unrecorded_columns(width: int, height: int) -> dict[str, Any]:
    """Return the column `video` of a recording that has not ended."""
    return video_columns(VideoInfo(width, height, "", "matroska", None, None, None, None))


def unfilmed_columns(size_wh: tuple[int, int], duration_s: float | None) -> dict[str, Any]:
    """Return the column `video` of a survey that was imported without its film.

    Args:
        size_wh: Picture size of the rig.
        duration_s: Duration of the film; None if its times are unknown.
    """
    return unrecorded_columns(*size_wh) | {
        "container": "",
        "duration_s": duration_s,
        "media_type": "application/octet-stream",
    }


def _kind_of(info: VideoInfo) -> str:
    """Return our kind for FFmpeg's demuxer, whose names are lists such as `mov,mp4,m4a`."""
    names = set(info.container.split(","))
    if "webm" in names:  # FFmpeg has one demuxer for both
        return "webm" if info.codec in _WEBM_CODECS else "matroska"
    return next(kind for kind in _KINDS if kind in names)


def _is_playable(kind: str, info: VideoInfo) -> bool:
    """Return whether browsers play the original; otherwise single frames are shown."""
    return info.codec in _BROWSERS_PLAY.get(kind, ()) and info.pixel_format in _BROWSERS_SHOW
