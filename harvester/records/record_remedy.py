"""The command that cleans a file for a scene, tried before it is printed."""

import shlex
from dataclasses import replace
from pathlib import Path
from typing import Any

from harvester.errors import InputError
from harvester.records.cleaning import Part, clean
from harvester.records.csv_table import MOST_BYTES
from harvester.records.record_facts import AskedError, RecordFacts

UNKNOWN_VALUES = {"rate": "HZ", "unit": "UNIT"}  # names of values that only the user knows
_TRIES = 6  # options that a file may need


def remedy(path: str) -> str:
    """The command that cleans a file, with the options that it needs; empty if no options help."""
    try:
        if Path(path).stat().st_size > MOST_BYTES:
            return ""
    except (OSError, ValueError):
        return ""
    facts = RecordFacts()
    part = Part()
    options = dict[str, str]()
    for _ in range(_TRIES):
        try:
            clean(path, facts, part)
        except AskedError as asked:
            if asked.option == "longest":
                part = Part(longest=True)
                options["--longest"] = ""
                continue
            name = "--" + asked.option.replace("_", "-")
            if asked.value is None:
                options[name] = UNKNOWN_VALUES.get(asked.option, asked.option.upper())
                break
            chosen: dict[str, Any] = {asked.option: asked.value}
            facts = replace(facts, **chosen)
            options[name] = asked.value
            continue
        except InputError:
            return ""
        break
    every = [word for pair in options.items() for word in pair if word]
    words = ["harvester", "record", path, *every, "--out", "clean.csv"]
    typed = (word if word in UNKNOWN_VALUES.values() else shlex.quote(word) for word in words)
    return f"'{' '.join(typed)}'"
