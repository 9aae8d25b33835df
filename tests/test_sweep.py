"""A sweep: order, errors and progress are the same wherever it runs."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from multiprocessing import get_context

import numpy as np
import pytest

from validation import impacts
from validation.sweep import sweep

INPUTS = list(range(23))


def square(number: int) -> int:
    return number * number


def refuse(number: int, bad: int) -> int:
    if number == bad:
        raise ValueError(f"number = {number}: must not be {bad}")
    return number


@pytest.fixture(scope="module")
def processes():
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as pool:
        yield pool


@pytest.fixture(scope="module")
def dask():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client.get_executor()


@pytest.fixture(params=["here", "threads", "processes", "dask"])
def executor(request):
    if request.param == "here":
        yield None
    elif request.param == "threads":
        with ThreadPoolExecutor(3) as pool:
            yield pool
    else:
        yield request.getfixturevalue(request.param)


@pytest.mark.parametrize("chunk", [1, 4, 100])
def test_answers_keep_the_order_of_the_inputs(executor, chunk):
    told = []
    assert sweep(square, INPUTS, executor, chunk=chunk, progress=told.append) == [n * n for n in INPUTS]
    assert told == sorted(told) and told[-1] == 1.0 and len(told) == -(-len(INPUTS) // chunk)


def test_no_inputs_no_answers(executor):
    told = []
    assert sweep(square, [], executor, progress=told.append) == []
    assert told == [1.0]


@pytest.mark.parametrize("chunk", [1, 5])
def test_an_error_names_its_input(executor, chunk):
    with pytest.raises(ValueError, match="must not be 17") as caught:
        sweep(partial(refuse, bad=17), INPUTS, executor, chunk=chunk)
    assert any("input 17: 17" in note for note in getattr(caught.value, "__notes__", []))


@pytest.mark.parametrize("chunk", [0, -1, 1.5, True])
def test_a_chunk_below_one_is_refused(chunk):
    with pytest.raises(ValueError, match="chunk = "):
        sweep(square, INPUTS, chunk=chunk)


def test_the_reference_answers_the_same_on_an_executor(processes, monkeypatch):
    asked = [(0.5, 1.0, 1.0), (1.5, 1.0, 0.9), (0.5, 1.0, 1.0)]
    told = []
    monkeypatch.setattr(impacts, "_KNOWN", {})
    there = impacts.judge(asked, annuli=8, progress=told.append, executor=processes)
    assert told[-1] == 1.0
    monkeypatch.setattr(impacts, "_KNOWN", {})
    here = impacts.judge(asked, annuli=8)
    assert np.array_equal(here.psi_2, there.psi_2) and np.array_equal(here.uncertainty, there.uncertainty)
    assert here.psi_2[0] == here.psi_2[2] != here.psi_2[1]


def test_the_reference_is_asked_once(monkeypatch):
    monkeypatch.setattr(impacts, "_KNOWN", {})
    calls = []
    monkeypatch.setattr(impacts, "rebound_extrapolated", lambda *one, annuli: calls.append(one) or (0.0, 0.0))
    for _ in range(2):
        impacts.judge([(0.5, 1.0, 1.0), (0.5, 1.0, 1.0), (0.6, 1.0, 1.0)], annuli=8)
    assert calls == [(0.5, 1.0, 1.0), (0.6, 1.0, 1.0)]
