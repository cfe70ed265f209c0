"""Random bodies of tests/soak/bodies.py that were read wrongly once, and that the tool itself works."""

import bodies
import pytest

# The narrow pad is wide for its thickness.
pytestmark = pytest.mark.filterwarnings("ignore::mjtactile.MeshWarning")


@pytest.mark.parametrize(
    ("kind", "seed", "pad", "cells"),
    [
        # Rings of a mesh whose facets make a level bottom of a quarter of a millimetre, under 14 to 45 mN.
        ("ring", 107, "small", 1600),
        ("ring", 151, "narrow", 1600),
        # A ring over the rim of the pad, where its ridge goes on beyond the last line of the search's grid.
        ("ring", 3202, "narrow", 2500),
        # Boxes on a sharp edge, of which the search's grid sees a tenth, under 11 and 18 mN.
        ("edge", 254, "small", 2500),
        ("edge", 101, "small", 2500),
        # Such edges of which it sees a quarter and more, under 12 mN.
        ("edge", 3012, "small", 2500),
        ("edge", 3022, "default", 2500),
        # Feet of which one stands beside the pad, but presses on its rim.
        ("feet", 3004, "small", 1600),
        # Rods of which each had cells as many across as along.
        ("rods", 3014, "small", 2500),
        ("rods", 3015, "default", 2500),
        # Steps of microns, whose rims press the most.
        ("step", 3202, "default", 2500),
        ("step", 3207, "small", 2500),
    ],
)
@pytest.mark.parametrize(("fidelity", "bound"), [("fast", 0.06), ("balanced", 0.04)])
def test_narrow_contacts_are_read_as_by_the_dense_contact(kind, seed, pad, cells, fidelity, bound):
    case = bodies.case_of(seed, kind, pad)
    found = bodies.look_at(case, f"{kind} {seed} {pad}", fidelity, cells=cells, farthest=float("inf"))
    assert found.error is not None
    assert found.error <= bound


@pytest.mark.parametrize(("fidelity", "bound"), [("fast", 0.12), ("balanced", 0.04)])
def test_a_height_field_is_read_though_cells_that_overlook_a_part_cannot_be_split(fidelity, bound):
    found = bodies.look_at(bodies.case_of(4020, "terrain", "default"), "", fidelity, cells=1600, farthest=float("inf"))
    assert found.error is not None
    assert found.error <= bound


@pytest.mark.parametrize(
    ("kind", "seed", "pad"), [("ring", 148, "narrow"), ("ring", 254, "small"), ("ring", 249, "default")]
)
def test_narrow_contacts_slide_smoothly(kind, seed, pad):
    """A ring over the pad's rim, and rings whose cells a line of the lattice just meets."""
    case = bodies.case_of(seed, kind, pad)
    found = bodies.look_at(case, f"{kind} {seed} {pad}", "balanced", cells=0)
    assert found.change is not None
    assert 0.0 < found.change <= 0.01


def test_the_tool_reads_bodies_and_sums_them_up(capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["bodies.py", "--count", "1", "--kinds", "feet,frame", "--no-dense"])
    assert bodies.main() == 0
    printed = capsys.readouterr().out
    assert "feet 0 default" in printed
    assert "frame 0 narrow" in printed
    assert "fast, slide: 2 bodies" in printed or "fast, slide: 1 bodies" in printed
