"""Keys of a chip without effect, and contradictory tables of efficiencies, are refused."""

import dataclasses

import pytest

import harvester as hv
from harvester.records.efficiency_table import read_efficiencies
from harvester.scene.sensor_node import HarvestingChip
from harvester.storage.supply import chip_of
from tests.support.paths import EXAMPLES

AT_INPUT = {"start_voltage": 3.0, "stop_voltage": 2.5}


@pytest.mark.parametrize("key", ["efficiency", "efficiency_table"])
@pytest.mark.parametrize("name", [None, "ltc3588"])
def test_a_key_without_effect_is_an_error(key, name):
    """1e-6 and 0.8 gave the same 635 packets per hour: no converter charges there."""
    with pytest.raises(
        hv.InputError, match=rf"^chip\.{key} must be left out for .* without input_ratio"
    ):
        chip_of(
            HarvestingChip(name=name, **AT_INPUT, **{key: 0.8 if key == "efficiency" else "a.csv"}),
            3.3,
        )


@pytest.mark.parametrize("name", ["bq25570", None])
def test_with_an_input_ratio_the_same_keys_count(name):
    keys = {"input_ratio": 0.5, "full_voltage": 5.0} if name is None else {}
    good, bad = (
        chip_of(HarvestingChip(name=name, **AT_INPUT, **keys, efficiency=e), 1.8)
        for e in (0.8, 1e-6)
    )
    assert (good.charging[0][2], bad.charging[0][2]) == (0.8, 1e-6)


def test_the_example_s_chip_is_as_before():
    scene = hv.load(EXAMPLES / "bimorph_chip.toml")
    assert chip_of(scene.chip, scene.node.supply_voltage).ratio is not None
    with pytest.raises(hv.InputError, match=r"^chip\.efficiency must be left out"):
        dataclasses.replace(scene.chip, name=None, efficiency=0.5)


HEAD = "input voltage (V),input current (A),efficiency\n"
BAD = {
    "once": (
        "1,1e-5,0.8\n1,2e-5,0.8\n1,1e-5,0.4\n",
        "must have each point once, but has 1 V and 1e-05 A 2 times",
    ),
    "volts": ("1,1e-5,0.8\n1e300,1e-5,0.8\n", "must have voltages up to 1e+06 V"),
    "amperes": ("1,1e-5,0.8\n1,1e300,0.8\n", "currents up to 1e+06 A, but has"),
    "share": ("1,1e-5,1.8\n", "efficiencies above 0, up to 1"),
    "below": ("-1,1e-5,0.8\n", "row 1 has -1 V, 1e-05 A and 0.8"),
    "nan": ("nan,1e-5,0.8\n", "row 1 has nan V, 1e-05 A and 0.8"),
}


@pytest.mark.parametrize("name", BAD)
def test_a_table_that_no_chip_has(tmp_path, name):
    """A point twice had one of two efficiencies, by the order of sorting."""
    rows, told = BAD[name]
    (tmp_path / "a.csv").write_text(HEAD + rows)
    with pytest.raises(hv.InputError) as error:
        read_efficiencies(str(tmp_path / "a.csv"))
    assert told in str(error.value)
    assert "\n" not in str(error.value)
