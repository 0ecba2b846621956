"""Point features of two pictures, matched."""

from __future__ import annotations

import cv2
import numpy as np

from vo_core.types import Image, Matrix

LEAST_MATCHES = 8
"""Least number of matches for a motion."""

Matches = tuple[Matrix, Matrix]
"""Pixels of the same points in two pictures, (N, 2) each."""

_NONE: Matches = np.zeros((0, 2)), np.zeros((0, 2))


def klt_matches(before: Image, now: Image) -> Matches:
    """Track corners of (H, W) pictures by pyramidal Lucas-Kanade."""
    corners = cv2.goodFeaturesToTrack(before, 400, 0.01, 8)
    if corners is None:
        return _NONE
    found, status, _ = cv2.calcOpticalFlowPyrLK(
        before, now, corners, corners.copy(), winSize=(21, 21), maxLevel=4
    )
    good = status.ravel() == 1
    return corners.reshape(-1, 2)[good], found.reshape(-1, 2)[good]


class OrbMatcher:
    """Matches ORB features that choose each other."""

    def __init__(self) -> None:
        self._orb = cv2.ORB.create(1000)
        self._matcher = cv2.BFMatcher(cv2.NORM_HAMMING, crossCheck=True)

    def matches(self, before: Image, now: Image) -> Matches:
        """Match the features of (H, W) pictures."""
        (points, bits), (points_now, bits_now) = (
            self._orb.detectAndCompute(image, None) for image in (before, now)
        )
        if bits is None or bits_now is None:
            return _NONE
        pairs = self._matcher.match(bits, bits_now)
        return (
            np.array([points[m.queryIdx].pt for m in pairs]).reshape(-1, 2),
            np.array([points_now[m.trainIdx].pt for m in pairs]).reshape(-1, 2),
        )
