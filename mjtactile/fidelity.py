"""Fidelity by name: what a reading may cost, and how far it may be off.

A preset bundles the choices that trade speed for accuracy: the mesh, how its influence matrices are stored, and how
the contact pressure is found. The contact law and its cells are free to change later; the rest decides which table is
built.
"""

from __future__ import annotations

from dataclasses import dataclass

from mjtactile.contact.laws import BY_NAME
from mjtactile.errors import PresetError
from mjtactile.fem.mesh import MESHES, MeshDensity, mesh_density

#: Storage precisions of the stress matrices, coarse to fine.
PRECISIONS = ("int8", "float16", "float32", "float64")
#: What a reading is: the mean over a taxel's sample points of the von Mises stress, or the von Mises stress of their
#: mean stress, in all layers ("mean") or in all but the shallowest ("deep"), where stress varies slowly.
AVERAGINGS = ("points", "deep", "mean")
#: Where a load may act: on all nodes of the surface, or on the elements' corners only.
LOADS = ("nodes", "corners")
#: Contact laws a preset may name.
CONTACT_LAWS = tuple(BY_NAME)


@dataclass(frozen=True, kw_only=True)
class Fidelity:
    """Choices that trade speed for accuracy; the defaults are those of a plain mesh.

    Raises:
        PresetError: for a choice that does not exist.
        MeshError: for a mesh that does not exist.
    """

    mesh: str | MeshDensity = "default"  #: name of a mesh, or a density
    precision: str = "float32"  #: storage of the stress matrices: "int8", "float16", "float32" or "float64"
    reduction: float = 0.0  #: relative error of a layer's readings given away for speed [-], 0 for none; reduction.py
    averaging: str = "points"  #: "points", "deep" or "mean": norms first or the mean first; averaging.py
    loads: str = "nodes"  #: "nodes", or "corners": nodal forces spread onto elements' corners first; corners.py
    law: str = "uniform"  #: contact law: "uniform", "foundation" or "elastic"
    cells: int = 400  #: contact cells the elastic law aims at

    def __post_init__(self) -> None:
        """Refuse what does not exist."""
        mesh_density(self.mesh)
        if self.precision not in PRECISIONS:
            raise PresetError(f"precision {self.precision!r} does not exist. Available: {', '.join(PRECISIONS)}.")
        if self.averaging not in AVERAGINGS:
            raise PresetError(f"averaging {self.averaging!r} does not exist. Available: {', '.join(AVERAGINGS)}.")
        if self.loads not in LOADS:
            raise PresetError(f"loads {self.loads!r} does not exist. Available: {', '.join(LOADS)}.")
        if not (isinstance(self.reduction, float | int) and 0.0 <= self.reduction < 1.0):
            raise PresetError(
                f"reduction = {self.reduction!r}; expected a relative error from 0 (none) to below 1, such as 0.003."
            )
        if self.law not in CONTACT_LAWS:
            raise PresetError(f"contact law {self.law!r} does not exist. Available: {', '.join(CONTACT_LAWS)}.")
        if not (isinstance(self.cells, int) and self.cells >= 1):
            raise PresetError(f"cells = {self.cells!r}; expected a whole number of contact cells, such as 400.")

    @property
    def density(self) -> MeshDensity:
        """The density of the mesh."""
        return mesh_density(self.mesh)


#: Named fidelities, fast to accurate.
PRESETS: dict[str, Fidelity] = {
    "fast": Fidelity(mesh="draft", precision="int8", reduction=0.03, averaging="mean", law="elastic", cells=20),
    "balanced": Fidelity(
        mesh="default",
        precision="float16",
        reduction=0.01,
        averaging="deep",
        loads="corners",
        law="elastic",
        cells=60,
    ),
    "precise": Fidelity(mesh="default", precision="float32", reduction=0.003, law="elastic", cells=200),
    "accurate": Fidelity(mesh="fine", precision="float32", reduction=0.0, law="elastic", cells=800),
}


def fidelity(preset: str | Fidelity) -> Fidelity:
    """The fidelity behind a preset's name; a Fidelity stands for itself.

    Raises:
        PresetError: when no preset has that name; the message lists those that exist.
    """
    if isinstance(preset, Fidelity):
        return preset
    if preset not in PRESETS:
        raise PresetError(f"preset {preset!r} does not exist. Available: {', '.join(PRESETS)}; or pass a Fidelity.")
    return PRESETS[preset]


def mesh_or_preset(mesh: str | MeshDensity | None, preset: str | Fidelity | None) -> Fidelity:
    """The fidelity that a caller's `mesh` and `preset` ask for; mesh "default" where there is neither.

    Raises:
        PresetError: when both are given, or the preset does not exist.
        MeshError: when the mesh does not exist.
    """
    if preset is None:
        return Fidelity(mesh="default" if mesh is None else mesh)
    if mesh is not None:
        raise PresetError(
            f"preset {preset!r} brings its own mesh, {fidelity(preset).mesh!r}, but mesh = {mesh!r} was given too. "
            "Drop mesh=, or change it in the preset: dataclasses.replace(PRESETS[name], mesh=...)."
        )
    return fidelity(preset)


def mesh_name(density: MeshDensity) -> str | None:
    """Name of a mesh; None when it has none."""
    return next((name for name, named in MESHES.items() if named == density), None)
