"""Configuration of the documentation: ``sphinx-build -W docs build/docs``."""

from mbma_tables import __version__

project = "mbma_tables"
author = "mbma_tables contributors"
release = __version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "numpydoc"]
myst_enable_extensions = ["dollarmath"]
myst_heading_anchors = 3
numpydoc_show_class_members = False
autodoc_typehints = "none"
autodoc_member_order = "bysource"
html_theme = "furo"
