"""Numbers that a sentence computes: a day's packets of an interval, and as many digits as two numbers need."""

import re

import pytest

from harvester.presentation.messages import sentence

NODE = {
    "sent": "all",
    "per_day": 0.0,
    "error": 0.0,
    "begins": 0.0,
    "days": 7.0,
    "outage": None,
    "lasts": None,
    "lasts_error": None,
    "survived": None,
    "longest": False,
}


def coupling(merit, strong_from):
    """The two numbers of the sentence on a device's coupling."""
    text = sentence("coupling", {"how": "medium", "merit": merit, "strong_from": strong_from})
    return re.search(r"k\^2 Q = (\S+) \(strong from (\S+)\)", text).groups()


@pytest.mark.parametrize("interval", [1.0, 8.0, 60.0, 86400.0])
def test_packets_of_a_day_fill_the_day(interval):
    """A node that sends all packets sends one every interval: their product is a day."""
    text = sentence("node_answer", NODE | {"interval": interval})
    packets = int(re.match(r"yes: ([\d,]+) packets per day", text)[1].replace(",", ""))
    assert packets * interval == pytest.approx(86400.0)


@pytest.mark.parametrize(
    ("merit", "strong_from"),
    [(0.123456, 0.987654), (1.5704, 1.5708), (1.5707962, 1.5707963), (2.0, 2.0)],
)
def test_two_numbers_have_the_fewest_digits_that_tell_them_apart(merit, strong_from):
    """Three, or more if they would read alike; a fourth digit of 0.123 states a precision that nobody asked for."""
    shown = coupling(merit, strong_from)
    digits = [len(text.replace(".", "").lstrip("0")) for text in shown]
    assert (shown[0] != shown[1]) == (merit != strong_from)
    assert (
        max(digits) <= 3 or f"{merit:.{max(digits) - 1}g}" == f"{strong_from:.{max(digits) - 1}g}"
    )
