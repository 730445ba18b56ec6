"""Every circuit, every excitation, and every spring or stop at least once, against ngspice alone with the whole device.

The references are those of `python benchmarks/products.py NAME`, such as ``bridge harmonic gap``,
which runs through all of them: mean power and its doubt (mW).
"""

import dataclasses
import importlib
import sys

import pytest

import harvester as hv
from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
products = importlib.import_module("products")

pytestmark = pytest.mark.ngspice

REFERENCES = {
    "resistor recorded gap": (0.243590, 1.0e-4),
    "bridge recorded free": (0.217682, 6.2e-5),
    "doubler harmonic free": (0.596936, 1.6e-4),
    "resistor harmonic bistable": (0.341034, 4.5e-6),
    "parallel_sshi harmonic free": (0.622797, 2.6e-5),
    "series_sshi harmonic free": (0.299972, 1.3e-4),
    "sece harmonic free": (0.307443, 1.5e-4),
    "self_powered_sshi harmonic free": (0.623486, 9.7e-6),
    "ltc3588 harmonic free": (0.453744, 4.5e-6),
    "bridge coloured gap": (0.15818, 3.9e-4),
    "own harmonic stop": (0.133454, 1.7e-5),
    "doubler harmonic gap": (0.224971, 1.0e-4),
    "own harmonic gap": (0.278127, 1.1e-4),
    "resistor recorded stop": (0.0205933, 2.7e-5),
    "own recorded gap": (0.182673, 8.8e-5),
    "parallel_sshi recorded free": (0.351946, 2.7e-5),
    "bridge coloured free": (0.27431, 2.9e-4),
}
LARGEST, SAMPLED = 2e-3, 1.5e-2  # of the power, of both errors together
FEW = {"trajectories": 8, "duration": 0.25}
# a budget: no search for other responses
EFFORTS = {"harmonic": {}, "recorded": {"budget": "300s"}, "coloured": FEW}


@pytest.mark.thorough("test_engines.py")
@pytest.mark.parametrize("name", REFERENCES)
def test_the_answer_holds_the_reference(name, tmp_path):
    """Within what both state, with no warning but that of the record's join, or of a response in either well."""
    circuit, shaking, spring = name.split()
    found = hv.Spice(**EFFORTS[shaking]).run(products.scene_of(circuit, shaking, spring, tmp_path))
    # without the join
    power = dataclasses.replace(found.mean_power, model=0.0)
    (expected, doubt) = REFERENCES[name]
    largest = SAMPLED if shaking == "coloured" else LARGEST
    assert abs(1e3 * power.value - expected) < 1e3 * power.error95 + doubt < largest * expected
    words = ["the recording's end does not meet its beginning"] if shaking == "recorded" else []
    words += (
        ["the excitation has 2 responses, and this is the one from rest"]
        if spring == "bistable"
        else []
    )
    assert len(found.warnings) == len(words) and all(
        map(str.startswith, map(str, found.warnings), words)
    )


def test_a_record_is_doubted_alike_by_all_engines(tmp_path):
    """`spice` did not state that the join of a record matters, where its answer is a periodic response."""
    scene = products.scene_of("resistor", "recorded", "free", tmp_path)
    record = (tmp_path / "shake.csv").read_text().splitlines()
    (tmp_path / "shake.csv").write_text("\n".join(record[:-170]) + "\n")  # it ends amid the motion
    scene = dataclasses.replace(scene, load=hv.Load(resistance=35e3))
    exact, spice = hv.Exact().run(scene), hv.Spice().run(scene)
    assert exact.warnings and spice.warnings == exact.warnings
    assert abs(spice.mean_power.value - exact.mean_power.value) < 1.5 * spice.mean_power.error95


@pytest.mark.thorough("test_netlist_load")
def test_a_resistor_alone_is_paired_by_whatever_name(tmp_path):
    """It was sampled without the exact model next to it: 37 % from 8 runs, where that leaves 0.4 %."""
    scene = products.scene_of("resistor", "coloured", "gap", tmp_path)
    own = tmp_path / "shunt.cir"
    own.write_text("* my load\n.subckt shunt a b ohms=35k\nRload b a {ohms}\n.ends\n")
    loads = (hv.Load(resistance=35e3), scene.load, hv.Load(netlist=str(own)))
    answers = [hv.Spice(**FEW).run(dataclasses.replace(scene, load=load)) for load in loads]
    power = answers[0].mean_power
    assert power.error95 < 0.01 * power.value
    assert abs(1e3 * power.value - 0.2328) < 1e3 * power.error95 + 3.3e-3
    assert [one.mean_power for one in answers[1:]] == [power, power]
    assert all("resistive_load" in one.effects and "netlist" not in one.effects for one in answers)
