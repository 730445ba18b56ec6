"""The command `harvester tolerance`."""

from typing import TYPE_CHECKING, Any

import cloup

from harvester.commands.options import (
    engine_option,
    keys_option,
    percent,
    seed_option,
    who_computes,
)
from harvester.commands.priors import prior_options, spreads_by_priors
from harvester.commands.study import Output, output_options, study_command
from harvester.errors import InputError

if TYPE_CHECKING:
    from harvester.identification.stated_spreads import ScenesSpreads
    from harvester.scene.scene import Scene


@study_command(
    "harvester tolerance mine.toml --vary piezo.capacitance=10% --vary load.resistance=E24:5% --out spread",
    'harvester tolerance mine.toml --vary stop.restitution=0.94:0.98 --limit "mean_power > 5 uW"',
    "harvester tolerance mine.toml --vary piezo.capacitance=10% --vary oscillator.damping=normal:5% --runs first-order",
    "harvester tolerance board.toml --vary load.parameters.R1=5% --budget 60s",
)
@cloup.option_group(
    "Spreads and limits",
    keys_option(
        "--vary",
        "varied",
        metavar="KEY=SPREAD",
        help_="Spread of a key; repeatable.  10% or LOW:HIGH: uniform; E24:5%: the nearest value of the series; "
        "normal:2% or normal:MEAN:SD; lognormal:0.3; triangular:10% or triangular:LOW:MODE:HIGH; "
        "A,B,C: measured values.  "
        "Default: the intervals that identify wrote into SCENE.",
    ),
    *prior_options("Also the spreads of a real device of this class"),
    cloup.option(
        "--limit",
        "limits",
        multiple=True,
        metavar="TEXT",
        help="A limit for good devices such as 'mean_power > 5 uW'; also voltage_rms, mean_square_voltage; repeatable.",
    ),
    cloup.option(
        "--lifetime",
        metavar="TIME",
        help="Lifetime for limits on peak_displacement, peak_voltage, peak_strain, peak_impact_speed and "
        "impact_rate: '5 years'.",
    ),
    cloup.option(
        "--correlate",
        multiple=True,
        metavar="KEY,KEY=NUMBER",
        help="Correlation of two keys; repeatable.",
    ),
)
@cloup.option_group(
    "Computation",
    engine_option(
        "Default: the cheapest engine whose own error is small compared with the spread."
    ),
    cloup.option(
        "--samples",
        type=int,
        metavar="N",
        help="Number of devices in the distribution.  Default: 10000.",
    ),
    cloup.option(
        "--runs",
        metavar="N",
        help="Number of samples computed by the engine; a polynomial surrogate gives the rest.  Default: 512 for "
        "formulas, otherwise 24 per key and 24 more.  first-order: linearise the power in each key with the "
        "gradient from engine density, or by slopes of the cheapest engine for a netlist.",
    ),
    cloup.option(
        "--budget",
        metavar="TIME",
        help="Time for a netlist: each part alone, then checks and samples.  Not with --runs, --checks, "
        "--lifetime or --resume.  Default: 60s.",
    ),
    cloup.option(
        "--checks",
        type=int,
        metavar="N",
        help="Samples a slower engine rechecks.  Default: 8 (spice: 4).",
    ),
    cloup.option(
        "--within",
        type=percent,
        metavar="PERCENT",
        help="Target error of the checking engine, or of one that samples.  Default: 0.5 % for a check (ngspice: 2 %).",
    ),
    seed_option,
)
@output_options(
    "Folder for tolerance.csv (all samples), tolerance.png, provenance.json and the sweeps."
)
@who_computes(
    "Keep the samples that an earlier run of the same study finished.",
    "Processes.  Default: one per core.",
)
def tolerance(
    output: Output,
    varied: tuple[str, ...],
    workers: int | None,
    scheduler: str | None,
    resume: bool,
    prior: str | None,
    known: tuple[str, ...],
    **options: Any,
) -> None:
    """Scatter of power and voltage over manufactured devices: quantiles, yield, and the influence of each part."""
    from harvester.machine.bars import Bar
    from harvester.studies.sweep.cluster import client_of
    from harvester.studies.tolerance.tolerance import tolerance as study

    scene, spreads = spreads_by_priors(output.scene, varied, prior, known)
    stated = None if spreads else _stated(output.path, scene)
    if stated is not None and not options["correlate"]:
        options["correlate"] = stated.correlate
    shorter = "fewer --runs, fewer --checks or a larger --within"
    with Bar("tolerance", shorter=shorter, enough=0.02) as bar, client_of(scheduler) as executor:
        execution = output.execution(bar, workers=workers, executor=executor, resume=resume)
        answer = study(
            scene, vary=spreads if stated is None else stated.vary, execution=execution, **options
        )
    output.show(
        answer,
        ("tolerance.csv", "tolerance.png", "provenance.json"),
        lambda report: report.of_tolerance(scene, answer, options["seed"]),
        text=None if stated is None else f"{answer}\n{stated}",
    )


def _stated(path: str, scene: "Scene") -> "ScenesSpreads":
    """The spreads that the comments of a scene file state; InputError if absent."""
    from harvester.identification.stated_spreads import spreads_of
    from harvester.machine import files
    from harvester.scene.toml import MOST_BYTES

    spreads = spreads_of(files.read(path, "scene", MOST_BYTES).decode(errors="replace"), scene)
    if not spreads.vary:
        raise InputError(
            "`vary` must be given for one key or more if the scene file has no intervals of 'harvester identify', "
            "but is left out"
        )
    return spreads
