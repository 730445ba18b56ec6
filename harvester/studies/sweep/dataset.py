"""A sweep's table as a dataset with labels and units (xarray), and as a NetCDF file of it."""

import io
import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from harvester.figures.shapes import SweepShape
from harvester.scene.keys import unit_of
from harvester.studies.sweep.rows import TEXTS

if TYPE_CHECKING:
    import xarray

Variable = tuple[tuple[str, ...], Any, dict[str, str]]  # dimensions, values and attributes

MEANINGS = {
    "mean_square_voltage": ("mean square voltage of the piezo", "V2"),
    "mean_square_voltage_stderr": ("standard error of the mean square voltage", "V2"),
    "mean_power": ("mean power in the load", "W"),
    "mean_power_stderr": ("standard error of the mean power", "W"),
    "mean_power_bias": ("estimated error of step and model in the mean power", "W"),
    "seconds": ("time of the computation", "s"),
    "responses": ("responses to the steady drive that a search found", "1"),
}


class TableShape(SweepShape, Protocol):
    """What a dataset reads of a `harvester.SweepTable`, beside what its figure does."""

    @property
    def points(self) -> Sequence[int]:
        """The number of each row's point."""
        ...

    @property
    def about(self) -> Mapping[str, Any]:
        """The provenance."""
        ...


def dataset(table: TableShape) -> "xarray.Dataset":
    """The table as variables over (engine, key, key, ...), or over (engine, point) for a list of points.

    A variable is nan where there is no number.  Units are attributes with udunits' names, "1" for a pure number; the
    whole of ``table.about`` is an attribute as JSON.
    """
    import xarray

    return xarray.Dataset(*_variables(table), _attributes(table.about))


def netcdf(table: TableShape) -> bytes:
    """The dataset as the bytes of a NetCDF 3 file (64-bit offsets), which every reader knows.

    SciPy writes it, and texts as xarray reads them: loading xarray takes longer than most sweeps by a formula.
    """
    from scipy.io import netcdf_file

    out = io.BytesIO()
    file = netcdf_file(out, "w", version=2)
    for name, text in _attributes(table.about).items():
        setattr(file, name, text.encode())
    found, labels = _variables(table)
    for name, one in (labels | found).items():
        dimensions, values, about = _characters(*one) if one[1].dtype == object else one
        for dimension, length in zip(dimensions, values.shape, strict=True):
            if dimension not in file.dimensions:
                file.createDimension(dimension, length)
        variable = file.createVariable(name, values.dtype, dimensions)
        variable[:] = values
        for key, text in about.items():
            setattr(variable, key, text.encode())
    file.flush()
    return out.getvalue()


def _characters(dimensions: tuple[str, ...], texts: Any, about: dict[str, str]) -> Variable:
    """A variable of texts as one of characters, with their number as its last dimension."""
    coded = np.char.encode(texts.astype(str), "utf-8")
    characters = coded.astype(f"S{max(coded.itemsize, 1)}")[..., None].view("S1")
    return (*dimensions, f"string{characters.shape[-1]}"), characters, about | {"_Encoding": "utf-8"}


def _variables(table: TableShape) -> tuple[dict[str, Variable], dict[str, Variable]]:
    """The variables of the table, and its labels: engines and keys."""
    engines = list(dict.fromkeys(row["engine"] for row in table.rows))
    if table.listed:
        shape: tuple[int, ...] = (len(table.axes[0].values),)
        dimensions: tuple[str, ...] = ("point",)
    else:
        shape, dimensions = tuple(len(a.values) for a in table.axes), tuple(a.key for a in table.axes)
    size = math.prod(shape)
    at = [engines.index(row["engine"]) * size + point for row, point in zip(table.rows, table.points, strict=True)]
    found: dict[str, Variable] = {}
    for name, (meaning, unit) in MEANINGS.items():
        numbers = np.full((len(engines), size), np.nan)
        numbers.flat[at] = [float(row[name]) if row[name] else np.nan for row in table.rows]
        about = {"long_name": meaning, "units": unit if table.unit_names.power or name == "seconds" else "1"}
        found[name] = (("engine", *dimensions), numbers.reshape(-1, *shape), about)
    for name in TEXTS:
        texts = np.full((len(engines), size), "", dtype=object)
        texts.flat[at] = [row[name] for row in table.rows]
        found[name] = (("engine", *dimensions), texts.reshape(-1, *shape), {"long_name": f"{name}, '' for none"})
    labels: dict[str, Variable] = {"engine": (("engine",), np.array(engines, object), {})}
    for a in table.axes:
        unit = unit_of(a.key)
        labels[a.key] = (("point" if table.listed else a.key,), np.array(a.values), {"units": unit} if unit else {})
    return found, labels


def _attributes(about: Mapping[str, Any]) -> dict[str, str]:
    """The attributes of a dataset that say where its numbers come from."""
    known = {
        "title": about.get("scene", {}).get("title", ""),
        "source": f"harvester {about.get('versions', {}).get('harvester', '')}".strip(),
        "history": f"{about.get('when', '')} harvester {' '.join(about.get('command', []))}".strip(),
        "scene_digest": str(about.get("scene_digest", "")),
        "provenance": json.dumps(about, default=str) if about else "",
    }
    return {name: text for name, text in known.items() if text}
