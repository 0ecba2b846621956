"""Filters give the same result wherever their pictures lie in memory."""

import numpy as np

from vo_core.image.filters import magnitude


def test_a_length_is_the_same_to_the_bit_in_every_place_of_memory():
    # The forward view of a film had another track from process to process, by 1e-7 mm.
    rng = np.random.default_rng(0)
    along, down = rng.standard_normal((2, 72, 96)).astype(np.float32)
    kept, found = [], set()
    for size in range(1, 200):
        kept.append(np.zeros(37 * size, np.uint8))  # the next picture gets another place
        found.add(magnitude(along, down).tobytes())
    assert len(found) == 1
    assert np.allclose(magnitude(along, down), np.hypot(along, down), rtol=1e-6)
