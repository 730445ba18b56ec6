"""Keys that belong together, or that exclude each other: each breach is one line with both names."""

import pytest

import harvester as hv
from harvester.errors import InputError

NODE = {
    "wake_voltage": "3 V",
    "stop_voltage": "2 V",
    "interval": "10 s",
    "currents": ["4 mA"],
    "durations": ["5 ms"],
}


@pytest.mark.parametrize(
    ("keys", "why"),
    [
        ({"retries": 2}, r"node\.lost_share must be given with retries"),
        ({"retries": 1.5, "lost_share": 0.1}, r"node\.retries must be a whole number"),
        ({"lost_share": 1.0}, r"node\.lost_share must be below 1"),
        ({"low_interval": "1 min"}, r"node\.low_voltages must be given with"),
        (
            {"low_voltages": ["3.3 V", "3 V"], "low_interval": "1 min"},
            r"node\.low_voltages must ascend",
        ),
    ],
)
def test_radio_of_a_node(keys, why):
    assert hv.SensorNode(**NODE, retries=2, lost_share=0.1).retries == 2
    with pytest.raises(InputError, match=why):
        hv.SensorNode(**NODE, **keys)


SINUSOID = {"acceleration_amplitude": "0.2 g", "frequency": "46 Hz"}
NOISE = {"acceleration_psd": "1e-5 g^2/Hz"}
COLOURED = {**NOISE, "correlation_time": "5 ms"}
FILE = {"acceleration_psd_file": "psd.csv"}


@pytest.mark.parametrize(("one", "other"), [(COLOURED, FILE), (SINUSOID, FILE)])
def test_kinds_of_excitation_that_exclude_each_other(one, other):
    """White noise can be combined with all of them, coloured noise with a sinusoid."""
    for allowed in (SINUSOID | NOISE, SINUSOID | COLOURED, FILE | NOISE):
        assert hv.Excitation(**allowed).acceleration_psd is not None
    with pytest.raises(InputError, match=r"must be left out if .* is given, but both are given"):
        hv.Excitation(**one, **other)
