"""What is published: numbers that rise, and the newest of them kept."""

from __future__ import annotations

import itertools
import threading

from app.tracking.live import Live, Progress, Update

PROGRESS = Progress(0, None, None, None)


def test_of_two_updates_at_once_the_one_with_the_higher_number_is_kept() -> None:
    live, numbers = Live(), itertools.count(1)
    other = threading.Thread(target=live.publish, args=(Update("a", "running", PROGRESS),))

    class Interrupted:
        def __next__(self) -> int:
            number = next(numbers)
            if number == 2:
                other.start()
                other.join(0.2)  # it would overtake this update here
            return number

    live._seq = Interrupted()  # type: ignore[assignment]
    live.publish(Update("a", "running", PROGRESS))
    live.publish(Update("a", "running", PROGRESS))
    other.join()
    newest = live.newest("a")
    assert newest is not None
    assert newest.seq == 3
