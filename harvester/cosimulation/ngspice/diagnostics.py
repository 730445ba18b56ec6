"""Why a run of ngspice failed, as one line made from its messages: place, time, and remedy."""

import re
from collections.abc import Sequence

from harvester.uncertainty.value import clock

_SINGULAR = re.compile(r"singular matrix:\s*check nodes?\s+(.*)", re.IGNORECASE)
_SMALL = re.compile(r"timestep too small;\s*time = (\S+), timestep = (\S+?):\s*(.*)", re.IGNORECASE)
_CULPRIT = re.compile(
    r'trouble with (?:node|\S+)\s+"?([^"\s]+)"?|trouble with (\S+)', re.IGNORECASE
)
_CHATTER = (
    "note:",
    "circuit:",
    "doing analysis",
    "using transient",
    "reference value",
    "no. of data",
    "run simulation",
)
_STATE = re.compile(r"error: ngspice\.dll .*", re.IGNORECASE)  # says nothing of the circuit
LONGEST = 300  # letters of ngspice's own words


def why_refused(messages: Sequence[str]) -> str:
    """State why ngspice did not take a circuit, in its own words."""
    reasons = [_STATE.sub("", message).strip() for message in messages]
    reasons = [reason for reason in reasons if reason and not reason.lower().startswith(_CHATTER)]
    words = "; ".join(dict.fromkeys(reasons)) or "it gave no reason"
    words = "".join(letter if letter.isprintable() else " " for letter in words)
    return f"ngspice refused the circuit: {words if len(words) <= LONGEST else words[:LONGEST] + ' ...'}"


def no_step_was_small_enough(messages: Sequence[str]) -> bool:
    """Whether ngspice ended because it found no solution even with its smallest step."""
    text = "\n".join(messages)
    return _SINGULAR.search(text) is not None or _SMALL.search(text) is not None


def why_stopped(messages: Sequence[str], end: float, duration: float) -> str:
    """State why ngspice stopped at the time ``end`` (s) of ``duration``."""
    text = "\n".join(messages)
    singular, small = _SINGULAR.search(text), _SMALL.search(text)
    if singular is None and small is None:
        refused = why_refused(messages)
        return refused if end == 0.0 else f"{_stopped(end, duration)}: {refused.partition(': ')[2]}"
    at = float(small[1]) if small else end
    said = _stopped(at, duration)
    if singular is not None:
        where = " and ".join(place_of(name) for name in singular[1].split(" and "))
        return (
            f"{said}: its equations have no single solution at {where}; give every node a path to ground (such as "
            "1 Gohm), and every loop of voltage sources and coils a small resistance"
        )
    assert small is not None
    culprit = _CULPRIT.search(small[3])
    where = f"at {place_of(culprit[1] or culprit[2])}" if culprit else "at an unnamed node"
    return (
        f"{said}: it did not converge {where} even with a step of {float(small[2]):.3g} s; lower `dt`, or, in "
        "the netlist, make abrupt switches and B sources gradual, and give diodes a series resistance (Rs) and a "
        "junction capacitance (Cjo)"
    )


def why_given_up(end: float, duration: float, step: float, patience: float) -> str:
    """Say that a run made no progress in ``patience`` seconds.

    ``step`` (s) is that of its last accepted points.
    """
    return (
        f"{_stopped(end, duration)}: it came no further than that in {patience:g} s, with steps of {step:.2g} s; "
        "slow down anything faster than the vibration (oscillating coils, high frequencies), and make switches gradual"
    )


def why_out_of_time(end: float, duration: float, seconds: float) -> str:
    """Say that a run had not ended after the ``seconds`` that were left to it, and the time that it needs."""
    whole = (
        f"; to its end it would need about {clock(seconds * duration / end)}"
        if min(end, seconds) > 0.0
        else ""
    )
    return (
        f"{_stopped(end, duration)}: the `budget` left it {clock(max(seconds, 0.0))}{whole}: give more, fewer "
        "`trajectories` or a shorter `duration`, or slow down anything faster than the vibration"
    )


def _stopped(end: float, duration: float) -> str:
    """Say when ngspice stopped, the beginning of an error."""
    return f"ngspice stopped at {end:.6g} s of {duration:.6g} s"


def place_of(name: str) -> str:
    """Name a node or branch of the whole circuit in the words of the load's netlist."""
    name = name.strip().strip("'\"").lower()
    inner = name.split(".")
    if name.endswith("#branch"):
        element = inner[-1].removesuffix("#branch")
        return "the current of the piezo" if len(inner) == 1 else f"the current through {element!r}"
    if inner[0] == "xload":
        return f"node {'.'.join(inner[1:])!r}"
    return {"p": "the piezo's terminal", "drive": "the piezo's source"}.get(name, f"node {name!r}")
