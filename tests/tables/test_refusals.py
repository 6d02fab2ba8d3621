"""Every damaged, edited or foreign file is refused on open, by a message that names it and says what to do."""

import dataclasses
import itertools
from functools import partial

import netCDF4
import numpy as np
import pytest
from helpers import spoilt
from small_tables import copied, edited, seal, small_table, unseal

from mbma_tables.common.errors import TableFileError
from mbma_tables.common.netcdf import (
    MAX_BYTES,
    SEAL_LENGTH,
    attributes_digest,
)
from mbma_tables.tables.reader import read_table
from mbma_tables.tables.schema import (
    FORMAT_VERSIONS,
    ISLAND4D,
    KINDS,
    UNIVERSAL,
    check_content,
)


def refused(path, kind=None):
    with pytest.raises(TableFileError) as caught:
        read_table(path, kind)
    message = str(caught.value)
    assert message.count(str(path)) == 1
    assert message.count("`mbma tables make ") == 1
    assert "\n" not in message
    return message


@pytest.mark.parametrize("kind", KINDS)
def test_damaged_bytes_never_reach_the_library(kind, sources, tmp_path):
    content = sources[kind]
    rng = np.random.default_rng(8)
    path = tmp_path / f"{kind}.nc"
    in_the_seal = (
        content[:k] + bytes([content[k] ^ 1 << k % 8]) + content[k + 1 :]
        for k in range(-SEAL_LENGTH, -1)
    )
    for damaged in itertools.chain(
        in_the_seal, (spoilt(content, rng) for _ in range(200))
    ):
        if damaged != content:
            path.write_bytes(damaged)
            message = refused(path, kind)
            assert "damaged" in message or "cut short" in message


def edits(content):
    """Edits of one thing as netCDF tools make them: values, names and attributes, some of each."""
    with netCDF4.Dataset("table", memory=unseal(content)) as dataset:
        owners = {"": dataset, **dataset.variables}
        attributes = [
            (name, key) for name, owner in owners.items() for key in owner.ncattrs()
        ]

    def change(dataset, name, place):
        at = (place,) * dataset[name].ndim
        dataset[name][at] = np.nextafter(float(dataset[name][at]), np.inf)

    def swap(dataset, first, second):
        for old, new in ((first, "between"), (second, first), ("between", second)):
            dataset.renameVariable(old, new)

    def edit(dataset, name, key, way):
        owner = dataset[name] if name else dataset
        value = owner.getncattr(key)
        change = (
            owner.setncattr,
            owner.renameAttribute,
            lambda key, _: owner.delncattr(key),
        )
        change[way](
            key, "other" if way else value + "x" if isinstance(value, str) else [1.5, 2.5]
        )

    for name in list(owners)[1:]:
        yield from (partial(change, name=name, place=place) for place in (0, -1))
        yield lambda d, name=name: d.renameVariable(name, "other")
        if name.endswith("_F"):
            yield partial(swap, first=name, second=f"{name[:-1]}A")
    for number, (name, key) in enumerate(attributes):
        yield partial(edit, name=name, key=key, way=number % 3)
    yield lambda d: d.setncattr("other", 1)
    yield lambda d: d["error_F"].setncattr("scale_factor", 2.0)
    yield lambda d: d.createVariable("other", "f8", ("X",))
    yield lambda d: d.setncattr(
        "mbma_kind", UNIVERSAL if d.mbma_kind == ISLAND4D else ISLAND4D
    )


def test_edits_under_a_right_checksum(sources, tmp_path):
    kind = UNIVERSAL
    done = 0
    for done, edit in enumerate(edits(sources[kind])):
        path = edited(tmp_path / f"{kind}.nc", sources[kind], edit)
        assert refused(path, kind if done % 2 else None), edit
    assert done > 100


def test_variables_left_out_or_in_another_type(sources, tmp_path):
    kind = UNIVERSAL
    path = tmp_path / "universal.nc"
    # as it is, the copy opens: what is refused below is the change
    assert read_table(copied(path, sources[kind]), kind).kind == kind
    with netCDF4.Dataset("table", memory=unseal(sources[kind])) as dataset:
        names = list(dataset.variables)
    for number, name in enumerate(names):
        refused(copied(path, sources[kind], leave_out=name), kind)
        refused(
            copied(path, sources[kind], change_type=(name, ("f4", "i4")[number % 2])),
            kind,
        )


def test_the_wrong_kind_under_a_right_name(sources, tmp_path):
    for kind, other in (KINDS, KINDS[::-1]):
        path = tmp_path / f"{kind}.nc"
        path.write_bytes(sources[other])
        message = refused(path, kind)
        assert f"holds a table of kind '{other}', not {kind}" in message
        assert f"`mbma tables make {kind} --out FILE.nc`" in message
        assert read_table(path).kind == other


@pytest.mark.parametrize("version", ["1.0", "1.9", "2.1", 2.0, ""])
def test_another_format(version, sources, tmp_path):
    path = edited(
        tmp_path / "a.nc",
        sources[UNIVERSAL],
        lambda d: d.setncattr("format_version", version),
    )
    message = refused(path)
    assert (
        f"has format {version}, this library reads {FORMAT_VERSIONS[UNIVERSAL]}"
        in message
    )


def test_no_table_at_all(sources, tmp_path):
    assert "No such file" in refused(tmp_path / "missing.nc")
    assert "No such file" in refused(tmp_path / "no" / "folder.nc")
    assert "not a regular file" in refused(tmp_path)
    for name, content in (
        ("empty.nc", b""),
        ("text.nc", b"X,mu,phi_F\n1,2,3\n" * 50),
        ("zeros.nc", bytes(5000)),
    ):
        (tmp_path / name).write_bytes(content)
        assert "is not a table file" in refused(tmp_path / name)
    for length in (1, SEAL_LENGTH - 1, SEAL_LENGTH, SEAL_LENGTH + 1):
        for piece in (sources[UNIVERSAL][:length], sources[UNIVERSAL][-length:]):
            (tmp_path / "piece.nc").write_bytes(piece)
            refused(tmp_path / "piece.nc")


@pytest.mark.parametrize("format", ["NETCDF4", "NETCDF3_CLASSIC"])
def test_a_netcdf_file_of_another_purpose(format, tmp_path):
    path = tmp_path / "foreign.nc"
    with netCDF4.Dataset(path, "w", format=format) as dataset:
        dataset.createDimension("X", 3)
        dataset.createVariable("log_ratio_F", "f8", ("X",))[...] = [1.0, 2.0, 3.0]
    assert "no checksum at its end" in refused(path)
    path.write_bytes(seal(path.read_bytes()))
    assert "holds a table of kind None" in refused(path)
    for body in (
        b"",
        b"no netCDF",
        bytes(3000),
        b"\x89HDF\r\n\x1a\n",
        b"CDF\x01" + bytes(60),
    ):
        path.write_bytes(seal(body))
        refused(path)


def test_a_file_larger_than_any_table(tmp_path):
    path = tmp_path / "large.nc"
    with path.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    assert f"has more than {MAX_BYTES} bytes" in refused(path)


def rehashed(path, source, edit):
    def both(dataset):
        edit(dataset)
        dataset.setncattr("attributes_sha256", attributes_digest(dataset))

    return edited(path, source, both)


INJECTION = "5 */ int main(void) { system(0); } /*"
MISSING = object()
WRONG = {
    "certificate_points": (INJECTION, 5000.0, 0, MISSING),
    "source_sha256": (INJECTION, MISSING),
    "values_sha256": ("0" * 63 + "g",),
    "data_version": (INJECTION,),
    "variant": (INJECTION, "reported\nEND", MISSING),
    "title": ("one\ntwo", 3, [1.5, 2.5]),
    "largest_error_F": ("1e-9", MISSING),
    "largest_error_A": (np.nan, -1.0),
    "another": (1.5,),
    "X:offset": ("10",),
    "X:first": (np.inf,),
    "X:transform": ("log; rm",),
    "chebyshev_F:units": (1,),
}


@pytest.mark.parametrize(
    ("name", "value"), [(name, value) for name in WRONG for value in WRONG[name]]
)
def test_an_attribute_of_another_type_or_missing_is_refused_by_its_name(
    name, value, sources, tmp_path
):
    def edit(dataset):
        owner, _, key = name.rpartition(":")
        place = dataset[owner] if owner else dataset
        place.delncattr(key) if value is MISSING else place.setncattr(key, value)

    path = rehashed(tmp_path / "table.nc", sources[UNIVERSAL], edit)
    assert (
        f"lacks attribute {name}" if value is MISSING else f"has attribute {name} = "
    ) in refused(path)


def with_axis(content, number, **changes):
    axes = list(content.axes)
    axes[number] = dataclasses.replace(axes[number], **changes)
    return dataclasses.replace(content, axes=tuple(axes))


def with_points(content, **points):
    return dataclasses.replace(content, conformance=content.conformance | points)


def changed(content, name, values):
    return dataclasses.replace(content, **{name: values(getattr(content, name))})


def with_edges(content, **changes):
    labels = dict(content.auxiliary)
    for name, change in changes.items():
        over, values, text = labels[name]
        labels[name] = over, change(values), text
    return dataclasses.replace(content, auxiliary=labels)


def with_axis_and_edges(content, change):
    moved = with_edges(content, X_low=change, X_high=change)
    return with_axis(moved, 0, high=float(change(np.array(content.axes[0].high))))


CHANGES = {
    "axes": (KINDS, lambda c: with_axis(c, 0, name="Y"), "has axes"),
    "order of axes": (
        KINDS,
        lambda c: dataclasses.replace(c, axes=c.axes[::-1]),
        "has axes",
    ),
    "transform": ([ISLAND4D], lambda c: with_axis(c, 0, transform="linear"), "has axes"),
    "falling": (KINDS, lambda c: with_axis(c, 0, low=c.axes[0].high), "axis X from"),
    "no logarithm": (KINDS, lambda c: with_axis(c, 1, low=-1.0), "axis (mu|spread) from"),
    "infinite": (
        KINDS,
        lambda c: with_axis(c, 0, high=np.inf),
        "axis X|one after the other",
    ),
    "offset": (KINDS, lambda c: with_axis(c, 1, offset=1.0), "offset 1"),
    "no Hurst exponent": ([ISLAND4D], lambda c: with_axis(c, 3, high=1.1), "axis hurst"),
    "nodes": (
        [ISLAND4D],
        lambda c: with_axis(c, 0, nodes=c.axes[0].nodes + 1),
        "not over its axes",
    ),
    "coefficients": (
        KINDS,
        lambda c: changed(c, "coefficients", lambda v: v[1:]),
        "not over its (axes|cells)",
    ),
    "errors": (
        KINDS,
        lambda c: changed(c, "local_error", lambda v: v[:0]),
        "error bounds that are not over",
    ),
    "cells": (
        [UNIVERSAL],
        lambda c: with_edges(c, X_low=lambda v: v[1:]),
        "not over its cells",
    ),
    "a gap": (
        [UNIVERSAL],
        lambda c: with_edges(c, mu_low=lambda v: v * 1.125),
        "one after the other",
    ),
    "an overlap": (
        [UNIVERSAL],
        lambda c: with_edges(c, X_high=lambda v: v + 1),
        "one after the other",
    ),
    "an open end": (
        [UNIVERSAL],
        lambda c: with_axis(c, 1, high=200.0),
        "one after the other",
    ),
    "an empty cell": (
        [UNIVERSAL],
        lambda c: with_edges(c, X_high=lambda v: v * np.nan),
        "one after the other",
    ),
    "odd strips": (
        [UNIVERSAL],
        lambda c: with_axis_and_edges(c, lambda v: v + 1e-3 * (v > -2)),
        "by arithmetic",
    ),
    "odd cells": (
        [UNIVERSAL],
        lambda c: with_edges(
            c,
            **dict.fromkeys(
                ("mu_low", "mu_high"), lambda v: v * np.where(v < 100, 1 + 1e-9, 1)
            ),
        ),
        "by arithmetic",
    ),
    "negative error": (
        KINDS,
        lambda c: changed(c, "local_error", np.negative),
        "error bound below 0",
    ),
    "no points": (KINDS, lambda c: dataclasses.replace(c, conformance={}), "incomplete"),
    "fewer points": (KINDS, lambda c: with_points(c, tolerance=np.ones(3)), "incomplete"),
    "negative answer": (
        KINDS,
        lambda c: with_points(c, table_F=0 * c.conformance["table_F"]),
        "not positive",
    ),
    "not a ratio": (
        [ISLAND4D],
        lambda c: changed(c, "coefficients", lambda v: v + 200),
        "not logarithms",
    ),
    "NaN": (
        KINDS,
        lambda c: changed(c, "coefficients", lambda v: v * np.nan),
        "(chebyshev|spline)_F, which is",
    ),
}


@pytest.mark.parametrize(("kinds", "change", "message"), CHANGES.values(), ids=CHANGES)
def test_parts_that_do_not_fit(kinds, change, message):
    for kind in kinds:
        check_content(small_table(kind))
        with pytest.raises(ValueError, match=message):
            check_content(change(small_table(kind)))
