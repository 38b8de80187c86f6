"""Settings of the site: `make docs` builds it into docs/_build/html, without any network."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

from mbody import __version__

project, author = "mbody", "The mbody authors"
release = version = __version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "site_maker"]
exclude_patterns = ["_build", "pictures", "site_maker"]

# Pages: plain Markdown, as other readers show it too.
myst_heading_anchors = 4
myst_enable_extensions = ["deflist"]
highlight_language = "text"
smartquotes = False  # quotes are part of what is written in files

# Notebooks are kept without outputs and run here; one that fails ends the build.
nb_execution_mode = "cache"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_ipywidgets_js = {}  # these would come from the network

# The reference of Python: docstrings as they are.
autodoc_typehints = "none"
autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
napoleon_google_docstring = False
napoleon_use_rtype = False
napoleon_custom_sections = [("Attributes", "params_style")]
default_role = "code"
add_module_names = False
toc_object_entries = False
python_maximum_signature_line_length = 80

html_theme = "furo"
html_title = f"mbody {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
templates_path = []
