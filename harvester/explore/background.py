"""A run of an engine in the background of the page: started, watched, and killed with all that it started."""

import contextlib
import json
import os
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from typing import Any

from harvester.machine.processes import SAFE

Told = Callable[[dict[str, Any]], None]


class Background:
    """A run in a process ``group`` of its own; ``told`` gets each JSON object that it says, in a thread of its own.

    The last one has ``answer``, ``error`` or ``cancelled``.
    """

    def __init__(self, tables: dict[str, Any], engine: str, within: str, told: Told) -> None:
        self._told, self._cancelled = told, False
        self._process = subprocess.Popen(
            [sys.executable, "-m", "harvester.explore.job", engine, within],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            text=True,
            start_new_session=True,
            env={**os.environ, **SAFE},
        )
        self.group = self._process.pid
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):  # it died at once, and stdout will say nothing
            self._process.stdin.write(json.dumps(tables) + "\n")
            self._process.stdin.flush()
        threading.Thread(target=self._listen, daemon=True).start()

    def cancel(self) -> None:
        """Kill the run and all the processes that it started."""
        self._cancelled = True
        with contextlib.suppress(ProcessLookupError):
            os.killpg(self.group, signal.SIGKILL)

    def _listen(self) -> None:
        """Hand on what the process says; at its end, that it ended without a word where it did."""
        ended = False
        with self._process as process:
            for line in process.stdout or ():
                with contextlib.suppress(ValueError):
                    said = json.loads(line)
                    if not isinstance(said, dict) or self._cancelled:
                        continue
                    ended = ended or "answer" in said or "error" in said
                    self._told(said)
            with contextlib.suppress(ProcessLookupError):  # workers that would outlive it
                os.killpg(self.group, signal.SIGKILL)
        status = self._process.returncode
        if self._cancelled:
            self._told({"cancelled": True})
        elif not ended:
            self._told({"error": f"the run ended without an answer (status {status})"})
