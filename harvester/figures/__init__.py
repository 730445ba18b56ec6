"""All drawing: each function makes a `Plot` of an object of `figures.shapes`, and `save` writes its files.

The names are in ``__init__.pyi``; matplotlib is loaded when one of them is first used.
"""

from typing import Any

import lazy_loader

from harvester.machine.imports import load_elsewhere

_loaded, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)


def __getattr__(name: str) -> Any:
    if name in __all__:
        # which would take the look of figures from a file matplotlibrc
        load_elsewhere("matplotlib")
    return _loaded(name)
