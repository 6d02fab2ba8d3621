"""Ways through the library that a user seldom takes: what fails on them ends in a typed error or in nothing."""

import click
import pytest
from click.testing import CliRunner

from mbma_tables import InputError, compiled, theories
from mbma_tables import theories as theories_module
from mbma_tables.cli import Program
from mbma_tables.cli.scene import _show
from mbma_tables.errors import ConvergenceError
from mbma_tables.surfaces.surface import Surface


def ended(fault):
    """Exit code and output of a command that ends so."""

    @click.group(cls=Program)
    def program():
        """Nothing else."""

    @program.command()
    def fail():
        raise fault

    done = CliRunner().invoke(program, ["fail"])
    return done.exit_code, done.output


@pytest.mark.parametrize(
    ("fault", "code", "said"),
    [
        (click.Abort(), 1, ""),
        (FileNotFoundError(2, "No such file or directory", "a.txt"), 2, "mbma: a.txt: No such file or directory\n"),
        (OSError(28, "No space left on device"), 2, "mbma: No space left on device\n"),
        (OSError("odd\nfault"), 2, "mbma: odd fault\n"),
        (click.ClickException("two\nlines"), 2, "mbma: two lines\n"),
        (InputError("not so"), 2, "mbma: not so\n"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_every_known_fault_is_one_line(fault, code, said):
    assert ended(fault) == (code, said)


def test_without_a_folder_for_compiled_code_it_is_compiled_anyway():
    asked = []

    def decorate(*signature, cache=False):
        def wrap(function):
            asked.append(cache)
            if cache:
                raise RuntimeError("cannot cache function: no locator available")
            return function, signature

        return wrap

    assert compiled._kept(decorate, "f8(f8)", cache=True)(abs) == (abs, ("f8(f8)",))
    assert asked == [True, False]


def test_a_theory_that_finds_no_load_says_where(monkeypatch):
    monkeypatch.setattr(theories_module, "STEPS", 1)
    with pytest.raises(ConvergenceError, match="no load found for 2 separations in 1 steps") as caught:
        theories.persson_force(Surface.named("concrete"), [0.2, 0.5])
    assert caught.value.mask.tolist() == [True, True]


def test_progress_stays_on_its_line_until_it_is_done(capsys):
    _show("totals", 1, 2)
    _show("totals", 2, 2)
    assert capsys.readouterr().err == "\rtotals: 1 of 2\rtotals: 2 of 2\n"
