"""The source of ngspice: Debian's own archive of it, found, checked by its SHA-256, and unpacked."""

import hashlib
import os
import shutil
import tarfile
from pathlib import Path

from recipe import apt

ARCHIVE = "ngspice_39.3+ds.orig.tar.gz"
SHA256 = "d2a934d057c66364d96f451dd7845e38109dde0e0d57287a6b33a525c7289647"
VARIABLE = "NGSPICE_SOURCE"  # of the environment: the path of the archive


class NoSourceError(RuntimeError):
    """The source of ngspice is not to be had, or is not what it was; the text says what to do."""


def archive(root: Path) -> Path:
    """The archive, checked: the one that VARIABLE names, else that in ``root``, else from apt, without root.

    Raises NoSourceError where there is none, and for an archive whose content is not the one that
    is known.
    """
    named = os.environ.get(VARIABLE)
    found = Path(named) if named else root / ARCHIVE
    if not found.is_file() and not named:
        apt.download(
            ARCHIVE,
            "source",
            "-qq",
            "--download-only",
            "ngspice=39.3+ds-1",
            to=root,
            source_lines=True,
        )
    if not found.is_file():
        raise NoSourceError(f"the source of ngspice must be a file, but {found} is none: {_how()}")
    digest = hashlib.sha256(found.read_bytes()).hexdigest()
    if digest != SHA256:
        raise NoSourceError(f"{found} must have the SHA-256 {SHA256}, but has {digest}: {_how()}")
    return found


def unpacked(path: Path, folder: Path) -> Path:
    """Unpack the archive into a new folder, and return the one in it that has everything."""
    shutil.rmtree(folder, ignore_errors=True)
    with tarfile.open(path) as all_files:
        all_files.extractall(folder, filter="data")
    (top,) = folder.iterdir()
    return top


def _how() -> str:
    return f"get {ARCHIVE} of Debian's source package ngspice 39.3+ds-1, and set {VARIABLE} to its path"
