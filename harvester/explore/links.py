"""A design in the address of its page: the text of the scene file, compressed."""

import base64
import tempfile
import zlib
from pathlib import Path

from harvester.errors import InputError
from harvester.explore.draft import Draft

MOST_LETTERS = 20_000  # of the scene in a link


def held(draft: Draft) -> str | None:
    """The part of a design in a link; None if it needs files of its own, which no link has."""
    if draft.files or "/" in (draft.netlist or ""):
        return None
    return base64.urlsafe_b64encode(zlib.compress(draft.toml().encode(), 9)).decode()


def opened(text: str) -> Draft:
    """The draft that a link holds.

    Raises InputError for any other text, and as `harvester.scene.toml.loads`, also for files
    of its own, and for more parameters than uploads may have.
    """
    reader = zlib.decompressobj()
    try:
        scene = reader.decompress(base64.urlsafe_b64decode(text), MOST_LETTERS).decode()
    except (ValueError, zlib.error):
        raise InputError("the link must hold a scene, but was cut off or changed") from None
    if not reader.eof:  # nothing of it is read: the first part may be another scene
        raise InputError(
            f"the link must hold a scene of at most {MOST_LETTERS} letters, "
            "but holds more, or was cut off"
        )
    with tempfile.TemporaryDirectory() as empty:
        draft = Draft.of_text(scene, Path(empty))
    draft.check_knobs()
    return draft
