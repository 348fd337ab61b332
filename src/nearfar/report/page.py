"""Self-contained HTML pages: pictures inside, nothing fetched, readable without their script."""

import json
import re
from html import escape
from importlib.resources import files
from io import StringIO
from pathlib import Path

import matplotlib as mpl
from matplotlib.figure import Figure

from nearfar.arrays import Booleans, Floats
from nearfar.files import new_output
from nearfar.markup import SCALE, embedded, false_colour
from nearfar.report.about import Methods, about_page
from nearfar.report.figures.style import DPI, styled

# Colours of the light and the dark theme; data-theme on the root overrides the browser's choice.
_LIGHT = """--ink: #1d2129; --soft: #5b6472; --line: #dfe3e8; --back: #f7f8fa; --card: #ffffff;
  --edge: #8a93a0; --mark: #1f6ec9; --bad: #b3261e; --near: #c2561a; --far: #2f855f;
  --saturated: #d6285a; color-scheme: light;"""
_DARK = """--ink: #e8eaed; --soft: #a0a8b4; --line: #343a44; --back: #14171c; --card: #1d2128;
  --edge: #6b7482; --mark: #6aa9f5; --bad: #ff8a80; --near: #f0874a; --far: #58c496;
  color-scheme: dark;"""
_THEMES = (
    f":root {{ {_LIGHT} }}\n"
    f"@media (prefers-color-scheme: dark) {{ :root:not([data-theme=light]) {{ {_DARK} }} }}\n"
    f":root[data-theme=dark] {{ {_DARK} }}\n"
)

# Colours of plots, and what they become in a page: legible in both themes.
INKS = {
    "#000000": "currentColor",
    "#111111": "currentColor",
    "#1f4e9c": "var(--mark)",
    "#c2561a": "var(--near)",
    "#3f9e74": "var(--far)",
}
# A page of fewer parts needs no links to them.
FEWEST_LINKED_PARTS = 3

SATURATED_KEY = '<figcaption class="mark">saturated: not measured</figcaption>'

STYLE = (
    _THEMES
    + """
* { box-sizing: border-box; }
body { margin: 0; background: var(--back); color: var(--ink);
  font: 16px/1.55 system-ui, -apple-system, "Segoe UI", Roboto, sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 2.5rem 1.25rem 4rem; }
h1 { font-size: 1.9rem; line-height: 1.2; margin: 0 0 .4rem; letter-spacing: -.01em; }
h2 { font-size: 1.2rem; margin: 2.6rem 0 .3rem; }
p { margin: .3rem 0 1rem; max-width: 46rem; color: var(--soft); }
.facts { display: grid; grid-template-columns: repeat(auto-fit, minmax(150px, 1fr)); gap: .75rem;
  margin: 1.4rem 0; }
.fact { background: var(--card); border: 1px solid var(--line); border-radius: 10px;
  padding: .8rem 1rem; }
.fact b { display: block; font-size: 1.5rem; font-variant-numeric: tabular-nums; }
.fact span { color: var(--soft); font-size: .85rem; }
.wide { overflow-x: auto; }
table { border-collapse: collapse; width: 100%; }
.gallery td, .gallery th { padding: 4px; text-align: center; font-weight: 500;
  font-size: .85rem; color: var(--soft); }
.gallery th.row { text-align: right; padding-right: .7rem; white-space: nowrap; }
img { display: block; width: 100%; min-width: 110px; image-rendering: pixelated;
  border-radius: 4px; }
.verdict { background: var(--card); border: 1px solid var(--line); border-left: 6px solid
  var(--far);
  border-radius: 10px; padding: .8rem 1rem; margin: 1.2rem 0; color: var(--ink); max-width: none; }
.verdict b { text-transform: capitalize; }
.verdict.doubtful { border-left-color: var(--near); }
.verdict.wrong { border-left-color: var(--bad); }
.numbers { background: var(--card); border: 1px solid var(--line); border-radius: 10px;
  max-width: 46rem; }
.numbers td, .numbers th { padding: .45rem .9rem; border-bottom: 1px solid var(--line);
  text-align: right; font-variant-numeric: tabular-nums; }
.numbers td:first-child, .numbers th:first-child { text-align: left; }
.numbers tr:last-child td { border-bottom: 0; }
.numbers th { color: var(--soft); font-weight: 500; font-size: .85rem; }
.numbers tr.best td, .numbers td.best { font-weight: 650; color: var(--far); }
.broad .numbers { max-width: none; }
.broad .numbers td:first-child { min-width: 14rem; }
.maps { display: grid; grid-template-columns: repeat(auto-fit, minmax(230px, 1fr)); gap: 1.2rem; }
.maps figure { max-width: 26rem; }
.beside { display: grid; grid-template-columns: repeat(auto-fit, minmax(280px, 1fr)); gap: 1.6rem;
  align-items: start; }
figure { margin: 0; }
.words .numbers td, .words .numbers th { text-align: left; }
.sheet { margin-bottom: 1.2rem; }
.sheet img { image-rendering: auto; background: #ffffff; }
figcaption { font-size: .85rem; color: var(--soft); margin-top: .4rem; }
.scale { display: flex; justify-content: space-between; font-size: .75rem; color: var(--soft); }
.findings { max-width: 46rem; padding-left: 1.2rem; }
.mark::before { content: ""; display: inline-block; width: .7em; height: .7em; border-radius: 2px;
  margin-right: .4em; background: var(--saturated); }
.references { max-width: 46rem; padding-left: 1.6rem; color: var(--soft); font-size: .9rem; }
.about { display: grid; grid-template-columns: max-content 1fr; gap: .3rem 1rem; margin: .6rem 0 0;
  max-width: 46rem; font-size: .9rem; }
.about dt { color: var(--soft); }
.about dd { margin: 0; overflow-wrap: anywhere; }
.bar { height: 8px; border-radius: 4px; margin-top: .5rem; }
"""
)


# Of pages alone, not of the viewer.
_PAGE_STYLE = """
main img { cursor: zoom-in; box-shadow: 0 0 0 1px var(--line); }
main a img { cursor: pointer; }
.contents { display: flex; flex-wrap: wrap; gap: .2rem 1.1rem; font-size: .9rem;
  margin: 0 0 1.2rem; padding: 0 0 .7rem; border-bottom: 1px solid var(--line); }
.contents a { color: var(--soft); text-decoration: none; }
.contents a:hover, .contents a:focus { color: var(--mark); text-decoration: underline; }
h2 { scroll-margin-top: 1rem; }
@media (min-width: 1500px) {
  .contents { position: fixed; top: 2.6rem; left: max(1.5rem, 50vw - 590px - 12rem); width: 10.5rem;
    flex-direction: column; border: 0; }
}
.under-pointer { font-variant-numeric: tabular-nums; color: var(--ink); }
.sheet svg { width: 100%; height: auto; color: var(--ink); }
.sheet svg text { fill: currentColor; font-family: inherit !important; }
dialog { border: 0; padding: 0; background: transparent; max-width: 96vw; max-height: 96vh; }
dialog::backdrop { background: rgb(0 0 0 / .82); }
dialog img { width: auto; height: min(88vh, 92vw); max-width: 96vw; object-fit: contain;
  cursor: zoom-out; }
dialog p { color: #e8eaed; text-align: center; margin: .5rem auto 0; }
@media print { .contents { display: none; } }
"""
_SCRIPT = files("nearfar.report").joinpath("page.js")


def page(
    title: str, body: str, *, methods: Methods | None = None, command: str | None = None
) -> str:
    """Return a whole HTML page, which ends with its methods, its date and what made it.

    Parameters
    ----------
    title, body : str
        Each <h2> of the body has a link at the page's top, where there are several.
    methods : Methods, optional
    command : str, optional
        The command line that was typed.
    """
    contents, headed = _with_contents(f"{body}\n{about_page(methods, command)}")
    script = _SCRIPT.read_text(encoding="utf-8")
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n'
        f'<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<title>{escape(title)}</title>\n<style>{STYLE}{_PAGE_STYLE}</style>\n</head>\n<body>\n"
        f"<main>\n{contents}{headed}\n</main>\n"
        f'<script type="module">\n{script}</script>\n</body>\n</html>\n'
    )


def _with_contents(body: str) -> tuple[str, str]:
    """Return links to the <h2> of a body, and the body with an id on each."""
    found: list[tuple[str, str]] = []

    def named(heading: re.Match[str]) -> str:
        known = re.search(r'id="([^"]+)"', heading[1])
        name = known[1] if known else f"part-{len(found) + 1}"
        found.append((name, heading[2]))
        return heading[0] if known else f'<h2 id="{name}"{heading[1]}>{heading[2]}</h2>'

    headed = re.sub(r"<h2([^>]*)>(.*?)</h2>", named, body)
    if len(found) < FEWEST_LINKED_PARTS:
        return "", headed
    links = "".join(f'<a href="#{name}">{title}</a>' for name, title in found)
    return f'<nav class="contents" aria-label="contents">{links}</nav>\n', headed


def colour_map(
    values: Floats,
    low: float,
    high: float,
    unit: str,
    caption: str,
    *,
    reading: str = "",
    saturated: Booleans | None = None,
    step: int = 1,
) -> str:
    """Return a <figure> of values in false colour with its scale.

    Parameters
    ----------
    values : ndarray, shape (y, x)
        NaN where there is no value.
    low, high : float
        Ends of the colour scale.
    unit, caption : str
    reading : str
        How to read it, a sentence or two.
    saturated : ndarray of bool, shape (y, x), optional
        Camera pixels that are marked as saturated.
    step : int
        Rows and columns of the camera from one value to the next.
    """
    stops = ", ".join(f"rgb({r:.0f},{g:.0f},{b:.0f})" for r, g, b in SCALE)
    digits = 0 if high - low >= 10 else 1
    first, last = (f"<span>{value:.{digits}f} {escape(unit)}</span>" for value in (low, high))
    marks = saturated is not None and bool(saturated.any())
    data = f'data-low="{low:.9g}" data-high="{high:.9g}" data-unit="{escape(unit)}"'
    return (
        f'<figure {data} data-step="{step}" data-stops="{json.dumps(SCALE.tolist())}">'
        f"{embedded(false_colour(values, low, high, saturated), caption)}"
        f'<div class="bar" style="background: linear-gradient(to right, {stops})"></div>'
        f'<div class="scale">{first}<span class="under-pointer"></span>{last}</div>'
        f"{figure_caption(caption, reading)}"
        f"{SATURATED_KEY if marks else ''}</figure>"
    )


def figure_caption(caption: str, reading: str) -> str:
    """Return the <figcaption> of a figure: its title, and how to read it."""
    first = f"<b>{escape(caption[:1].upper() + caption[1:])}.</b> " if caption else ""
    return f"<figcaption>{first}{escape(reading)}</figcaption>" if caption or reading else ""


def verdict_box(grade: str, text: str) -> str:
    """Return a verdict as HTML: its grade, and what it means, one sentence or more."""
    return f'<p class="verdict {grade}"><b>{grade}.</b> {escape(text)}</p>'


def listed(sentences: list[str]) -> str:
    """Return a list of sentences; text in backticks is set as code."""
    marked = (re.sub("`([^`]+)`", r"<code>\1</code>", escape(sentence)) for sentence in sentences)
    items = "".join(f"<li>{sentence}</li>" for sentence in marked)
    return f'<ul class="findings">{items}</ul>'


def gallery(columns: list[str], rows: list[tuple[str, list[str]]]) -> str:
    """Return a table of pictures with named rows and columns."""
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in columns)
    body = "".join(
        f'<tr><th class="row" scope="row">{escape(name)}</th>'
        + "".join(f"<td>{cell}</td>" for cell in cells)
        + "</tr>"
        for name, cells in rows
    )
    return f'<div class="wide"><table class="gallery"><tr><th></th>{head}</tr>{body}</table></div>'


def facts(pairs: list[tuple[str, str]]) -> str:
    """Return cards of numbers, each with its meaning."""
    cards = "".join(
        f'<div class="fact"><b>{escape(value)}</b><span>{escape(name)}</span></div>'
        for value, name in pairs
    )
    return f'<div class="facts">{cards}</div>'


def write_page(path: Path, text: str, *, force: bool = False) -> None:
    """Write a page, completely or not at all.

    Raises
    ------
    ExistingOutputError, MissingFileError, StorageError
        As `nearfar.files.new_output`.
    """
    with new_output(path, force=force) as partial:
        partial.write_text(text, encoding="utf-8")


def plot(figure: Figure, description: str, reading: str = "") -> str:
    """Return a <figure> of a plot, with how to read it; its ink is that of the page.

    Parameters
    ----------
    figure : Figure
    description : str
        What a reader who does not see it is told; different for each plot of a page.
    reading : str
        How to read it, a sentence or two.
    """
    drawn = StringIO()
    # Names inside of a plot differ from those of the page's other plots, and stay the same.
    with styled(), mpl.rc_context({"svg.fonttype": "none", "svg.hashsalt": description}):
        nameless = dict.fromkeys(("Creator", "Date", "Format", "Type"))
        figure.savefig(drawn, format="svg", transparent=True, dpi=DPI, metadata=nameless)
    text = drawn.getvalue()
    vector = text[text.index("<svg") :]
    for ink, themed in INKS.items():
        vector = vector.replace(ink, themed)
    label = f'<svg role="img" aria-label="{escape(description)}"'
    return (
        f'<figure class="sheet">{vector.replace("<svg", label, 1)}'
        f"{figure_caption(description, reading)}</figure>"
    )
