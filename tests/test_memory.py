"""Memory is kept for later arrays, only when nothing refers to it, and never more than so much."""

import gc
import subprocess
import sys
import threading

import numpy as np
import pytest

import tetsimplify
from tests import meshes
from tetsimplify import memory

N = memory.LARGE  # so many float64 are large


@pytest.fixture(autouse=True)
def nothing_kept():
    memory.hand_back_memory()
    yield
    memory.hand_back_memory()


def ball():
    """A volume with a sphere in it."""
    x, y, z = np.mgrid[-1:1:24j, -1:1:24j, -1:1:24j]
    return 0.6 - np.sqrt(x * x + y * y + z * z)


def kept():
    """Bytes that are kept."""
    return sum(size * len(blocks) for size, blocks in memory._kept.items())


needs_lazy_freeing = pytest.mark.skipif(not memory.CAN_KEEP, reason="the system takes all at once")


@pytest.mark.parametrize("shape", [5, (N,), (3, N), (N, 8), (0, 3)])
@pytest.mark.parametrize("dtype", [np.float64, np.int32, np.uint8])
def test_empty_is_as_that_of_numpy(shape, dtype):
    found, expected = memory.empty(shape, dtype), np.empty(shape, dtype)
    assert (found.shape, found.dtype) == (expected.shape, expected.dtype)
    assert found.flags.c_contiguous and found.flags.aligned and found.flags.writeable
    found[:] = 1
    assert found.sum(dtype=np.int64) == found.size


def test_full_is_filled_though_the_memory_was_used_before():
    memory.empty(N).fill(3.0)
    assert (memory.full(N, 0, np.float64) == 0.0).all()


def test_lines_of_a_cache_begin_at_its_lines():
    for n in (1, 3, 1000, N):
        lines = memory.cache_lines(n)
        assert lines.shape == (n, 8)
        assert lines.ctypes.data % memory.LINE == 0


@needs_lazy_freeing
def test_memory_is_used_again():
    array = memory.empty(N)
    where = array.ctypes.data
    del array
    assert kept() >= 8 * N
    again = memory.empty(N - 10)
    assert again.ctypes.data == where
    assert kept() == 0
    assert again.size == N - 10


@needs_lazy_freeing
def test_memory_is_kept_only_when_no_view_refers_to_it():
    array = memory.empty((N, 4))
    part = array[:, 1:3].view(np.int64)[7:]
    part[:] = 5
    del array
    gc.collect()
    assert kept() == 0
    other = memory.empty((N, 4))
    other.fill(0.0)
    assert (part == 5).all()
    del part
    assert kept() > 0


@needs_lazy_freeing
def test_small_arrays_do_not_take_large_blocks():
    memory.empty(8 * N)
    assert kept() > 0
    before = kept()
    small = memory.empty(N)
    assert kept() == before
    assert small.size == N


@needs_lazy_freeing
def test_no_more_is_kept_than_so_much(monkeypatch):
    monkeypatch.setattr(memory, "MOST_KEPT", 20 * N)
    arrays = [memory.empty(N) for _ in range(5)]
    arrays.clear()
    assert 8 * N <= kept() <= 20 * N


@needs_lazy_freeing
def test_memory_is_handed_back():
    memory.empty(N)
    assert kept() > 0
    memory.hand_back_memory()
    assert kept() == 0


@needs_lazy_freeing
def test_nothing_is_kept_where_memory_is_dear():
    memory.empty(N)
    outer = memory.empty(N + 1)
    with memory.nothing_kept():
        assert kept() == 0
        memory.empty(N)
        with memory.nothing_kept():
            del outer
        memory.empty(N)
        assert kept() == 0
    memory.empty(N)
    assert kept() > 0


@needs_lazy_freeing
def test_streams_keep_nothing(monkeypatch):
    monkeypatch.setattr(memory, "LARGE", 1)
    tetsimplify.extract_and_simplify(ball(), 0.0, max_edge_length=0.5, threads=2)
    assert kept() == 0
    tetsimplify.simplify(*tetsimplify.extract_isosurface(ball(), 0.0), max_edge_length=0.5)
    assert kept() > 0


def test_no_two_arrays_of_several_threads_share_memory():
    wrong = []

    def work(number):
        for k in range(200):
            array = memory.full(N // 4 + k, number, np.int64)
            if (array != number).any():
                wrong.append(number)

    threads = [threading.Thread(target=work, args=(i,)) for i in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong


def test_results_stay_as_they_are_when_memory_is_used_again():
    """Arrays of a result are never those that a later run works on."""
    first = meshes.icosphere(6)
    results = [tetsimplify.simplify(*first, keep_ratio=0.5) for _ in range(2)]
    results += [tetsimplify.simplify(*first, max_edge_length=0.01) for _ in range(2)]
    before = [[array.copy() for array in result[:4]] for result in results]
    for _ in range(3):
        tetsimplify.simplify(*meshes.icosphere(6), keep_ratio=0.3)
        tetsimplify.simplify(*meshes.icosphere(6), max_edge_length=0.05)
    for result, arrays in zip(results, before, strict=True):
        for found, expected in zip(result[:4], arrays, strict=True):
            assert np.array_equal(found, expected)


CHILD = """
import os, sys, numpy as np
from tetsimplify import memory
memory.full({n}, 1, np.float64)
array = memory.full({n}, 2, np.float64)
child = os.fork()
if child == 0:
    ok = (array == 2).all()
    array.fill(3)
    memory.full({n}, 4, np.float64)
    os._exit(0 if ok else 1)
assert os.waitpid(child, 0)[1] == 0
mine = memory.full({n}, 5, np.float64)
assert (array == 2).all() and (mine == 5).all()
print("good")
"""


@pytest.mark.skipif(not hasattr(memory.mmap, "MAP_PRIVATE"), reason="no fork")
def test_a_forked_process_has_memory_of_its_own():
    code = CHILD.format(n=N)
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert run.stdout.strip() == "good", run.stderr


def test_sparse_zeros_are_zeros_that_can_be_written():
    for shape in ((3, 4), (2, N)):
        array = memory.sparse_zeros(*shape)
        assert array.shape == shape and not array.any()
        array[:] = 7
        assert (array == 7).all()
        assert not memory.sparse_zeros(*shape).any()
