// Contact cells of a tangent plane laid onto the curved surface below it.
//
// Each cell presses along its own normal n, inclined to the plane's normal N by the slopes of the surface. Forces
// f are measured along N. The force along n is f / c with c = n . N, on an area of 1 / c times the cell's in the plane,
// so the pressure is f over the cell's area, as on a flat pad. For moments, f acts where the line along n through the
// cell meets the plane. The surface moves along n; a body that moves along N meets a displacement w along n after w / c.
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/compliance.hpp"
#include "contact/cells/face.hpp"
#include "geometry/tangent_plane.hpp"
#include "influence/surface_grid.hpp"

namespace mjtactile {

class BentCells {
 public:
  struct LoadedNode {
    double* force;
    double arm[3], weight;   // from the plane's point [m]; how much presses on it [N]
  };
  struct Workspace {
    SurfaceGrid::Workspace grid;
    std::vector<TractionEdge> edges;
    std::vector<double> tractions, areas;
    std::vector<LoadedNode> nodes;
  };

  // Map the cells of a face, whose frame is the plane's, onto the surface. The plane must outlive this object.
  void lay(const Face& face, const TangentPlane& plane);

  const TangentPlane& plane() const { return *plane_; }
  // Of each cell: where it is on the pad (cells, 2) and in the pad frame (cells, 3) [m], where forces along N act
  // (cells, 2) [m], slopes of the surface along U and V (cells, 2), and 1 / c (cells).
  const std::vector<double>& on_pad() const { return on_pad_; }
  const std::vector<double>& positions() const { return positions_; }
  const std::vector<double>& levers() const { return levers_; }
  const std::vector<double>& slopes() const { return slopes_; }
  const std::vector<double>& stretches() const { return stretches_; }
  Bend bend() const {
    const std::size_t cells = stretches_.size();
    return {positions_.data(), stretches_.data(), seen_.data(), seen_.data() + cells, seen_.data() + 2 * cells};
  }

  // Resultants of pressing forces f (cells) in the plane: forces along U and V, and the torsion about N.
  void along_plane(const double* pressing, double* along) const;
  // Force on a cell in the pad frame, of shear along U and V and -f.
  void force_on(std::size_t cell, const double* force, double* on_pad) const;
  // Nodal forces (nodes y, nodes x, 3) [N] of forces (shear along U and V, -f) on the cells (cells, 3), with a wrench (6)
  // about the pad's origin: what rounding of cells to polygons leaves of it is spread over what is pressed. False, and
  // the wrench becomes that of the forces, where they are too few to carry it.
  bool nodal_forces(const Face& face, const SurfaceGrid& grid, const double* forces, double* wrench,
                    Workspace& workspace, double* nodal) const;

 private:
  void gather(const SurfaceGrid& grid, double* nodal, std::vector<LoadedNode>& nodes) const;
  bool correct(const std::vector<LoadedNode>& nodes, double* wrench) const;

  const TangentPlane* plane_ = nullptr;
  std::vector<double> on_pad_, positions_, levers_, slopes_, stretches_;
  std::vector<double> seen_;   // u, v and w of all cells, in blocks
};

}  // namespace mjtactile
