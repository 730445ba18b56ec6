"""What the page says in words, as HTML: answers with their errors, what the numbers mean, warnings, differences.

All that comes from a scene is escaped.
"""

import math
import re
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from harvester.answers.estimate import Estimate
from harvester.engines.selection import ENGINES
from harvester.equations.problem import Problem
from harvester.explore.live import FORMULAS, Live, best, engineering
from harvester.quantities.units import SYMBOLS
from harvester.scene.keys import keys
from harvester.uncertainty.value import Value

_PRINTED = (("+-", "±"), (" uW", " µW"), (" um", " µm"), (" uV", " µV"), ("^2", "²"), (" V²", " V²"))
_ARGUMENT = re.compile(r"`([a-z][a-z_]*)`")


SERVING = ("engines_that_serve", "no_engine_yet")  # which the page shows elsewhere


def plain(text: str) -> str:
    """A sentence of the library for the page: signs of print, and no backticks about names."""
    for written, printed in _PRINTED:
        text = text.replace(written, printed)
    return _ARGUMENT.sub(r"\1", text)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "") -> str:
    """A table; cells are texts, which are escaped."""
    head = "".join(f"<th>{escape(one)}</th>" for one in heads)
    body = "".join("<tr>" + "".join(f"<td>{escape(plain(cell))}</td>" for cell in row) + "</tr>" for row in rows)
    return f'<table class="{kind}">{f"<thead><tr>{head}</tr></thead>" if heads else ""}<tbody>{body}</tbody></table>'


def problem_line(text: str) -> str:
    """An error in one line, or nothing."""
    return f'<div class="error" role="alert">{escape(plain(" ".join(text.split())))}</div>' if text else ""


def headline(live: Live, runs: Sequence[dict[str, Any]], why: str = "") -> str:
    """The working point in large letters: the power of the engine nearest to the truth, with its whole error.

    The last of the ``runs`` there goes before a formula that is not exact.  A circuit's power is never that of a
    resistor in its place: until a run has it, it is not known yet, or not at all, and ``why``.
    """
    found = best(live.here)
    own = [run for run in runs if run["own"]]
    if own and (found is None or not ENGINES[found.engine].is_exact or live.instead):
        unit = "W" if live.problem.physical else ""
        number, told = _number(own[-1]["y"], unit, own[-1]["error"])
        told += "" if own[-1]["known"] else " of what is known of its error"
        return _large(number, told, f"mean power by <b>{escape(own[-1]['engine'])}</b>")
    if live.instead:
        by = plain(why) if why else "The curves are those of a resistor in its place."
        known = "The circuit's power is not known." if why else "Computing the circuit's power ..."
        return f'<div class="power none">{known}</div><div class="by">{escape(by)}</div>'
    if found is None:
        return (
            '<div class="power none">No formula knows this scene.</div>'
            '<div class="by">Run an engine below; the reasons are under "The working point".</div>'
        )
    value, error = found.mean_power, found.mean_power.error95
    number, told = _number(value.value, found.unit_names.power, error)
    return _large(number, told, f"mean power by <b>{escape(found.engine)}</b>")


def _large(number: str, told: str, by: str) -> str:
    """A number in large letters, its error beside it, and below it whose it is."""
    head = f'{escape(plain(number))} <span class="error95">{escape(plain(told))}</span>'
    return f'<div class="power">{head}</div><div class="by">{by}</div>'


def _number(value: float, unit: str, error: float | None) -> tuple[str, str]:
    """A value with its unit, and its whole error in the same unit, as far as it is known."""
    power = engineering([value]) if unit else 0
    prefix = SYMBOLS[power]
    if error is None:
        return f"{value / 10.0**power:.4g} {prefix}{unit}", "its error is not known"
    if error < 1e-6 * abs(value):
        return f"{value / 10.0**power:.5g} {prefix}{unit}", "closed form"
    digits = max(2, 2 + math.ceil(math.log10(abs(value) / error))) if value else 3
    return f"{value / 10.0**power:.{digits}g} {prefix}{unit}", f"± {error / 10.0**power:.2g} {prefix}{unit} (95 %)"


def answers(live: Live, runs: Sequence[dict[str, Any]]) -> str:
    """The working point by every engine that answered, with all parts of the error; and why others did not."""
    rows = [_row(one, " (a resistor)" * live.instead) for one in live.here.values()]
    rows += [(run["engine"], run["text"], run["voltage"]) for run in runs if run["own"]]
    found = table(("engine", "mean power", "mean square voltage"), rows, "answers") if rows else ""
    reasons = [(name, live.refused[name]) for name in FORMULAS if name in live.refused]
    if reasons:
        items = "".join(f"<li>{escape(plain(reason))}</li>" for _, reason in reasons)
        found += f'<ul class="refused">{items}</ul>'
    return found


def _row(one: Estimate, instead: str) -> tuple[str, str, str]:
    units = one.unit_names
    return (
        one.engine + instead,
        one.mean_power.format(units.power),
        one.mean_square_voltage.format(units.mean_square_voltage),
    )


def warnings(live: Live, runs: Sequence[dict[str, Any]], more: Sequence[str] = ()) -> str:
    """The warnings of all answers, each once."""
    found = [f"{one.engine}: {word}" for one in live.here.values() for word in one.warnings]
    found += [f"{run['engine']}: {word}" for run in runs if run["own"] for word in run["warnings"]]
    found += more
    items = "".join(f"<li>{escape(plain(one))}</li>" for one in dict.fromkeys(found))
    return f'<ul class="warnings">{items}</ul>' if items else ""


def meanings(problem: Problem) -> tuple[str, list[str]]:
    """What the scene's numbers mean, as HTML, and the warnings among it."""
    if not problem.physical:
        known = {f"{one.table}.{one.name}": one.meaning for one in keys()}
        rows = [
            (name, f"{value:.4g}", known.get(f"nondimensional.{name}", ""))
            for name, value in problem.scene.tables()["nondimensional"].items()
        ]
        return table((), rows, "numbers"), []
    from harvester.devices.interpretation import meaning

    found = meaning(problem)
    rows = [(name, Value(value).format(unit), what) for name, value, unit, what in found.numbers]
    doubts = [str(one) for one in found.remarks if one.severity == "warning"]
    told = [one.line for one in found.remarks if one.severity == "note" and one.code not in SERVING]
    paragraphs = "".join(f"<p>{escape(plain(one[:1].upper() + one[1:]))}</p>" for one in told)
    return paragraphs + table((), rows, "numbers"), doubts


def difference(rows: Sequence[tuple[str, str, str]], before: Estimate | None, after: Estimate | None) -> str:
    """The table of what differs from the pinned design, and its power beside the present one."""
    cells = [(name.replace("load.parameters.", "").replace(".", ": ").replace("_", " "), *rest) for name, *rest in rows]
    if before is not None and after is not None:
        unit, was, now = after.unit_names.power, before.mean_power, after.mean_power
        cells.append((f"mean power ({after.engine})", was.format(unit), now.format(unit)))
        if was.value > 0.0 and before.unit_names == after.unit_names:
            cells.append(("ratio of the powers", "1", f"{now.value / was.value:.4g}"))
    if not rows:
        return "<p>The present design is the pinned one: turn a knob.</p>" + (
            table(("", "pinned", "now"), cells, "difference") if cells else ""
        )
    return table(("", "pinned", "now"), cells, "difference")
