"""Every public function and class refuses a keyword that it does not know, and states which one is near it."""

import inspect
import re

import pytest

import harvester as hv
from tests.support.paths import EXAMPLES

SCENE = hv.load(EXAMPLES / "plate_with_stop.toml")
REQUIRED = {
    "compare": (SCENE,),
    "cosimulate": (None,) * 6,
    "extremes": (SCENE,),
    "export": (SCENE, "plate.lib"),
    "identify": ("a.csv",),
    "linspace": (1.0, 2.0, 3),
    "load": (EXAMPLES / "plate.toml",),
    "loads": ((EXAMPLES / "plate.toml").read_text(),),
    "logspace": (1.0, 2.0, 3),
    "motion": (SCENE,),
    "optimise": (SCENE,),
    "response": (SCENE, [1.0, 2.0]),
    "run": (SCENE,),
    "stability": (SCENE,),
    "sweep": (SCENE,),
    "tolerance": (SCENE,),
}
ANY = {"Netlist"}  # whose keywords are the parameters of the circuit
# A keyword as it is misspelt, of those that the signature hides behind **options.
HIDDEN = {
    "compare": ("trajectoris", "trajectories"),
    "cosimulate": ("toleranc", "tolerance"),
    "run": ("trajectoris", "trajectories"),
}


def is_error(thing):
    return inspect.isclass(thing) and issubclass(thing, Exception)


NAMES = [
    name for name in hv.__all__ if callable(getattr(hv, name)) and not is_error(getattr(hv, name))
]


def misspelt(name):
    """A keyword that is nearly one of those that a function or class has, and the right one."""
    if name in HIDDEN:
        return HIDDEN[name]
    words = [one.name for one in inspect.signature(getattr(hv, name)).parameters.values()]
    right = max(words, key=len)
    return right[:-2] + right[-1] if len(right) > 4 else right + "s", right


@pytest.mark.parametrize("name", [name for name in NAMES if name not in ANY])
def test_a_misspelt_keyword(name):
    """`hv.compare(scene, trajectoris=5)` is an InputError that names `trajectories`, never a bare TypeError."""
    wrong, right = misspelt(name)
    with pytest.raises(hv.InputError, match=rf"{wrong}.*did you mean '{right}'") as caught:
        getattr(hv, name)(*REQUIRED.get(name, ()), **{wrong: 1})
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", [name for name in NAMES if name not in ANY])
def test_a_keyword_like_none(name):
    """One that is near to none is refused by its name."""
    with pytest.raises(hv.InputError, match=re.escape("xyzzy_qq")):
        getattr(hv, name)(*REQUIRED.get(name, ()), xyzzy_qq=1)


SEEDED = [
    name
    for name in NAMES
    if name not in HIDDEN and "seed" in inspect.signature(getattr(hv, name)).parameters
]


@pytest.mark.parametrize("seed", [-1, 1.5, "1"])
@pytest.mark.parametrize("name", SEEDED)
def test_a_seed_is_a_whole_number(name, seed):
    """`densities --seed -1` was an internal error after the computation."""
    with pytest.raises(hv.InputError, match=r"^`seed` must be a whole number of at least 0, but"):
        getattr(hv, name)(*REQUIRED.get(name, (SCENE,)), seed=seed)


@pytest.mark.parametrize("engine", ["published", "averaged"])
def test_an_option_that_would_be_ignored(engine):
    """A formula has no trajectories: the number that was asked for would do nothing."""
    with pytest.raises(hv.InputError, match="trajectories"):
        hv.compare(SCENE, engines=[engine], trajectories=5)


def test_what_is_given_in_another_form():
    """A misspelt keyword of a method, one name in place of a list of names, and None in place of a number."""
    with pytest.raises(hv.InputError, match="did you mean 'resistance'"):
        SCENE.with_load(resistanc=1.0)
    assert [one.engine for one in hv.compare(SCENE, engines="averaged").estimates] == ["averaged"]
    with pytest.raises(hv.InputError, match="`within` and `budget` must be numbers or texts"):
        hv.optimise(
            SCENE, vary={"load.resistance": ("1 kohm", "1 Mohm")}, engine="averaged", within=None
        )


def test_what_code_of_others_catches():
    """Bad input is a ValueError and an unknown keyword a TypeError, told in the same line, not in pydantic's words."""
    with pytest.raises(
        TypeError, match=r"^unknown option of an engine 'sead': did you mean 'seed'"
    ):
        hv.run(SCENE, sead=1)
    for table, keys, line in (
        (
            hv.Piezo,
            {"coupling": "1 kg", "capacitance": 5e-8},
            "piezo.coupling must be an electromechanical coupling",
        ),
        (hv.Stop, {"restitution": 0.5, "stiffness": 1.0}, "stop.stiffness must be left out"),
        (hv.Scene, {"oscillator": SCENE.oscillator}, r"\[piezo\] must be given"),
        (
            hv.Scene,
            {"oscillator": {"mass": -1.0, "stiffness": 1.0}},
            "oscillator.mass must be a mass",
        ),
    ):
        with pytest.raises(ValueError, match=f"^{line}") as caught:
            table(**keys)
        assert "\n" not in str(caught.value)
