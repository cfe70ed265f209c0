"""Write the models and scenes of this repository: python models/generate.py."""

from pathlib import Path

from mjtactile.experiments.grasp.scene import GraspObject, grasp_mjcf
from mjtactile.experiments.hands.gripper import GRIPPER
from mjtactile.experiments.hands.hand import HAND
from mjtactile.geometry.indenter import box, cylinder, punch, sphere
from mjtactile.geometry.outlines import INDENTER_NAMES
from mjtactile.sim.mjcf import indenter_mjcf, pad_mjcf, press_mjcf

ROOT = Path(__file__).resolve().parent.parent


def files() -> dict[str, str]:
    """Text of every generated file, by its path from the repository's root."""
    indenters = [
        *map(punch, INDENTER_NAMES),
        sphere(6e-3),
        cylinder(3e-3, 8e-3, "x"),
        box((6e-3, 4e-3, 5e-3)),
    ]
    return {
        "models/xml/pad.xml": pad_mjcf(),
        **{f"models/xml/{indenter.name}.xml": indenter_mjcf(indenter) for indenter in indenters},
        "models/xml/gripper.xml": GRIPPER.mjcf(),
        "models/xml/hand.xml": HAND.mjcf(),
        "scenes/grasp.xml": grasp_mjcf(GraspObject(), wrist="xyz"),
        "scenes/hand.xml": grasp_mjcf(GraspObject(shape="cylinder", size=(0.04, 0.04, 0.09)), hand="hand"),
        "scenes/press.xml": press_mjcf(punch("star")),
        "scenes/press_free.xml": press_mjcf(punch("star"), tilt_free=True),
    }


if __name__ == "__main__":
    for name, text in files().items():
        (ROOT / name).write_text(text)
        print(name)
