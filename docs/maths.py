"""Sphinx: formulas as MathML, which browsers draw by themselves, with a mathematical font served beside the pages."""

import importlib.util
import re
import tempfile
from pathlib import Path

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from fontTools import subset

FONT = "STIXTwoMath.woff"
CHARACTERS = "U+20-7E,U+A0-17F,U+2B0-3FF,U+2000-23FF,U+27E0-27EF,U+2A00-2AFF,U+1D400-1D7FF"
FUNCTION = re.compile(
    r"(\\(?:sinh|sin|cos|coth|exp|ln|log|max|min))(?![a-zA-Z])((?:\^\{?\w\}?)?)\s*"
)
BARS = re.compile(r"(?<!\\left)(?<!\\right)\|([^|]+?)\||\\lvert(.+?)\\rvert")


def font_folder():
    """A folder with the font of the package ziamath, of which only the characters of formulas are kept."""
    source = (
        Path(importlib.util.find_spec("ziamath").origin).parent
        / "fonts"
        / "STIXTwoMath-Regular.ttf"
    )
    folder = tempfile.mkdtemp()
    options = [f"--unicodes={CHARACTERS}", "--layout-features=*", "--flavor=woff"]
    subset.main([str(source), *options, f"--output-file={folder}/{FONT}"])
    return folder


def spaced(tex):
    """The formula with the thin spaces about functions that TeX sets, and with bars that open and close."""
    tex = FUNCTION.sub(
        lambda f: f[0] if tex[f.end() : f.end() + 1] in "(\\[" else rf"{f[1]}{f[2]}\,", tex
    )
    tex = re.sub(r"(?<=[\w}])\s*(?=\\(?:sin|cos|exp|ln|coth)\b)", r"\\,", tex)
    return BARS.sub(lambda f: rf"\left| {f[1] or f[2]} \right|", tex)


def mathml(tex, block):
    """The formula in MathML, with slashes and angle brackets as TeX sets them: without space, and not stretched."""
    found = tex2mathml(tex, as_block=block)
    return re.sub(
        r"<mo[^>]*>(/|⟨|⟩)</mo>", r'<mo stretchy="false" lspace="0" rspace="0">\1</mo>', found
    )


def in_line(translator, node):
    """A formula in a line."""
    translator.body.append(mathml(spaced(node.astext()), block=False))
    raise nodes.SkipNode


def displayed(translator, node):
    """A formula of its own, with its number; equations side by side come below each other on a narrow screen."""
    tex = spaced(node.astext())
    parts = [tex] if "\\begin" in tex else re.split(r"\\qquad", tex)
    translator.body.append(
        f'<div class="formula" id="{"".join(node["ids"][:1])}"><div class="equations">'
    )
    translator.body.extend(f"<div>{mathml(part, block=True)}</div>" for part in parts)
    translator.body.append("</div>")
    if node["number"]:
        translator.body.append(f'<span class="eqno">({node["number"]})</span>')
    translator.body.append("</div>")
    raise nodes.SkipNode


def setup(app):
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (in_line, None), (displayed, None))
    app.connect("config-inited", lambda app, config: config.html_static_path.append(font_folder()))
    return {"parallel_read_safe": True}
