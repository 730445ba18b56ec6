"""Dates and times of day as loggers write them, in seconds from the first.

ISO, US and European dates, AM and PM are read.
A date and its time may be in one cell or in two columns, with the fraction of the second in a
third.  Whether 04/10/2031 is in April or in October is decided by the file: the order of day and
month with the smaller steps.
"""

import datetime
import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from harvester.arrays import Floats
from harvester.errors import invalid

_DATE = r"(?:\d{4}[-/.]\d\d?[-/.]\d\d?|\d\d?[-/.]\d\d?[-/.]\d{4}|\d\d?[/.]\d\d?[/.]\d\d)"
_TIME = r"\d{1,2}:\d\d(?::\d\d(?:[.,]\d+|:\d{3})?|[.,]\d+)(?:\s*[AaPp]\.?[Mm]\.?)?"
DATE = re.compile(_DATE)
TIME_OF_DAY = re.compile(_TIME)
CLOCK = re.compile(rf"(?:{_DATE}(?:[T ]\s*|,\s+))?{_TIME}(?:\s*(?:Z|UTC|[+-]\d\d:?\d\d))?")
_PARTS = (  # hour, minute, second, fraction, half of the day, zone
    r"(?:^|[T\s,])(?:(\d{1,2}):)?(\d\d?):(\d\d)(?:[.,:](\d+))?\s*([AaPp])?\.?[Mm]?\.?"
    r"\s*(Z|UTC|[+-]\d\d:?\d\d)?\s*$"
)
_ISO = re.compile(r"\d{4}-\d\d-\d\d[T ]\d\d:\d\d:\d\d(?:\.\d+)?(?:Z|[+-]\d\d:?\d\d)?")
DAY = 86400.0
ASCENDING = 0.9  # share of steps that ascend if a column holds the fractions of another


def is_clock(cell: str) -> bool:
    """Whether a cell is a date, a time of day, or both."""
    return bool(CLOCK.fullmatch(cell) or DATE.fullmatch(cell))


def seconds(cells: Any, key: str) -> Floats:
    """Cells of dates and times, or of times of day, as seconds from the first that is one.

    Nan for others.

    A time of day that jumps back by more than half a day is the next day's.  Raises InputError,
    which begins with ``key``, if none of the dates is one of the calendar.
    """
    import pandas as pd

    texts = pd.Series(cells).astype(str).str.strip()
    if texts.map(lambda text: bool(_ISO.fullmatch(text))).all():  # the quick way
        stamps = pd.to_datetime(texts, format="ISO8601", errors="coerce", utc=True)
        if not stamps.notna().any():
            raise invalid(
                key, "have dates of the calendar, such as 2024-05-01 12:00:00", str(texts.iloc[0])
            )
        return np.asarray((stamps - stamps.dropna().iloc[0]).dt.total_seconds(), float)
    spans = _of_day(texts)
    days = days_of(texts.str.extract(rf"^({_DATE})", expand=False).fillna("").tolist(), key)
    if days is None:
        back = np.nan_to_num(np.diff(spans, prepend=spans[:1])) < -0.5 * DAY
        return _from_first(spans + DAY * np.cumsum(back))
    return _from_first(spans + DAY * days)


def _from_first(spans: Floats) -> Floats:
    """Seconds from the first that is known."""
    known = np.isfinite(spans)
    return np.asarray(spans - spans[known][0] if known.any() else spans)


def _of_day(texts: Any) -> Floats:
    """The seconds of a day, and of its time zone; 0 without a time of day; nan for another text."""
    parts = texts.str.extract(_PARTS)
    number = {k: np.asarray(parts[k].fillna("0").astype(float)) for k in (0, 1, 2)}
    fraction = np.asarray(("0." + parts[3].fillna("0")).astype(float))
    half = parts[4].fillna("").str.lower()
    hour = np.where(half != "", number[0] % 12.0 + 12.0 * np.asarray(half == "p"), number[0])
    zone = parts[5].fillna("").str.replace(":", "", regex=False)
    east = (
        np.array([_east(text) for text in zone])
        if zone.str.len().max() > 1
        else np.zeros(len(texts))
    )
    known = parts[2].notna() | texts.map(lambda text: bool(DATE.fullmatch(text)))
    good = np.asarray(known) & (hour < 25.0) & (number[1] < 60.0) & (number[2] < 61.0)
    return np.where(good, 3600.0 * hour + 60.0 * number[1] + number[2] + fraction - east, np.nan)


def _east(zone: str) -> float:
    """The seconds that a time zone is ahead."""
    if not zone or zone in ("Z", "UTC"):
        return 0.0
    return float(zone[0] + "1") * (3600.0 * int(zone[1:3]) + 60.0 * int(zone[3:5]))


def days_of(dates: Sequence[str], key: str) -> Floats | None:
    """The days of dates from the first, shape (n,), nan if a cell has none.

    None if no cell has one.

    Raises InputError if a date is not in the calendar in either order of day and month.
    """
    different = sorted({date for date in dates if date})
    if not different:
        return None
    orders = [
        order
        for month_first in (True, False)
        if (order := _ordinals(different, month_first)) is not None
    ]
    if not orders:
        raise invalid(
            key,
            "have dates of the calendar, such as 2024-05-01",
            next(date for date in dates if date),
        )
    every = [np.array([order.get(date, np.nan) for date in dates]) for order in orders]
    best = min(every, key=lambda days: float(np.nanmax(np.abs(np.diff(days)), initial=0.0)))
    return np.asarray(best - best[np.isfinite(best)][0])


def _ordinals(dates: Sequence[str], month_first: bool) -> dict[str, float] | None:
    """The numbers of the days of dates; None if one is not in the calendar."""
    numbers = {}
    for date in dates:
        parts = re.split(r"[-/.]", date)
        if len(parts) != 3:
            return None
        first, second, third = parts
        if len(first) == 4:
            year = first
            month = second
            day = third
        else:
            year = third
            month, day = (first, second) if month_first else (second, first)
        try:
            numbers[date] = float(
                datetime.date(int(year) + 2000 * (len(year) == 2), int(month), int(day)).toordinal()
            )
        except ValueError:
            return None
    return numbers


def together(dates: Any, times: Any, fraction: Floats | None, key: str) -> Floats:
    """The seconds of columns of dates, of times of day, and of fractions of a second."""
    days = days_of([str(date) for date in dates], key)
    spans = _of_day(times) + (0.0 if days is None else DAY * days)
    return _from_first(spans if fraction is None else spans + fraction)


def with_fraction(spans: Floats, fraction: Floats) -> Floats | None:
    """Whole seconds with the fractions of a second of another column; None without such fractions.

    Fractions are between 0 and 1 s, and the sums ascend if the seconds do.
    """
    known = np.isfinite(spans)
    if not known.any() or (spans[known] != np.round(spans[known])).any():
        return None
    if not (np.nanmin(fraction) >= 0.0 and np.nanmax(fraction) < 1.0 and np.ptp(fraction) > 0.0):
        return None
    total = spans + fraction
    steps = np.diff(total[known])
    return np.asarray(total) if len(steps) and (steps > 0.0).mean() > ASCENDING else None
