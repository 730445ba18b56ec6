"""If a result comes from, without what nobody else should read."""

import sys

import pytest

from harvester.machine.provenance import origin


@pytest.mark.parametrize("secret", ["me:secret", "me:s@c/ret"])
def test_a_password_in_an_address_is_left_out(monkeypatch, secret):
    """provenance.json is shared with the numbers; a scheduler's address may hold the password of a user."""
    monkeypatch.setattr(
        sys, "argv", ["harvester", "sweep", "--scheduler", f"tls://{secret}@host:8786", "--out=a@b"]
    )
    assert origin()["command"] == ["sweep", "--scheduler", "tls://...@host:8786", "--out=a@b"]
