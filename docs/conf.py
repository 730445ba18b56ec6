"""Sphinx: the narrative pages and the reference of `harvester.__all__`; `make docs`."""

import itertools
import sys
from pathlib import Path

# command_help.py, gallery_wall.py, scene_keys.py, page_head.py and maths.py are in this folder
sys.path.insert(0, str(Path(__file__).parent))

import page_head

import harvester

project = "harvester"
version = release = harvester.__version__
html_title = f"harvester {version}"
copyright = "the authors; GPL-3.0-or-later"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon"]
extensions += ["sphinx.ext.viewcode", "sphinx_copybutton"]
extensions += ["command_help", "gallery_wall", "notebook_page", "maths", "scene_keys"]
extensions += ["page_head"]
exclude_patterns = ["_build", "_templates"]
templates_path = ["_templates"]
copybutton_exclude = ".linenos, .gp, .go"
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
default_role = "literal"  # docstrings write code between single backticks
autodoc_typehints = "description"
autodoc_typehints_description_target = "documented"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_use_rtype = False
html_theme = "furo"
html_theme_options = page_head.repository_options()
html_static_path = ["_static"]
html_css_files = ["own.css"]
html_copy_source = False
html_math_renderer = "mathml"


def equations_as_they_stand(app, what, name, of, options, lines):
    """Equations, which docstrings indent after an empty line, keep their lines."""
    text = list(lines)
    lines.clear()
    equation = False
    for before, line in itertools.pairwise(["", *text]):
        inside = line.startswith("    ")
        opening = inside and not before and not (len(lines) > 1 and lines[-2].startswith("    "))
        lines.extend(["::", ""] if opening else [])
        equation = opening or (equation and (inside or not line))
        # a bar is a size, not a substitution
        lines.append(line if equation else line.replace("|", r"\|"))


def links_of_included(app, path, parent, content):
    """A page that is included from elsewhere links to pages that have another name here."""
    pages = {
        "examples/README.md": "gallery.md",
        "CONTRIBUTING.md": "contributing.md",
        "CHANGELOG.md": "changelog.md",
    }
    pages |= {
        "CODE_OF_CONDUCT.md": "conduct.md",
        "SUPPORT.md": "support.md",
        "SECURITY.md": "security.md",
        "CITATION.cff": "../CITATION.cff",
    }
    for elsewhere, here in pages.items():
        content[0] = content[0].replace(f"]({elsewhere})", f"](docs/{here})")


def setup(app):
    """Called by Sphinx."""
    app.connect("include-read", links_of_included)
    app.connect("autodoc-process-docstring", equations_as_they_stand, priority=400)
