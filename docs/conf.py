"""Sphinx: the narrative pages and the reference of `harvester.__all__`; `make docs`."""

import itertools
import sys
from pathlib import Path

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml

sys.path.insert(0, str(Path(__file__).parent))  # command_help.py lies beside this file

project = "harvester"
html_title = "harvester"
copyright = "the authors; GPL-3.0-or-later"
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "command_help"]
exclude_patterns = ["_build"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
default_role = "literal"  # docstrings write code between single backticks
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
napoleon_use_rtype = False
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["own.css"]
html_copy_source = False
html_math_renderer = "mathml"


def in_line(translator, node):
    """A formula in a line, as MathML: browsers draw it themselves, without a script and without the net."""
    translator.body.append(tex2mathml(node.astext()))
    raise nodes.SkipNode


def displayed(translator, node):
    """A formula of its own, with its name where it has one."""
    translator.body.append(f'<div class="formula" id="{"".join(node["ids"][:1])}">')
    translator.body.append(tex2mathml(node.astext(), as_block=True))
    if node["number"]:
        translator.body.append(f'<span class="eqno">({node["number"]})</span>')
    translator.body.append("</div>")
    raise nodes.SkipNode


def equations_as_they_stand(app, what, name, of, options, lines):
    """Equations, which docstrings indent after an empty line, keep their lines."""
    text = list(lines)
    lines.clear()
    for before, line in itertools.pairwise(["", *text]):
        inside = line.startswith("    ")
        opening = inside and not before and not (len(lines) > 1 and lines[-2].startswith("    "))
        lines.extend(["::", ""] if opening else [])
        lines.append(line if inside else line.replace("|", r"\|"))  # a bar is a size, not a substitution


def links_of_included(app, path, parent, content):
    """A page that is included from elsewhere links to pages that have another name here."""
    for elsewhere, here in (("examples/README.md", "gallery.md"), ("CONTRIBUTING.md", "contributing.md")):
        content[0] = content[0].replace(f"]({elsewhere})", f"](docs/{here})")


def setup(app):
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (in_line, None), (displayed, None))
    app.connect("include-read", links_of_included)
    app.connect("autodoc-process-docstring", equations_as_they_stand, priority=400)
