"""Where a result comes from, without what nobody else should read."""

import sys

from harvester.machine.provenance import origin


def test_a_password_in_an_address_is_left_out(monkeypatch):
    """provenance.json is shared with the numbers; a scheduler's address may hold the password of a user."""
    monkeypatch.setattr(sys, "argv", ["harvester", "sweep", "--scheduler", "tls://me:secret@host:8786", "--out=a@b"])
    assert origin()["command"] == ["sweep", "--scheduler", "tls://...@host:8786", "--out=a@b"]
