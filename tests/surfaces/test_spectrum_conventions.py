"""Spectra by name of convention: closed forms, averages, files of contact.engineering."""

import mpmath
import numpy as np
import pytest

from mbma_tables import Surface, contact
from mbma_tables.common.errors import InputError, MbmaError
from mbma_tables.surfaces.conventions import (
    MeasuredSpectrum,
    average_spectra,
    converted,
    read_spectra,
)


def closed_form(hurst, q):
    """C1D of C = q^(-2 - 2 H) without an end, by the beta function."""
    return 2 * np.pi * q ** (-1 - 2 * hurst) * float(mpmath.beta(hurst + 0.5, 0.5))


@pytest.mark.parametrize("hurst", [0.3, 0.8, 1.0])
def test_a_power_law_both_ways(hurst):
    # so far beyond that what is left out does not count at the lowest wavenumbers
    q = np.geomspace(1.0, 1e6, 1201)
    found = converted(q, q ** (-2 - 2 * hurst), "paper", "C1D")[:400]
    np.testing.assert_allclose(found, closed_form(hurst, q[:400]), rtol=1e-4)
    few = np.geomspace(1.0, 300.0, 60)
    back = converted(few, closed_form(hurst, few), "C1D", "paper")
    np.testing.assert_allclose(back, few ** (-2 - 2 * hurst), rtol=0.02)


def test_a_finite_band_against_quadrature():
    # C = q^-3.6 from 1 to 50, the integral with its end by mpmath
    q = np.geomspace(1.0, 50.0, 40)
    found = converted(q, q**-3.6, "paper", "C1D")
    for place in (0, 17, 33):
        low = mpmath.mpf(q[place])
        integral = mpmath.quad(
            lambda t, low=low: mpmath.sqrt(low**2 + t**2) ** mpmath.mpf("-3.6"),
            [0, low, mpmath.sqrt(50**2 - low**2)],
        )
        assert found[place] == pytest.approx(float(4 * mpmath.pi * integral), rel=1e-9)
    assert found[-1] == 0.0


def test_a_roll_off_comes_back():
    q = np.geomspace(0.05, 40.0, 120)
    C = np.maximum(q, 1.0) ** -3.4
    longer = np.geomspace(0.05, 4000.0, 800)
    along = converted(longer, np.maximum(longer, 1.0) ** -3.4, "paper", "C1D")
    along = np.exp(np.interp(np.log(q), np.log(longer[:-1]), np.log(along[:-1])))
    back = converted(q, along, "C1D", "paper")
    away = np.abs(np.log(q)) > 0.5
    np.testing.assert_allclose(back[away], C[away], rtol=0.06)


def test_variances_are_the_same_in_every_convention():
    q = np.geomspace(0.1, 100.0, 601)
    C = np.maximum(q, 1.0) ** -3.6
    h2 = 2 * np.pi * np.trapezoid(C * q, q)
    isotropic = converted(q, C, "paper", "isotropic")
    assert np.trapezoid(isotropic * q, q) / (2 * np.pi) == pytest.approx(h2, rel=1e-9)
    along = converted(q, C, "paper", "C1D")
    # both continued flat below the lowest wavenumber
    traced = (np.trapezoid(along, q) + along[0] * q[0]) / np.pi
    assert traced == pytest.approx(h2 + np.pi * C[0] * q[0] ** 2, rel=1e-3)
    one_sided = converted(q, C, "isotropic", "C1D+") * 4 * np.pi**2
    np.testing.assert_allclose(one_sided, 2 * along, rtol=1e-12)


def test_a_surface_of_a_spectrum_of_traces():
    q = np.geomspace(0.1, 20.0, 60)
    for convention, times in (("C1D", 1.0), ("C1D+", 2.0)):
        along = times * 1e-4 * closed_form(0.8, q)
        found = Surface.from_spectrum(
            q[::-1], along[::-1], h_max=1.0, convention=convention
        )
        of_surface = Surface.from_spectrum(
            q, 1e-4 * q**-3.6, h_max=1.0, convention="paper"
        )
        assert found.h_rms == pytest.approx(of_surface.h_rms, rel=0.01)
        assert found.rms_gradient == pytest.approx(of_surface.rms_gradient, rel=0.01)
        assert found.fit().hurst == pytest.approx(0.8, abs=0.01)
        pressed = contact(found, pressure=1e-3, theory="calibrated")
        assert not pressed.valid
        assert any("spectrum is of traces" in reason for reason in pressed.reasons)


def test_averages_weigh_by_length():
    q = np.geomspace(1.0, 10.0, 11)
    one = MeasuredSpectrum("one", q, q**-3.0, "C1D", "um")
    other = MeasuredSpectrum("other", q[5:], 4 * q[5:] ** -3.0, "C1D", "um")
    mean = average_spectra([one, other], [1.0, 2.0])
    np.testing.assert_allclose(mean.C, np.where(q >= q[5], 3.0, 1.0) * q**-3.0)
    assert (mean.convention, mean.unit) == ("C1D", "um")
    in_mm = MeasuredSpectrum("mm", 1e3 * q, 1e-9 * q**-3.0, "C1D", "mm")
    np.testing.assert_allclose(average_spectra([one, in_mm]).C, one.C)
    for wrong, lengths, message in (
        ([], None, "one or more spectra"),
        ([one, one], [1.0], "2 numbers"),
        ([one, one], [1.0, 0.0], "lengths must be positive"),
        ([one, one.to("C1D+")], None, "conventions C1D, C1D"),
        ([one, MeasuredSpectrum("bare", q, q, "C1D")], None, "some spectra have a unit"),
    ):
        with pytest.raises(InputError, match=message):
            average_spectra(wrong, lengths)


def test_refusals():
    q = np.geomspace(1.0, 10.0, 11)
    for arguments, message in (
        ((q, q**-3, "C2D", "paper"), "no convention is named 'C2D'"),
        ((q, q**-3, "C1D", "iso"), "no to is named 'iso'"),
        ((q[::-1], q**-3, "C1D", "paper"), "rising"),
        ((q, -q, "C1D", "paper"), "C must be positive"),
        ((q, q * np.nan, "C1D", "paper"), "finite"),
        ((q, q[1:], "C1D", "paper"), "two columns"),
        ((q[:4], q[:4], "C1D", "paper"), "at least 6"),
    ):
        with pytest.raises(MbmaError, match=message):
            converted(*arguments)


Q = np.geomspace(1e5, 1e7, 8)
SERIES = {"1D PSD along x": 1e-18 * Q**-1.0, "q/π × 2D PSD": 2e-18 * Q**-1.0}


def exported_text(path):
    """A text as contact.engineering writes it with numpy.savetxt."""
    with open(path, "w", encoding="utf-8") as file:
        file.write("# Power spectrum\n# ==============\n#\n")
        file.write("# Topography: plate\n# =================\n# Creator: somebody\n#\n")
        for name, C in SERIES.items():
            columns = (
                "Columns: Wavevector (m⁻¹), PSD (m³), standard error of average PSD (m³)"
            )
            rows = np.transpose([Q, C, np.full(Q.size, np.nan)])
            rows[3, 1] = np.nan
            np.savetxt(file, rows, header=f"{name}\n{'-' * len(name)}\n{columns}")
            file.write("\n")


def exported_table(path):
    """The same as a table."""
    lines = [
        "Subject type;Subject name;Data series;Wavevector (m⁻¹);PSD (m³);"
        "standard error of PSD (m³);comment"
    ]
    for name, C in SERIES.items():
        for k, (q, value) in enumerate(zip(Q, C, strict=True)):
            shown = "" if k == 3 else repr(float(value))
            lines.append(f"measurement;plate;{name};{float(q)!r};{shown};;")
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def exported_workbook(path):
    """The same as a workbook."""
    openpyxl = pytest.importorskip("openpyxl")
    book = openpyxl.Workbook()
    book.active.title = "INDEX"
    for k, (name, C) in enumerate(SERIES.items()):
        sheet = book.create_sheet(f"analysis-0-series-{k}")
        labels = (("Analysis", "Power spectrum"), ("Subject", "plate"))
        for row in (*labels, ("Subject Type", "measurement"), ("Data Series", name)):
            sheet.append(row)
        sheet.append([])
        sheet.append([None, "Wavevector (m⁻¹)", "PSD (m³)"])
        for n, (q, value) in enumerate(zip(Q, C, strict=True)):
            sheet.append([n, float(q), None if n == 3 else float(value)])
    book.save(path)


@pytest.mark.parametrize(
    ("name", "write"),
    [
        ("psd.txt", exported_text),
        ("psd.csv", exported_table),
        ("psd.xlsx", exported_workbook),
    ],
)
def test_files_of_contact_engineering(tmp_path, name, write):
    write(tmp_path / name)
    along, radial = read_spectra(tmp_path / name)
    known = np.arange(Q.size) != 3
    for found in (along, radial):
        assert found.unit == "m"
        assert found.left_out == 1
        np.testing.assert_allclose(found.q, Q[known])
    assert (along.convention, radial.convention) == ("C1D", "isotropic")
    assert along.name == "plate: 1D PSD along x"
    np.testing.assert_allclose(along.C, SERIES["1D PSD along x"][known])
    expected = np.pi / Q * SERIES["q/π × 2D PSD"]
    np.testing.assert_allclose(radial.C, expected[known])
    surface = Surface.from_spectrum(**radial.arguments, h_max=2e-6)
    assert surface.unit == "m"


def test_other_files_are_refused(tmp_path):
    path = tmp_path / "psd.txt"
    good = "# 1D PSD along x\n# --\n# Columns: Wavevector (µm⁻¹), PSD (µm³)\n1 2\n2 1\n"
    for text, message in (
        ("1 2\n3 4\n", "holds no spectrum"),
        (good.replace("1D PSD along x", "Height distribution"), "'Height distribution'"),
        (good.replace("Wavevector", "Height"), "not a wavevector"),
        (good.replace("2 1", "2 1,5"), "no numbers"),
        (good.replace("2 1", "2 -1"), "C must be positive"),
        (good.replace("2 1", "2"), "got rows of 1, 2 numbers"),
    ):
        path.write_text(text, encoding="utf-8")
        with pytest.raises(InputError, match=message):
            read_spectra(path)
    with pytest.raises(MbmaError, match="missing"):
        read_spectra(tmp_path / "missing.txt")
    (tmp_path / "x.xlsx").write_bytes(b"no workbook")
    pytest.importorskip("openpyxl")
    with pytest.raises(InputError, match="no workbook"):
        read_spectra(tmp_path / "x.xlsx")
