"""The intervals that `identify` wrote are the spreads of a study of tolerances; the resonance keeps its own."""

import json

import numpy as np
import pytest

import harvester as hv
from harvester.identification.stated_spreads import spreads_of
from harvester.studies.tolerance import design
from harvester.studies.tolerance.spreads import spreads

SHAKEN = """
[excitation]
acceleration_psd = "1e-4 g^2/Hz"
[load]
resistance = "100 kohm"
"""
IDENTIFIED = """
[oscillator]                       # the mass on its spring
mass = 0.0166047302                # kg, 95 %: 0.01652467 to 0.01668519
stiffness = 1369.23567             # N/m, 95 %: 1362.624 to 1375.88
damping_ratio = 0.0269748924       # 95 %: 0.02692431 to 0.0270255
[piezo]                            # what couples it to the circuit
coupling = 0.00253054708           # N/V, 95 %: 0.002524458 to 0.00253665
capacitance = 4.12498731e-08       # F, 95 %: 4.122977e-08 to 4.126999e-08
# Also measured:
#   short_circuit_frequency = 45.70285 (Hz, 95 %: 45.7006 to 45.7051)
#   coupling_squared_per_mass = 0.0003856533 (N^2/(V^2 kg), 95 %: 0.0003851252 to 0.0003861813)
"""


def test_the_derived_numbers_keep_their_intervals():
    """Resonance and theta^2/M scatter as identify stated of them, though M scatters a hundred times more."""
    scene = hv.loads(IDENTIFIED + SHAKEN)
    stated = spreads_of(IDENTIFIED + SHAKEN, scene)
    found = spreads(stated.vary, scene)
    keys = [one.key for one in found]
    matrix = design.correlation(stated.correlate, keys)
    x = design.values_at(found, design.tied(design.sobol_points(4096, len(keys), 0), matrix))
    m, k, theta = (
        x[:, keys.index(key)]
        for key in ("oscillator.mass", "oscillator.stiffness", "piezo.coupling")
    )
    resonance = np.sqrt(k / m) / (2.0 * np.pi)
    coupling = theta**2 / m
    low, high = np.quantile(resonance, [0.025, 0.975])
    assert (low, high) == pytest.approx((45.7006, 45.7051), abs=0.0005)
    low, high = np.quantile(coupling, [0.025, 0.975])
    assert (low, high) == pytest.approx((0.0003851252, 0.0003861813), rel=5e-4)
    assert np.quantile(m, 0.975) == pytest.approx(0.01668519, rel=1e-4)


@pytest.mark.slow
def test_by_the_command(harvester, tmp_path):
    """Without --vary it uses them, all five, and states so; a value that the user changed is left as it is."""
    path = tmp_path / "device.toml"
    path.write_text(
        IDENTIFIED.replace("capacitance = 4.12498731e-08", 'capacitance = "50 nF"') + SHAKEN
    )
    words = ("--samples", "256", "--checks", "0")
    status, out, err = harvester("tolerance", path, *words)
    assert (status, err) == (0, "")
    assert "spreads: the 95 % intervals that the scene file states" in out
    assert out.rstrip().endswith(
        "without piezo.capacitance, whose value is no longer in its interval"
    )
    answer = json.loads(harvester("tolerance", path, *words, "--json")[1])
    assert answer["quantiles"]["0.05"] < answer["quantiles"]["0.95"]


@pytest.mark.parametrize(
    ("restitution", "spread"),
    [("0.9", "normal:0.9:"), ("0.999", "0.998:1.0")],
    ids=["inside", "at the end"],
)
def test_a_spread_ends_where_the_key_does(restitution, spread):
    """A normal spread would exceed a restitution of 1: there the interval itself is the spread."""
    low, high = (0.998, 1.0) if restitution == "0.999" else (0.899, 0.901)
    text = IDENTIFIED + f"[stop]\nrestitution = {restitution}   # 95 %: {low} to {high}\n" + SHAKEN
    assert spreads_of(text, hv.loads(text)).vary["stop.restitution"].startswith(spread)


@pytest.mark.parametrize(
    "comment",
    [
        "# 95 %: 2 to 1",
        "# 95 %: nan to 1",
        "# 95 %: x to y",
        "# 95 %: 0 to inf",
        "# about 95 % of it",
        "",
    ],
)
def test_comments_that_state_none(harvester, tmp_path, comment):
    path = tmp_path / "device.toml"
    path.write_text(
        f'[oscillator]\nmass = 0.02 {comment}\nstiffness = 16\n[piezo]\ncoupling=1e-3\ncapacitance="50 nF"\n'
    )
    status, out, err = harvester("tolerance", path)
    assert (status, out) == (2, "")
    assert err.startswith(
        "harvester: --vary must be given for one key or more if the scene file has no intervals of"
    )
