"""The words of the page, as HTML: answers with their errors, the meaning of the numbers, warnings, differences.

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
from harvester.studies.prediction.prediction_result import Prediction
from harvester.uncertainty.value import Value, amount

_PRINTED = (
    ("+-", "±"),
    (" uW", " µW"),
    (" um", " µm"),
    (" uV", " µV"),
    ("^2", "²"),
    (" V²", " V²"),
)
_ARGUMENT = re.compile(r"`([a-z][a-z_]*)`")


SERVING = ("engines_that_serve", "no_engine_yet")  # which the page shows elsewhere


def plain(text: str) -> str:
    """A sentence of the library for the page: signs of print, and no backticks about names."""
    for written, printed in _PRINTED:
        text = text.replace(written, printed)
    return _ARGUMENT.sub(r"\1", text)


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], kind: str = "") -> str:
    """A table; cells are texts, which are escaped."""
    head = "".join(f"<th>{escape(name)}</th>" for name in heads)
    body = "".join(
        "<tr>" + "".join(f"<td>{escape(plain(cell))}</td>" for cell in row) + "</tr>"
        for row in rows
    )
    return f'<table class="{kind}">{f"<thead><tr>{head}</tr></thead>" if heads else ""}<tbody>{body}</tbody></table>'


def problem_line(text: str) -> str:
    """An error in one line, or nothing."""
    return (
        f'<div class="error" role="alert">{escape(plain(" ".join(text.split())))}</div>'
        if text
        else ""
    )


def without_knobs(tables: Iterable[str]) -> str:
    """That tables of the scene have no sliders on the page."""
    names = " and ".join("[[mode]]" if table == "mode" else f"[{table}]" for table in tables)
    return by(f"{names} of the scene counts as its file has it: there are no sliders for it.")


class Power(NamedTuple):
    """The power at a working point, of the engine nearest to the truth: in W or nondimensional, by ``unit``.

    ``error`` is the known part of its 95 % error, None if nothing is; ``known`` states that this is
    all of it; ``share`` is that of the most that any device of this mass could absorb, None if no
    bound applies.
    """

    engine: str
    value: float
    error: float | None
    known: bool
    share: float | None
    unit: str


def power_here(live: Live, runs: Sequence[dict[str, Any]]) -> Power | None:
    """The power of the design itself: that of the last of its ``runs``, which precedes a formula that is not exact.

    A circuit's power is never that of a resistor in its place: None until a run has it.
    """
    estimate = best(live.here)
    unit = "W" if live.problem.physical else ""
    here = [run for run in runs if run["own"]]
    if here and (estimate is None or not ENGINES[estimate.engine].is_exact or live.instead):
        last = here[-1]
        error = last["error"] if last["known"] or last["error"] else None
        return Power(last["engine"], last["y"], error, last["known"], last["share"], unit)
    if estimate is None or live.instead:
        return None
    value = estimate.mean_power
    return Power(
        estimate.engine, value.value, value.error95, True, estimate.share_of_possible, unit
    )


def headline(
    live: Live, runs: Sequence[dict[str, Any]], why: str = "", beside: Sequence[str] = ()
) -> str:
    """The working point in large letters: its power with the total error, and the known facts ``beside`` it.

    If it is not known the page reports it, and ``why``, or that it is being computed.
    """
    power = power_here(live, runs)
    if power is not None:
        number, error = _number(power.value, power.unit, power.error)
        error += "" if power.known or power.error is None else " of what is known of its error"
        share = [] if power.share is None else [f"{100.0 * power.share:.3g} % of the upper bound"]
        more = "".join(f", {escape(plain(fact))}" for fact in (*share, *beside))
        return _large(number, error, f"mean power by <b>{escape(power.engine)}</b>{more}", live.at)
    if live.instead:
        by = plain(why) if why else "The curves are those of a resistor in its place."
        known = "The circuit's power is not known." if why else "Computing the circuit's power ..."
        return f'<div class="power none">{known}</div><div class="by">{escape(by)}</div>'
    return (
        '<div class="power none">No formula knows this scene.</div>'
        '<div class="by">Run an engine below; the reasons are under "The working point".</div>'
    )


def _large(number: str, error: str, by: str, at: float) -> str:
    """A number in large letters, its error next to it, below it whose it is.

    The page's code has the place ``at``.
    """
    head = f'{escape(plain(number))} <span class="error95">{escape(plain(error))}</span>'
    return f'<div class="power" data-at="{at!r}">{head}</div><div class="by">{by}</div>'


def _number(value: float, unit: str, error: float | None) -> tuple[str, str]:
    """A value with its unit, and its total error in the same unit, as far as it is known."""
    power = engineering([value]) if unit else 0
    prefix = SYMBOLS[power]
    if error is None:
        return f"{value / 10.0**power:.4g} {prefix}{unit}", "its error is not known"
    if error < 1e-6 * abs(value):
        return f"{value / 10.0**power:.5g} {prefix}{unit}", "closed form"
    digits = max(2, 2 + math.ceil(math.log10(abs(value) / error))) if value else 3
    return (
        f"{value / 10.0**power:.{digits}g} {prefix}{unit}",
        f"± {error / 10.0**power:.2g} {prefix}{unit} (95 %)",
    )


def answers(live: Live, runs: Sequence[dict[str, Any]]) -> str:
    """The working point by every engine that answered, with all parts of the error; and why others did not."""
    rows = [_row(estimate, " (a resistor)" * live.instead) for estimate in live.here.values()]
    rows += [(run["engine"], run["text"], run["voltage"]) for run in runs if run["own"]]
    html = table(("engine", "mean power", "mean square voltage"), rows, "answers") if rows else ""
    reasons = [(name, live.refused[name]) for name in FORMULAS if name in live.refused]
    if reasons:
        items = "".join(f"<li>{escape(plain(reason))}</li>" for _, reason in reasons)
        html += f'<ul class="refused">{items}</ul>'
    return html


def _row(estimate: Estimate, instead: str) -> tuple[str, str, str]:
    units = estimate.unit_names
    return (
        estimate.engine + instead,
        estimate.mean_power.format(units.power),
        estimate.mean_square_voltage.format(units.mean_square_voltage),
    )


def warnings(live: Live, runs: Sequence[dict[str, Any]], more: Sequence[str] = ()) -> str:
    """The warnings of all answers, each once."""
    sentences = [
        f"{estimate.engine}: {word}"
        for estimate in live.here.values()
        for word in estimate.warnings
    ]
    sentences += [
        f"{run['engine']}: {word}" for run in runs if run["own"] for word in run["warnings"]
    ]
    sentences += more
    items = "".join(f"<li>{escape(plain(sentence))}</li>" for sentence in dict.fromkeys(sentences))
    return f'<ul class="warnings">{items}</ul>' if items else ""


def life(answer: dict[str, Any]) -> str:
    """How the node lives, by `in_worker.life`, or why that is not known (``error``); or a chip."""
    if "error" in answer:
        return by(f"The node: {answer['error']}")
    remarks = "".join(f"<li>{escape(plain(remark))}</li>" for remark in answer["remarks"])
    return (
        table(answer.get("heads", ("the node", "in a day")), answer["rows"], "life")
        + f"<ul>{remarks}</ul>"
    )


def by(*lines: str) -> str:
    """Lines in pale letters."""
    return "".join(f'<div class="by">{escape(plain(line))}</div>' for line in lines)


def real_device(prediction: Prediction) -> str:
    """The computed power with its error, below it the interval of a real device, and remarks."""
    interval = (
        f"a real device: {amount(prediction.power.low, 'W')} to "
        f"{amount(prediction.power.high, 'W')} (95 %)"
    )
    if prediction.next_measurement:
        interval += f", measure {prediction.next_measurement} next"
    # arguments of `harvester.predict` are options of the command that is named above them
    remarks = [_ARGUMENT.sub(r"--\1", entry.line) for entry in prediction.diagnostics]
    items = "".join(f"<li>{escape(plain(remark))}</li>" for remark in remarks)
    return by(f"computed: {prediction.computed}", interval) + (
        f"<details><summary>As by harvester run --predict --prior {prediction.prior}</summary>"
        f"<ul>{items}</ul></details>"
    )


def meanings(problem: Problem) -> tuple[str, list[str]]:
    """The meaning of the scene's numbers, as HTML, and the warnings among it."""
    if not problem.physical:
        known = {f"{key.table}.{key.name}": key.meaning for key in keys()}
        rows = [
            (name, f"{value:.4g}", known.get(f"nondimensional.{name}", ""))
            for name, value in problem.scene.tables()["nondimensional"].items()
        ]
        return table((), rows, "numbers"), []
    from harvester.devices.interpretation import meaning

    interpretation = meaning(problem)
    rows = [
        (name, Value(value).format(unit), what)
        for name, value, unit, what in interpretation.numbers
    ]
    warnings = [str(remark) for remark in interpretation.remarks if remark.severity == "warning"]
    notes = [
        note.line
        for note in interpretation.remarks
        if note.severity == "note" and note.code not in SERVING
    ]
    paragraphs = "".join(f"<p>{escape(plain(note[:1].upper() + note[1:]))}</p>" for note in notes)
    return paragraphs + table((), rows, "numbers"), warnings


def difference(
    rows: Sequence[tuple[str, str, str]],
    before: Power | None,
    after: Power | None,
    beside: tuple[Mapping[str, str], Mapping[str, str]] = ({}, {}),
) -> str:
    """Two designs side by side: the keys in which they differ, their powers, and the known facts ``beside`` of each."""
    cells = [
        (name.replace("load.parameters.", "").replace(".", ": ").replace("_", " "), *rest)
        for name, *rest in rows
    ]
    cells.append(("mean power", _with_error(before), _with_error(after)))
    if before and after and (before.share is not None or after.share is not None):
        cells.append(("fraction of the upper bound", _share(before), _share(after)))
    if before and after and before.value > 0.0 and before.unit == after.unit:
        cells.append(("ratio of the powers", "1", f"{after.value / before.value:.4g}"))
    unknown = "not computed yet"
    cells += [
        (name, *(facts.get(name, unknown) for facts in beside))
        for name in {**beside[0], **beside[1]}
    ]
    same = "" if rows else "<p>The present design is the pinned one: move a slider.</p>"
    return same + table(("", "pinned", "now"), cells, "difference")


def _with_error(power: Power | None) -> str:
    """A power with its error and its engine."""
    if power is None:
        return "not computed yet"
    number, error = _number(power.value, power.unit, power.error)
    return f"{number} {error}{'' if power.known or power.error is None else ' of what is known'}, by {power.engine}"


def _share(power: Power) -> str:
    return "no bound" if power.share is None else f"{100.0 * power.share:.3g} %"
