"""The model as a package: built and installed by CMake, found by others, and called from Fortran and Rust."""

import csv
import os
import re
import shutil
import subprocess

import pytest
from law_points import needs

from mbma_tables import Surface, contact
from mbma_tables.export.model.bindings import declarations
from mbma_tables.export.model.c_code import write_code
from mbma_tables.export.model.conformance import POINTS_FILE
from mbma_tables.theories import Mbma

# kinds of points that the programs below replay: calls with one answer
KINDS = ("phi", "geometry", "total", "formula", "calibrated", "separation")
KINDS += ("joint", "joint_separation", "unloaded", "unloaded_separation")

CONSUMER = """
cmake_minimum_required(VERSION 3.15)
project(consumer LANGUAGES C)
find_package(mbma REQUIRED)
add_executable(consumer consumer.c)
target_link_libraries(consumer PRIVATE mbma::mbma)
"""

USER = """
#include <mbma_model.h>
#include <stdio.h>
int main(void) {
    mbma_surface road = {0.8, 1.0, 100.0, 1.0, 3.0};
    mbma_contact found;
    const int status = mbma_total_of(&road, 1.5, 13.3, 1e-8, &found);
    printf("%d %.17g %.17g\\n", status, found.force, found.area);
    return 0;
}
"""

FORTRAN = """
program replay
  use mbma
  implicit none
  character(24) :: kind
  integer :: given, status, k, unit
  real(c_double) :: v(11), answer(14), d
  type(mbma_answer) :: phi
  type(mbma_island) :: island
  type(mbma_contact) :: contact, contacts(2)
  type(mbma_surface) :: surface
  type(mbma_bodies) :: bodies
  type(mbma_joint) :: joint
  type(mbma_peak) :: peak
  real(c_double), allocatable :: spectrum(:)
  open (newunit=unit, file="points.txt", status="old")
  do
    read (unit, *, end=1) kind, given, (v(k), k = 1, given)
    surface = mbma_surface(v(1), v(2), v(3), v(4), v(5))
    bodies = mbma_bodies(v(6), v(7), v(8), v(9))
    answer = 0
    select case (kind)
    case ("phi")
      status = mbma_phi_of(v(1), v(2), phi)
      answer(:3) = [phi%phi_F, phi%phi_A, phi%error]
    case ("formula")
      status = mbma_formula_of(v(1), v(2), phi)
      answer(:3) = [phi%phi_F, phi%phi_A, phi%error]
    case ("geometry")
      status = mbma_island_geometry_of(v(1), v(2), v(3), island)
      answer = transfer(island, answer)
    case ("total")
      status = mbma_total_of(surface, v(6), v(7), v(8), contact)
      answer(:4) = transfer(contact, answer(:4))
      if (mbma_totals_of(surface, 1_c_size_t, v(6:6), v(7), v(8), contacts) /= 0) stop 2
      if (contacts(1)%force /= contact%force) stop 3
    case ("calibrated")
      status = mbma_calibrated_of(surface, v(6), v(7), contact)
      answer(:4) = transfer(contact, answer(:4))
    case ("separation")
      status = mbma_calibrated_separation_of(surface, v(6), v(7), d)
      answer(1) = d
    case ("joint")
      status = mbma_joint_of(surface, bodies, v(10), joint)
      answer(:size(transfer(joint, answer))) = transfer(joint, answer)
    case ("joint_separation")
      status = mbma_joint_separation_of(surface, bodies, v(10), d)
      answer(1) = d
    case ("unloaded")
      if (mbma_peak_of(surface, bodies, v(10), peak) /= MBMA_OK) stop 9
      status = mbma_unloaded_of(surface, bodies, peak, v(11), joint)
      answer(:size(transfer(joint, answer))) = transfer(joint, answer)
    case ("unloaded_separation")
      if (mbma_peak_of(surface, bodies, v(10), peak) /= MBMA_OK) stop 9
      status = mbma_unloaded_separation_of(surface, bodies, peak, v(11), d)
      answer(1) = d
    end select
    print "(i0, 14(1x, es25.17e3))", status, answer
  end do
1 close (unit)
  if (mbma_text(mbma_phi_of(1d9, 1d0, phi)) /= "X is above the range") stop 4
  allocate (spectrum, source=mbma_spectrum_memory())
  surface = mbma_surface(0.8d0, 1d0, 100d0, 1d0, 3d0)
  if (mbma_surface_spectrum_of(surface, MBMA_PERSSON, spectrum) /= MBMA_OK) stop 5
  if (mbma_spectrum_contact_of(spectrum, 1.5d0, 1d0, contact) /= MBMA_OK) stop 6
  if (mbma_spectrum_separation_of(spectrum, contact%force, 1d0, d) /= MBMA_OK) stop 7
  if (abs(d - 1.5d0) > 1d-9) stop 8
end program
"""

RUST = """
#[path = "mbma_model.rs"]
mod mbma_model;
use mbma_model as mbma;
fn main() {
    let text = std::fs::read_to_string("points.txt").unwrap();
    for line in text.lines() {
        let words: Vec<&str> = line.split(' ').collect();
        let v: Vec<f64> = words[2..].iter().map(|word| word.parse().unwrap()).collect();
        let surface = || mbma::Surface { hurst: v[0], q0: v[1], q1: v[2], h_rms: v[3], h_max: v[4] };
        let bodies = || mbma::Bodies { E_star: v[5], hardness: v[6], nu: v[7], conductivity: v[8] };
        let joint = |j: mbma::Joint| vec![
            j.force, j.area, j.stiffness, j.error, j.yielded, j.unloading_stiffness, j.tangential_stiffness,
            j.solid_conductance, j.plane_separation, j.flow_coefficient];
        let peak = || mbma::peak_of(&surface(), &bodies(), v[9]).unwrap();
        let of = |c: mbma::Contact| vec![c.force, c.area, c.stiffness, c.error];
        let answer = match words[0] {
            "phi" => mbma::phi_of(v[0], v[1]).map(|a| vec![a.phi_F, a.phi_A, a.error]),
            "formula" => mbma::formula_of(v[0], v[1]).map(|a| vec![a.phi_F, a.phi_A, a.error]),
            "geometry" => mbma::island_geometry_of(v[0], v[1], v[2]).map(|i| vec![
                i.zeta_d, i.zeta_u, i.R_d, i.R_u, i.D, i.sigma, i.h_d, i.h_u, i.eta, i.X, i.mu, i.D_d, i.sigma_d,
                i.width]),
            "total" => mbma::total_of(&surface(), v[5], v[6], v[7]).map(of),
            "calibrated" => mbma::calibrated_of(&surface(), v[5], v[6]).map(of),
            "joint" => mbma::joint_of(&surface(), &bodies(), v[9]).map(joint),
            "unloaded" => mbma::unloaded_of(&surface(), &bodies(), &peak(), v[10]).map(joint),
            "unloaded_separation" => mbma::unloaded_separation_of(&surface(), &bodies(), &peak(), v[10]).map(|d| vec![d]),
            "joint_separation" => mbma::joint_separation_of(&surface(), &bodies(), v[9]).map(|d| vec![d]),
            _ => mbma::calibrated_separation_of(&surface(), v[5], v[6]).map(|d| vec![d]),
        }.unwrap();
        let numbers: Vec<String> = answer.iter().map(|number| format!("{:e}", number)).collect();
        println!("0 {}", numbers.join(" "));
    }
    assert_eq!(mbma::phi_of(1e9, 1.0), Err(mbma::Status(mbma::MBMA_X_ABOVE)));
    assert_eq!(mbma::Status(mbma::MBMA_X_ABOVE).to_string(), "X is above the range");
}
"""


def run(*command, folder, **more):
    done = subprocess.run(
        [str(word) for word in command],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        **more,
    )
    assert done.returncode == 0, done.stdout[-2000:] + done.stderr[-2000:]
    return done.stdout


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The folder of the source, built, and the prefix where it was installed."""
    folder = tmp_path_factory.mktemp("package")
    source, prefix = folder / "source", folder / "prefix"
    write_code(source)
    run("cmake", "-S", source, "-B", folder / "build", folder=folder)
    run("cmake", "--build", folder / "build", folder=folder)
    run("cmake", "--install", folder / "build", "--prefix", prefix, folder=folder)
    return source, prefix


def points(source):
    """Rows of kind, tolerance, arguments, and pairs of an answer and the scale of its difference."""
    with open(source / POINTS_FILE, encoding="utf-8") as file:
        rows = [row for row in csv.reader(file) if row and row[0] in KINDS]
    for kind, tolerance, given, *numbers in rows:
        first = int(given)
        pairs = [float(number) for number in numbers[first:]]
        yield kind, float(tolerance), numbers[:first], pairs


def assert_replays(output, source):
    """Each line of a program's output has the answers of a point, within its tolerance."""
    rows = list(points(source))
    lines = output.splitlines()
    assert len(lines) == len(rows) > 100
    for line, (kind, tolerance, given, pairs) in zip(lines, rows, strict=True):
        status, *answers = (float(word) for word in line.split())
        assert status == 0
        for answer, wanted, scale in zip(answers, pairs[::2], pairs[1::2], strict=False):
            assert abs(answer - wanted) <= tolerance * scale, (kind, given)


def write_points(folder, source):
    lines = [
        " ".join([kind, str(len(given)), *given]) for kind, _, given, _ in points(source)
    ]
    (folder / "points.txt").write_text("\n".join([*lines, ""]), encoding="utf-8")


def assert_is_the_road(output):
    """The program of `USER` has the contact that the library has."""
    status, force, area = (float(word) for word in output.split())
    road = Surface(0.8, 1.0, 100.0, 1.0, 3.0)
    wanted = contact(road, 13.3, separation=1.5, theory=Mbma(rtol=1e-8))
    assert status == 0
    assert force == pytest.approx(float(wanted.pressure), rel=1e-12)
    assert area == pytest.approx(float(wanted.area), rel=1e-12)


@pytest.mark.slow
@needs("cmake")
def test_cmake_replays_its_points_and_finds_it(installed, tmp_path):
    source, prefix = installed
    run("ctest", folder=source.parent / "build")
    (tmp_path / "CMakeLists.txt").write_text(CONSUMER, encoding="utf-8")
    (tmp_path / "consumer.c").write_text(USER, encoding="utf-8")
    run(
        "cmake",
        "-S",
        ".",
        "-B",
        "build",
        f"-DCMAKE_PREFIX_PATH={prefix}",
        folder=tmp_path,
    )
    run("cmake", "--build", "build", folder=tmp_path)
    assert_is_the_road(run("build/consumer", folder=tmp_path))


@pytest.mark.slow
@needs("cmake", "pkg-config")
def test_pkg_config_finds_it_where_it_was_moved(installed, tmp_path):
    _, prefix = installed
    moved = shutil.copytree(prefix, tmp_path / "moved")
    (described,) = moved.glob("lib*/**/mbma.pc")
    where = os.environ | {"PKG_CONFIG_PATH": str(described.parent)}
    flags = run("pkg-config", "--cflags", "--libs", "mbma", folder=tmp_path, env=where)
    assert str(prefix) not in flags
    (tmp_path / "user.c").write_text(USER, encoding="utf-8")
    run("cc", "user.c", *flags.split(), "-o", "user", folder=tmp_path)
    assert_is_the_road(run("./user", folder=tmp_path))


@pytest.mark.slow
@needs("cmake", "gfortran")
def test_fortran_replays_the_points(installed, tmp_path):
    source, prefix = installed
    (library,) = prefix.glob("lib*/**/libmbma.a")
    write_points(tmp_path, source)
    (tmp_path / "replay.f90").write_text(FORTRAN, encoding="utf-8")
    warnings = ("-Wall", "-Wno-unused-dummy-argument", "-Werror", "-std=f2018")
    files = (source / "mbma_model.f90", "replay.f90", library)
    run("gfortran", *warnings, *files, "-lm", "-o", "replay", folder=tmp_path)
    assert_replays(run("./replay", folder=tmp_path), source)


@pytest.mark.slow
@needs("cmake", "rustc")
def test_rust_replays_the_points(installed, tmp_path):
    source, prefix = installed
    (library,) = prefix.glob("lib*/**/libmbma.a")
    write_points(tmp_path, source)
    (tmp_path / "mbma_model.rs").write_bytes((source / "mbma_model.rs").read_bytes())
    (tmp_path / "replay.rs").write_text(RUST, encoding="utf-8")
    run(
        "rustc",
        "--edition=2021",
        "-L",
        library.parent,
        "replay.rs",
        "-l",
        "m",
        folder=tmp_path,
    )
    assert_replays(run("./replay", folder=tmp_path), source)


def test_each_function_of_the_header_is_in_both_modules(tmp_path):
    write_code(tmp_path)
    texts = {
        path.name: path.read_text(encoding="utf-8") for path in tmp_path.glob("mbma*")
    }
    found = declarations(texts["mbma.h"], texts["mbma_model.h"])
    names = {one.name for one in found.functions}
    # written another way: every name before a parenthesis that the header declares
    head = re.sub(r"/\*.*?\*/", "", texts["mbma_model.h"], flags=re.DOTALL)
    declared = set(re.findall(r"\b(mbma_\w+)\(", head))
    pointers = set(re.findall(r"^const mbma_\w+ \*(mbma_\w+)\(", head, re.MULTILINE))
    assert names == declared - pointers
    for name in names:
        assert f'bind(C, name="{name}")' in texts["mbma_model.f90"]
        assert f"pub fn {name}(" in texts["mbma_model.rs"]
    assert max(map(len, texts["mbma_model.f90"].splitlines())) <= 132
    assert len(found.constants) == 10 + 3
