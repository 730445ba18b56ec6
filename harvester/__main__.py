"""The program: `harvester`, or ``python -m harvester``."""

import os
import signal  # and nothing that takes long: before `main` Python prints a traceback for ^C

from harvester.machine.cores import ONE_THREAD
from harvester.machine.imports import search_garbage_rarely

NO_MEMORY = b"harvester: there is not enough memory to start the program\n"


def main() -> None:
    """Load the command line and run it; one line if memory does not even suffice for that."""
    try:
        _main()
    except (MemoryError, SystemError):  # Python itself raises SystemError if memory ends
        os.write(2, NO_MEMORY)
        os._exit(3)


def _main() -> None:
    """As `main`; ^C while the command line loads ends the program without a word."""
    before = signal.getsignal(signal.SIGINT)
    if (
        before is signal.default_int_handler
    ):  # otherwise ^C is ignored, as in the background of a script
        signal.signal(signal.SIGINT, signal.SIG_DFL)
    for name, count in ONE_THREAD.items():
        os.environ.setdefault(name, count)
    # figures go into files, whatever windows the user has chosen or misspelt
    os.environ["MPLBACKEND"] = "agg"
    search_garbage_rarely()
    from harvester.cli import main as run

    signal.signal(signal.SIGINT, before)
    run()


if __name__ == "__main__":
    main()
