"""Sphinx configuration."""

import re
import sys
from importlib.metadata import version as installed_version
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

import generate  # noqa: E402  # a module beside this file

project = "stickslip"
author = "The stickslip developers"
project_copyright = "The stickslip developers"
version = release = installed_version("stickslip")

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx.ext.mathjax",
    "sphinx-mathjax-offline",  # formulas without a network
    "sphinx_gallery.gen_gallery",
    "sphinxcontrib.bibtex",
]
source_suffix = {".md": "markdown", ".rst": "restructuredtext"}
exclude_patterns = ["_build", "generated", "strategies_alarms.md", "contact_points_numbers.md"]
html_theme = "furo"
html_title = "stickslip"
html_static_path: list[str] = []

myst_enable_extensions = ["amsmath", "dollarmath", "deflist"]
myst_heading_anchors = 3
math_number_all = False
suppress_warnings = ["misc.highlighting_failure"]  # sketches of types on the design page are not quite Python

autodoc_default_options = {"members": True, "member-order": "bysource"}
autodoc_typehints = "none"  # the numpydoc text has shapes and units, which the annotations lack
napoleon_google_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False

bibtex_bibfiles = ["references.bib"]

sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "auto_examples",
    "filename_pattern": r"/plot_",
    "ignore_pattern": r"two_blades_python\.py$",  # stands on a page of its own
    "only_warn_on_example_error": False,
    "download_all_examples": False,
    "capture_repr": (),
    "show_memory": False,
    "write_computation_times": False,
    "show_signature": False,
    "remove_config_comments": True,
}

generate.write_all(HERE / "generated")


def _linked(_app, page, source):
    """Make the names of the table of the interface links to their full text."""
    if page == "api":
        source[0] = re.sub(r"^\| `ss\.([\w.]+)`", r"| {py:obj}`ss.\1 <stickslip.\1>`", source[0], flags=re.M)


def _attributes_apart(_app, _what, _name, _obj, _options, lines):
    """Give attributes that share a description an entry each: of "a, b" napoleon takes "a" for a type."""
    inside, out, shared, told = False, [], [], []
    for i, line in enumerate([*lines, ""]):
        if i + 1 < len(lines) and set(lines[i + 1]) == {"-"}:
            inside = line == "Attributes"
        indented = line.startswith(" ") or not line
        if shared and not indented:
            out += [row for name in shared[1:] for row in (name, *told)]
            shared = []
        if inside and re.fullmatch(r"\w+(, \w+)+", line):
            shared, told = line.split(", "), []
            out.append(shared[0])
            continue
        out.append(line)
        if shared:
            told.append(line)
    if shared:
        out += [row for name in shared[1:] for row in (name, *told)]
    lines[:] = out


def setup(app):
    """Connect what this page of settings adds."""
    app.connect("source-read", _linked)
    app.connect("autodoc-process-docstring", _attributes_apart, priority=100)  # before napoleon
