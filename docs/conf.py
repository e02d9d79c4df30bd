"""How Sphinx builds the site: `sphinx-build -W --keep-going docs out/site`."""

import re
from inspect import isfunction
from pathlib import Path
from typing import Any

import nbformat
from sphinx.application import Sphinx
from sphinx.ext.napoleon import Config, GoogleDocstring

project = "riseg_drake"
author = "the riseg_drake developers"
html_title = "riseg_drake"

extensions = [
    "myst_nb",  # the pages are Markdown, and read the same on a code host; notebooks are pages, too
    "sphinx.ext.apidoc",  # a page of docstrings for every room
    "sphinx.ext.autodoc",
]
exclude_patterns = ["README.md"]  # index.rst is that page, and the list of all others
html_theme = "furo"
html_show_sphinx = False
html_show_copyright = False

# Links to headings, such as systems.md#pushplanner, work as they do on a code host.
myst_heading_anchors = 3

# Notebooks hold what they made when they were executed last; tests/test_notebooks.py executes them anew.
nb_execution_mode = "off"
NOTEBOOKS = Path(__file__).parent.parent / "notebooks"

apidoc_modules = [
    {
        "path": "../riseg_drake",
        "destination": "api",
        "module_first": True,
        "separate_modules": False,
        "automodule_options": {"members", "show-inheritance"},
    }
]
autodoc_member_order = "bysource"
autodoc_typehints_format = "short"
autodoc_preserve_defaults = True
autodoc_mock_imports = ["torch", "transformers"]  # both are optional

# Docstrings say `mask` where reStructuredText has ``mask``.
default_role = "code"

SECTIONS = Config(napoleon_custom_sections=[("Inputs", "params_style"), ("Outputs", "params_style")])
ARRAY = re.compile(r"ndarray\[tuple\[Any, \.\.\.\], dtype(?:\[_ScalarT\]|(\[\w+\]))\]")
CODE_OR_BAR = re.compile(r"(`[^`]*`)|\|")


def as_restructured_text(app: Sphinx, what: str, name: str, thing: Any, options: Any, lines: list[str]) -> None:
    """Rewrites a docstring in place: "Args:" and its like become lists, and |x| is no substitution."""
    lines[:] = [CODE_OR_BAR.sub(lambda found: found[1] or r"\|", line) for line in lines]
    # What stands before a colon in an attribute's docstring would be taken for its type.
    if what not in ("attribute", "data", "property"):
        lines[:] = GoogleDocstring(lines, SECTIONS, app, what, name, thing, options).lines()


def with_short_arrays(
    app: Sphinx, what: str, name: str, thing: Any, options: Any, signature: str | None, returns: str | None
) -> tuple[str | None, str | None]:
    """NDArray[float64] as the code says it, not as numpy spells it out."""
    return tuple(
        text and ARRAY.sub(lambda found: f"NDArray{found[1] or ''}", text) for text in (signature, returns)
    )


def is_made_elsewhere(app: Sphinx, what: str, name: str, thing: Any, skip: bool, options: Any) -> bool | None:
    """Whether a function comes from another project, as the `set` that matplotlib gives its subclasses does."""
    return True if isfunction(thing) and not thing.__module__.startswith(project) else None


def with_notebooks(app: Sphinx) -> None:
    """Lay the notebooks among the pages, each with the file itself to take along."""
    folder = Path(app.srcdir) / NOTEBOOKS.name
    folder.mkdir(exist_ok=True)
    for path in NOTEBOOKS.glob("*.ipynb"):
        notebook = nbformat.read(path, as_version=4)
        link = nbformat.v4.new_markdown_cell(
            f"{{download}}`{path.name} <../../notebooks/{path.name}>`, to open in Jupyter."
        )
        notebook.cells.insert(1, link)
        nbformat.write(notebook, folder / path.name)


def setup(app: Sphinx) -> None:
    """Called by Sphinx."""
    app.connect("builder-inited", with_notebooks)
    app.connect("autodoc-process-docstring", as_restructured_text)
    app.connect("autodoc-process-signature", with_short_arrays)
    app.connect("autodoc-skip-member", is_made_elsewhere)
