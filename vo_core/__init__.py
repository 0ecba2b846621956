"""Monocular visual odometry for pipes and culverts: arrays in, arrays out."""

from vo_core.containers import VideoInfo
from vo_core.errors import ChainageError, InvalidRig, InvalidTrack, ShapeMismatch, UnreadableVideo
from vo_core.frames_at import read_frame
from vo_core.geometry.wall import Pose, WallPoint, wall_point
from vo_core.odometry import Odometry
from vo_core.register import Shift, register
from vo_core.rig import Camera, Mount, Pipe, Rig
from vo_core.sources import Frame, VideoFile
from vo_core.track import Estimate, Track

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
