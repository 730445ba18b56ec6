"""The command `harvester tolerance`."""

from typing import TYPE_CHECKING, Any

import cloup

from harvester.commands.options import engine_option, keys_option, percent, seed_option, who_computes
from harvester.commands.study import Output, output_options, study_command
from harvester.errors import InputError

if TYPE_CHECKING:
    from harvester.identification.stated_spreads import ScenesSpreads
    from harvester.scene.scene import Scene


@study_command(
    "harvester tolerance mine.toml --vary piezo.capacitance=10% --vary load.resistance=E24:5% --out spread",
    'harvester tolerance mine.toml --vary stop.restitution=.94:.98 --limit "mean_power > 5 uW"',
    "harvester tolerance mine.toml --vary piezo.capacitance=10% --vary oscillator.damping=normal:5% --runs first-order",
)
@cloup.option_group(
    "What scatters, and what must hold",
    keys_option(
        "--vary",
        "varied",
        metavar="KEY=SPREAD",
        help_="Repeatable.  Default: the intervals that identify wrote into SCENE.  10% or LOW:HIGH: anywhere between; "
        "E24:5%: the nearest value of the series; normal:2% or "
        "normal:MEAN:SD; triangular:10% or triangular:LOW:MODE:HIGH; A,B,C: measured values.",
    ),
    cloup.option(
        "--limit",
        "limits",
        multiple=True,
        metavar="TEXT",
        help="What a good device has, such as 'mean_power > 5 uW'; also voltage_rms, mean_square_voltage; repeatable.",
    ),
    cloup.option(
        "--lifetime",
        metavar="TIME",
        help="For limits of peak_displacement, peak_voltage, peak_strain, peak_impact_speed and impact_rate: "
        "'5 years'.",
    ),
    cloup.option("--correlate", multiple=True, metavar="KEY,KEY=NUMBER", help="Two keys that go together; repeatable."),
)
@cloup.option_group(
    "What to compute",
    engine_option("Default: the cheapest whose own error is small against the spread."),
    cloup.option("--samples", type=int, metavar="N", help="Devices in the distribution.  Default: 10000."),
    cloup.option(
        "--runs",
        metavar="N",
        help="Of them that the engine computes; a polynomial through them stands for the others.  "
        "Default: 512 by formulas, else 24 a key and 24 more.  first-order: none but a few; the power goes linearly "
        "with each key, by the gradient of engine density.",
    ),
    cloup.option("--checks", type=int, metavar="N", help="Samples a dearer engine checks.  Default: 8 (spice: 4)."),
    cloup.option(
        "--within",
        type=percent,
        metavar="PERCENT",
        help="Error of the engine that checks, or of one that samples.  Default: 0.5% of a check (ngspice: 2%).",
    ),
    seed_option,
)
@output_options("Folder for tolerance.csv (all samples), tolerance.png, provenance.json and the sweeps.")
@who_computes("Keep the samples that an earlier run of the same study finished.", "Processes.  Default: one a core.")
def tolerance(
    output: Output, varied: tuple[str, ...], workers: int | None, scheduler: str | None, resume: bool, **options: Any
) -> None:
    """How power and voltage scatter over devices whose parts have tolerances: quantiles, yield, what matters."""
    from harvester.commands.progress import Bar
    from harvester.studies.sweep.cluster import client_of
    from harvester.studies.tolerance.tolerance import tolerance as study

    scene = output.scene
    stated = None if varied else _stated(output.path, scene)
    if stated is not None and not options["correlate"]:
        options["correlate"] = stated.correlate
    shorter = "fewer --runs, fewer --checks or a larger --within"
    with Bar("tolerance", shorter=shorter, enough=0.02) as bar, client_of(scheduler) as executor:
        execution = output.execution(bar, workers=workers, executor=executor, resume=resume)
        answer = study(scene, vary=varied if stated is None else stated.vary, execution=execution, **options)
    output.show(
        answer,
        ("tolerance.csv", "tolerance.png", "provenance.json"),
        lambda report: report.of_tolerance(scene, answer, options["seed"]),
        text=None if stated is None else f"{answer}\n{stated}",
    )


def _stated(path: str, scene: "Scene") -> "ScenesSpreads":
    """The spreads that the comments of a scene file state; InputError where there is none."""
    from harvester.identification.stated_spreads import spreads_of
    from harvester.machine import files
    from harvester.scene.toml import MOST_BYTES

    spreads = spreads_of(files.read(path, "scene", MOST_BYTES).decode(errors="replace"), scene)
    if not spreads.vary:
        raise InputError(
            "`vary` must be given for one key or more where the scene file has no intervals of 'harvester identify', "
            "but is left out"
        )
    return spreads
