"""The tests of the core run OpenCV on one thread, as its speed is stated for.

Two test processes share two cores; OpenCV's threads would wait for each other busily (measured:
8 ms a step in place of 3).
"""

import cv2

cv2.setNumThreads(1)
