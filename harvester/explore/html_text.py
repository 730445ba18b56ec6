"""What the page says in words, as HTML: answers with their errors, what the numbers mean, warnings, differences.

All that comes from a scene is escaped.
"""

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import Any, NamedTuple

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


def without_knobs(tables: Iterable[str]) -> str:
    """That tables of the scene have no knobs on the page."""
    names = " and ".join("[[mode]]" if one == "mode" else f"[{one}]" for one in tables)
    return f'<div class="by">{escape(names)} of the scene counts as its file has it: there are no knobs for it.</div>'


class Power(NamedTuple):
    """The power at a working point, of the engine nearest to the truth: in W or nondimensional, as ``unit`` says.

    ``error`` is what is known of its 95 % error, None where nothing is; ``known`` says that this is all of it;
    ``share`` is that of the most that any device of this mass could take, None where no bound applies.
    """

    engine: str
    value: float
    error: float | None
    known: bool
    share: float | None
    unit: str


def power_here(live: Live, runs: Sequence[dict[str, Any]]) -> Power | None:
    """The power of the design itself: that of the last of its ``runs``, which goes before a formula that is not exact.

    A circuit's power is never that of a resistor in its place: None until a run has it.
    """
    found, unit = best(live.here), "W" if live.problem.physical else ""
    own = [run for run in runs if run["own"]]
    if own and (found is None or not ENGINES[found.engine].is_exact or live.instead):
        one = own[-1]
        error = one["error"] if one["known"] or one["error"] else None
        return Power(one["engine"], one["y"], error, one["known"], one["share"], unit)
    if found is None or live.instead:
        return None
    value = found.mean_power
    return Power(found.engine, value.value, value.error95, True, found.share_of_possible, unit)


def headline(live: Live, runs: Sequence[dict[str, Any]], why: str = "", beside: Sequence[str] = ()) -> str:
    """The working point in large letters: its power with the whole error, and what is known ``beside`` it.

    Where it is not known the page says so, and ``why``, or that it is being computed.
    """
    found = power_here(live, runs)
    if found is not None:
        number, told = _number(found.value, found.unit, found.error)
        told += "" if found.known or found.error is None else " of what is known of its error"
        share = [] if found.share is None else [f"{100.0 * found.share:.3g} % of the possible"]
        more = "".join(f", {escape(plain(one))}" for one in (*share, *beside))
        return _large(number, told, f"mean power by <b>{escape(found.engine)}</b>{more}", live.at)
    if live.instead:
        by = plain(why) if why else "The curves are those of a resistor in its place."
        known = "The circuit's power is not known." if why else "Computing the circuit's power ..."
        return f'<div class="power none">{known}</div><div class="by">{escape(by)}</div>'
    return (
        '<div class="power none">No formula knows this scene.</div>'
        '<div class="by">Run an engine below; the reasons are under "The working point".</div>'
    )


def _large(number: str, told: str, by: str, at: float) -> str:
    """A number in large letters, its error beside it, below it whose it is; the page's code has the place ``at``."""
    head = f'{escape(plain(number))} <span class="error95">{escape(plain(told))}</span>'
    return f'<div class="power" data-at="{at!r}">{head}</div><div class="by">{by}</div>'


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


def life(found: dict[str, Any]) -> str:
    """How the node lives, as `in_worker.life` tells it, or why that is not known (``error``); or a chip."""
    if "error" in found:
        return f'<div class="by">The node: {escape(plain(found["error"]))}</div>'
    remarks = "".join(f"<li>{escape(plain(one))}</li>" for one in found["remarks"])
    return table(found.get("heads", ("the node", "in a day")), found["rows"], "life") + f"<ul>{remarks}</ul>"


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


def difference(
    rows: Sequence[tuple[str, str, str]],
    before: Power | None,
    after: Power | None,
    beside: tuple[Mapping[str, str], Mapping[str, str]] = ({}, {}),
) -> str:
    """Two designs side by side: the keys in which they differ, their powers, and what is known ``beside`` of each."""
    cells = [(name.replace("load.parameters.", "").replace(".", ": ").replace("_", " "), *rest) for name, *rest in rows]
    cells.append(("mean power", _told(before), _told(after)))
    if before and after and (before.share is not None or after.share is not None):
        cells.append(("of the possible", _share(before), _share(after)))
    if before and after and before.value > 0.0 and before.unit == after.unit:
        cells.append(("ratio of the powers", "1", f"{after.value / before.value:.4g}"))
    unknown = "not computed yet"
    cells += [(name, *(one.get(name, unknown) for one in beside)) for name in {**beside[0], **beside[1]}]
    same = "" if rows else "<p>The present design is the pinned one: turn a knob.</p>"
    return same + table(("", "pinned", "now"), cells, "difference")


def _told(power: Power | None) -> str:
    """A power with its error and its engine."""
    if power is None:
        return "not computed yet"
    number, error = _number(power.value, power.unit, power.error)
    return f"{number} {error}{'' if power.known or power.error is None else ' of what is known'}, by {power.engine}"


def _share(power: Power) -> str:
    return "no bound" if power.share is None else f"{100.0 * power.share:.3g} %"
