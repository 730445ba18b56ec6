"""Predictions of D10 to D24: the file has those of the script, and the mode agrees with that of the package."""

import dataclasses
import importlib
import math
import re
import sys

import numpy as np
import pytest

from harvester.arrays import Floats
from harvester.devices.beam import Beam, lumped
from harvester.linear.single_points import LinearDevice
from tests.support.paths import ROOT

sys.path.append(str(ROOT / "benchmarks"))
cantilevers, unseen_cantilevers, priors_fit = map(
    importlib.import_module, ("cantilevers", "unseen_cantilevers", "priors_fit")
)
ROWS = cantilevers.table()
MIDDLE = (
    dict.fromkeys(unseen_cantilevers.NORMALS, 0.0)
    | dict.fromkeys(unseen_cantilevers.CHOICES, 0.0)
    | dict.fromkeys(unseen_cantilevers.PLACES, 0.75)
)


def test_every_device_has_its_source_and_its_ratio():
    """A DOI each, fifteen devices, and the resonance of the geometry over the measured one as it is computed."""
    assert list(ROWS) == [f"D{number}" for number in range(10, 25)]
    about = {row["device"]: row for row in priors_fit.rows("real_devices.csv")}
    for device, row in ROWS.items():
        assert re.match(r"10\.\d{4,}/\S+", row["doi"]), device
        assert row["frequency_ratio"] == unseen_cantilevers.frequency_ratio(row), device
        assert (row["mass_known"] == "stated") == bool(row["tip_mass_g"]), device
        assert (row["damping_known"] == "measured") == bool(row["bandwidth_hz"]), device
        origins = [row["class"], row["coupling_known"], row["damping_known"]]
        assert [about[device][name] for name in ("class", "coupling", "damping")] == origins


@pytest.mark.parametrize("device", ROWS)
def test_the_file_has_the_predictions_of_the_script(device):
    """With the seed of the file the same numbers; with another the median within four standard errors."""
    kept = {row["quantity"]: row for row in priors_fit.rows("predicted.csv")}
    written = [
        f"{device}.{text.partition(' ')[0]}" for text in ROWS[device]["quantities"].split("; ")
    ]
    assert [name for name in kept if name.startswith(f"{device}.")] == written
    for first, second in zip(
        unseen_cantilevers.samples(ROWS[device]),
        unseen_cantilevers.samples(ROWS[device], seed=2),
        strict=True,
    ):
        row = kept[first.quantity]
        assert row["unit"] == first.unit
        numbers = [float(row[name]) for name in ("predicted", "low", "high")]
        assert first.quantiles() == pytest.approx(numbers, rel=1e-3)
        for base in ("predicted_1", "predicted_2", "predicted_3"):
            assert float(row[base]) == numbers[0]
        effective = second.weights.sum() ** 2 / (second.weights**2).sum()
        # The density at the median by the quantiles 0.4 and 0.6 gives the standard error of the median.
        near, far = np.log(second.quantiles((0.4, 0.6)))
        error = 0.5 / math.sqrt(effective) * (far - near) / 0.2
        off = math.log(second.quantiles()[0] / numbers[0])
        assert abs(off) < 4.0 * math.sqrt(2.0) * error


def package_beam(row, layers, tip_mass):
    """The beam of a row as the package has it."""
    return Beam(
        1e-3 * float(row["length_mm"]),
        1e-3 * float(row["width_mm"]),
        1e-6 * float(row["substrate_um"]),
        1e-6 * float(row["piezo_um"]),
        row["piezo"],
        row["substrate"],
        layers=layers,
        tip_mass=tip_mass,
    )


@pytest.mark.parametrize(("layers", "tip_g"), [(1, 50.0), (2, 50.0), (1, 0.0), (2, 0.0)])
def test_the_mode_is_that_of_the_package(layers, tip_g):
    """A heavy tip within 0.1 %, a bare beam within 5 %: frequency, mass, coupling, capacitance and tip."""
    row = ROWS["D13"] | {
        "piezo": "PZT-5A",
        "layers": str(layers),
        "block": "attached" if tip_g else "none",
        "block_mm": "1e-9",
        "tip_mass_g": str(tip_g),
        "damping_known": "unknown",
        "bandwidth_hz": "",
    }
    exact = lumped(package_beam(row, layers, 1e-3 * tip_g))
    short = math.sqrt(exact.stiffness / exact.mass) / (2.0 * math.pi)
    row["frequency_hz"] = repr(short)
    assert unseen_cantilevers.frequency_ratio(row | {"mass_known": "stated"}) == "1.00"
    found = unseen_cantilevers.device(row, MIDDLE)
    rel = 1e-3 if tip_g else 5e-2
    assert found.linear.mass == pytest.approx(exact.mass, rel=rel)
    assert found.linear.coupling == pytest.approx(exact.coupling, rel=rel)
    assert found.linear.capacitance == pytest.approx(exact.capacitance, rel=1e-9)
    assert found.tip == pytest.approx(exact.tip, rel=rel)


def test_a_patch_and_a_block_in_closed_form():
    """A load a beyond a beam: k = EI/(L^3/3 + L^2 a + L a^2), slope (L^2/2 + L a) of it; a patch has its part."""
    one = cantilevers.Section(2e-3, 0.0, (1e-3,))
    beam = cantilevers.Cantilever(0.05, one, one, 0.0, 0.02, 0.01, True, (1e-9,))
    found = cantilevers.mode(beam)
    length, reach = beam.length, beam.reach
    size = length**3 / 3.0 + length**2 * reach + length * reach**2
    assert found.stiffness == pytest.approx(2e-3 / size, rel=1e-4)
    turn = (length + reach) * beam.end - 0.5 * beam.end**2
    assert found.couplings[0] == pytest.approx(1e-3 * turn / size, rel=1e-4)
    # A softer part beyond the patch bends more, and the patch less.
    soft = dataclasses.replace(beam, bare=dataclasses.replace(one, bending=1e-3))
    assert cantilevers.mode(soft).couplings[0] < 0.9 * found.couplings[0]


def test_layers_in_series_and_in_parallel():
    """Equal layers in series have half the coupling and a quarter of the capacitance of the same in parallel."""
    series = cantilevers.wired((2.0, 2.0), (3.0, 3.0), False)
    parallel = cantilevers.wired((2.0, 2.0), (3.0, 3.0), True)
    assert series == pytest.approx((2.0, 1.5)) and parallel == pytest.approx((4.0, 6.0))
    assert series[0] ** 2 / series[1] == pytest.approx(parallel[0] ** 2 / parallel[1])
    unequal = cantilevers.wired((1.0, 3.0), (4.0, 2.0), False)
    assert unequal[0] / unequal[1] == pytest.approx(1.0 / 4.0 + 3.0 / 2.0)  # voltages add


def test_a_width_at_the_load_has_the_damping_of_the_load():
    """The half-power width of a device of the measured width is that width again, to the first order of coupling."""
    row = ROWS["D13"]
    of = MIDDLE | {"loaded": 1.0, "piezo": 0.25}
    found = unseen_cantilevers.device(row, of)
    one = found.linear
    w = one.frequency * np.linspace(0.8, 1.3, 20_001)
    electric = 1j * w * one.coupling / (1.0 / found.resistance + 1j * w * one.capacitance)
    moved = one.mass * (one.frequency**2 - w**2 + 1j * w * one.frequency / one.q)
    power: Floats = np.abs(electric / (moved + one.coupling * electric)) ** 2
    above = w[power > 0.5 * power.max()]
    width = (above[-1] - above[0]) / (2.0 * math.pi)
    assert width == pytest.approx(float(row["bandwidth_hz"]), rel=0.1)
    alone = unseen_cantilevers.device(row, of | {"loaded": 0.0}).linear
    assert one.frequency / one.q < alone.frequency / alone.q


@pytest.mark.parametrize(("load", "most"), [(1.0, 1.0), (4.0, 2.0), (0.25, 0.5), (2.0, 1.0)])
def test_how_far_a_load_is_from_the_best(load, most):
    """A weak coupling has a power of r/(1 + r^2) at r = w R C: the most of three loads over that at the load."""
    linear = LinearDevice(1e-3, 500.0, 50.0, 1e-8, 1e-7)
    one = unseen_cantilevers.Device(linear, load / (500.0 * 1e-8), 1.0, 1.0)
    expected = math.log(most / (1.0 + most**2) / (load / (1.0 + load**2)))
    assert one.flatness() == pytest.approx(expected, abs=1e-4)


def test_the_displacement_at_the_load():
    """At its resonance a weakly coupled mass moves by tip Q a/w^2."""
    linear = LinearDevice(1e-3, 500.0, 50.0, 1e-8, 1e-7)
    one = unseen_cantilevers.Device(linear, 2e5, 3.0, 1.2)
    assert one.amplitude() == pytest.approx(1.2 * 50.0 * 3.0 / 500.0**2, rel=1e-3)


def test_the_judgement_counts_by_class_and_by_damping():
    """Made-up values: one at the low end by its digits, one outside; widths of a voltage are squared."""
    held = unseen_cantilevers.Judged("D13", "D13.p_47k", "uW", 2.0, 1.04, 4.0, "1.0")
    outside = unseen_cantilevers.Judged("D10", "D10.p_10k", "uW", 2.0, 1.0, 4.0, "9")
    volts = unseen_cantilevers.Judged("D13", "D13.v_open_amplitude", "V", 2.0, 1.0, 4.0, "3")
    assert held.holds and not outside.holds and volts.width == 16.0
    some = [held, outside, volts]
    lines = [*unseen_cantilevers.judgement(some), *unseen_cantilevers.by_group(some)]
    assert "| D10.p_10k | 2 uW | 1 to 4 | 9 | 4.5 | no |" in lines
    assert [line.split(" | ")[:2] for line in lines[8:]] == [
        ["| all", "2 of 3"],
        ["| film", "0 of 1"],
        ["| bulk", "2 of 2"],
        ["| damping unknown", "0 of 1"],
        ["| damping measured", "2 of 2"],
    ]
