"""The files that a program and its processes open, as strace shows them, and which of them are nobody's business."""

import os
import re
import shutil
import sys
import sysconfig
from collections import defaultdict
from pathlib import Path

import matplotlib

from harvester.machine import folders
from tests.support.paths import EXAMPLES, ROOT

STRACE = shutil.which("strace")
SYSTEM = ("/usr", "/lib", "/lib64", "/bin", "/sbin", "/etc", "/proc", "/sys", "/dev")


def traced(trace):
    """The words before a command that write each file it opens to ``trace``; none if there is no strace."""
    calls = ["-e", "open,openat,execve,chdir,fchdir"]
    return (
        [STRACE, "-f", "--seccomp-bpf", "-z", *calls, "-s", "300", "-o", str(trace)]
        if STRACE
        else []
    )


def opened(trace, start):
    """Each file opened or executed: (its path, the line of strace); ``start`` was the current folder at first."""
    current = defaultdict(lambda: [start])  # the folders of each process
    for line in trace.read_text(errors="replace").splitlines():
        folder = current[line.split()[0]]
        if call := re.match(r'\d+\s+(chdir|open|openat|execve)\((?:AT_FDCWD, )?"([^"]*)"', line):
            path = Path(os.path.normpath(folder[-1] / call[2]))
            if call[1] == "chdir":
                folder.append(path)
            else:
                yield path, line
        elif "fchdir(" in line:
            folder.pop()


def strange(path, own):
    """Whether a file is in none of: ``own`` folders, Python and its packages, the cache, the fonts', the system's."""
    places = {*own, EXAMPLES, ROOT / "harvester", ROOT / "netlists", folders.cache_folder()}
    places |= {Path(sys.prefix), Path(sys.base_prefix), *map(Path, sysconfig.get_paths().values())}
    places |= {
        Path(matplotlib.get_configdir()),
        Path(matplotlib.get_cachedir()),
        *map(Path, SYSTEM),
    }
    return not any(path.is_relative_to(place) for place in places)
