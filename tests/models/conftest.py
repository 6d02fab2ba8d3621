"""Tests of models use the small tables of the tests of table files."""

import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).parents[1] / "tablefiles"))
