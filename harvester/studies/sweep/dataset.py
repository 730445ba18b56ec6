"""A sweep's table as a dataset with labels and units (xarray), and as a NetCDF file of it."""

import io
import json
import math
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from harvester.presentation.table import Column, Table
from harvester.scene.keys import unit_of
from harvester.studies.sweep.points import Axis
from harvester.studies.sweep.rows import SweepRow

if TYPE_CHECKING:
    import xarray

Variable = tuple[tuple[str, ...], Any, dict[str, str]]  # dimensions, values and attributes

# What the parts of a value are, by the ends of their columns' names.
MEANINGS = {
    "_stderr": "standard error of the {}",
    "_dof": "degrees of freedom of the standard error of the {}",
    "_step_bias": "estimated step error in the {}",
    "_model_bias": "estimated model error in the {}",
    "_error95": "error of the {} at 95 %",
    "_unknown": "parts of the error of the {} that are not known",
}
PURE = ("_dof", "_unknown")


class TableShape(Protocol):
    """The part of a `harvester.SweepTable` that a dataset reads; the table is above it."""

    @property
    def axes(self) -> Sequence[Axis]:
        """The varied keys with their values."""
        ...

    @property
    def listed(self) -> bool:
        """Whether the axes hold the values of one point after another."""
        ...

    @property
    def rows(self) -> Sequence[SweepRow]:
        """The rows."""
        ...

    @property
    def engines(self) -> Sequence[str]:
        """The engines that answered."""
        ...

    @property
    def keys(self) -> Sequence[str]:
        """The varied keys."""
        ...

    @property
    def points(self) -> Sequence[int]:
        """The number of each row's point."""
        ...

    @property
    def about(self) -> Mapping[str, Any]:
        """The provenance."""
        ...

    @property
    def table(self) -> Table:
        """All columns."""
        ...


def dataset(table: TableShape) -> "xarray.Dataset":
    """The table as variables over (engine, key, key, ...), or over (engine, point) for a list of points.

    A variable is nan without a number.  Units are attributes with udunits' names, "1" for a pure
    number; the whole of ``table.about`` is an attribute as JSON.
    """
    import xarray

    return xarray.Dataset(*_variables(table), _attributes(table.about))


def netcdf(table: TableShape) -> bytes:
    """The dataset as the bytes of a NetCDF 3 file (64-bit offsets), which every reader knows.

    SciPy writes it, and texts as xarray reads them: loading xarray needs longer than most sweeps by
    a formula.
    """
    from scipy.io import netcdf_file

    out = io.BytesIO()
    file = netcdf_file(out, "w", version=2)
    for name, text in _attributes(table.about).items():
        setattr(file, name, text.encode())
    variables, labels = _variables(table)
    for name, entry in (labels | variables).items():
        dimensions, values, about = entry
        if values.dtype == object:
            dimensions, values, about = _characters(dimensions, values, about)
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
    return (
        (*dimensions, f"string{characters.shape[-1]}"),
        characters,
        about | {"_Encoding": "utf-8"},
    )


def _variables(table: TableShape) -> tuple[dict[str, Variable], dict[str, Variable]]:
    """The variables of the table, and its labels: engines and keys."""
    if table.listed:
        shape: tuple[int, ...] = (len(table.axes[0].values),)
        dimensions: tuple[str, ...] = ("point",)
    else:
        shape = tuple(len(a.values) for a in table.axes)
        dimensions = tuple(table.keys)
    engines = table.engines
    size = math.prod(shape)
    indices = [
        engines.index(row.engine) * size + point
        for row, point in zip(table.rows, table.points, strict=True)
    ]
    variables: dict[str, Variable] = {}
    for column in table.table.columns:
        if column.name not in ("engine", *table.keys):
            for name, cells in column.plain().items():
                values = _laid_out(cells, indices, len(engines) * size).reshape(-1, *shape)
                variables[name] = (
                    ("engine", *dimensions),
                    values,
                    _meaning(column, name, values.dtype == object),
                )
    labels: dict[str, Variable] = {"engine": (("engine",), np.array(engines, object), {})}
    for a in table.axes:
        unit = unit_of(a.key)
        labels[a.key] = (
            ("point" if table.listed else a.key,),
            np.array(a.values),
            {"units": unit} if unit else {},
        )
    return variables, labels


def _laid_out(cells: Sequence[Any], indices: Sequence[int], size: int) -> Any:
    """Cells at their places among so many: numbers, nan if absent, or texts, '' if absent."""
    texts = any(isinstance(cell, str) for cell in cells)
    values = np.full(size, "", dtype=object) if texts else np.full(size, np.nan)
    nothing = "" if texts else np.nan
    values[list(indices)] = [nothing if cell is None else cell for cell in cells]
    return values


def _meaning(column: Column, name: str, is_text: bool) -> dict[str, str]:
    """The attributes of a variable: its meaning, and its unit."""
    end = name.removeprefix(column.name)
    meaning = MEANINGS.get(end, "{}").format(column.head)
    if is_text:
        return {"long_name": f"{meaning}, '' for none"}
    return {
        "long_name": meaning,
        "units": "1" if end in PURE else column.unit.replace("^", "") or "1",
    }


def _attributes(about: Mapping[str, Any]) -> dict[str, str]:
    """The attributes of a dataset that state the origin of its numbers."""
    known = {
        "title": about.get("scene", {}).get("title", ""),
        "source": f"harvester {about.get('versions', {}).get('harvester', '')}".strip(),
        "history": f"{about.get('when', '')} harvester {' '.join(about.get('command', []))}".strip(),
        "scene_digest": str(about.get("scene_digest", "")),
        "provenance": json.dumps(about, default=str) if about else "",
    }
    return {name: text for name, text in known.items() if text}
