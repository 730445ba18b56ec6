"""The efficiency of a chip's converter over its input's voltage and current: a CSV file of three columns."""

from collections import Counter

import numpy as np

from harvester.errors import InputError, shown
from harvester.quantities.kinds import CURRENT, VOLTAGE_FROM_0
from harvester.records.csv_table import read_table
from harvester.records.named_columns import no_column, numbers
from harvester.records.read_once import read_once

KEY = "chip.efficiency_table"
LARGEST = 1e6  # V and A: beyond them a table is no chip's
Efficiencies = tuple[tuple[float, float, float], ...]


def read_efficiencies(path: str) -> Efficiencies:
    """Rows of voltage (V), current (A) and efficiency, ascending.

    Raises InputError in one line for a file that cannot be read or has no such columns, voltages
    and currents that are not above 0, and efficiencies that are not a share.
    """
    return read_once(_efficiencies, path)


def _efficiencies(path: str) -> Efficiencies:
    table = read_table(path, KEY)
    _, volts = numbers(
        table, KEY, lambda column: "voltage" in column.words, "input voltage", VOLTAGE_FROM_0
    )
    _, amperes = numbers(
        table, KEY, lambda column: "current" in column.words, "input current", CURRENT
    )
    columns = table.find(lambda column: "efficiency" in column.words)
    if not columns:
        raise no_column(table, KEY, "efficiency", CURRENT)
    if len(columns) > 1 or columns[0].stated not in ("", "%"):
        names = ", ".join(f"{column.name} ({column.stated})" for column in columns)
        raise InputError(
            f"{KEY} must have one column 'efficiency' or 'efficiency (%)', but has {shown(names)}"
        )
    shares = columns[0].values / (100.0 if columns[0].stated == "%" else 1.0)
    good = (volts > 0.0) & (amperes > 0.0) & (shares > 0.0) & (shares <= 1.0)
    if not good.all():
        row = int(np.argmin(good))
        raise InputError(
            f"{KEY} must have voltages and currents above 0 and efficiencies above 0, up to 1 (or 100 %), but row "
            f"{row + 1} has {volts[row]:g} V, {amperes[row]:g} A and {shares[row]:g}"
        )
    if not (max(volts) <= LARGEST and max(amperes) <= LARGEST):
        raise InputError(
            f"{KEY} must have voltages up to {LARGEST:g} V and currents up to {LARGEST:g} A, "
            f"but has {max(volts):g} V and {max(amperes):g} A"
        )
    points = Counter(zip(volts.tolist(), amperes.tolist(), strict=True))
    (volt, ampere), count = points.most_common(1)[0]
    if count > 1:
        raise InputError(
            f"{KEY} must have each point once, but has {volt:g} V and {ampere:g} A {count} times"
        )
    return tuple(sorted(zip(volts.tolist(), amperes.tolist(), shares.tolist(), strict=True)))
