"""Solvers of a campaign, by one of which a process is once killed and once slow, as workers of tests import them."""

import os
import time

KILLED, SLOW = 1, 3  # seeds of these surfaces


def press(recipe):
    """A surface at one load, by the campaign's engine: what it measures of time is left out."""
    from generate.boundary_elements.solve import Contact
    from generate.boundary_elements.surfaces import heights

    contact = Contact(heights(recipe), recipe.sizes)
    found = contact.press(0.5)
    return {
        **{name: found[name] for name in ("area", "energy", "mean_separation")},
        "traction": contact.model.traction,
    }


def press_or_end(recipe):
    """As `press`; the first call of one surface ends its process, and of another takes 0.5 s longer."""
    marks = os.environ["MBMA_TEST_MARKS"]
    what = {KILLED: "killed", SLOW: "slow"}.get(recipe.seed)
    with open(marks, "a+") as stream:
        stream.seek(0)
        is_first = what is not None and what not in stream.read().split()
        if is_first:
            stream.write(f"{what}\n")
    if is_first and recipe.seed == KILLED:
        os.kill(os.getpid(), 9)
    if is_first:
        time.sleep(0.5)
    return press(recipe)
