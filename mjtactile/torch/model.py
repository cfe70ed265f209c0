"""The influence matrices of a pad as a PyTorch module."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import torch
from torch import Tensor, nn

from mjtactile.contact.footprint import Footprint
from mjtactile.contact.uniform import uniform_basis
from mjtactile.errors import InfluenceError, StaleInfluenceError, of_type, shortened
from mjtactile.fem.tractions import cell_integrals
from mjtactile.fidelity import Fidelity, mesh_name
from mjtactile.influence.forces import nodal_batch
from mjtactile.influence.matrices import InfluenceMatrices
from mjtactile.influence.surface_load import SurfaceLoad
from mjtactile.pad import Pad, require_flat
from mjtactile.pad_shape.taxels import FreeTaxels
from mjtactile.torch.arguments import existing_layers, floating, matrices_of
from mjtactile.torch.symmetry import Folded, LayerStress, as_buffer, element_integrals

#: For error messages: why there is no wrench basis on a curved pad, and what to use instead.
_NOT_LINEAR = (
    "On a curved pad a load is not linear in its wrench: make each with contact_load, and its tensor with "
    "nodal_forces(load)."
)


class PadOutput(NamedTuple):
    """Readings and stress tensors of a pad under a batch of loads."""

    readings: Tensor  #: von Mises stress (..., layers, rows, columns) or (..., taxels) [Pa]
    stress: Tensor  #: mean stress tensor of every taxel, xx, yy, zz, xy, yz, zx: (..., 6, *reading_shape) [Pa]


class PadModel(nn.Module):
    """Readings of surface loads as in `InfluenceMatrices`, for batches of loads and with gradients.

    Pads may be flat or curved, with taxels on a grid or free. Shapes (layers, rows, columns) are (taxels,) for free
    taxels.

    The module has no parameters. Its matrices are buffers that move with it to any device, in float32 or float64. A
    state dictionary contains the pad's fingerprint instead of the matrices; a model of another pad refuses it.

    Args:
        pad: a pad, the name of a registered one, a TOML file of one, a file of saved influence matrices, or the
            matrices themselves; by default the paper's pad.
        fidelity: preset by name, or a Fidelity; "balanced" by default. Influence matrices have their own.
        layers: sensing layers to read, 0 at the top; by default all.
        stress: whether stress tensors are needed; their matrices take a fifth more memory.
        dtype: torch.float32 or torch.float64.
        device: of the matrices.

    Attributes:
        pad: the sheet and its taxels.
        fidelity: the mesh, and how the matrices are stored.
        surface: the grid on whose nodes forces act.
        layers: sensing layers that are read.

    Raises:
        InfluenceError: a layer or device does not exist, `dtype` is another type, or a file holds no influence
            matrices.
        PresetError: the fidelity does not exist, or is given together with matrices.
        PadError: `pad` is none of these.
        SceneError: no pad or file has that name.
    """

    def __init__(
        self,
        pad: Pad | str | Path | InfluenceMatrices | None = None,
        *,
        fidelity: str | Fidelity | None = None,
        layers: Sequence[int] | None = None,
        stress: bool = False,
        dtype: torch.dtype = torch.float32,
        device: torch.device | str | None = None,
    ) -> None:
        super().__init__()
        influence = matrices_of(pad, fidelity)
        self.pad, self.fidelity, self.surface = influence.pad, influence.fidelity, influence.surface
        self.layers = existing_layers(self.pad, layers)
        self._folded = Folded(influence)
        self._deviatoric = nn.ModuleList(LayerStress(influence, k, "deviatoric") for k in self.layers)
        self._mean = nn.ModuleList(LayerStress(influence, k, "mean") for k in self.layers) if stress else None
        for place, k in enumerate(self.layers):
            as_buffer(self, f"average_{place}", influence.averages[k].toarray())
        for name, line in (("cells_y", self.surface.y), ("cells_x", self.surface.x)):
            as_buffer(self, name, element_integrals(line.sizes))
        if not self.pad.surface.is_flat:
            as_buffer(self, "cells", cell_integrals(self.surface))
        try:
            self.to(device=device, dtype=floating(dtype))
        except (RuntimeError, AssertionError) as error:  # torch raises the latter where it was built without CUDA
            raise InfluenceError(
                f'the model cannot be on device {device!r}: {error}. Use "cpu", or a device that PyTorch and this '
                "machine have."
            ) from error

    @property
    def reading_shape(self) -> tuple[int, ...]:
        """Shape of one set of readings: (layers, rows, columns), or (taxels,) for free taxels."""
        if isinstance(self.pad.taxels, FreeTaxels):
            return self.pad.reading_shape
        return (len(self.layers), *self.pad.grid_shape[1:])

    @property
    def force_shape(self) -> tuple[int, int, int]:
        """Shape of the nodal forces of one load: (nodes along y, nodes along x, 3)."""
        return (*self.surface.node_shape, 3)

    @property
    def dtype(self) -> torch.dtype:
        """Floating-point type of matrices, loads and readings."""
        return self.get_buffer("cells_x").dtype

    @property
    def device(self) -> torch.device:
        """Device of matrices, loads and readings."""
        return self.get_buffer("cells_x").device

    def forward(self, forces: Tensor) -> Tensor:
        """Mean von Mises stress at every taxel.

        Args:
            forces: on the surface's nodes [N], pad frame, (..., nodes y, nodes x, 3): see `nodal_forces`,
                `traction_forces` and `wrench_basis`.

        Returns:
            (..., layers, rows, columns) [Pa]. The gradient is zero where the stress is zero.

        Raises:
            InfluenceError: the tensor has another shape, type or device. NaN is not detected and gives NaN.
        """
        return self.readings_of(self.point_response(forces))

    def point_response(self, forces: Tensor) -> Tensor:
        """Deviatoric stress at all sample points of the layers, linear in the forces.

        Responses add up. For a body at a fixed position, compute the response of each part of its load once (for
        example of `wrench_basis`), combine them linearly, and take `readings_of` the sum.

        Args:
            forces: on the surface's nodes [N], pad frame, (..., nodes y, nodes x, 3).

        Returns:
            (..., points, 5) [Pa], coordinates as in fem/stress.py.

        Raises:
            InfluenceError: the tensor has another shape, type or device.
        """
        batch, flat = self._batch(forces)
        with _full_precision(flat):
            classes = self._folded(flat)
            response = torch.cat([matrices(classes) for matrices in self._deviatoric], dim=1)
        return response.unflatten(0, batch) if batch else response[0]

    def readings_of(self, response: Tensor) -> Tensor:
        """Readings of a response, or of a sum of responses.

        Args:
            response: (..., points, 5) [Pa], see `point_response`.

        Returns:
            (..., layers, rows, columns) [Pa].

        Raises:
            InfluenceError: the response is no tensor, or has another shape, type or device.
        """
        of_type(Tensor, "response", response, InfluenceError, "point_response(forces) makes one")
        averages = [self.get_buffer(f"average_{place}") for place in range(len(self.layers))]
        points = [average.shape[1] for average in averages]
        if response.shape[-2:] != (sum(points), 5):
            raise InfluenceError(
                f"the response has shape {tuple(response.shape)}, but this model makes (..., {sum(points)}, 5). Make "
                "it with this model's point_response."
            )
        self._check_kind(response, "response")
        with _full_precision(response):
            norms = torch.linalg.vector_norm(response, dim=-1).split(points, dim=-1)
            layers = [of_layer @ average.T for of_layer, average in zip(norms, averages, strict=True)]
        return torch.cat(layers, dim=-1).unflatten(-1, self.reading_shape)

    def stress(self, forces: Tensor) -> Tensor:
        """Mean stress tensor over every taxel's ball, pad frame, tension positive.

        Args:
            forces: on the surface's nodes [N], pad frame, (..., nodes y, nodes x, 3).

        Returns:
            (..., 6, layers, rows, columns) [Pa]: components xx, yy, zz, xy, yz, zx.

        Raises:
            InfluenceError: the tensor has another shape, type or device, or the model was made without `stress=True`.
        """
        return self.readings_and_stress(forces).stress

    def readings_and_stress(self, forces: Tensor) -> PadOutput:
        """Readings and stress tensors in one pass, which is faster than two.

        Args:
            forces: on the surface's nodes [N], pad frame, (..., nodes y, nodes x, 3).

        Raises:
            InfluenceError: the tensor has another shape, type or device, or the model was made without `stress=True`.
        """
        if self._mean is None:
            raise InfluenceError("this model was made for readings alone. For stress: PadModel(..., stress=True).")
        batch, flat = self._batch(forces)
        readings, tensors = [], []
        with _full_precision(flat):
            classes = self._folded(flat)
            for place, (deviatoric, mean) in enumerate(zip(self._deviatoric, self._mean, strict=True)):
                average, response = self.get_buffer(f"average_{place}"), deviatoric(classes)
                readings.append(torch.linalg.vector_norm(response, dim=-1) @ average.T)
                tensors.append(_stress_tensor(average @ response, average @ mean(classes)))
        shape = self.reading_shape
        readings, stress = torch.cat(readings, dim=1), torch.cat(tensors, dim=1).movedim(-1, 1)
        output = PadOutput(readings.unflatten(-1, shape), stress.unflatten(-1, shape))
        return PadOutput(*(one.unflatten(0, batch) if batch else one[0] for one in output))

    def nodal_forces(self, load: SurfaceLoad | Sequence[SurfaceLoad]) -> Tensor:
        """Nodal forces of loads, such as from `contact_load`, as a tensor of this model.

        Args:
            load: one load on this pad's surface, or a sequence of them.

        Returns:
            (nodes y, nodes x, 3) [N], with a leading batch axis for a sequence.

        Raises:
            InfluenceError: a load belongs to another surface or is not finite.
        """
        if isinstance(load, Sequence):
            return self._tensor(nodal_batch(load, self.surface) if load else np.zeros((0, *self.force_shape)))
        return self._tensor(nodal_batch([load], self.surface)[0])

    def traction_forces(self, tractions: Tensor) -> Tensor:
        """Nodal forces (..., nodes y, nodes x, 3) [N] of tractions that are constant on each cell of the surface grid.

        Args:
            tractions: on the pad, in the pad frame [Pa], (..., cells y, cells x, 3); pressing is -z. The boundaries of
                the cells are `surface.y.vertices` and `surface.x.vertices`. On a curved pad these are the cells seen
                from above, tractions are forces per area of the surface, and a pressure p is -p times
                `surface.outer.normals`.

        Raises:
            InfluenceError: the tensor has another shape, type or device.
        """
        along_y, along_x = self.get_buffer("cells_y"), self.get_buffer("cells_x")
        rows, columns = along_y.shape[1], along_x.shape[1]
        self._check(tractions, (rows, columns, 3), "tractions", "cells y, cells x, 3")
        with _full_precision(tractions):
            if self.pad.surface.is_flat:
                forces = along_y @ tractions.flatten(-2)
                return along_x @ forces.unflatten(-1, (-1, 3))
            cells = self.get_buffer("cells")
            forces = tractions.new_zeros(*tractions.shape[:-3], *self.force_shape)
            for j, i in itertools.product(range(3), repeat=2):
                shares = cells[..., j, i, None] * tractions
                forces[..., j : j + 2 * rows - 1 : 2, i : i + 2 * columns - 1 : 2, :] += shares
            return forces

    def wrench_basis(self, footprint: Footprint) -> Tensor:
        """Nodal forces per unit of a wrench on a footprint, by law "uniform" while its pressure is positive everywhere.

        The load of wrenches (..., 6) is `torch.einsum("...w,wyxc->...yxc", wrenches, basis)`.

        Args:
            footprint: of the body; of a curved body its lowest part is used.

        Returns:
            (6, nodes y, nodes x, 3) [N/N, N/(N m)]: force x, y, z and moment x, y, z about the pad's origin, pad frame.

        Raises:
            InfluenceError: the footprint is none, or was made for another surface.
            PadError: the pad is curved: there the load is not linear in the wrench.
        """
        require_flat(self.pad, "PadModel.wrench_basis", _NOT_LINEAR)
        of_type(Footprint, "footprint", footprint, InfluenceError, "Footprint.from_outline(...) makes one")
        if not self.surface.matches(footprint.surface):
            raise InfluenceError(
                "the footprint was made for another pad or mesh than this model's. Make it with influence matrices of "
                "the same pad and fidelity."
            )
        return self._tensor(uniform_basis(footprint.lowest_part))

    def get_extra_state(self) -> dict[str, Any]:
        """The pad's fingerprint and the layers, stored in a state dictionary instead of the matrices."""
        return {"pad_fingerprint": self.pad.fingerprint, "layers": list(self.layers)}

    def set_extra_state(self, state: Any) -> None:
        """Check that a state dictionary is of a model of this pad and these layers; its fidelity may differ.

        Raises:
            StaleInfluenceError: it is of another pad or of other layers, or of no pad.
        """
        if not isinstance(state, Mapping):
            raise StaleInfluenceError(
                f"the state dictionary holds {shortened(state)} in place of a pad's fingerprint and layers. Load one "
                "that a PadModel's state_dict() gave."
            )
        own = self.get_extra_state()
        for name in own:
            if state.get(name) != own[name]:
                raise StaleInfluenceError(
                    f"the state dictionary was saved with {name.replace('_', ' ')} {state.get(name)}, but this model "
                    f"has {own[name]}, of a {self.pad.summary}. Make it with the pad and layers that were saved."
                )

    def extra_repr(self) -> str:
        """Text for print(model)."""
        mesh = mesh_name(self.fidelity.density) or "custom"
        return f"{self.pad.summary}, mesh {mesh!r}, layers={self.layers}, stress={self._mean is not None}"

    def _tensor(self, values: np.ndarray) -> Tensor:
        return torch.as_tensor(np.ascontiguousarray(values), dtype=self.dtype).to(self.device)

    def _batch(self, forces: Tensor) -> tuple[tuple[int, ...], Tensor]:
        """Leading axes of forces, and the forces with these flattened to one."""
        self._check(forces, self.force_shape, "forces", "nodes y, nodes x, 3")
        batch = tuple(forces.shape[:-3])
        return batch, forces.reshape(math.prod(batch), *self.force_shape)

    def _check(self, given: Any, shape: tuple[int, ...], name: str, axes: str) -> None:
        if not isinstance(given, Tensor):
            raise InfluenceError(
                f"{name} are of type {type(given).__name__}; expected a tensor. nodal_forces(load) makes one of a load."
            )
        if given.shape[-3:] != shape:
            raise InfluenceError(f"{name} have shape {tuple(given.shape)}; expected (..., {axes}) = (..., {shape}).")
        self._check_kind(given, name)

    def _check_kind(self, given: Tensor, name: str) -> None:
        floating(self.dtype)  # model.half() and the like ask nobody
        if given.dtype != self.dtype:
            raise InfluenceError(
                f"the dtype of {name} is {given.dtype}, but the model's is {self.dtype}. Convert one: "
                f"{name}.to(model.dtype), or model.to({given.dtype})."
            )
        if given.device != self.device:
            raise InfluenceError(
                f"the device of {name} is {given.device}, but the model's is {self.device}. Move one: "
                f'{name}.to(model.device), or model.to("{given.device}").'
            )


def _full_precision(tensor: Tensor) -> torch.autocast:
    """Context that disables autocast, whose half precision is too coarse for readings."""
    return torch.autocast(tensor.device.type, enabled=False)


def _stress_tensor(deviatoric: Tensor, mean: Tensor) -> Tensor:
    """Components (..., 6) from deviatoric coordinates (..., 5) and mean stress (..., 1), as stress.stress_tensor."""
    s_zz, difference = deviatoric[..., 0] / 1.5, deviatoric[..., 1] * (2 / math.sqrt(3))
    normal = torch.stack([(difference - s_zz) / 2, (-difference - s_zz) / 2, s_zz], dim=-1) + mean
    return torch.cat([normal, deviatoric[..., 2:] / math.sqrt(3)], dim=-1)
