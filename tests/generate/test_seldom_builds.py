"""`python -m generate` and what builds behind it, on the ways that a run seldom takes."""

from __future__ import annotations

import concurrent.futures
import contextlib
import dataclasses
import sys
import types

import click
import numpy as np
import pytest
from click.testing import CliRunner
from small_builds import KINDS, small

from generate.__main__ import main
from generate.pages import fidelity
from generate.pages.comparisons import REFERENCES
from generate.tables import build as build_module
from generate.tables import campaign as campaign_module
from generate.tables import commands as command
from generate.tables import island4d
from generate.tables.build import UncertifiedError, build
from generate.tables.campaign import Campaign, CampaignError, Workers, split
from generate.tables.configuration import load
from mbma_tables import InputError


def test_without_dask_there_are_plain_processes(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with command.engine(2, None, False) as executor:
        assert isinstance(executor, Workers)
        assert executor.count == 2
    with (
        pytest.raises(InputError, match="--scheduler needs dask"),
        command.engine(2, "tcp://127.0.0.1:1", False),
    ):
        pytest.fail("entered")
    with command.engine(1, None, False) as executor:
        assert executor is None


@pytest.fixture
def dask(monkeypatch):
    """In place of dask: a cluster and a client that note how they end."""
    closed = []

    class Client:
        def __init__(self, where):
            self.where = where

        def __enter__(self):
            return self

        def __exit__(self, *_):
            closed.append("client")

        def get_executor(self):
            return f"executor of {self.where}"

    @contextlib.contextmanager
    def cluster(**options):
        assert options == {"n_workers": 3, "threads_per_worker": 1, "dashboard_address": None}
        yield "cluster"
        closed.append("cluster")

    fake = types.SimpleNamespace(LocalCluster=cluster, Client=Client, KilledWorker=KeyError)
    monkeypatch.setitem(sys.modules, "distributed", fake)
    return closed


def test_a_cluster_is_closed(dask):
    with command.engine(3, None, False) as executor:
        assert executor == "executor of cluster"
    assert dask == ["client", "cluster"]


@pytest.mark.parametrize("fault", [KeyError("a chunk"), ImportError("no module"), RuntimeError("lost")])
def test_what_dask_loses_can_be_resumed(dask, fault):
    def lose():
        with command.engine(3, "tcp://there", False) as executor:
            assert executor == "executor of tcp://there"
            raise fault

    with pytest.raises(CampaignError, match="--resume goes on"):
        lose()
    assert dask == ["client"]


def test_a_campaigns_own_fault_stays_as_it_is(dask):
    with pytest.raises(CampaignError, match=r"^the disk is full$"), command.engine(3, None, False):
        raise CampaignError("the disk is full")


@pytest.mark.parametrize(("what", "tables"), [("heights", []), ("all", ["universal", "island4d"])])
def test_what_is_made_and_where(what, tables, monkeypatch, tmp_path):
    made = []
    monkeypatch.setattr(command.height_coefficients, "main", lambda: made.append("heights"))
    monkeypatch.setattr(command, "make_table", lambda c, path, *_: made.append((c.kind, path.name)))
    done = CliRunner().invoke(main, ["tables", what, "--out", str(tmp_path / "here"), "--workers", "1"])
    assert done.exit_code == 0
    assert made == ["heights", *((kind, f"{kind}.nc") for kind in tables)]


@pytest.mark.parametrize("option", ["--config", "--target"])
def test_options_of_one_table(option):
    done = CliRunner().invoke(main, ["tables", "all", option, "1"])
    assert done.exit_code == 2
    assert done.output == "generate: --config and --target belong to one table\n"


def test_an_interrupted_run_says_how_to_go_on(monkeypatch, tmp_path):
    def interrupted(*_):
        raise click.Abort

    monkeypatch.setattr(command, "make_table", interrupted)
    done = CliRunner().invoke(main, ["tables", "universal", "--out", str(tmp_path / "a.nc"), "--workers", "1"])
    assert done.exit_code == 1
    assert done.output == "generate: interrupted; --resume continues from the chunks that are done\n"


@pytest.fixture
def universal(tmp_path):
    configuration = load("universal", small(tmp_path, "universal"))
    return KINDS["universal"](configuration), configuration


def test_a_target_out_of_reach_ends_the_refinement(universal, monkeypatch):
    kind, configuration = universal
    aims = []
    monkeypatch.setattr(build_module, "ROUNDS", 2)
    resolve = build_module.resolve
    monkeypatch.setattr(build_module, "resolve", lambda *given: aims.append(given[3]) or resolve(*given))
    certificate = {"largest_error_F": 2 * configuration.target, "largest_error_A": 0.0}
    monkeypatch.setattr(build_module, "certify", lambda *_: certificate)
    with pytest.raises(UncertifiedError, match=r"is still 2\.00e-04 after 2 refinements, the target 1\.00e-04"):
        build(kind, configuration, Campaign())
    # twice too much asks for less than half
    assert aims[1] == pytest.approx(0.4 * aims[0], rel=1e-12, abs=0)


def test_a_table_that_is_not_finite_is_not_written(universal, monkeypatch):
    monkeypatch.setattr(build_module, "is_finite_content", lambda content: False)
    with pytest.raises(UncertifiedError, match="not finite"):
        build(*universal, Campaign())


def test_axes_that_no_surface_visits(tmp_path, monkeypatch):
    monkeypatch.setattr(island4d, "RAREST", 8)
    kind = KINDS["island4d"](load("island4d", small(tmp_path, "island4d")))
    monkeypatch.setattr(kind, "_visited", lambda draw: ([np.zeros(draw)] * 4, np.zeros(draw, dtype=bool)))
    with pytest.raises(UncertifiedError, match="hardly a surface visits these axes"):
        kind.manifold(10)


def test_the_first_process_follows_nobody():
    campaign_module._follow_parent()
    # a child would end here with code 1
    assert campaign_module.multiprocessing.parent_process() is None


class Broken:
    """An executor that takes two chunks and then none, until it is asked again."""

    def __init__(self):
        self.asked = 0

    def submit(self, work, /, *arguments):
        self.asked += 1
        if self.asked == 3:
            raise concurrent.futures.BrokenExecutor("a worker died")
        future = concurrent.futures.Future()
        future.set_result(work(*arguments))
        return future


def test_chunks_that_were_not_taken_are_given_out_again():
    executor = Broken()
    chunks = split(10, np.arange(40.0))
    found = Campaign(executor).run("test", "identity", np.multiply, chunks, (2.0,))
    assert np.concatenate(found).tolist() == (2 * np.arange(40.0)).tolist()
    # two, one that failed, and the two that were left
    assert executor.asked == 5


@pytest.mark.slow
def test_a_band_of_areas_without_data_has_no_span():
    reference = dataclasses.replace(REFERENCES["challenge"], band=(1e-9, 2e-9))
    for own, dashes in ((reference, True), (REFERENCES["challenge"], False)):
        assert ("| — | — | — | — |" in fidelity.reference_tables(own)) == dashes
