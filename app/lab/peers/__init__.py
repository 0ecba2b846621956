"""The peers of the bench: methods that a practitioner would write instead of Chainage's.

- `features`: point features of two pictures, matched by KLT or ORB.
- `down`: motion of the picture times the height of the camera.
- `forward`: essential matrices, and counting of joints, for a camera that looks along the pipe.
"""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Mapping

from app.lab.peers.down import FrameToFrame, Klt, Orb, PhaseCorrelate, SkimageCorrelation
from app.lab.peers.forward import ForwardPeer, JointCounting, KltEssential, OrbEssential
from vo_core.rig import Rig

DOWN_PEERS: Mapping[str, Callable[[Rig], FrameToFrame]] = {
    "phaseCorrelate": PhaseCorrelate,
    "KLT": Klt,
    "ORB": Orb,
    **({"skimage": SkimageCorrelation} if importlib.util.find_spec("skimage") else {}),
}
"""Peers by name for a camera that looks down; skimage only where it is installed."""

FORWARD_PEERS: Mapping[str, Callable[[Rig], ForwardPeer]] = {
    "KLT + essential matrix": KltEssential,
    "ORB + essential matrix": OrbEssential,
    "joint counting": JointCounting,
}
"""Peers by name for a camera that looks along the pipe."""

__all__ = ["DOWN_PEERS", "FORWARD_PEERS", "ForwardPeer", "FrameToFrame", "PhaseCorrelate"]
