"""The `chainage` command in processes of its own, forked from one that has imported it.

To import the server takes four seconds of processor time, and the tests start it many times over;
a fork takes next to none.  The process that is forked does nothing else and has a single thread.
Tests of the start itself run `python` instead.
"""

from __future__ import annotations

import os
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from multiprocessing import get_context
from multiprocessing.connection import Connection
from pathlib import Path

_CONTEXT = get_context("forkserver")
_CONTEXT.set_forkserver_preload(["app.main", "app.cli.main", "app.cli.server"])


def become(words: list[str], environment: dict[str, str], out: Connection, log: Path) -> None:
    """Become the command, in the child."""
    from app.cli.main import main  # it is loaded there, and not in every test process

    os.environ.clear()
    os.environ.update(environment)
    os.dup2(out.fileno(), 1)
    out.close()
    with log.open("ab") as errors:
        os.dup2(errors.fileno(), 2)
    sys.argv = ["chainage", *words]
    main()


class Fork:
    """A running command, whose output is to be read from `stdout`."""

    def __init__(
        self,
        words: Sequence[str],
        environment: Mapping[str, str],
        log: Path,
        *,
        target: Callable[[list[str], dict[str, str], Connection, Path], None] = become,
    ) -> None:
        """Run `chainage` with some words; what it says of errors is added to the file `log`.

        Args:
            target: What the process does instead of `become`, such as to change a constant before.
        """
        ours, theirs = _CONTEXT.Pipe(duplex=False)
        self._process = _CONTEXT.Process(
            target=target, args=(list(words), dict(environment), theirs, log)
        )
        self._process.start()
        theirs.close()
        self.stdout = os.fdopen(os.dup(ours.fileno()), encoding="utf-8")
        ours.close()

    @property
    def pid(self) -> int:
        assert self._process.pid is not None
        return self._process.pid

    def terminate(self, patience_s: float) -> int:
        """Terminate it like a service manager; return the exit code."""
        os.kill(self.pid, signal.SIGTERM)
        return self.wait(patience_s)

    def wait(self, patience_s: float) -> int:
        """Wait for its end; return the exit code, of a signal a negative one."""
        self._process.join(patience_s)
        assert self._process.exitcode is not None, "The process did not end in time."
        return self._process.exitcode

    def end(self) -> None:
        """End it in whatever state it is."""
        self._process.kill()
        self._process.join()
        self.stdout.close()
