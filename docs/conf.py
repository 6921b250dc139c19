"""Configuration of the site: ``make docs``; no network is needed once Sphinx is installed."""

import hashlib
import os
import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE))

from site_tasks import FILE_NAMES  # noqa: E402

import rom  # noqa: E402


def digest(root: Path) -> str:
    """Of all that notebooks show the results of."""
    files = sorted([*root.glob("rom/**/*.py"), *root.glob("meshes/*")])
    return hashlib.sha256(b"".join(path.read_bytes() for path in files)).hexdigest()[:16]


project = "rom"
author = "the fenicsx-rom authors"
copyright = author
version = release = rom.__version__

extensions = [
    "sphinx.ext.autodoc", "sphinx.ext.autosummary", "sphinx.ext.napoleon", "myst_nb",
    "sphinx_copybutton", "sphinx_design", "site_pages", "site_text",
]  # fmt: skip
exclude_patterns = ["build"]
nitpicky = True  # a name that is linked must exist
nitpick_ignore_regex = [("py:class", ".*")]  # but for types in signatures
suppress_warnings = ["config.cache"]

autosummary_filename_map = FILE_NAMES
autodoc_typehints_format = "short"
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "inherited-members": "RomError, Exception, tuple"}
add_module_names = False
python_maximum_signature_line_length = 88
toc_object_entries_show_parents = "hide"
napoleon_use_param = False  # several names may share a line
napoleon_attr_annotations = False
napoleon_custom_sections = [
    "Source", "Sources", "Returns", ("Attributes", "params_style"),
]  # fmt: skip

nb_execution_mode = "off"  # `make docs` runs notebooks, and again when the sources have changed
nb_execution_cache_path = str(HERE.parent / "build" / "notebooks" / digest(HERE.parent))
nb_execution_raise_on_error = True
nb_execution_timeout = 600  # of a cell [s]
nb_merge_streams = True
for name in ("OMPI_ALLOW_RUN_AS_ROOT", "OMPI_ALLOW_RUN_AS_ROOT_CONFIRM"):  # one starts mpirun
    os.environ.setdefault(name, "1")

myst_enable_extensions = ["dollarmath", "amsmath", "colon_fence"]
myst_heading_anchors = 3

html_theme = "pydata_sphinx_theme"
html_title = f"rom {release}"
html_theme_options = {
    "logo": {"text": "rom"},
    "collapse_navigation": True,  # a page lists its neighbours, not all there are
    "show_toc_level": 2,  # methods beside their class
    "navbar_align": "left",
    "primary_sidebar_end": [],
    "footer_start": [],
    "footer_end": [],
}
html_sidebars = {"**": ["sidebar-nav-bs"], "index": [], "generated/demos": []}
html_static_path = ["static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_search_scorer = str(Path(__file__).with_name("search_scores.js"))
html_show_sourcelink = False
html_copy_source = False
