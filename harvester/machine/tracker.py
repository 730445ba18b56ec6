"""The process of loky that unlinks the semaphores of processes that were killed, without a stderr.

Loky starts it anew if it was killed, and then has a traceback for each semaphore of before.
"""

import os


def main(fd: int, verbose: bool = False) -> None:
    """Run loky's tracker, which reads the names of semaphores from a pipe, with stderr closed."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), 2)
    from loky.backend.resource_tracker import main as of_loky

    of_loky(fd, verbose)
