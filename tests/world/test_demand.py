"""What is compiled on demand is asked for by compiled code, which can hand no exception on."""

from __future__ import annotations

import signal
import threading
import time

import pytest

from contactlaw.world import demand


def test_an_interrupt_while_something_is_compiled_waits_until_it_is_there(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without an address the step would jump to none and end the process."""

    def interrupted(what: int) -> int:
        signal.raise_signal(signal.SIGINT)
        return 40 + what

    monkeypatch.setattr(demand, "supply", interrupted)
    before = signal.getsignal(signal.SIGINT)
    assert demand._supply(2) == 42
    with pytest.raises(KeyboardInterrupt):
        time.sleep(5.0)
    assert signal.getsignal(signal.SIGINT) is before


def test_other_threads_leave_signals_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    found: list[int] = []
    monkeypatch.setattr(demand, "supply", lambda what: 40 + what)
    thread = threading.Thread(target=lambda: found.append(demand._supply(1)))
    thread.start()
    thread.join()
    assert found == [41]
