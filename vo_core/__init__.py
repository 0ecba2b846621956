"""Monocular visual odometry for pipes and culverts: arrays in, arrays out.

A name is loaded with its first use: a program that reads a rig or an error loads no codec.
"""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vo_core.errors import (
        ChainageError,
        InvalidRig,
        InvalidTrack,
        ShapeMismatch,
        UnreadableVideo,
    )
    from vo_core.frames_at import read_frame
    from vo_core.geometry.wall import Pose, WallPoint, wall_point
    from vo_core.odometry import Odometry
    from vo_core.registration import Shift, register
    from vo_core.rig import Camera, Mount, Pipe, Rig
    from vo_core.sources import Frame, VideoFile
    from vo_core.track import Estimate, Track
    from vo_core.video_info import VideoInfo

_HOMES = {
    "errors": ("ChainageError", "InvalidRig", "InvalidTrack", "ShapeMismatch", "UnreadableVideo"),
    "frames_at": ("read_frame",),
    "geometry.wall": ("Pose", "WallPoint", "wall_point"),
    "odometry": ("Odometry",),
    "registration": ("Shift", "register"),
    "rig": ("Camera", "Mount", "Pipe", "Rig"),
    "sources": ("Frame", "VideoFile"),
    "track": ("Estimate", "Track"),
    "video_info": ("VideoInfo",),
}
"""The public names by the module that has them."""

__all__ = [
    "Camera",
    "ChainageError",
    "Estimate",
    "Frame",
    "InvalidRig",
    "InvalidTrack",
    "Mount",
    "Odometry",
    "Pipe",
    "Pose",
    "Rig",
    "ShapeMismatch",
    "Shift",
    "Track",
    "UnreadableVideo",
    "VideoFile",
    "VideoInfo",
    "WallPoint",
    "read_frame",
    "register",
    "wall_point",
]


def __getattr__(name: str) -> object:
    for module, names in _HOMES.items():
        if name in names:
            value: object = getattr(import_module(f"vo_core.{module}"), name)
            globals()[name] = value
            return value
    raise AttributeError(f"vo_core has no {name}")
