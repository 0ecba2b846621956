"""Memory stays flat however long the video is."""

import gc
import resource
import sys
from itertools import cycle, islice
from pathlib import Path

import numpy as np
from worlds import FRAME_S, World, small_rig, speckle, stored

from vo_core import Odometry

RIG = small_rig(camera={"width": 96, "height": 72, "cx": 47.5, "cy": 35.5})
WARM_UP, FRAMES = 200, 1000
"""Frames until every cache is full; and after that."""


def used():
    """Blocks that Python holds, and bytes of the process in memory."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return sys.getallocatedblocks(), pages * resource.getpagesize()


def test_a_thousand_frames_more_take_no_more_memory():
    world = World(RIG, speckle(0))
    x_mm = 60 * (1 - np.cos(np.linspace(0, 2 * np.pi, 100, endpoint=False)))
    # There and back again, with keyframes on the way, and a few frames that are lost.
    images = [stored(world.view(x), n) for n, x in enumerate(x_mm)]
    images[40:43] = [np.zeros_like(images[0])] * 3
    odometry, frames = Odometry(RIG), enumerate(cycle(images))

    def drive(count):
        for n, image in islice(frames, count):
            odometry.step(image, n * FRAME_S)
        return used()

    (blocks, resident_bytes), (blocks_later, resident_later_bytes) = drive(WARM_UP), drive(FRAMES)
    # One object a frame would be 1000 blocks, one picture a frame 25 MB; smoothing keeps 0.6 MB.
    assert blocks_later - blocks < 500
    assert resident_later_bytes - resident_bytes < 9_000_000
