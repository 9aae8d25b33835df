"""The same function over many inputs, here or on any executor that has `submit` of concurrent.futures: a process pool,
or a cluster, `dask.distributed.Client("scheduler:8786").get_executor()`.

Function and inputs are then pickled: the function must stand at the top of a module (or be a `functools.partial` of one
that does), and that module must be importable where it runs.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import Executor, Future, as_completed
from typing import TypeVar

Input = TypeVar("Input")
Answer = TypeVar("Answer")


def sweep(
    function: Callable[[Input], Answer],
    inputs: Sequence[Input],
    executor: Executor | None = None,
    *,
    chunk: int = 1,
    progress: Callable[[float], None] | None = None,
) -> list[Answer]:
    """Call a function once for each input.

    Args:
        function: Takes one input.
        inputs: What it is called with, shape (n,).
        executor: Where it is called; None: here, one after the other.
        chunk: Inputs sent together; more than one where a call takes no longer than sending does (about 1 ms).
        progress: Told the part done, 0 to 1, as the chunks come in.

    Returns:
        The answers in the order of the inputs, however the calls were shared out.

    Raises:
        ValueError: `chunk` is no integer >= 1.
        Exception: What the function raised, with a note that names the input. What has not begun is then cancelled.
    """
    if isinstance(chunk, bool) or not isinstance(chunk, int) or chunk < 1:
        raise ValueError(f"chunk = {chunk!r}: must be an integer >= 1")
    if not inputs and progress:
        progress(1.0)
    parts = [inputs[start : start + chunk] for start in range(0, len(inputs), chunk)]
    if executor is None:
        return _here(function, parts, len(inputs), progress)
    futures: list[Future[list[Answer]]] = []
    try:
        futures += (executor.submit(_chunk, function, part, number * chunk) for number, part in enumerate(parts))
        sizes = {future: len(part) for future, part in zip(futures, parts, strict=True)}
        done = 0
        for future in as_completed(futures):
            future.result()
            done += sizes[future]
            if progress:
                progress(done / len(inputs))
    except BaseException:
        for future in futures:
            future.cancel()
        raise
    return [answer for future in futures for answer in future.result()]


def _here(
    function: Callable[[Input], Answer],
    parts: list[Sequence[Input]],
    total: int,
    progress: Callable[[float], None] | None,
) -> list[Answer]:
    answers: list[Answer] = []
    for part in parts:
        answers += _chunk(function, part, len(answers))
        if progress:
            progress(len(answers) / total)
    return answers


def _chunk(function: Callable[[Input], Answer], inputs: Sequence[Input], first: int) -> list[Answer]:
    """The answers to a few inputs, of which the first has this number."""
    answers = []
    for number, one in enumerate(inputs, start=first):
        try:
            answers.append(function(one))
        except Exception as error:
            error.add_note(f"in the sweep's input {number}: {one!r}")
            raise
    return answers
