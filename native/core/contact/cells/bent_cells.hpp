// Contact cells of a tangent plane, projected onto the curved surface along the plane's normal.
//
// Each cell presses along its own normal n, which is inclined to the plane's normal N by the slopes of the surface.
// Forces f are measured along N. With c = n . N, the force along n is f / c, and it acts on an area of 1 / c times that
// of the cell in the plane. So the pressure is f over the cell's area in the plane, as on a flat pad. For moments, f
// acts where the line along n through the cell meets the plane. The surface moves along n. A displacement w along n is
// closed by a motion w / c of the body along N. Forces on cells that lean are turned from n towards the body's normal;
// see lean.hpp.
#pragma once

#include <cstddef>
#include <optional>
#include <vector>

#include "contact/cells/compliance.hpp"
#include "contact/cells/face.hpp"
#include "geometry/tangent_plane.hpp"

namespace mjtactile {

class BentCells {
 public:
  struct LoadedNode {
    double* force;           // (3) [N], pad frame; in the caller's nodal forces
    double arm[3], weight;   // position from the plane's origin, pad frame [m]; size of the force along N [N]
  };
  // Memory that the caller keeps between calls.
  struct Workspace : TractionWork {
    std::vector<double> areas;
    std::vector<LoadedNode> nodes;
  };

  // Project the cells of a face, whose frame is the plane's, onto the surface. The plane must outlive this object.
  void lay(const Face& face, const TangentPlane& plane);

  const TangentPlane& plane() const { return *plane_; }
  // Positions of the cells along x and y, in the pad frame (cells, 2) [m].
  const std::vector<double>& on_pad() const { return on_pad_; }
  // The same of the face's quadrature points [m].
  const std::vector<double>& quadrature() const { return quadrature_; }
  // Points of the plane at which forces along N act (cells, 2) [m].
  const std::vector<double>& levers() const { return levers_; }
  // Slopes of the surface along u and v (cells, 2) [-].
  const std::vector<double>& slopes() const { return slopes_; }
  // 1 / c (cells) [-].
  const std::vector<double>& stretches() const { return stretches_; }
  Bend bend() const {
    const std::size_t cells = stretches_.size();
    return {positions_.data(), stretches_.data(), seen_.data(), seen_.data() + cells, seen_.data() + 2 * cells};
  }

  // Resultants in the plane of pressing forces f (cells) [N]: forces along u and v [N], and the torsion about N [N m].
  void along_plane(const double* pressing, double* along) const;
  // Force on a cell in the pad frame (3) [N], from its shear along u and v, and -f.
  void force_on(std::size_t cell, const CellForces& forces, double* on_pad) const;
  // Nodal forces (nodes y, nodes x, 3) [N] of forces on the cells, as for force_on(). They are corrected to
  // have exactly the resultant `wrench` (6), about the pad's origin, pad frame [N, N m]: cells are polygons on the pad,
  // so their nodal forces miss it slightly. False if the loaded nodes cannot carry this wrench. Forces are then not
  // corrected, and `wrench` becomes their own resultant.
  bool nodal_forces(const Face& face, const SurfaceGrid& grid, const CellForces& forces, double* wrench,
                    Workspace& workspace, double* nodal) const;

 private:
  void find_loaded_nodes(const SurfaceGrid& grid, double* nodal, std::vector<LoadedNode>& nodes) const;
  bool correct(const std::vector<LoadedNode>& nodes, double* wrench) const;

  const TangentPlane* plane_ = nullptr;
  std::vector<double> on_pad_, quadrature_, positions_, levers_, slopes_, stretches_;
  std::vector<double> seen_;   // positions in the plane's frame (3, cells) [m]
};

// How cells lie on a curved surface; none if `bent` is null, on a flat one.
inline std::optional<Bend> bend_of(const BentCells* bent) {
  return bent == nullptr ? std::nullopt : std::optional(bent->bend());
}

}  // namespace mjtactile
