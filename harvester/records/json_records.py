"""JSON records as rows: one object per line, or an array of objects, such as {"t": 0.005, "a": 0.98}."""

import csv
import io
import json
from typing import Any

from harvester.errors import InputError, shown

_FIRST = "{", "["  # first letters of a file of JSON


def as_csv(text: str, shown_path: str, argument: str) -> str | None:
    """The rows of JSON records as CSV, the names of their values above; None for another file.

    Raises InputError, which begins with ``argument``, for records that are not flat, or whose names
    differ.
    """
    begin = text.lstrip()[:2].strip()
    if not begin.startswith(_FIRST) or begin[1:] not in ("", '"', "{", "}"):
        return None
    records = _records(text)
    if records is None:
        return None
    names = list(records[0])
    out = io.StringIO()
    rows = csv.writer(out, lineterminator="\n")
    rows.writerow(names)
    for number, record in enumerate(records, 1):
        if list(record) != names or any(isinstance(cell, dict | list) for cell in record.values()):
            raise InputError(
                f"{argument} must have JSON records of the same names with a number or a text "
                f"each, {shown(','.join(names))}, but {shown_path} has another in record {number}: "
                "export it as CSV"
            )
        rows.writerow("" if cell is None else cell for cell in record.values())
    return out.getvalue()


def _records(text: str) -> list[dict[str, Any]] | None:
    """The objects of an array, or of lines; None if the text is not one of both."""
    try:
        loaded = json.loads(text)
        records = loaded if isinstance(loaded, list) else [loaded]
    except (ValueError, RecursionError):
        try:
            records = [json.loads(line) for line in text.splitlines() if line.strip()]
        except (ValueError, RecursionError):
            return None
    are_objects = bool(records) and all(isinstance(record, dict) and record for record in records)
    return records if are_objects else None
