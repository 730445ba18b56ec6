"""The gradient by the adjoint against differences of solutions, in ten scenes, and what normalised
sensitivities must add up to."""

import dataclasses

import pytest

import harvester as hv
from harvester.density.adjoint import gradient
from harvester.density.box import settled
from harvester.density.mesh import RESOLUTIONS, mesh
from harvester.density.refine import solution
from harvester.equations.coefficients import Equations
from harvester.errors import CannotServeError, InputError
from tests.support.systems import PAPER, changed, linear, scene

SCENES = {
    "paper": PAPER,
    "strong impacts": changed(PAPER, restitution=0.37),
    "collapse": changed(PAPER, restitution=0.1),
    "linear": linear(0.3, 0.7),
    "passive": changed(PAPER, beta=None),
    "preload": changed(PAPER, c1=-0.05, gap=-0.2, mu=1.0),
    "gap": changed(PAPER, c1=-0.05, gap=0.3, n12=0.006),
    "compliant": changed(
        PAPER, c1=-0.05, restitution=None, gap=0.2, stop_stiffness=40.0, stop_damping=1.0
    ),
    "two wells": Equations(c1=-0.2, beta=0.1, mu=0.5, n1=0.1, linear=-1.0, alpha=1.0, alpha2=0.1),
    "open circuit": Equations(c1=-0.1, beta=0.5, n1=0.02, restitution=0.8, gap=0.1),
    "coloured noise": Equations(c1=-0.1, beta=0.5, coloured=0.02, correlation_time=0.7, alpha=0.5),
}


# each a kind of boundary; the others are the same code
REMAINING = "collapse", "compliant", "two wells"
OTHERS = pytest.mark.thorough("test_gradient_is_that_of_differences")
MARKS = {name: pytest.mark.slow if name in REMAINING else OTHERS for name in SCENES}


@pytest.mark.parametrize(
    "eqs", [pytest.param(eqs, id=name, marks=MARKS[name]) for name, eqs in SCENES.items()]
)
def test_gradient_is_that_of_differences(eqs):
    """To 1e-6 of the largest normalised sensitivity, in a coefficient of each scene after the
    other, on the coarsest mesh."""
    setting = settled(eqs, 20.0)
    on = mesh(eqs, setting.box, RESOLUTIONS[0])
    base = solution(eqs, setting, on, 5)
    told = gradient(eqs, base, setting)
    names = [name for name in told if "gap" not in name]
    largest = max(abs(told[name] * getattr(eqs, name)) for name in names)
    place = [*SCENES.values()].index(eqs)
    for name in {names[place % len(names)], names[(place + 3) % len(names)], "restitution"} & set(
        names
    ):
        step = 1e-3 * abs(getattr(eqs, name))
        means = [
            float(
                solution(
                    dataclasses.replace(eqs, **{name: getattr(eqs, name) + h}), setting, on, 5
                ).means[0]
            )
            for h in (-step, -0.5 * step, 0.5 * step, step)
        ]
        slope = (8.0 * (means[2] - means[1]) - (means[3] - means[0])) / (6.0 * step)
        assert abs(told[name] - slope) * abs(getattr(eqs, name)) < 1e-6 * largest


@pytest.mark.parametrize(
    "by_formula",
    [True, pytest.param(False, marks=pytest.mark.thorough("test_gradient_is_that_of_differences"))],
)
def test_elasticities_add_up_to_what_units_ask_for(by_formula):
    """Linear scene: twice the noise is twice the power, and with P = M w0^3 l^2 f(...) no unit matters.

    Units of mass, time and charge: the normalised sensitivities of the keys times their dimensions
    are those of a power.  By differences of engine `Exact`, and by the adjoint of the density.
    """
    found = hv.sensitivity("examples/plate.toml", within=1e-3)
    assert found.engine == "exact"
    of = {key: one.value for key, one in zip(found.keys, found.elasticities, strict=True)}
    if not by_formula:
        _, slopes = hv.Density(within=1e-3).run_with_slopes(hv.load("examples/plate.toml"))
        adjoint = {key: slopes.elasticity(key) for key in of}
        assert adjoint == pytest.approx(of, abs=1e-5)
        of = adjoint
    assert of["excitation.acceleration_psd"] == pytest.approx(1.0, abs=1e-5)
    mass = [
        ("oscillator.mass", 1),
        ("oscillator.stiffness", 1),
        ("oscillator.damping", 1),
        ("piezo.coupling", 1),
    ]
    # In units of kg, m, s and V: stiffness kg/s^2, damping kg/s, coupling N/V, capacitance J/V^2,
    # resistance V^2/W.
    mass += [("piezo.capacitance", 1), ("load.resistance", -1)]
    assert sum(power * of.get(key, 0.0) for key, power in mass) == pytest.approx(1.0, abs=1e-5)
    volts = [("piezo.coupling", -1), ("piezo.capacitance", -2), ("load.resistance", 2)]
    assert sum(power * of[key] for key, power in volts) == pytest.approx(0.0, abs=1e-5)


@pytest.mark.slow
def test_the_largest_stands_first_and_the_table_has_units():
    found = hv.sensitivity("examples/plate_with_stop.toml", within=1e-3)
    sizes = [abs(one.value) for one in found.elasticities]
    assert sizes == sorted(sizes, reverse=True)
    assert found.keys[0] == "stop.restitution"
    assert all(one.error95 is not None for one in found.elasticities)
    assert "Mohm" in str(found)


@pytest.mark.slow
def test_what_has_no_power_or_no_density_is_refused():
    with pytest.raises(InputError, match="must have a coupling and a load resistance"):
        hv.sensitivity(scene(changed(PAPER, beta=None)))
    driven = hv.Nondimensional(
        c1=-0.1, beta=0.05, mu=1.0, drive=1.0, drive_frequency=1.0, restitution=0.9
    )
    with pytest.raises(CannotServeError, match="harmonic"):
        hv.sensitivity(hv.Scene(nondimensional=driven))
