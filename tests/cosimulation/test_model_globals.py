"""Values that a model's functions name outside of it are a part of its key."""

import types

import numpy as np

from harvester.cosimulation.ngspice import model_globals

numbers = types.ModuleType("numbers_of_a_model")
numbers.inner = types.ModuleType("inner")


class Model:
    def kick(self):
        return numbers.K + numbers.inner.K


def key():
    return model_globals.values_named(Model)


def test_numbers_of_modules_are_in_the_key():
    """NumPy's scalars of a module, and numbers of a module in a module, were left out."""
    numbers.K = np.int64(1)
    numbers.inner.K = 1.0
    first = key()
    assert key() == first and hash(key()) == hash(first)
    numbers.K = np.int64(2)
    second = key()
    numbers.inner.K = 2.0
    assert len({first, second, key()}) == 3


def test_an_object_is_itself_alone():
    """The id of an object that was deleted may be that of another."""
    keys = set()
    one = object()
    for thing in (one, object(), one):
        numbers.inner.K = thing
        keys.add(model_globals.values_named(types.SimpleNamespace(kick=thing)))
    assert len(keys) == 2
