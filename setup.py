"""The README of a package index: without the picture and the links of a checkout, which lead nowhere there."""

import pathlib
import re

from setuptools import setup

readme = pathlib.Path("README.md").read_text(encoding="utf-8")
readme = re.sub(r"!\[[^]]*\]\((?!https:)[^)]*\)\n+", "", readme)
# whole in brackets, such as "(why)"
readme = re.sub(r" \(\[[^]]+\]\((?!https:)[^)]*\)\)", "", readme)
readme = re.sub(r"\[([^]]+)\]\((?!https:)[^)]*\)", r"\1", readme)
readme += "\nPages named here are in the folder docs of the source distribution.\n"
setup(long_description=readme, long_description_content_type="text/markdown")
