"""The efficiency of a chip's converter over its input's voltage and current: a CSV file of three columns."""

import numpy as np

from harvester.errors import InputError
from harvester.quantities.kinds import CURRENT, VOLTAGE_FROM_0
from harvester.records.csv_table import read_table
from harvester.records.record_files import no_column, numbers, read_once

KEY = "chip.efficiency_table"
Efficiencies = tuple[tuple[float, float, float], ...]


def read_efficiencies(path: str) -> Efficiencies:
    """Rows of voltage (V), current (A) and efficiency, ascending.

    Raises InputError in one line for a file that cannot be read or has no such columns, voltages
    and currents that are not above 0, and efficiencies that are not share.
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
    shares = columns[0].values / (100.0 if columns[0].stated == "%" else 1.0)
    good = (volts > 0.0) & (amperes > 0.0) & (shares > 0.0) & (shares <= 1.0)
    if not good.all():
        row = int(np.argmin(good))
        raise InputError(
            f"{KEY} must have voltages and currents above 0 and efficiencies above 0, up to 1 (or 100 %), but row "
            f"{row + 1} has {volts[row]:g} V, {amperes[row]:g} A and {shares[row]:g}"
        )
    return tuple(sorted(zip(volts.tolist(), amperes.tolist(), shares.tolist(), strict=True)))
