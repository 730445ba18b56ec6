"""A record of any length, read from its file in blocks of some megabytes, so that a day needs no more memory.

The layout is that of the first block (`harvester.records.csv_layout`).  All rows are counted and
checked once; from then on a block is read again when its samples are asked for.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from harvester.arrays import Floats
from harvester.errors import InputError, invalid, shown
from harvester.machine import files
from harvester.records import csv_table
from harvester.records.csv_layout import Layout, layout, plain_lines
from harvester.records.csv_table import CsvTable, table_of
from harvester.records.plain_text import decoded
from harvester.records.record_facts import MendError
from harvester.records.records import Record

BLOCK = 2**22  # bytes
MOST_BYTES = 8_000_000_000
UNEVEN = 0.01  # of a step: how far a time may be off an even grid
# times to a sample, and samples at once, for the mean jerk
FINE = 8
EACH = 2**16
UTF_16 = b"\xff\xfe", b"\xfe\xff"

# times (s) and accelerations (m/s^2) of a table, checked
Columns = Callable[[CsvTable], tuple[Floats, Floats]]


class Block(NamedTuple):
    """Some rows of a file: their first byte and their bytes, the number of rows before, the line of the last of those.

    ``repeated`` is that line, which a block of times of a clock begins with; for others it is
    empty.
    """

    offset: int
    size: int
    before: int
    repeated: bytes


@dataclass(frozen=True)
class LongFile:
    """A file with the layout of its first block, and the function that selects the columns of a table."""

    path: str
    argument: str
    layout: Layout
    columns: Columns

    @classmethod
    def of(cls, path: str, argument: str, columns: Columns) -> "LongFile | None":
        """The file; None for one that is short, or that cannot be cut at the ends of its lines."""
        head = files.read_part(path, argument, 0, BLOCK)
        if len(head) < BLOCK or head[:2] in UTF_16 or b"\n" not in head:
            return None
        if (size := Path(path).stat().st_size) > MOST_BYTES:
            raise invalid(argument, f"be a file of at most {MOST_BYTES} bytes", size)
        form = layout(decoded(head[: head.rfind(b"\n")], path, argument))
        return None if form is None else cls(path, argument, replace(form, rows=()), columns)

    def table(self, block: Block) -> CsvTable:
        """The rows of a block."""
        data = block.repeated + files.read_part(self.path, self.argument, block.offset, block.size)
        text = decoded(data, self.path, self.argument)
        if (
            not block.offset and (form := layout(text)) is not None
        ):  # without what stands above the rows
            text = "\n".join(form.rows)
        table = table_of(self.layout, text, self.path, self.argument)
        return replace(table, before=block.before - bool(block.repeated))

    def blocks(self) -> Iterator[tuple[CsvTable, Block]]:
        """All blocks in turn.

        If a clock gives the times, each repeats the last row of that before.
        """
        block = Block(0, 0, 0, b"")
        while data := files.read_part(self.path, self.argument, block.offset, BLOCK):
            data = data if len(data) < BLOCK else data[: data.rfind(b"\n") + 1]
            if not data:
                raise InputError(
                    f"{self.argument} must have lines of at most {BLOCK} bytes, but one has more"
                )
            block = block._replace(size=len(data))
            table = self.table(block)
            rows = len(table.columns[0].values) - bool(block.repeated)
            if rows:  # there may be nothing but remarks
                yield table, block
            row = (
                _last_row(data)
                if rows and any(column.clock for column in table.columns)
                else block.repeated
            )
            block = Block(block.offset + len(data), 0, block.before + rows, row)


def _last_row(data: bytes) -> bytes:
    """The last line that holds a row, of lines of which one does."""
    return next(
        line + b"\n" for line in reversed(data.split(b"\n")) if plain_lines(line.decode("latin-1"))
    )


@lru_cache(4)
def _samples(file: LongFile, block: Block) -> Floats:
    """The accelerations of a block (m/s^2)."""
    return file.columns(file.table(block))[1][bool(block.repeated) :]


@dataclass(frozen=True)
class Scan:
    """The result of one pass over all rows of a file: its blocks, the rows, their spacing (s) and rms (m/s^2).

    ``whole`` reads the record at once.
    """

    file: LongFile
    blocks: tuple[Block, ...]
    count: int
    spacing: float
    rms: float
    whole: Callable[[], Record]


class LongRecord(Record):
    """A record in a file, of which ``part`` reads the requested part.

    Its ``values`` are read at once when they are.

    ``time`` and ``value`` are the factors of times and accelerations.  InputError for the values of
    a file that has more than `csv_table.MOST_BYTES`.
    """

    scan: Scan
    time: float
    value: float

    def __init__(self, scan: Scan, time: float = 1.0, value: float = 1.0) -> None:
        fields = {"scan": scan, "time": time, "value": value, "spacing": scan.spacing * time}
        self.__dict__.update(fields)  # which is frozen

    def __repr__(self) -> str:
        return f"LongRecord({self.scan.file.path!r}, {self.count} samples)"

    @cached_property
    def whole(self) -> Record:
        """The record with all its samples, as a shorter one has them."""
        file = self.scan.file
        if (size := Path(file.path).stat().st_size) > csv_table.MOST_BYTES:
            raise InputError(
                f"{file.argument} must be a file of at most {csv_table.MOST_BYTES} bytes if all of it is needed at "
                f"once, but {shown(file.path)} has {size}: 'harvester node' and 'harvester design' read it in blocks"
            )
        return self.scan.whole().scaled(self.time, self.value)

    @property
    def values(self) -> Floats:
        """All samples, as of `Record`."""
        return self.whole.values

    @property
    def bridged(self) -> bool:
        """Whether the last are those of a bridge."""
        return self.whole.bridged

    @property
    def count(self) -> int:
        """The samples of the file."""
        return self.scan.count

    @property
    def rms(self) -> float:
        """The root of the mean square of the file's samples."""
        return self.scan.rms * abs(self.value)

    @property
    def mean_jerk(self) -> float:
        """E|a'|, of pieces whose Fourier series are those of `resampled`."""
        pieces = (self.resampled(k, 1, EACH, FINE * EACH) for k in range(self.count // EACH))
        return float(sum(np.abs(np.diff(piece)).sum() for piece in pieces)) / (
            self.count * self.spacing
        )

    def scaled(self, time: float, value: float) -> "LongRecord":
        """As of `Record`."""
        return LongRecord(self.scan, self.time * time, self.value * value)

    def part(self, begin: int, end: int) -> Floats:
        """As of `Record`."""
        file, blocks = self.scan.file, self.scan.blocks
        firsts = [block.before for block in blocks]
        some = range(
            int(np.searchsorted(firsts, begin, "right")) - 1, int(np.searchsorted(firsts, end))
        )
        samples = (
            np.concatenate([_samples(file, blocks[k]) for k in some])
            if end > begin
            else np.empty(0)
        )
        first = firsts[some.start] if end > begin else 0
        return np.asarray(samples[begin - first : end - first] * self.value)


def long_record(
    path: str, argument: str, columns: Columns, whole: Callable[[], Record]
) -> Record | None:
    """The record of a long file; None for one that is short, or that has to be read at once.

    Raises InputError as ``columns`` and for times that are not even; errors begin with
    ``argument``.
    """
    file = LongFile.of(path, argument, columns)
    if file is None:
        return None
    blocks = []
    count = 0
    square = 0.0
    ends = list[tuple[int, float]]()
    uneven = 0.0
    for table, block in file.blocks():
        time, values = columns(table)
        if block.repeated:
            time = time + (ends[-1][1] - time[0])
        times = time[bool(block.repeated) :]
        steps = np.diff(times, prepend=ends[-1][1] if ends else times[0] - 1.0)
        if not (steps > 0.0).all():
            row = count + int(np.argmin(steps > 0.0)) + 1
            raise MendError(f"{argument} must have ascending times, but row {row} does not")
        uneven = max(
            uneven, float(np.abs(times - np.linspace(times[0], times[-1], len(times))).max())
        )
        ends += [(count, float(times[0])), (count + len(times) - 1, float(times[-1]))]
        blocks.append(block)
        count = count + len(times)
        square = square + float((values[bool(block.repeated) :] ** 2).sum())
    rows, when = np.array(ends).T
    spacing = float(when[-1] - when[0]) / (count - 1)
    off = np.abs(when - when[0] - spacing * rows)
    if max(float(off.max()), 0.5 * uneven) > UNEVEN * spacing:
        row = int(rows[off.argmax()]) + 1
        raise MendError(f"{argument} must have equal time steps, but about row {row} has others")
    if not square > 0.0:
        raise invalid(argument, "have accelerations other than 0", 0.0)
    return LongRecord(
        Scan(file, tuple(blocks), count, spacing, float(np.sqrt(square / count)), whole)
    )
