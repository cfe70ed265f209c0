"""Law "uniform" with a bound on friction: what shear it holds, and what it says of the rest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from shapely import box

from mjtactile.contact.contact_load import contact_load
from mjtactile.contact.footprint import Footprint
from mjtactile.errors import ContactError, ContactWarning
from mjtactile.fidelity import Fidelity
from mjtactile.influence.cache import influence_matrices

INFLUENCE = influence_matrices(fidelity=Fidelity(mesh="draft"), progress=False)
SQUARE = Footprint.from_outline(box(-3e-3, -3e-3, 3e-3, 3e-3), INFLUENCE.surface)


def test_shear_within_the_limit_is_carried():
    load = contact_load(INFLUENCE, SQUARE, (0.03, -0.02, -0.1), friction=0.5)
    np.testing.assert_allclose(load.resultant()[0], [0.03, -0.02, -0.1], atol=1e-13)


@pytest.mark.parametrize("friction", [0.0, 0.2, 0.8])
def test_shear_beyond_the_limit_slips(friction):
    with pytest.warns(ContactWarning, match=rf"it slips: friction {friction} cannot carry"):
        load = contact_load(INFLUENCE, SQUARE, (0.3, 0.4, -0.1), friction=friction)
    got = load.resultant()[0]
    np.testing.assert_allclose(got, 0.1 * friction * np.array([0.6, 0.8, 0]) + [0, 0, -0.1], atol=1e-7)
    np.testing.assert_allclose(load.residual_force, np.array([0.3, 0.4, -0.1]) - got, atol=1e-12)


def test_torsion_beyond_the_limit_slips():
    """A square of side s under uniform pressure holds mu P s (sqrt 2 + asinh 1) / 6."""
    with pytest.warns(ContactWarning, match="it slips"):
        load = contact_load(INFLUENCE, SQUARE, (0, 0, -0.1), moment=(0.0, 0.0, 1e-3), friction=0.5)
    limit = 0.5 * 0.1 * 6e-3 * (math.sqrt(2) + math.asinh(1.0)) / 6
    assert load.resultant()[1][2] == pytest.approx(limit, rel=0.03)  # of nodal forces


def test_load_says_what_the_law_knows():
    load = contact_load(INFLUENCE, SQUARE, (0.0, 0.0, -0.1))
    assert load.contact_area == pytest.approx(36e-6)
    assert load.peak_pressure == pytest.approx(0.1 / 36e-6)
    assert math.isnan(load.indentation)
    assert all(math.isnan(tilt) for tilt in load.tilts)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"tangential": "glue"}, r"tangential 'glue' does not exist\. Available: proportional, stick, coulomb\."),
        ({"tilt": "half"}, r"tilt 'half' does not exist\. Available: free, fixed\."),
        ({"tangential": "stick"}, r"tangential='stick' needs law='elastic'"),
        ({"law": "foundation", "tangential": "coulomb", "friction": 0.5}, r"'coulomb' needs law='elastic'"),
        ({"law": "elastic", "tangential": "coulomb"}, r"'coulomb' needs a coefficient: pass friction="),
        ({"friction": -0.1}, r"friction = -0\.1; expected a coefficient that is not negative"),
        ({"friction": math.nan}, "friction = nan; expected a coefficient"),
        ({"cells": 0}, "cells = 0; expected a whole number"),
        ({"cells": 2.5}, "cells = 2.5; expected a whole number"),
        ({"cells": True}, "cells = True; expected a whole number"),
    ],
    ids=str,
)
def test_options_that_make_no_sense_are_refused_with_the_cure(options, message):
    with pytest.raises(ContactError, match=message):
        contact_load(INFLUENCE, SQUARE, (0.0, 0.0, -0.1), **options)
