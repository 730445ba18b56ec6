"""A sweep's table as a labelled dataset (xarray), and as a NetCDF file of it."""

import json
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import xarray

from harvester.scene.keys import unit_of

if TYPE_CHECKING:
    from harvester.studies.sweep.table import Table

MEANINGS = {
    "mean_square_voltage": ("mean square voltage of the piezo", "V2"),
    "mean_square_voltage_stderr": ("standard error of the mean square voltage", "V2"),
    "mean_power": ("mean power in the load", "W"),
    "mean_power_stderr": ("standard error of the mean power", "W"),
    "mean_power_bias": ("estimated error of step and model in the mean power", "W"),
    "seconds": ("time of the computation", "s"),
}
TEXTS = ("error", "warnings")


def dataset(table: "Table") -> xarray.Dataset:
    """Variables over (engine, key, key, ...), of a list of points over (engine, point); nan where there is no number.

    Units are attributes, by udunits' names, "1" for a number; ``table.about`` is in the attributes, as JSON whole.
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


def netcdf(table: "Table") -> bytes:
    """The dataset as a file: NetCDF 3 (64-bit offsets), which SciPy writes and every reader of NetCDF knows."""
    data = dataset(table)
    for name in TEXTS:
        data[name] = data[name].astype(str)
    return bytes(data.to_netcdf(engine="scipy"))


def _attributes(about: dict[str, Any]) -> dict[str, str]:
    """Where the numbers come from."""
    given = {
        "title": about.get("scene", {}).get("title", ""),
        "source": f"harvester {about.get('versions', {}).get('harvester', '')}".strip(),
        "history": f"{about.get('when', '')} harvester {' '.join(about.get('command', []))}".strip(),
        "scene_digest": str(about.get("scene_digest", "")),
        "provenance": json.dumps(about, default=str) if about else "",
    }
    return {name: text for name, text in given.items() if text}
