"""The description of each page for search engines, and the link to the repository in its foot."""

import html
import os
import re
import subprocess
from pathlib import Path
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx

LONGEST = 160  # characters of a description


def web_address(remote: str) -> str:
    """The page of a git remote, without a password; empty for one that is not on the web.

    >>> web_address("git@example.org:group/harvester.git"), web_address("/srv/harvester")
    ('https://example.org/group/harvester', '')
    """
    remote = remote.strip().removesuffix(".git").removesuffix("/")
    found = re.fullmatch(
        r"(?:ssh://|https?://)?(?:[^@/]+@)?([\w.-]+\.\w+)[:/](?:\d+/)?(\S+)", remote
    )
    return f"https://{found[1]}/{found[2]}" if found and not remote.startswith((".", "/")) else ""


def repository() -> str:
    """HARVESTER_REPOSITORY, or the page of the remote `origin`; empty if there is none."""
    done = subprocess.run(
        ["git", "remote", "get-url", "origin"],
        cwd=Path(__file__).parent,
        capture_output=True,
        text=True,
        check=False,
    )
    return os.environ.get("HARVESTER_REPOSITORY") or web_address(done.stdout)


def repository_options() -> dict[str, Any]:
    """The theme's options for a link to the repository in the foot of each page."""
    address = repository()
    link = {"name": "Repository", "url": address, "html": "Repository", "class": ""}
    return {"footer_icons": [link]} if address else {}


def describe(
    app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: nodes.document | None
) -> None:
    """Add the beginning of the first paragraph as the description of the page."""
    paragraphs = doctree.findall(nodes.paragraph) if doctree is not None else ()
    text = next((one.astext() for one in paragraphs if len(one.astext()) > 30), "")
    text = " ".join(text.split())
    if len(text) > LONGEST:
        text = text[:LONGEST].rpartition(" ")[0] + " ..."
    tag = f'<meta name="description" content="{html.escape(text)}" />'
    context["metatags"] = context.get("metatags", "") + (f"\n{tag}" if text else "")


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("html-page-context", describe)
    return {"parallel_read_safe": True}
