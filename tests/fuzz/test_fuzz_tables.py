"""Spoilt table files: bytes, bytes under a right checksum, and content under right hashes."""

import dataclasses

import netCDF4
import numpy as np
import pytest
from fuzzing import SCALE, finite, spoilt
from small_tables import seal, small_table, unseal

from mbma_tables.models.island4d import Island4dModel
from mbma_tables.models.universal import UniversalModel
from mbma_tables.models.verify import verify
from mbma_tables.tablefiles import contents, provenance
from mbma_tables.tablefiles.contents import Contents, contents_of
from mbma_tables.tablefiles.netcdf import _digest_of, check_table, read_table, write_table
from mbma_tables.tablefiles.schema import KINDS, UNIVERSAL

SIGNATURES = (b"OHDR", b"OCHK", b"FRHP", b"FHDB", b"FHIB", b"BTHD", b"BTLF", b"TREE", b"GCOL")
KINDS_OF_NUMBERS = ("f4", "f8", ">f8", "i1", "i4", "i8", "u2")
SPECIAL = (np.nan, np.inf, -np.inf, 0.0, -1.0, 1e300, 700.1, 5e-324)

ODD_ATTRIBUTES = (
    None,
    None,
    "",
    "x" * 5000,
    -1,
    0,
    2**40,
    5e-324,
    1e308,
    np.nan,
    -np.inf,
    [1.5, 2.5],
    ["a", "b"],
    "1",
    "log",
)


@pytest.fixture(scope="module")
def sources(tmp_path_factory):
    """The bytes of one good file of each kind."""
    folder = tmp_path_factory.mktemp("good")
    return {kind: write_table(folder / f"{kind}.nc", small_table(kind)).read_bytes() for kind in KINDS}


@pytest.fixture
def one_process(monkeypatch):
    """What was refused ends the process that reads only where it crashed; how often that was."""
    ends, end = [], contents._end

    def end_crashed():
        process = contents._processes.get(contents.os.getpid())
        if process is not None and process.poll() is not None:
            ends.append(process.returncode)
            end()

    monkeypatch.setattr(contents, "_end", end_crashed)
    yield ends
    end()


@pytest.mark.parametrize("kind", KINDS)
def test_bytes(kind, sources, tmp_path, tally):
    rng = np.random.default_rng(21)
    for _ in range(50 * SCALE):
        content = spoilt(sources[kind], rng)
        found = tally.read_file(tmp_path / "table.nc", content, read_table)
        assert found is None or content == sources[kind]


def damaged(body, rng):
    """Bytes with a few changed, most of them where HDF5 keeps what it needs to find the rest."""
    data = bytearray(body)
    for _ in range(rng.integers(1, 4)):
        at = int(rng.integers(len(data)))
        if rng.integers(4):
            found = [place for place in (body.find(SIGNATURES[rng.integers(len(SIGNATURES))], at),) if place >= 0]
            at = min((found or [at])[0] + int(rng.integers(200)), len(data) - 9)
        match rng.integers(4):
            case 0:
                data[at] ^= 1 << int(rng.integers(8))
            case 1:
                data[at : at + 8] = bytes([int(rng.choice([0, 1, 127, 255]))] * 8)
            case 2:
                data[at : at + 4] = rng.bytes(4)
            case 3:
                data = bytearray(spoilt(bytes(data), rng))
    return bytes(data) or b"\x00"


@pytest.mark.parametrize("kind", KINDS)
def test_bytes_under_a_right_checksum(kind, sources, tmp_path, tally, one_process):
    rng = np.random.default_rng(22)
    own = small_table(kind)
    for _ in range(80 * SCALE):
        content = seal(damaged(unseal(sources[kind]), rng))
        found = tally.read_file(tmp_path / "table.nc", content, read_table)
        if found is not None:
            assert provenance.digest_arrays(found.arrays()) == provenance.digest_arrays(own.arrays())
            assert found.attributes.items() >= own.attributes.items()


def odd_values(values, rng):
    """An array of another type, shape or with odd entries."""
    values = values.copy()
    match rng.integers(7):
        case 0:
            with np.errstate(all="ignore"):
                return values.astype(KINDS_OF_NUMBERS[rng.integers(len(KINDS_OF_NUMBERS))])
        case 1 | 2:
            values.flat[rng.integers(0, values.size, 3)] = SPECIAL[rng.integers(len(SPECIAL))]
            return values
        case 3:
            return values[tuple(slice(0, rng.integers(1, n + 1)) for n in values.shape)]
        case 4:
            return values.T
        case 5:
            return values.reshape([(-1,), (1, *values.shape), ()][rng.integers(3 if values.size == 1 else 2)])
        case _:
            return np.concatenate([values, values])


def odd_attributes(attributes, rng):
    """Attributes of which one is away, or something odd."""
    others = dict(attributes)
    name = list(others)[rng.integers(len(others))]
    value = ODD_ATTRIBUTES[rng.integers(len(ODD_ATTRIBUTES))]
    if value is None:
        del others[name]
    else:
        others[name] = value
    return others


def forged(given, rng):
    """Contents with something odd, under attributes that say so."""
    variables, attributes = dict(given.variables), dict(given.attributes)
    for _ in range(rng.integers(1, 3)):
        name = list(variables)[rng.integers(len(variables))]
        one = variables[name]
        match rng.integers(6):
            case 0 | 1 | 2:
                variables[name] = dataclasses.replace(one, values=odd_values(one.values, rng))
            case 3:
                variables[name] = dataclasses.replace(one, attributes=odd_attributes(one.attributes, rng))
            case 4:
                attributes = odd_attributes(attributes, rng)
            case _:
                del variables[name]
                if rng.integers(2):
                    variables[list(variables)[rng.integers(len(variables))]] = one
    return Contents(attributes, variables)


def dimensions_of(variables):
    """Names and sizes of the dimensions that these variables need, by variable."""
    known, needed = {}, {}
    for name, variable in variables.items():
        names = (*variable.dimensions, *(f"more_{number}" for number in range(variable.values.ndim)))
        needed[name] = {}
        for number, size in enumerate(variable.values.shape):
            own = names[number] if known.setdefault(names[number], size) == size else f"{name}_{number}_{size}"
            needed[name][own] = size
    return needed


def write_sealed(path, given):
    """Write contents as a table file, its hashes right; or nothing where netCDF knows no such file."""
    needed, described = dimensions_of(given.variables), {}
    every = {name: size for own in needed.values() for name, size in own.items()}
    if any(name in every and [*own] != [name] for name, own in needed.items()):
        return
    with netCDF4.Dataset(path, "w") as dataset:
        for name, size in every.items():
            dataset.createDimension(name, size)
        for name, variable in given.variables.items():
            order = "big" if variable.values.dtype.byteorder == ">" else "little"
            kind = variable.values.dtype.str
            made = dataset.createVariable(name, kind, [*needed[name]], fill_value=False, endian=order)
            made.setncatts(variable.attributes)
            made.set_auto_maskandscale(False)
            made[...] = variable.values
            described[name] = made.dimensions, contents.attributes_of(made)
        dataset.setncatts(given.attributes)
        values = {name: variable.values for name, variable in given.variables.items()}
        dataset.setncattr("values_sha256", provenance.digest_arrays(values))
        dataset.setncattr("attributes_sha256", _digest_of(contents.attributes_of(dataset), described))
    path.write_bytes(seal(path.read_bytes()))


def answers(path):
    """Answers of a table, as far as it says that it reaches."""
    content, _ = check_table(path)
    places = np.linspace(0, 1, 7)
    if content.kind == UNIVERSAL:
        model = UniversalModel(content)
        X, mu = (axis.coordinate(places * (axis.nodes - 1)) for axis in content.axes)
        found = model.answer(X[:, None], mu)
        return found.phi_F, found.phi_A, found.error
    raw = (content.conformance[name] for name in ("delta_over_h_rms", "zeta_d", "zeta_u", "hurst"))
    return tuple(Island4dModel(content).lookup(*raw))


@pytest.mark.parametrize("kind", KINDS)
def test_content_under_right_hashes(kind, sources, tmp_path, tally, one_process):
    rng = np.random.default_rng(23)
    given = contents_of(unseal(sources[kind]))
    path = tmp_path / "table.nc"
    path.write_bytes(sources[kind])
    # what compiles does so now
    assert finite(*answers(path), verify(path).conformance_error)
    for _ in range(20 * SCALE):
        path.unlink(missing_ok=True)
        write_sealed(path, forged(given, rng))
        if not path.exists():
            continue
        found = tally.read_file(path, path.read_bytes(), lambda path: (*answers(path), verify(path).conformance_error))
        assert found is None or finite(*found)
    assert not one_process


def test_the_forger_forges_nothing_by_itself(sources, tmp_path):
    for kind, source in sources.items():
        path = tmp_path / "table.nc"
        write_sealed(path, contents_of(unseal(source)))
        assert finite(*answers(path))
        assert verify(path).kind == kind
