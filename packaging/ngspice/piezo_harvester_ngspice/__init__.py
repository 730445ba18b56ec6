"""Where the ngspice library of this wheel is, and its code models; nothing is loaded here."""

from pathlib import Path

__version__ = "39.3.0"  # of ngspice, and of this wheel of it

_HERE = Path(__file__).absolute().parent
_LIBRARIES = ("libngspice.so", "libngspice.dylib", "ngspice.dll")


def library() -> Path:
    """The path of the ngspice library: the one that is there of the names that Linux, macOS and Windows give it.

    Raises FileNotFoundError where there is none, as in the source of this package.
    """
    for path in (_HERE / name for name in _LIBRARIES):
        if path.is_file():
            return path
    raise FileNotFoundError(
        f"there is no ngspice library in {_HERE}: build the wheel and install that"
    )


def code_models() -> list[Path]:
    """The paths of its code models, in the order in which ngspice's own start loads them."""
    names = ("spice2poly", "analog", "digital", "xtradev", "xtraevt", "table")
    return [_HERE / f"{name}.cm" for name in names]
