"""The options of `harvester new` that describe a cantilever by its geometry, and how they are read."""

from collections.abc import Callable
from functools import partial
from typing import Any

import cloup

from harvester.devices.materials import PIEZOS, SUBSTRATES
from harvester.errors import InputError, reading

SIZES = {
    "length": "Length of the beam from clamp to tip, such as 50.8 mm.",
    "width": "Width of the beam, such as 31.8 mm.",
    "substrate_thickness": "Thickness of the substrate, such as 0.14 mm.",
    "piezo_thickness": "Thickness of one layer, such as 0.26 mm.",
    "tip_mass": "Mass at the tip, such as 12 g.  Default: none.",
    "tip_length": "Length of the tip mass along the beam.  Default: a point.",
    "tip_height": "Height of the tip mass.  Default: a point.",
}
NEEDED = ("length", "width", "substrate_thickness", "piezo_thickness")
LONGEST = 10.0  # m: no piezo beam is longer, and 60 is one of 60 mm
MOST_MODES = 4
TEXTS = ("piezo", "substrate")


def geometry_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options of a beam to a command."""
    return cloup.option_group(
        "Or a cantilever by its geometry (instead of mass, stiffness, coupling and capacitance)",
        cloup.option(
            "--bimorph", is_flag=True, help="A piezo layer on both sides of the substrate."
        ),
        cloup.option("--unimorph", is_flag=True, help="A piezo layer on one side."),
        cloup.option(
            "--parallel", is_flag=True, help="Bimorph: the layers in parallel.  Default: in series."
        ),
        *(
            cloup.option("--" + key.replace("_", "-"), key, metavar="VALUE", help=text)
            for key, text in SIZES.items()
        ),
        cloup.option(
            "--modes",
            type=int,
            metavar="N",
            help="Bending modes, 1 to 4.  Default: the first alone.",
        ),
        cloup.option("--piezo", metavar="NAME", help=f"One of {', '.join(PIEZOS)}."),
        cloup.option("--substrate", metavar="NAME", help=f"One of {', '.join(SUBSTRATES)}."),
    )(command)


def take(values: dict[str, Any]) -> Any:
    """Extract the beam, and how many modes, out of the values of a command.

    None if none of its options is given.

    Raises InputError for options that contradict each other, are missing, or are not lengths and
    masses.
    """
    bimorph, unimorph, parallel = (values.pop(name) for name in ("bimorph", "unimorph", "parallel"))
    texts = {name: values.pop(name) for name in (*SIZES, *TEXTS)}
    modes = values.pop("modes")
    given = [name for name, text in texts.items() if text is not None]
    given += ["parallel"] * bool(parallel) + ["modes"] * (modes is not None)
    if not (bimorph or unimorph):
        if given:
            raise InputError(
                f"`bimorph` or `unimorph` must be given with `{given[0]}`, but neither is"
            )
        return None
    _check_layers(bimorph, unimorph, parallel)
    missing = [name for name in (*NEEDED, *TEXTS) if texts[name] is None]
    if missing:
        names = ", ".join(f"`{name}`" for name in missing)
        raise InputError(f"these must be given for the geometry: {names}, but are left out")
    if modes is not None and not 1 <= modes <= MOST_MODES:
        raise InputError(f"`modes` must be from 1 to {MOST_MODES}, but is {modes}")
    return _beam(texts, bimorph, parallel), modes or 1


def _check_layers(bimorph: bool, unimorph: bool, parallel: bool) -> None:
    """Refuse both kinds of beam at once, and two layers in parallel if there is one."""
    if bimorph and unimorph:
        raise InputError("one of `bimorph`, `unimorph` must be left out, but both are given")
    if parallel and unimorph:
        raise InputError(
            "`parallel` must be used with `bimorph`, for a unimorph has one layer, but is given"
        )


def _beam(texts: dict[str, str | None], bimorph: bool, parallel: bool) -> Any:
    from harvester.devices.beam import Beam
    from harvester.quantities.kinds import MASS, Kind, with_prefix

    sizes = {}
    for name in SIZES:
        text = texts[name]
        if text is None:
            continue
        kind = MASS if name == "tip_mass" else Kind("a length (m)", "m", "'0.26 mm'", above=0.0)
        sizes[name] = reading(f"`{name}`", partial(with_prefix, kind=kind), text)
        if name != "tip_mass" and sizes[name] > LONGEST:
            raise InputError(
                f"`{name}` must be at most {LONGEST:g} m, but is {sizes[name]:g} m: a number without a unit is in m, "
                f"write {text.strip()}mm for millimetres"
                if text.strip().replace(".", "", 1).isdigit()
                else f"`{name}` must be at most {LONGEST:g} m, but is {text.strip()!r}"
            )
    for name in ("substrate_thickness", "piezo_thickness"):
        if not sizes[name] < sizes["length"]:
            raise InputError(
                f"`{name}` must be less than the length of {sizes['length']:g} m, but is {sizes[name]:g} m: "
                "are both in their unit?"
            )
    if "tip_mass" not in sizes and ({"tip_length", "tip_height"} & set(sizes)):
        raise InputError("`tip_mass` must be given with the size of the tip mass, but is left out")
    return Beam(
        piezo=texts["piezo"] or "",
        substrate=texts["substrate"] or "",
        layers=2 if bimorph else 1,
        parallel=parallel,
        **sizes,
    )
