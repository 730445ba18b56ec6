"""The draft of a page: every key has its slider, every scene is the same after it, and what is wrong is one line."""

from dataclasses import replace

import pytest

import harvester as hv
from harvester.explore.draft import FIRST, Draft, differences, first
from harvester.explore.effects import effects
from harvester.explore.slider_scale import STEPS, slide
from harvester.explore.texts import normal, written
from harvester.scene.keys import keys
from harvester.scene.toml import loads
from tests.support.netlists import BRIDGE, STORE, on_plate
from tests.support.paths import ROOT

EXAMPLES = sorted((ROOT / "examples").rglob("*.toml"))


def test_every_key_has_one_knob():
    """Those of the load are made as the circuit asks for them; what is next to the device has none."""
    known = [
        key for physical in (True, False) for effect in effects(physical) for key in effect.keys
    ]
    without = ("load", "storage", "chip", "node", "mode", "magnifier", "ball")
    assert set(known) == {f"{one.table}.{one.name}" for one in keys() if one.table not in without}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_a_scene_stays_itself(path):
    """Read into the page and out of it again, and from the file that the page saves."""
    draft, scene = Draft.read(path), hv.load(path)
    assert draft.scene() == scene
    assert hv.loads(draft.toml(), path.parent).tables().keys() == scene.tables().keys()


def test_values_stay_as_they_were_written():
    assert Draft.read(ROOT / "examples" / "plate.toml").texts["piezo.capacitance"] == "50.2 nF"
    draft = first()
    draft.turn("excitation.acceleration_psd", 2e-5 * 9.80665**2)
    assert draft.texts["excitation.acceleration_psd"] == "2e-05 g^2/Hz"
    draft.type("load.resistance", "470k")
    assert draft.texts["load.resistance"] == "470 kohm"
    assert loads(draft.toml()).load.resistance == 470e3


@pytest.mark.parametrize(("value", "key", "text"), [
    (5.02e-8, "piezo.capacitance", "50.2 nF"), (0.04, "oscillator.mass", "40 g"), (2.0, "oscillator.mass", "2 kg"),
    (-3e-4, "stop.gap", "-300 um"), (0.0, "stop.gap", "0 m"), (0.96, "stop.restitution", "0.96"),
    (1e-3, "load.parameters.C", "1 mF"), (9.6e-4, "excitation.acceleration_psd", "0.00096 (m/s^2)^2/Hz"),
])  # fmt: skip
def test_a_value_is_read_back(value, key, text):
    """What is written into a field is what `read_value` and a scene file read."""
    assert written(key, value) == text
    draft = first()
    draft.type(key, text)
    assert draft.value(key) == pytest.approx(value, rel=1e-12)


def test_every_element_of_an_own_netlist_has_a_knob_and_is_in_the_scene_once_it_is_turned(tmp_path):
    """Those that the scene names as well; a scene that nobody changed stays itself."""
    body = BRIDGE.format("1N4148") + STORE + "L3 p q 2\nR4 q n 5k\nV1 c 0 0\nR5 c a 1Meg"
    scene = on_plate(tmp_path, body)
    draft = Draft(replace(scene, load=replace(scene.load, parameters={"rload": "1 Mohm"})))
    names = {
        key.removeprefix("load.parameters.")
        for key in draft.present_keys()
        if key.startswith("load.")
    }
    assert names == {"rload", "L3", "R4", "R5", "Csmooth"}
    assert draft.texts["load.parameters.L3"] == "2 H" and draft.scene().load.parameters == {
        "rload": 1e6
    }
    draft.turn("load.parameters.R4", 7e3)
    draft.type("load.parameters.L3", "3 H")
    assert draft.scene().load.parameters == {"rload": 1e6, "R4": 7e3, "L3": 3.0}
    draft.choose("bridge")
    assert not any("L3" in key for key in draft.present_keys())


@pytest.mark.parametrize(
    "text", ["", "many", "50 kg", "-1 ohm", "1e999", "nan", "<script>", "1" * 5000, "0"]
)
def test_a_wrong_text_is_one_line(text):
    with pytest.raises(hv.InputError, match=r"load\.resistance must be a load resistance") as error:
        normal("load.resistance", text)
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400


def test_effects_are_absent_or_present():
    """Switched off a key is not in the scene; on, it has a value that the scene accepts, also for a choice."""
    for draft in (first(), Draft.read(ROOT / "examples" / "paper_figure3.toml")):
        for effect in draft.effects:
            if (
                effect.fixed
                or any("file" in key for key in effect.keys)
                or "excitation by name" in (effect.needs, effect.label)
                or effect.label.lower() == "coupling of x^2"  # a scene with a stop refuses it
            ):
                continue
            one = draft.copy()
            one.switch(effect, True)
            tables = one.scene().tables()
            present = [
                key for key in effect.keys if key.split(".")[1] in tables.get(key.split(".")[0], {})
            ]
            assert present == ([*effect.keys] if one.has(effect) else [])
            assert sum(other.choice == effect.choice for other in one.on if effect.choice) <= 1
            one.switch(effect, False)
            assert not one.has(effect)


def test_a_record_that_is_not_there():
    draft = first()
    record = next(one for one in draft.effects if one.keys == ("excitation.acceleration_file",))
    draft.switch(record, True)
    with pytest.raises(hv.InputError, match="none is open: open one under 'Open and save'"):
        draft.scene()


def test_another_circuit():
    """The resistance stays; the netlist's parameters get sliders; back again nothing is left of them."""
    draft = first()
    draft.type("load.resistance", "220k")
    draft.choose("bridge")
    assert draft.scene().load.parameters["R"] == 220e3
    assert draft.texts["load.parameters.C"] == "1 uF"
    assert ("load.netlist", "absent", "bridge") in differences(first().tables(), draft.tables())
    draft.choose(None)
    assert draft.tables()["load"] == {"resistance": "220 kohm"}


@pytest.mark.parametrize(
    ("key", "value"), [("load.resistance", 1e6), ("stop.restitution", 0.96), ("stop.gap", -5e-4)]
)
def test_sliders(key, value):
    """A value in the middle is found again to three digits, ends are ends, and more to the right is more in size."""
    one = slide(key, value)
    assert one.value(one.position(value)) == pytest.approx(value, rel=2e-2)
    values = [abs(one.value(place)) for place in range(STEPS + 1)]
    assert values == sorted(values)
    assert one.holds(value)
    assert not one.holds(1e9)


def test_what_says_the_same_in_another_way_keeps_the_device():
    """Switched to a resonance, a quality factor and a frequency in open circuit, the power is what it was."""
    draft = Draft.of_text(FIRST, ROOT)
    before = hv.run(draft.scene(), "averaged").mean_power.value
    labels = {one.label: one for one in draft.effects}
    for label in ("spring, as a resonance frequency", "damping, as a quality factor"):
        draft.switch(labels[label], True)
    draft.switch(labels["coupling, as a frequency in open circuit"], True)
    scene = draft.scene()
    assert (
        scene.oscillator.stiffness is None
        and scene.oscillator.damping is None
        and scene.piezo.coupling is None
    )
    # texts have six digits
    assert hv.run(scene, "averaged").mean_power.value == pytest.approx(before, rel=1e-3)
    draft.switch(labels["spring, as a stiffness"], True)
    assert draft.scene().oscillator.frequency is None
    assert draft.scene().modal.stiffness == pytest.approx(16.0, rel=1e-4)
