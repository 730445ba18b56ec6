"""The looks of the page's parts, each of which has a style sheet of its own inside (shadow DOM)."""

# The colours of page.html, which has them for a light and for a dark page.
INK = "var(--ink)"
PALE = "var(--pale)"
LINE = "var(--line)"
ACCENT = "var(--accent)"
PICTURES = """
@media (prefers-color-scheme: dark) { :host { filter: invert(0.9) hue-rotate(180deg); } }
"""  # Bokeh draws on a canvas, which knows no variables of a page
CHART = (
    PICTURES
    + "@media (max-width: 820px) { :host { height: 33vh !important; min-height: 0 !important; max-height: 33vh; } }"
)

FIELD = f"""
:host {{ font-size: 13px; }}
label {{ color: {PALE}; font-size: 12px; line-height: 1.2; padding: 0; text-transform: none; }}
input.bk-input, select.bk-input {{ height: 28px; font-size: 13px; padding: 2px 7px; border: 1px solid {LINE};
  border-radius: 5px; color: {INK}; background-color: var(--card); }}
select.bk-input {{ appearance: auto !important; background-image: none !important; }}
input::file-selector-button {{ color: {INK}; background: var(--hover); border: 1px solid {LINE}; border-radius: 5px; }}
.bk-description > .bk-icon {{ background-color: {PALE}; }}
input.bk-input:focus {{ border-color: {ACCENT}; box-shadow: 0 0 0 2px var(--glow); outline: none; }}
"""
SLIDER = f"""
:host {{ --slider-size: 4px; --handle-width: 14px; --handle-height: 14px; }}
.noUi-target {{ height: 4px; background: {LINE}; border: none; box-shadow: none; margin: 10px 4px; }}
.noUi-connect {{ background: {ACCENT} !important; }}
.noUi-handle {{ background: var(--card); border: 2px solid {ACCENT}; box-shadow: none; border-radius: 50%;
  cursor: grab; }}
.noUi-handle:focus {{ box-shadow: 0 0 0 4px var(--glow); outline: none; }}
"""
CARD = f"""
:host(.card) {{ border: 1px solid {LINE}; border-radius: 8px; background: var(--card); box-shadow: none;
  outline: none; }}
.card-header {{ border: none; padding: 7px 12px; background: transparent; }}
.card-button svg {{ stroke: {INK}; }}
.card-header *, .card-header-row {{ font-size: 14px; font-weight: 600; color: {INK} !important; }}
:host > div:not(.card-header), :host > .bk-Column {{ margin: 0 12px; }}
"""
CHECKBOX = f"""
:host {{ font-size: 13px; color: {INK}; }}
input {{ accent-color: {ACCENT}; width: 15px; height: 15px; }}
"""
PICTURE = f"""
:host .bk-btn.bk-btn-default {{ display: flex; flex-direction: column; align-items: center; justify-content: center;
  padding: 2px 0; border-radius: 6px; font-size: 11px; letter-spacing: -0.02em;
  white-space: nowrap; color: {PALE} !important; background: var(--card) !important;
  border: 1px solid {LINE}; }}
:host .bk-btn.bk-btn-default > :first-child {{ margin: -18px 0 -22px; }}
:host .bk-btn.bk-btn-default:hover {{ border-color: {ACCENT}; color: {INK}; background: var(--hover) !important; }}
:host(.chosen) .bk-btn.bk-btn-default {{ border: 2px solid {ACCENT}; color: {INK};
  background: var(--hover) !important; }}
"""
BUTTON = f"""
:host .bk-btn.bk-btn-default {{ font-size: 13px; color: {INK} !important; background: var(--card) !important;
  border: 1px solid {LINE};
  border-radius: 6px; padding: 4px 10px; box-shadow: none; }}
:host .bk-btn.bk-btn-default:hover {{ border-color: {ACCENT}; background: var(--hover); }}
:host .bk-btn.bk-btn-default[disabled] {{ color: var(--pale); opacity: 0.6; background: var(--hover);
  border-color: {LINE}; cursor: not-allowed; }}
a {{ color: inherit; }}
"""
WORDS = f"""
:host {{ font-size: 13.5px; line-height: 1.45; color: {INK}; }}
table {{ border-collapse: collapse; width: 100%; margin: 4px 0 8px; }}
th {{ text-align: left; font-weight: 600; color: {PALE}; font-size: 12px; }}
th, td {{ padding: 3px 10px 3px 0; border-bottom: 1px solid var(--line); vertical-align: top; background: none; }}
td {{ overflow-wrap: anywhere; }}
table.numbers td:first-child, table.answers td:first-child {{ white-space: nowrap; font-weight: 600; }}
@media (max-width: 820px) {{ table.answers td:first-child {{ white-space: normal; }} }}
table.numbers td:nth-child(2) {{ white-space: nowrap; }}
table.difference td {{ font-size: 12.5px; }}
p {{ margin: 4px 0 8px; }}
ul {{ margin: 4px 0 8px; padding-left: 18px; }}
ul.warnings {{ color: var(--warn); }}
ul.refused {{ color: {PALE}; }}
.error {{ background: var(--bad); color: var(--bad-ink); border: 1px solid var(--bad-ink); border-radius: 6px;
  padding: 6px 10px; }}
.power {{ font-size: 27px; font-weight: 650; letter-spacing: -0.01em; line-height: 1.2; }}
.power.none {{ font-size: 18px; color: {PALE}; }}
.error95 {{ font-size: 15px; font-weight: 400; color: {PALE}; margin-left: 10px; }}
a {{ color: {ACCENT}; }}
.by {{ color: {PALE}; font-size: 13px; }}
"""
