"""Each promise of docs/reliability.md names a test that exists."""

import re

import pytest

from tests.support.paths import ROOT

TABLE = (ROOT / "docs" / "reliability.md").read_text(encoding="utf-8").partition("\n## Hangs")[0]
PROMISES = re.findall(r"^\| ([^|]+) \| (`[^|]+`) \|$", TABLE, flags=re.MULTILINE)


def test_the_table_has_promises():
    assert len(PROMISES) >= 25


@pytest.mark.parametrize("promise, tests", PROMISES, ids=[promise[:40] for promise, _ in PROMISES])
def test_a_promise_has_tests(promise, tests):
    """A file that was renamed or emptied would leave the promise without one."""
    for name in re.findall(r"`([^`]+)`", tests):
        file, _, function = name.partition("::")
        text = (ROOT / file).read_text(encoding="utf-8")
        assert f"def {function or 'test_'}" in text, promise
