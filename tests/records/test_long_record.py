"""A record that is read in blocks is what it is when all of it is read at once."""

import numpy as np
import pytest

import harvester as hv
from harvester.records import csv_table, long_record
from harvester.records.long_record import LongRecord
from harvester.records.record_files import read_record

N = 3000
RATE = 500.0


def values(count=N):
    return np.random.default_rng(5).standard_normal(count).round(4)


def plain(a, times=None):
    t = np.arange(len(a)) / RATE if times is None else times
    return "time (s),acceleration (m/s^2)\n" + "".join(
        f"{x:.3f},{y}\n" for x, y in zip(t, a, strict=True)
    )


def german(a):
    rows = "".join(f"{k * 2};{y}\n".replace(".", ",") for k, y in enumerate(a))
    return "Logger 7\nZeit (ms);Beschleunigung (g)\n" + rows


def with_remarks(a):
    lines = plain(a).splitlines()
    return "\n".join([*lines[:1000], "# battery changed", "", *lines[1000:], ""])


def with_a_long_end(a):
    """Remarks fill blocks of their own."""
    return plain(a) + "# nothing more\n" * 1000


def clock(a):
    """Every 20 ms from shortly before midnight on."""
    stamps = np.datetime64("2024-05-01T23:59:50.000") + np.arange(len(a)) * np.timedelta64(20, "ms")
    return "timestamp,acc_z (g)\n" + "".join(f"{s},{y}\n" for s, y in zip(stamps, a, strict=True))


@pytest.fixture
def read(tmp_path, monkeypatch):
    """Reads a text in blocks of a few thousand bytes."""
    monkeypatch.setattr(long_record, "BLOCK", 4099)

    def of(text, data=None):
        path = tmp_path / f"record{np.random.default_rng().integers(1 << 40)}.csv"
        path.write_bytes(text.encode() if data is None else data)
        return read_record(str(path))

    return of


@pytest.mark.parametrize(
    "text",
    [plain, german, with_remarks, with_a_long_end, pytest.param(clock, marks=pytest.mark.slow)],
)
def test_blocks_have_the_samples_of_the_whole(read, text):
    found = read(text(values()))
    assert isinstance(found, LongRecord) and found.count == N
    whole = found.whole
    assert found.spacing == pytest.approx(whole.spacing, rel=1e-12)
    assert found.rms == pytest.approx(np.sqrt(np.mean(whole.values[:N] ** 2)), rel=1e-12)
    for begin, end in ((0, N), (0, 1), (N - 1, N), (700, 1900), (5, 5)):
        assert found.part(begin, end) == pytest.approx(whole.values[begin:end], rel=1e-15)
    other = found.scaled(2.0, -3.0)
    assert (
        other.part(3, 9) == pytest.approx(whole.scaled(2.0, -3.0).values[3:9])
        and other.spacing == 2.0 * found.spacing
    )
    assert found.resampled(2, 5, 100, 256) == pytest.approx(
        whole.resampled(2, 5, 100, 256), abs=1e-12
    )


@pytest.mark.slow
@pytest.mark.parametrize(
    "between",
    ["# battery changed\n", "\n", "  \n# x\n\n", 900 * "# remark\n"],
    ids=["remark", "empty", "both", "blocks"],
)
@pytest.mark.parametrize("text", [plain, clock])
def test_no_row_is_lost_where_a_block_ends_in_a_remark(read, text, between):
    """At whatever byte of it: the first block's end is in what is between two rows, or within two rows of it."""
    rows = text(values()).splitlines(keepends=True)
    first = int(np.searchsorted(np.cumsum([len(row) for row in rows]), 4099))
    for k in range(first - 2, first + 3):
        found = read("".join([*rows[:k], between, *rows[k:]]))
        assert isinstance(found, LongRecord) and found.count == N
        assert found.part(0, N) == pytest.approx(found.whole.values[:N], rel=1e-15)
        assert found.spacing == pytest.approx(found.whole.spacing, rel=1e-12)


@pytest.mark.parametrize("text", [plain, clock])
def test_a_block_may_be_of_one_line(read, text):
    rows = text(values()).splitlines(keepends=True)
    # the second block's first line
    begin = int(np.searchsorted(np.cumsum([len(row) for row in rows]), 4099, "right"))
    found = read("".join(rows[: begin + 1]))
    assert isinstance(found, LongRecord) and found.count == begin
    assert found.part(0, begin) == pytest.approx(found.whole.values[:begin], rel=1e-15)
    with pytest.raises(hv.InputError, match="must have lines of at most 4099 bytes"):
        read("".join([*rows[:begin], "# " + 9000 * "-" + "\n", *rows[begin:]]))


def test_the_mean_jerk_of_pieces_is_that_of_the_whole(read, monkeypatch):
    monkeypatch.setattr(long_record, "EACH", 500)
    t = np.arange(N) / RATE
    found = read(plain((2.0 * np.sin(2 * np.pi * 40.0 * t)).round(6)))
    assert found.mean_jerk == pytest.approx(2.0 * 4.0 * 40.0, rel=0.01)  # 4 f A


def test_what_cannot_be_cut_is_read_at_once(read):
    assert not isinstance(read(plain(values(40))), LongRecord)
    assert not isinstance(read("", plain(values()).encode("utf-16")), LongRecord)


def times(change):
    t = np.arange(N) / RATE
    change(t)
    return plain(values(), t)


def late(t):
    t[2000:] += 0.001


def back(t):
    t[2000] = t[1990]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (times(late), "must have equal time steps, but about row"),
        (times(back), "must have ascending times, but row 2001 does not"),
        (plain(values()).replace("\n4.000,", "\n4.000,x", 1), "row 2001 must be a number"),
        (plain(np.zeros(N)), "must have accelerations other than 0"),
    ],
)
def test_a_bad_long_file_is_one_line_with_its_row(read, text, said):
    with pytest.raises(hv.InputError, match=said) as error:
        read(text)
    assert "\n" not in str(error.value)


def test_what_needs_all_of_it_says_so(read, monkeypatch):
    found = read(plain(values()))
    monkeypatch.setattr(csv_table, "MOST_BYTES", 1000)
    with pytest.raises(hv.InputError, match=r"if all of it is needed at once.*'harvester node'"):
        found.values  # noqa: B018 - it reads the file
