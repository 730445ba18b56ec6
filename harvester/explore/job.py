"""One engine on one scene in a process of its own, for the page: `python -m harvester.explore.job ENGINE WITHIN`.

The scene's tables are a JSON object, the first line of stdin.  Stdout gets a JSON object a line:
``fraction`` done, and at the end ``answer`` (as `harvester run --json`) with ``row`` (of a sweep),
and ``power`` and ``voltage`` in words, or ``error``.  The process ends when stdin does, for then
the page's program has ended.
"""

import json
import os
import sys
import threading
import time
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from harvester.answers.estimate import Estimate

SELDOM = 0.1  # seconds between two reports of the fraction


def main() -> None:
    """Run the engine and report how far it is; an error of any kind is one line."""
    tables = json.loads(sys.stdin.readline())
    threading.Thread(target=_end_with_stdin, daemon=True).start()
    try:
        _say(**_answer(tables, *sys.argv[1:3]))
    except Exception as error:
        from harvester.errors import named

        _say(error=str(named(error)))


def _answer(tables: dict[str, Any], engine: str, within: str) -> dict[str, Any]:
    from harvester.engines import selection
    from harvester.quantities.units import fraction
    from harvester.scene.scene import Scene

    last = [0.0]

    def tell(done: float) -> None:
        now = time.monotonic()
        if now - last[0] > SELDOM:
            last[0] = now
            _say(fraction=done)

    return told_of(selection.engine(engine, within=fraction(within)).run(Scene(**tables), tell))


def told_of(estimate: "Estimate") -> dict[str, Any]:
    """The report of an answer to a page."""
    from harvester.studies.sweep.rows import SweepRow

    units = estimate.unit_names
    return {
        "answer": estimate.as_json(),
        "settled": estimate.has_settled,
        "known_error95": estimate.mean_power.known_error95,
        "row": SweepRow.answered(estimate).written,
        "power": estimate.mean_power.format(units.power),
        "voltage": estimate.mean_square_voltage.format(units.mean_square_voltage),
    }


def _say(**what: Any) -> None:
    print(json.dumps(what, allow_nan=False), flush=True)


def _end_with_stdin() -> None:
    sys.stdin.buffer.read()
    os._exit(1)


if __name__ == "__main__":
    main()
