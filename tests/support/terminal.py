"""The program on a terminal of its own (a pty), as a person sees it."""

import fcntl
import os
import pty
import select
import struct
import subprocess
import sys
import termios
import time


def on_terminal(*args, answers=(), env=None, cwd=None, timeout=60.0, size=(40, 100)):
    """Run the program with stdin, stdout and stderr on a pty; returns exit status and what the screen was sent.

    ``answers`` are typed one after another, each when the program has been silent after a question
    (": "). ``size`` are lines and columns, both 0 on a terminal that does not know them.
    """
    master, slave = pty.openpty()
    fcntl.ioctl(slave, termios.TIOCSWINSZ, struct.pack("HHHH", *size, 0, 0))
    full = {**os.environ, "TERM": "xterm", **(env or {})}
    if "NO_COLOR" not in (env or {}):
        full.pop("NO_COLOR", None)
    process = subprocess.Popen(
        [sys.executable, "-m", "harvester", *map(str, args)],
        stdin=slave,
        stdout=slave,
        stderr=slave,
        env=full,
        cwd=cwd,
        start_new_session=True,
    )
    os.close(slave)
    told = b""
    waiting = list(answers)
    end = time.monotonic() + timeout
    answered = 0
    try:
        while time.monotonic() < end:
            ready, _, _ = select.select([master], [], [], 0.1)
            if ready:
                try:
                    piece = os.read(master, 65536)
                except OSError:  # the other end is closed
                    break
                if not piece:
                    break
                told += piece
            elif waiting and len(told) > answered and told.rstrip(b" ").endswith(b":"):
                answered = len(told)
                os.write(master, waiting.pop(0).encode() + b"\n")
        return process.wait(max(end - time.monotonic(), 0.1)), told.decode()
    finally:
        if process.poll() is None:
            process.kill()
            process.wait()
        os.close(master)
