"""Circuit-level co-simulation of vibro-impact piezoelectric energy harvesters.

    import harvester as hv
    scene = hv.load("examples/plate_with_stop.toml")
    print(hv.Averaged().run(scene))
    print(hv.Ensemble(within="1%").run(scene))

The public names are in ``__init__.pyi``, once each; the modules of a name are loaded when the name
is first used.
"""

# nothing else before the lines below: a stranger's typing.py in the current folder would be taken
import sys

if (
    sys.argv[:1] == ["-m"]
    and sys.orig_argv[-len(sys.argv)].endswith("harvester")
    and not sys.flags.safe_path
):
    # the current folder, put there for -m: a stranger's random.py in it would be taken for Python's
    del sys.path[0]

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
__version__ = "0.1.0"
