"""Faults of a logger's recording that cleaning found and corrected."""

from collections.abc import Callable

_NAMES = {"\t": "tab", " ": "space", ";": "semicolon", ",": "comma", "|": "bar"}


def _file_layout(delimiter: str, decimal: str) -> str:
    return f"columns separated by {_NAMES[delimiter]}, decimal {'comma' if decimal == ',' else 'point'}"


def _unit_of_times(unit: str, column: str) -> str:
    return (
        f"the times are in {unit}, from the name {column!r}"
        if unit
        else "the times have no unit: in seconds"
    )


def _stands_still(
    samples: int,
    share: float,
    begin: float,
    end: float,
    low: float | None = None,
    high: float | None = None,
) -> str:
    offer = ""
    if low is not None and high is not None:
        offer = f": `from` {low:.6g} `to` {high:.6g} selects the longest part in which it changes"
    return (
        f"{samples} samples are constant, a share of {share:.2g}, longest from {begin:.6g} to {end:.6g} s, "
        f"as of a sensor that died or stuck{offer}"
    )


def _zeros_at_the_beginning(samples: int, begin: float) -> str:
    those = "the first sample is 0" if samples == 1 else f"the first {samples} samples are 0"
    return (
        f"{those}, outside the range of all others, as of a logger that has not started: "
        f"`from` {begin:.6g} begins at the next one"
    )


def _lines_below(lines: int, first: str) -> str:
    rows = "1 line" if lines == 1 else f"{lines} lines"
    return f"{rows} below the last row of numbers left out, beginning with {first!r}"


def _lines_without_numbers(lines: int, first: str) -> str:
    return f"{lines} lines without numbers left out, the first of them {first!r}"


MESSAGES: dict[str, str | Callable[..., str]] = {
    "file_layout": _file_layout,
    "json_records": "records of JSON, with a column for each name",
    "step_in_column": "the step of the times is in the column {column!r}",
    "part_taken": "{begin:.6g} to {end:.6g} s of it used",
    "longest_part": "the longest of {parts} parts: from {begin:.6g} to {end:.6g} s from the beginning",
    "no_times": "no times: assumed {rate:g} samples per second",
    "unit_of_times": _unit_of_times,
    "unit_by_rate": "the times have no unit: read in {unit}, at {rate:.6g} samples per second, because {slow:.4g} per second (in s) is impossible for an accelerometer",
    "unit_by_stated_rate": "the times have no unit: read in {unit}, by the rate of {rate:.6g} Hz "
    "above them",
    "rate_contradicts": "the times have {rate:.6g} samples per second, the lines above them "
    "{stated:.6g}: the times are used",
    "unit_of_period": "the sampling period {period:g} has no unit: read in {unit}",
    "fraction_column": "the fractions of a second are those of {column!r}",
    "finer_times": "{coarse!r} repeats its times: those of {column!r} are used",
    "given_unit": "the unit given is {given}; the file states {stated}",
    "given_rate": "the rate given is {given:g} Hz; the file states {stated:g} Hz",
    "slow_times": "{rate:.4g} samples per second is too slow for an accelerometer: if the times are in {unit} (`time_unit` {unit}), it is {other:.6g}",
    "rolled_over": "the counter of times rolled over {times} times, by {by:.12g}: undone",
    "counted_rows": "the rows are numbered by {column!r}: {lost} numbers are missing",
    "no_names": "the columns have no names: read as {names}",
    "unit_of_preamble": "the unit {unit} is that of the lines above the columns",
    "unit_against_gravity": "the mean of a sensor at rest is gravity, which these numbers have in {likely} and not in {given}: check the unit",
    "range_in_brackets": "{range} behind the name is the range of the sensor: the numbers are in {unit}",
    "one_recording": "recording {number} of {of} is used: {rows} rows",
    "parts_joined": "{parts} of {of} parts joined, each without its mean: the vibration jumps at the joints",
    "header_again": "{times} more lines of names among the rows: left out",
    "lines_below": _lines_below,
    "lines_without_numbers": _lines_without_numbers,
    "stands_still": _stands_still,
    "rows_without_time": "{rows} rows without a time: placed evenly between the rows with one",
    "coarse_clock": "{times} times repeat because the clock is coarse: the rows are spread evenly, {rate:.6g} per second, which may be off by {error:.2g} of it",
    "times_repeat": "{times} times repeat",
    "jitter": "the times deviate from even ones by {share:.1%} of a step (rms): treated as even",
    "rows_written_twice": "{rows} rows written twice: the mean of each two is used",
    "samples_filled_in": "{samples} missing samples filled in, {in_a_row} in a row at most",
    "zeros_at_the_beginning": _zeros_at_the_beginning,
    "perhaps_clipped": "{samples} samples are constant at the end of the range: the sensor's resolution is too coarse to determine whether it was clipped there",
    "clipped": "{samples} samples are constant at the end of the range: the sensor was clipped there",
    "offset_removed": "offset of {offset:.4g} m/s^2 removed ({of_gravity:.3g} g)",
    "drift_removed": "drift of {drift:.3g} m/s^2 from beginning to end removed",
    "rate_too_low": "{share:.0%} of the power is above {frequency:.4g} Hz, just below half the rate: the rate is too low, and faster vibration may be aliased into the recording; record it again at a higher rate",
    "resampled": "resampled from {before:.6g} to {after:.6g} Hz behind a filter at half of it: {share:.1%} of the rms is kept",
}
