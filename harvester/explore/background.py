"""A run of an engine in the background of the page: started, watched, and killed with all that it started."""

import contextlib
import json
import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from typing import Any

from harvester.machine.processes import SAFE
from harvester.machine.system import this_system

# seconds that processes get to end by themselves; between two looks at them
PATIENCE, LOOK = 2.0, 0.02
Listener = Callable[[dict[str, Any]], None]


class Background:
    """A run in a process ``group`` of its own; ``listener`` gets each of its JSON objects, in a thread of its own.

    The last one has ``answer``, ``error`` or ``cancelled``.
    """

    def __init__(
        self, tables: dict[str, Any], engine: str, within: str, listener: Listener
    ) -> None:
        self._listener = listener
        self._cancelled = False
        self._process = subprocess.Popen(
            [sys.executable, "-m", "harvester.explore.job", engine, within],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            env={**os.environ, **SAFE},
            **this_system.own_group(),
        )
        self.group = self._process.pid
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it died at once, and stdout will say nothing
            self._process.stdin.write(json.dumps(tables) + "\n")
            self._process.stdin.flush()
        threading.Thread(target=self._listen, daemon=True).start()

    def cancel(self) -> None:
        """End the run and all the processes that it started: it ends itself when its stdin is closed."""
        self._cancelled = True
        with contextlib.suppress(OSError):
            if self._process.stdin is not None:
                self._process.stdin.close()

    def _listen(self) -> None:
        """Hand on the output of the process; at its end, report if it ended without any."""
        ended = False
        with self._process as process:
            for line in process.stdout or ():
                with contextlib.suppress(ValueError):
                    said = json.loads(line)
                    if not isinstance(said, dict) or self._cancelled:
                        continue
                    ended = ended or "answer" in said or "error" in said
                    self._listener(said)
            self._end_group()
        status = self._process.returncode
        if self._cancelled:
            self._listener({"cancelled": True})
        elif not ended:
            self._listener({"error": f"the run ended without an answer (status {status})"})

    def _end_group(self) -> None:
        """Wait until the processes of the run have ended, which free their shared memory, and kill those left."""
        for _ in range(round(PATIENCE / LOOK)):
            if not this_system.group_lives(self.group):
                return
            self._process.poll()
            time.sleep(LOOK)
        this_system.kill_group(self.group)
