"""The impacts that laws are judged by: the reference is asked for each but once."""

from __future__ import annotations

from functools import cache

from validation import impacts


def test_the_reference_is_asked_once(monkeypatch):
    calls = []
    monkeypatch.setattr(impacts, "_KEPT", cache(lambda *one, annuli: calls.append(one) or (one[0], 0.0)))
    for _ in range(2):
        found = impacts.judge([(0.5, 1.0, 1.0), (0.5, 1.0, 1.0), (0.6, 1.0, 1.0)], annuli=8)
    assert calls == [(0.5, 1.0, 1.0), (0.6, 1.0, 1.0)]
    assert found.psi_2.tolist() == [0.5, 0.5, 0.6]
