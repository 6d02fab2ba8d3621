"""Times of what editors and notebooks ask of an object unasked: text, table, facts, equality and hash."""

import json
import statistics
import subprocess
import sys

import click
import numpy as np

from benchmarks.rows import report

ROUNDS = 5
LIMIT = 10.0  # ms
OBJECTS = {
    "surface": "joint.surface",
    "joint": "joint",
    "contact by calibrated": "joint.at_pressure('10 MPa')",
    "contact by mbma": "contact(joint.surface, '100 GPa', pressure='1 MPa', theory='mbma')",
    "law": "joint.law()",
}
# milliseconds of the processor for each of them, once in a new process, then again
CODE = """
import json, sys, time
from mbma_tables import Joint, contact
face = {"Rq": "0.4 um", "hurst": 0.8, "longest": "500 um", "shortest": "8 um"}
metals = ("steel 4140 hard", "aluminium 6061 hard")
joint = Joint(face, face | {"Rq": "0.7 um"}, bodies=metals, nominal_area="4 cm^2")
made = eval(sys.argv[1])
asked = repr, lambda it: it._repr_html_(), lambda it: it._facts(), lambda it: it == 1, hash
times = []
for _ in range(2):
    for ask in asked:
        start = time.thread_time()
        ask(made)
        times.append(1e3 * (time.thread_time() - start))
print(json.dumps(times))
"""


def display(rng: np.random.Generator) -> None:
    """The slowest of the five in a new process, where the contact is made but nothing was shown, and again."""
    click.echo(
        "\nText, table, facts, equality and hash of an object, the slowest of them"
    )
    for name, made in OBJECTS.items():
        command = [sys.executable, "-c", CODE, made]
        taken = [json.loads(subprocess.check_output(command)) for _ in range(ROUNDS)]
        slowest = [(max(times[:5]), max(times[5:])) for times in taken]
        first, again = (statistics.median(each) for each in zip(*slowest, strict=True))
        report(f"{name}, first in a new process", first, "ms", at_most=LIMIT)
        report(f"{name}, again", again, "ms", at_most=LIMIT)


@click.command("display")
def display_command() -> None:
    """Times of texts, tables, facts, equality and hash alone."""
    display(np.random.default_rng())
