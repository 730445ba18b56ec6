"""All drawing: each function makes a `Plot` of what `figures.shapes` describes, and `save` writes its files.

The names stand in ``__init__.pyi``; matplotlib is loaded when one of them is first used.
"""

import lazy_loader

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
