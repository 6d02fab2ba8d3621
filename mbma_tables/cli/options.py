"""The options that commands share, in the order in which their help shows them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

DEFAULT_RTOL = 1e-8


def _parse_numbers(ctx: click.Context, param: click.Parameter, given: tuple[str, ...]) -> list[float] | None:
    """All numbers of a repeated option, with commas between them; None where it was not given."""
    numbers = []
    for text in given:
        try:
            numbers += [float(part) for part in text.split(",")] if text.strip() else []
        except ValueError:
            raise click.BadParameter(
                f"{text!r} is not a number, nor numbers with commas between them.", ctx, param
            ) from None
    return numbers if given else None


def _stack(*decorators: Decorator) -> Decorator:
    def decorate(function: Callable[..., Any]) -> Callable[..., Any]:
        for decorator in reversed(decorators):
            function = decorator(function)
        return function

    return decorate


def numbers_option(*names: str, help: str) -> Decorator:
    """An option that may be repeated, each time with one number or several."""
    return click.option(*names, multiple=True, callback=_parse_numbers, metavar="X[,X...]", help=help)


over_h_rms = click.option("--over-h-rms", is_flag=True, help="The lengths asked for are multiples of h_rms.")

surface_options = _stack(
    click.option("--surface", "name", metavar="NAME", help="Surface: a case of the paper; `mbma surfaces` lists them."),
    click.option("--file", "file", type=click.Path(path_type=Path), metavar="TOML", help="Surface: a TOML file."),
    click.option(
        "--map",
        "map",
        type=click.Path(path_type=Path),
        metavar="MAP",
        help="Surface: fitted to a measured map of heights.",
    ),
    click.option("--hurst", type=float, help="Surface in numbers: Hurst exponent, in (0, 1]."),
    click.option("--q0", type=float, help="Least wavenumber [1/length]."),
    click.option("--q1", type=float, help="Largest wavenumber [1/length]; or give --zeta-1."),
    click.option("--zeta-1", "zeta_1", type=float, help="Largest magnification q1/q0, above 3."),
    click.option("--h-rms", "h_rms", type=float, help="Root-mean-square height [length]."),
    click.option("--h-max", "h_max", type=float, help="Highest point above the mid-plane [length]."),
    click.option("--m0", type=float, help="Surface by moments: hurst, h_max, variance of height [length^2],"),
    click.option("--m2", type=float, help="variance of a profile's slope,"),
    click.option("--m4", type=float, help="variance of a profile's second derivative [1/length^2]."),
)

model_options = _stack(
    click.option("--E-star", "E_star", type=float, help="Effective modulus; else forces are over E*."),
    click.option("--E1", "E1", type=float, help="Instead of --E-star: Young's modulus,"),
    click.option("--nu1", "nu1", type=float, help="and Poisson's ratio of one body,"),
    click.option("--E2", "E2", type=float, help="Young's modulus of the other,"),
    click.option("--nu2", "nu2", type=float, help="and its Poisson's ratio."),
    click.option(
        "--reading",
        default="reported",
        show_default=True,
        metavar="reported|printed",
        help="Reading of the paper's equations.",
    ),
    click.option(
        "--tier",
        default="universal",
        show_default=True,
        metavar="exact|universal|island4d|formula|rigid",
        help="Island model.",
    ),
    click.option("--rtol", type=float, default=DEFAULT_RTOL, show_default=True, help="Relative error asked for."),
)

output_options = _stack(
    click.option("--json", "as_json", is_flag=True, help="Print one JSON object instead of a table."),
    click.option("--csv", "as_csv", is_flag=True, help="Print CSV with '#' comments instead of a table."),
    click.option(
        "--out",
        type=click.Path(path_type=Path),
        metavar="FILE",
        help="Write it to a file, whole or not at all.",
    ),
)
