"""Configuration of the documentation: ``sphinx-build -W docs build/docs``."""

from mbma_tables import __version__

project = "mbma_tables"
author = copyright = "mbma_tables contributors"
release = __version__
extensions = ["myst_nb", "sphinx.ext.autodoc", "sphinx.ext.autosummary", "numpydoc"]
# pages of `tutorials` are notebooks: run anew at each build, a fault ends it
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
numpydoc_show_class_members = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
templates_path = ["_templates"]
html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["wide.css"]
