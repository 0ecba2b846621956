"""A thread that the server needs begins again after a fault, and is named if it fails on and on."""

from __future__ import annotations

import queue
import threading

from builders import wait_until

from app.watched import Watched


def test_work_that_fails_begins_again_until_it_is_stopped() -> None:
    faults: queue.Queue[type[BaseException] | None] = queue.Queue()
    goes_on = threading.Event()

    def work() -> None:
        while (fault := faults.get()) is not None:
            raise fault
        goes_on.set()

    thread = Watched("post", work, stop_timeout_s=10.0)
    assert thread.trouble() is None  # nobody has started it
    thread.start()
    for fault in (KeyError, SystemExit):  # also what otherwise ends a thread without a word
        faults.put(fault)
    wait_until(faults.empty)
    assert thread.trouble() is None
    faults.put(MemoryError)
    assert "post has failed 3 times in a row (MemoryError)" in str(wait_until(thread.trouble))
    faults.put(None)
    assert goes_on.wait(10.0)
    wait_until(lambda: thread.trouble() == "post is dead; restart the server.")
    thread.stop()
    assert thread.trouble() is None
