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


MESSAGES: dict[str, str | Callable[..., str]] = {
    "file_layout": _file_layout,
    "part_taken": "{begin:.6g} to {end:.6g} s of it used",
    "longest_part": "the longest of {parts} parts: from {begin:.6g} to {end:.6g} s from the beginning",
    "no_times": "no times: assumed {rate:g} samples per second",
    "unit_of_times": _unit_of_times,
    "rows_without_time": "{rows} rows without a time: placed evenly between the rows with one",
    "coarse_clock": "{times} times repeat because the clock is coarse: the rows are spread evenly, {rate:.6g} per second, which may be off by {error:.2g} of it",
    "times_repeat": "{times} times repeat",
    "jitter": "the times deviate from even ones by {share:.1%} of a step (rms): treated as even",
    "rows_written_twice": "{rows} rows written twice: the mean of each two is used",
    "samples_filled_in": "{samples} missing samples filled in, {in_a_row} in a row at most",
    "perhaps_clipped": "{samples} samples are constant at the end of the range: the sensor's resolution is too coarse to determine whether it was clipped there",
    "clipped": "{samples} samples are constant at the end of the range: the sensor was clipped there",
    "offset_removed": "offset of {offset:.4g} m/s^2 removed ({of_gravity:.3g} g)",
    "drift_removed": "drift of {drift:.3g} m/s^2 from beginning to end removed",
    "rate_too_low": "{share:.0%} of the power is above {frequency:.4g} Hz, just below half the rate: the rate is too low, and faster vibration may be aliased into the recording; record it again at a higher rate",
    "resampled": "resampled from {before:.6g} to {after:.6g} Hz behind a filter at half of it: {share:.1%} of the rms is kept",
}
