"""The options --prior and --known, by which commands choose the spreads of a real device."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import cloup

from harvester.commands.options import pairs_of
from harvester.errors import InputError

if TYPE_CHECKING:
    from harvester.scene.scene import Scene
    from harvester.studies.prediction.prediction_result import Prediction
    from harvester.uncertainty.value import Value

POINT = "be NAME=POINT, such as open_circuit_voltage='21 V at 0.25 g'"
KNOWN = "be QUANTITY=ORIGIN, such as damping=measured"


class Origins(NamedTuple):
    """The values of --prior, --known and --points as they were typed."""

    prior: str | None
    known: Sequence[str]
    points: Sequence[str]


def prior_options(prior: str) -> list[Callable[..., Any]]:
    """The options --prior, whose help begins with ``prior``, and --known."""
    return [
        cloup.option(
            "--prior", metavar="CLASS", help=f"{prior}: bulk, composite, film or polymer."
        ),
        cloup.option(
            "--known",
            multiple=True,
            metavar="QUANTITY=ORIGIN",
            help="Origin of the number of frequency, damping, coupling, capacitance, gap or "
            "restitution: unknown, datasheet, geometry, measured_low, measured, given, or "
            "frequency=tuned; repeatable.",
        ),
    ]


def point_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the option --points to a command."""
    return cloup.option(
        "--points",
        "points",
        multiple=True,
        metavar="NAME=POINT",
        help="With --predict, a single point of the device's datasheet: open_circuit_voltage='21 V at 0.25 g', "
        "power_at_load='1.2 mW at 15 kohm and 0.25 g' or open_circuit_frequency='62 Hz'; repeatable.",
    )(command)


def prediction_of(
    scene: "Scene", computed: "Value", seed: int, origins: Origins, seconds: float | None = None
) -> "Prediction":
    """The prediction of a real device whose power was ``computed`` as the scene is written.

    ``seconds`` is the time of all devices, if they are `predicted_in_time`.
    """
    from harvester.machine.bars import Bar
    from harvester.machine.execution import Execution
    from harvester.studies.prediction.predict import predict
    from harvester.studies.prediction.priors import DEFAULT_CLASS

    with Bar("prediction", shorter="") as bar:
        return predict(
            scene,
            runs=None if seconds is None else f"{seconds} s",
            prior=DEFAULT_CLASS if origins.prior is None else origins.prior,
            known=pairs_of("--known", origins.known, KNOWN),
            seed=seed,
            points=pairs_of("--points", origins.points, POINT),
            computed=computed,
            execution=Execution(progress=bar),
        )


def predicted_in_time(scene: "Scene") -> bool:
    """Whether a prediction's devices can have a time limit: those of a netlist without a quick engine."""
    from harvester.equations.problem import Problem
    from harvester.studies.tolerance.circuit_study import is_study_of_circuit
    from harvester.studies.tolerance.samples import cheapest

    return is_study_of_circuit(cheapest(Problem.of(scene))())


def check_alone(
    predict: bool, prior: str | None, known: Sequence[str], points: Sequence[str] = ()
) -> None:
    """Refuse --prior, --known and --points without --predict, and points of another form."""
    for option, given in (("--prior", prior), ("--known", known), ("--points", points)):
        if given and not predict:
            raise InputError(f"{option} must be given with --predict, but --predict is left out")
    if points:
        from harvester.studies.prediction.evidence import read_points

        read_points(pairs_of("--points", points, POINT))


def spreads_by_priors(
    scene: "Scene", varied: Sequence[str], prior: str | None, known: Sequence[str]
) -> "tuple[Scene, dict[str, str] | Sequence[str]]":
    """The scene, and the spreads of --vary, with those of --prior for other keys."""
    if prior is None:
        if known:
            raise InputError("--known must be given with --prior, but --prior is left out")
        return scene, varied
    from harvester.studies.prediction.priors import in_modal_keys, priors_of

    scene = in_modal_keys(scene)
    named = pairs_of("--vary", varied, "be KEY=SPREAD, such as piezo.capacitance=2nF")
    priors = priors_of(scene, prior, pairs_of("--known", known, KNOWN))
    spreads = {entry.key: entry.written for entry in priors} | named
    if not spreads:
        raise InputError("--known must leave a quantity with a spread, but gives all of them")
    return scene, spreads
