"""Campaigns: results that do not depend on who computes them, checkpoints that are believed only when sound."""

import concurrent.futures
import os
import pathlib
import signal

import numpy as np
import pytest

from generate.tables.campaign import ATTEMPTS, Campaign, CampaignError, Workers, chunk_key, split

COUNT = 7


def double(x, factor):
    return factor * x


def refuse(x, factor):
    raise AssertionError("computed again what stood ready")


def die_once(x, marker):
    """Ends its own process the first time that anyone meets the marker."""
    try:
        pathlib.Path(marker).unlink()
    except FileNotFoundError:
        return 2 * x
    os.kill(os.getpid(), signal.SIGKILL)
    return x


def die_always(x, marker):
    if x[0] == 0:
        os.kill(os.getpid(), signal.SIGKILL)
    return 2 * x


def chunks():
    return split(10, np.arange(10.0 * COUNT))


def run(campaign, work=double, constant=2.0):
    return np.concatenate(campaign.run("test", "identity", work, chunks(), (constant,)))


class Unsteady:
    """An executor by hand: each submission runs at once, the first few are lost."""

    def __init__(self, losses):
        self.losses = losses
        self.calls = 0

    def submit(self, work, /, *arguments):
        self.calls += 1
        future = concurrent.futures.Future()
        if self.losses > 0:
            self.losses -= 1
            future.set_exception(concurrent.futures.BrokenExecutor("the worker is gone"))
        else:
            future.set_result(work(*arguments))
        return future


def files(folder):
    return sorted(path for path in folder.iterdir())


def test_split_covers_every_entry_once():
    a, b = np.arange(23.0), -np.arange(23.0)
    parts = split(10, a, b)
    assert [part[0].size for part in parts] == [10, 10, 3]
    np.testing.assert_array_equal(np.concatenate([part[0] for part in parts]), a)
    np.testing.assert_array_equal(np.concatenate([part[1] for part in parts]), b)


def test_any_executor_gives_the_same_results():
    expected = 2 * np.arange(10.0 * COUNT)
    np.testing.assert_array_equal(run(Campaign()), expected)
    with concurrent.futures.ThreadPoolExecutor(3) as threads:
        np.testing.assert_array_equal(run(Campaign(threads)), expected)
    np.testing.assert_array_equal(run(Campaign(Unsteady(0))), expected)


def test_lost_chunks_are_given_out_again():
    executor = Unsteady(3)
    np.testing.assert_array_equal(run(Campaign(executor)), 2 * np.arange(10.0 * COUNT))
    assert executor.calls == COUNT + 3


def test_attempts_without_a_finished_chunk_end_the_campaign(tmp_path):
    executor = Unsteady(10**6)
    with pytest.raises(CampaignError, match=f"test: {COUNT} of {COUNT} chunks failed {ATTEMPTS} times; --resume"):
        run(Campaign(executor, tmp_path))
    assert executor.calls == ATTEMPTS * COUNT


def test_a_killed_worker_process_costs_only_its_chunk(tmp_path):
    marker = tmp_path / "marker"
    marker.touch()
    with Workers(2) as workers:
        found = run(Campaign(workers, tmp_path / "kept"), die_once, str(marker))
    assert not marker.exists()
    np.testing.assert_array_equal(found, 2 * np.arange(10.0 * COUNT))


def test_a_chunk_that_kills_every_worker_ends_with_the_others_kept(tmp_path):
    with Workers(1) as workers, pytest.raises(CampaignError, match="chunks failed"):
        run(Campaign(workers, tmp_path), die_always, "")
    assert not list(tmp_path.glob(".chunk-*"))


def test_what_stands_is_not_computed_again_and_a_fresh_run_does_not_believe_it(tmp_path):
    first = run(Campaign(checkpoints=tmp_path))
    assert len(files(tmp_path)) == COUNT
    np.testing.assert_array_equal(run(Campaign(checkpoints=tmp_path), refuse), first)
    with pytest.raises(AssertionError, match="computed again"):
        run(Campaign(checkpoints=tmp_path, resume=False), refuse)


def test_a_fresh_run_knows_its_own_chunks(tmp_path):
    own = Campaign(checkpoints=tmp_path, resume=False)
    first = run(own)
    np.testing.assert_array_equal(run(own, refuse), first)


def test_names_depend_on_identity_and_arguments():
    a, b = np.arange(3.0), np.arange(4.0)
    keys = {chunk_key("x", [a, a]), chunk_key("y", [a, a]), chunk_key("x", [a, b]), chunk_key("x", [a])}
    assert len(keys) == 4
    assert chunk_key("x", [a, a]) == chunk_key("x", [a.copy(), a.copy()])


def truncate(path, other):
    path.write_bytes(path.read_bytes()[:-9])


def empty(path, other):
    path.write_bytes(b"")


def garble(path, other):
    path.write_bytes(b"PK\x03\x04" + os.urandom(300))


def flip(path, other):
    content = bytearray(path.read_bytes())
    content[-1] ^= 1
    path.write_bytes(content)


def swap(path, other):
    path.write_bytes(other.read_bytes())


def reshape(path, other):
    with path.open("wb") as file:
        np.save(file, np.zeros((2, 3)))


@pytest.mark.parametrize("damage", [truncate, empty, garble, flip, swap, reshape])
def test_a_damaged_checkpoint_is_recomputed_and_mended(tmp_path, damage):
    first = run(Campaign(checkpoints=tmp_path))
    before = {path: path.read_bytes() for path in files(tmp_path)}
    victim, other = files(tmp_path)[:2]
    damage(victim, other)
    assert victim.read_bytes() != before[victim]
    np.testing.assert_array_equal(run(Campaign(checkpoints=tmp_path)), first)
    assert {path: path.read_bytes() for path in files(tmp_path)} == before


def test_progress_is_silent_in_a_pipe(capfd):
    run(Campaign())
    out, err = capfd.readouterr()
    assert (out, err) == ("", "")
