"""A sweep's table as a dataset with labels and units (xarray), and as a NetCDF file of it."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, Protocol

import numpy as np
import xarray

from harvester.figures.shapes import SweepShape
from harvester.scene.keys import unit_of
from harvester.studies.sweep.rows import TEXTS

MEANINGS = {
    "mean_square_voltage": ("mean square voltage of the piezo", "V2"),
    "mean_square_voltage_stderr": ("standard error of the mean square voltage", "V2"),
    "mean_power": ("mean power in the load", "W"),
    "mean_power_stderr": ("standard error of the mean power", "W"),
    "mean_power_bias": ("estimated error of step and model in the mean power", "W"),
    "seconds": ("time of the computation", "s"),
}


class TableShape(SweepShape, Protocol):
    """What a dataset reads of a `harvester.Table`, beside what its figure does."""

    @property
    def points(self) -> Sequence[int]:
        """The number of each row's point."""
        ...

    @property
    def about(self) -> Mapping[str, Any]:
        """The provenance."""
        ...


def dataset(table: TableShape) -> xarray.Dataset:
    """The table as variables over (engine, key, key, ...), or over (engine, point) for a list of points.

    A variable is nan where there is no number.  Units are attributes with udunits' names, "1" for a pure number; the
    whole of ``table.about`` is an attribute as JSON.
    """
    engines = list(dict.fromkeys(row["engine"] for row in table.rows))
    if table.listed:
        shape: tuple[int, ...] = (len(table.axes[0].values),)
        dimensions: tuple[str, ...] = ("point",)
    else:
        shape, dimensions = tuple(len(a.values) for a in table.axes), tuple(a.key for a in table.axes)
    size = math.prod(shape)
    at = [engines.index(row["engine"]) * size + point for row, point in zip(table.rows, table.points, strict=True)]
    found: dict[str, Any] = {}
    for name, (meaning, unit) in MEANINGS.items():
        numbers = np.full((len(engines), size), np.nan)
        numbers.flat[at] = [float(row[name]) if row[name] else np.nan for row in table.rows]
        about = {"long_name": meaning, "units": unit if table.unit_names.power or name == "seconds" else "1"}
        found[name] = (("engine", *dimensions), numbers.reshape(-1, *shape), about)
    for name in TEXTS:
        texts = np.full((len(engines), size), "", dtype=object)
        texts.flat[at] = [row[name] for row in table.rows]
        found[name] = (("engine", *dimensions), texts.reshape(-1, *shape), {"long_name": f"{name}, '' for none"})
    labels: dict[str, Any] = {"engine": engines}
    for a in table.axes:
        unit = unit_of(a.key)
        labels[a.key] = ("point" if table.listed else a.key, np.array(a.values), {"units": unit} if unit else {})
    return xarray.Dataset(found, labels, _attributes(table.about))


def netcdf(table: TableShape) -> bytes:
    """The dataset as the bytes of a NetCDF 3 file (64-bit offsets), which SciPy writes and every reader knows."""
    data = dataset(table)
    for name in TEXTS:
        data[name] = data[name].astype(str)
    return bytes(data.to_netcdf(engine="scipy"))


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
