"""Models of `cosimulate` that an FMU cannot have: each is refused in one line."""

import collections
import math
import random

import numba
import numpy as np
import pytest

import harvester as hv
from harvester.errors import CannotServeError, InputError
from tests.support.paths import EXAMPLES
from tests.support.swing import PIEZO, Place, Swing

pytest.importorskip("fmpy")
pytest.importorskip("ziglang")
pytestmark = pytest.mark.slow


class Raising(Swing):
    def kick(self, s, h, reaction, noise):
        if s.x > 1.0:
            raise ValueError("too far")
        return s


class Lists(Swing):
    def kick(self, s, h, reaction, noise):
        return Place(*(part + 0.0 for part in {s: 1}.popitem()[0]))


class Arrays(Swing):
    def kick(self, s, h, reaction, noise):
        all_of = np.zeros(3)
        all_of[int(s.x)] = 1.0
        return Place(s.x, s.v + all_of.sum())


class Printing(Swing):
    def kick(self, s, h, reaction, noise):
        print(s.x)
        return s


class Drawing(Swing):
    def kick(self, s, h, reaction, noise):
        return Place(s.x, s.v + h * random.random())


TABLE = (1.0, 2.0, 3.0)


class Tabled(Swing):
    def kick(self, s, h, reaction, noise):
        return Place(s.x, s.v - h * TABLE[int(abs(s.x)) % 3])


@numba.njit
def not_far(x):
    if x > 1.0:
        raise ValueError("too far")
    return x


class Helped(Swing):
    def kick(self, s, h, reaction, noise):
        return Place(s.x, s.v - h * not_far(s.x))


Greek = collections.namedtuple("Greek", ["x", "\u03b8"])
LARGE = np.linspace(0.9, 1.1, 130_000)


class Large(Swing):
    def kick(self, s, h, reaction, noise):
        return Place(s.x, s.v - h * LARGE[int(1e6 * abs(s.x)) % 130_000] * s.x)


class Plain:
    def drift(self, state, h):
        return state

    def kick(self, state, h, reaction, noise):
        return state

    def source(self, state):
        return 0.0


GIVEN = {"port": PIEZO, "start": Place(0.0, 0.0), "step": "1 ms"}


@pytest.mark.parametrize(
    ("model", "options", "words"),
    [
        (
            Raising(),
            GIVEN,
            r"`model.kick` must not raise errors .*test_fmu_model_refusals.py, line \d+",
        ),
        (
            Arrays(),
            GIVEN,
            r"`model.kick` must use numbers alone .*test_fmu_model_refusals.py, line \d+",
        ),
        (Printing(), GIVEN, r"`model.kick` must use numbers alone .*output.*line \d+"),
        (Drawing(), GIVEN, r"`model.kick` must use .*random draws.* noise is the argument"),
        (Tabled(), GIVEN, r"`model.kick` must not raise errors .* an index .*line \d+"),
        (
            Helped(),
            GIVEN,
            r"`model.kick` must not raise errors .*test_fmu_model_refusals.py, line \d+",
        ),
        (Swing(k=math.inf), GIVEN, "`model` must have numbers between .*k=inf"),
        (Swing(k=2e30), GIVEN, "`model` must have numbers between .*k=2e"),
        (Swing(), GIVEN | {"start": Place(0.0, -2e30)}, "`start` must have numbers .*v=-2e"),
        (Swing(), GIVEN | {"start": Greek(0.0, 0.0)}, "`start` must have names of ASCII letters"),
        (Swing(), GIVEN | {"step": "1e-30 s"}, "`step` must be from 1e-12 to 1e.06 s"),
        (Swing(), GIVEN | {"step": "1e30 s"}, "`step` must be from 1e-12 to 1e.06 s"),
        (Plain(), GIVEN, "`model` must be a NamedTuple of numbers for an FMU"),
        (Swing(), GIVEN | {"port": None}, "`port` must be given with a model"),
        (Swing(), GIVEN | {"step": 0.0}, "`step` must be a time above 0"),
        (Swing(), GIVEN | {"step": math.nan}, "`step` must be a time above 0"),
        (Swing(), GIVEN | {"start": (0.0, 0.0)}, "`start` must be a NamedTuple"),
        (Swing(), GIVEN | {"inputs": ["mass"]}, "mass"),
        (Swing(), GIVEN | {"circuit": "inside"}, "`circuit` must belong to a Scene"),
        (Swing(), GIVEN | {"fmi": 4}, "`fmi` must be 2 or 3"),
        (Swing(), GIVEN | {"platforms": "amiga"}, "amiga"),
    ],
)
def test_a_model_is_refused_in_one_line(tmp_path, model, options, words):
    with pytest.raises(InputError, match=words) as caught:
        hv.export(model, tmp_path / "model.fmu", **options)
    assert "\n" not in str(caught.value)
    assert list(tmp_path.iterdir()) == []


def test_a_large_array_is_refused(tmp_path):
    """Above 1 MB numba reads it at its address in the exporting process, and an importer crashed."""
    with pytest.raises(CannotServeError, match="arrays of at most 1 MB"):
        hv.export(Large(), tmp_path / "model.fmu", **GIVEN)


def test_python_that_numba_does_not_compile_is_refused_with_its_line(tmp_path):
    """`cosimulate` names the same line; sets and sorted mixtures have no machine code."""
    with pytest.raises(
        InputError, match=r"numba compiles it, but Lists is not: .*line \d+"
    ) as caught:
        hv.export(Lists(), tmp_path / "model.fmu", **GIVEN)
    assert "\n" not in str(caught.value)
    assert "an FMU has no Python inside" in str(caught.value)


def test_what_only_a_scene_or_a_netlist_of_a_piezo_has(tmp_path):
    """A subcircuit of a model, a netlist with a coil, and an option of a model with a scene."""
    with pytest.raises(CannotServeError, match=r"must be an FMU, such as model.fmu"):
        hv.export(Swing(), tmp_path / "model.lib", **GIVEN)
    coil = GIVEN | {"port": hv.Coil(coupling=10.0)}
    with pytest.raises(CannotServeError, match="a load resistance inside"):
        hv.export(Swing(), tmp_path / "model.fmu", load="bridge", **coil)
    with pytest.raises(InputError, match="`step` must belong to a model of `cosimulate`"):
        hv.export(EXAMPLES / "plate.toml", tmp_path / "plate.fmu", step="1 ms")
    assert list(tmp_path.iterdir()) == []
