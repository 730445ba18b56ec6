"""The scene and its provenance: the scene in SI and nondimensional numbers, its effects, versions and machine."""

import shlex
from collections.abc import Sequence
from typing import Any

from harvester.equations import effects
from harvester.equations.coefficients import Equations
from harvester.equations.problem import Problem
from harvester.presentation.scene_words import COEFFICIENTS, EFFECTS
from harvester.report.numbers import amount, signs
from harvester.report.page import Listing, Page, Section, TextTable
from harvester.scene.keys import chosen, unit_of
from harvester.scene.scene import Scene
from harvester.scene.scene_writer import as_written, written


def scene_page(
    problem: Problem,
    kind: str,
    lead: Sequence[str],
    first: Section,
    about: dict[str, Any],
    text: str = "",
    **made: Any,
) -> Page:
    """The page of the findings for a scene: the findings, the scene and its effects, and their provenance.

    ``about`` is the provenance, ``text`` is above the scene, ``made`` is passed to `made_by`.
    """
    return Page(
        title=problem.scene.title,
        kind=kind,
        lead=lead,
        sections=[first, scene_section(problem, text), effects_section(problem)],
        command=command_line(about),
        about=made_by(about, **made),
    )


def scene_section(problem: Problem, text: str = "") -> Section:
    """The section of the scene: its file, and its numbers in SI and nondimensional."""
    tables = [coefficients("In nondimensional numbers", problem.equations)]
    if problem.physical:
        tables = [_keys(problem.scene), *tables, _scales(problem)]
    listings = [Listing("Scene file", as_written(problem.scene))]
    if text_of_netlist := problem.load.text:
        listings.append(Listing(f"Netlist {problem.netlist}", text_of_netlist, folded=True))
    return Section("Scene", texts=[text] if text else [], tables=tables, listings=listings)


def effects_section(problem: Problem) -> Section:
    """The section of the effects that are present, and those that are absent (not computed, rather than zero)."""
    present = problem.present_effects
    others = [effect.name for effect in effects.EFFECTS if effect.name not in EFFECTS]
    words = EFFECTS | {name: name.replace("_", " ") for name in others}
    absent = [name for name in words if name not in present]
    tables = [
        TextTable(caption, ["effect", "meaning"], [[name, words[name]] for name in names])
        for caption, names in (("On", present), ("Off", absent))
    ]
    text = "An effect that is off is absent: no step of the computation knows it."
    return Section("Effects on and off", texts=[text], tables=tables)


def coefficients(caption: str, eqs: Equations) -> TextTable:
    """The table of the nondimensional coefficients that are present."""
    rows = []
    of_keys = {key.name: key.meaning for key in chosen("nondimensional")}
    for name in sorted(vars(eqs), key=[*COEFFICIENTS, *vars(eqs)].index):
        value = getattr(eqs, name)
        meaning = COEFFICIENTS.get(name) or of_keys.get(name, name)
        if value is not None:
            rows.append(
                [
                    name,
                    meaning,
                    signs(f"{value:.5g}") if isinstance(value, float) else "from a file",
                ]
            )
    return TextTable(caption, ["coefficient", "meaning", "value"], rows, (2,))


def command_line(about: dict[str, Any]) -> str:
    """The command that makes the report again, as a shell accepts it."""
    return shlex.join(["harvester", *about["command"]])


def made_by(about: dict[str, Any], **more: Any) -> dict[str, str]:
    """Provenance: ``more`` first (such as the seed), then date, machine, versions and digest of the scene."""
    machine = about["machine"]
    rows = {name.replace("_", " "): str(value) for name, value in more.items()}
    rows["date"] = about["when"]
    rows["machine"] = f"{machine['processor']}, {machine['cores']} cores, {machine['system']}"
    versions = about["versions"].items()
    rows["versions"] = ", ".join(
        f"{name} {version or '(not installed)'}" for name, version in versions
    )
    if "scene_digest" in about:
        rows["digest of the scene"] = about["scene_digest"]
    return rows


def _keys(scene: Scene) -> TextTable:
    """The table of all keys of the scene file, in the units that people write."""
    rows = []
    for table, name, value in scene.values():
        rows += _key(table, name, value)
    return TextTable("As given", ["key", "value"], rows, (1,))


def _key(table: str, name: str, value: Any) -> list[list[str]]:
    if isinstance(value, dict):
        units = {part: unit_of(f"{table}.{name}.{part}") or "(SI)" for part in value}
        return [
            [f"{table}.{name}.{part}", amount(entry, units[part])] for part, entry in value.items()
        ]
    shown = written(table, name, value)
    if isinstance(shown, float):
        return [[f"{table}.{name}", amount(shown, unit_of(f"{table}.{name}"))]]
    return [[f"{table}.{name}", signs(shown) if shown is not value else str(value)]]


def _scales(problem: Problem) -> TextTable:
    """The table of the scales: the value of a nondimensional 1 in SI units."""
    s = problem.scales
    values = [
        ("frequency ω0", s.frequency, "rad/s"),
        ("length l", s.length, "m"),
        ("voltage θ l/Cp", s.volts, "V"),
        ("power M ω0³ l²", s.watts, "W"),
    ]
    return TextTable(
        "The value of a nondimensional 1",
        ["scale", "value"],
        [[n, amount(v, u)] for n, v, u in values],
        (1,),
    )
