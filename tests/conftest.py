"""What several files of tests use."""

import pytest

from tests.support.judge import asked


@pytest.fixture
def harvester():
    """The command line, run in this process: arguments -> exit status, stdout, stderr."""
    return asked
