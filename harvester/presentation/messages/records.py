"""What cleaning a logger's record found and mended."""

from collections.abc import Callable

_NAMES = {"\t": "tab", " ": "space", ";": "semicolon", ",": "comma", "|": "bar"}


def _file_layout(delimiter: str, decimal: str) -> str:
    return f"columns parted by {_NAMES[delimiter]}, decimal {'comma' if decimal == ',' else 'point'}"


def _unit_of_times(unit: str, column: str) -> str:
    return f"the times are in {unit}, as the name {column!r} says" if unit else "the times have no unit: in seconds"


MESSAGES: dict[str, str | Callable[..., str]] = {
    "file_layout": _file_layout,
    "part_taken": "{begin:.6g} to {end:.6g} s of it taken",
    "longest_part": "the longest of {parts} parts: from {begin:.6g} to {end:.6g} s from the beginning",
    "no_times": "no times: taken as {rate:g} samples a second",
    "unit_of_times": _unit_of_times,
    "rows_without_time": "{rows} rows without a time: taken as evenly between the rows with one",
    "coarse_clock": "{times} times repeat, for the clock is coarse: the rows are spread evenly, {rate:.6g} a second, which may be off by {error:.2g} of it",
    "times_repeat": "{times} times repeat",
    "jitter": "the times are off even ones by {share:.1%} of a step (rms): taken as even",
    "rows_written_twice": "{rows} rows written twice: the mean of each two is taken",
    "samples_filled_in": "{samples} missing samples filled in, {in_a_row} in a row at most",
    "perhaps_clipped": "{samples} samples stand still at the end of the range: the sensor's resolution is too coarse to tell whether it was clipped there",
    "clipped": "{samples} samples stand still at the end of the range: the sensor was clipped there",
    "offset_removed": "offset of {offset:.4g} m/s^2 taken off ({of_gravity:.3g} g)",
    "drift_removed": "drift of {drift:.3g} m/s^2 from beginning to end taken off",
    "rate_too_low": "{share:.0%} of the power is above {frequency:.4g} Hz, just below half the rate: the rate is too low, and what shakes faster may be folded into the record; record it again at a higher rate",
    "resampled": "resampled from {before:.6g} to {after:.6g} Hz behind a filter at half of it: {share:.1%} of the rms is kept",
}
