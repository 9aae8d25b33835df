"""What substeps of one contact read and do: those that are timed, and the terms that a damper alone has."""

from __future__ import annotations

import math

import numpy as np
import pytest

from contactlaw import LAWS, ContactPair
from contactlaw.laws import hertz
from contactlaw.laws.record import pair_of
from contactlaw.laws.step import reset
from validation.substeps import FRICTION, impacts_of


def test_elastic_contact_does_not_read_the_closing_speed() -> None:
    """NaN as speed reaches the damped force, and no other."""

    def force(restitution: float, closing: float) -> float:
        pair = ContactPair("steel", "steel", FRICTION, restitution, radius=0.0254)
        contact = pair.law.with_nodes(None).new_contact()[0][0]
        reset(contact, pair_of(pair.parameters()), 0.0254)
        contact.overlap, contact.mass, contact.stiffness, contact.closing = 1e-6, 1.0, 1e10, closing
        return hertz.normal_force(contact, pair_of(pair.parameters()), 1e-7)[0]

    assert force(1.0, math.nan) == force(1.0, 0.1) > 0.0
    assert math.isnan(force(0.93, math.nan)) and force(0.93, 0.1) > force(1.0, 0.1)


@pytest.mark.parametrize("law", LAWS)
def test_the_substeps_that_are_timed_are_those_of_an_impact_that_swings_back(law: str) -> None:
    normal, pull = impacts_of(law, impacts=2)().T
    once = impacts_of(law, impacts=1)()[:, 1]
    np.testing.assert_array_equal(pull, once)
    assert np.abs(pull).max() > 1.0 and pull.min() < 0.0 < pull.max()
    assert (np.abs(pull) <= FRICTION * normal * (1.0 + 1e-12)).all()
