"""Chips and inductors by their file: what a chip's netlist states as well, is the same number
there."""

import math
import re

import pytest

from harvester.commands.design import design
from harvester.netlists.load_circuit import netlist_folder
from harvester.scene.sensor_node import HarvestingChip
from harvester.storage.bought_parts import CHIPS
from harvester.storage.supply import output_efficiency

FOLDER = netlist_folder()


def head(path, name):
    """The parameters in the head of a subcircuit, as they are written."""
    text = path.read_text().replace("\n+", " ")
    return dict(re.findall(r"(\w+)=(\S+)", re.search(rf"(?m)^\.subckt {name} (.*)$", text)[1]))


@pytest.mark.parametrize(
    ("circuit", "part", "name"),
    [
        ("ltc3588", "ltc3588", "ltc3588_1"),
        ("node", "ltc3588", "ltc3588_1"),
        ("node", "sensor_node", "sensor_node"),
        ("bq25570", "bq25570", "bq25570_chip"),
    ],
)
def test_a_circuit_has_the_parameters_of_its_part(circuit, part, name):
    ours = head(FOLDER / f"{circuit}.cir", circuit)
    its = head(FOLDER / "parts" / f"{part}.lib", name)
    both = ours.keys() & its.keys()
    assert len(both) > 3 and {key: ours[key] for key in both} == {key: its[key] for key in both}


def test_the_keys_of_a_scene_name_every_chip():
    assert set(
        re.findall(r"\w+\d+", HarvestingChip.__annotations__["name"].__args__[0].__metadata__[0])
    ) == set(CHIPS)


def test_what_a_netlist_says_in_another_form_is_what_the_file_says():
    """Thresholds of an output, its table of efficiencies and the diodes."""
    ltc = CHIPS["ltc3588"]
    text = (FOLDER / "parts" / "ltc3588.lib").read_text()
    own = head(FOLDER / "parts" / "ltc3588.lib", "ltc3588_1")
    assert ltc.outputs[float(own["Vreg"])] == (float(own["Vrise"]), float(own["Vfall"]))
    assert re.search(r"\.model rectifier D\(Is=4\.4n N=1 ", text) and ltc.diodes == (4.4e-9, 1.0)
    assert re.search(
        r"\.model BAT54 D\(Is=0\.1u N=1 ", (FOLDER / "parts" / "diodes.lib").read_text()
    )
    assert all(chip.diodes == (1e-7, 1.0) for name, chip in CHIPS.items() if name != "ltc3588")
    line = re.search(r"Beta .*1e-9\)\), (.*)\)", (FOLDER / "parts" / "bq25570.lib").read_text())[1]
    points = [float(one) for one in line.split(",")]
    for log, share in zip(points[::2], points[1::2], strict=True):
        assert output_efficiency(CHIPS["bq25570"], math.exp(log)) == pytest.approx(share, abs=1e-4)


def test_the_file_and_the_netlist_do_not_both_have_a_number():
    text = (FOLDER / "parts" / "bought_parts.toml").read_text()
    tables = re.findall(r"(?s)netlist_keys = \{.*?\n\n", text)
    assert len(tables) == sum(bool(chip.netlist) for chip in CHIPS.values())
    for table in tables:
        for key in re.findall(r"(\w+) = \"", table.split("}")[0]):
            assert not re.search(rf"(?m)^{key} = ", table)


def test_texts_name_the_chips_that_there_are():
    """All in the list of the key, and those with a netlist in that of the option."""
    described = str(HarvestingChip.__annotations__["name"])
    assert all(name in described for name in CHIPS)
    option = next(one for one in design.params if one.name == "chips")
    with_netlist = [name for name, chip in CHIPS.items() if chip.netlist == name]
    assert sorted(re.findall(r"[a-z]+\d+", option.help)) == sorted(with_netlist)
