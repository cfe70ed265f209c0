// A rigid body on contact cells: which forces on them carry a wrench, and the parts whose sum they are.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/bent_cells.hpp"
#include "contact/laws/contact_law.hpp"
#include "contact/laws/surface_shear.hpp"
#include "influence/surface_grid.hpp"

namespace mjtactile {

struct LawOptions {
  const ContactLaw* law = nullptr;   // never null in use
  const TangentialChoice* tangential = nullptr;
  bool tilting = true;      // whether the body may tilt under its load
  double friction = -1.0;   // coefficient that bounds shear and torsion; negative: none
  std::size_t cells = 0;    // wanted
  double strength = 0.0;    // pressure that no cell bears more than [Pa]; 0: no bound
  double facing_gap = 0.0;  // law "uniform" presses with what is no higher than this above the first touch [m]
  double narrowest = 0.0;   // least width of cells that taxels can resolve [m]

  bool operator==(const LawOptions& other) const {
    return law == other.law && tangential == other.tangential && tilting == other.tilting &&
           friction == other.friction && cells == other.cells && strength == other.strength;
  }
};

// A body pressed at one place. Shear is in proportion to the pressure, with a turn for the torsion.
class CellContact {
 public:
  struct Workspace {
    SurfaceCompliance::Workspace compliance;
    SurfaceGrid::Workspace grid;
    Matrix matrix;   // the compliance between the cells that were placed last
    std::vector<double> placed, quadrature, modes, forces, tractions, most;
    std::vector<TractionEdge> edges;
    std::vector<std::size_t> order;
    std::vector<Point> points;
  };

  // Place cells on the pad; press() follows, as often as wanted. `bent`: how they lie on a curved pad, null on a flat one.
  void place(const Face& face, const Placement& placement, const SurfaceCompliance& compliance,
             const LawOptions& options, Workspace& workspace, const BentCells* bent = nullptr);
  // Find the pressed cells under a wrench (force [N], moment about the pad's origin [N m]), whose force presses.
  // `heights`: of the body above each cell at first touch, null for a flat face; `start`: cells likely pressed, null for
  // all. Where no contact is found, or none without more pressure than the pad's strength, the cells nearest to where
  // the force passes carry it: exact() is false then.
  void press(const Face& face, const SurfaceCompliance& compliance, const LawOptions& options, const double* wrench,
             Workspace& workspace, const double* heights = nullptr, const std::uint8_t* start = nullptr);

  // Whether forces are linear in the resultants while the same cells are pressed.
  bool linear() const { return linear_; }
  bool exact() const { return exact_; }
  // Forces on the cells (cells, 3) [N], pad frame, under the wrench that was pressed with, shear in proportion to the
  // pressure.
  void forces(const Face& face, const double* wrench, double* forces) const;
  // The cells and the pressing on them, for other ways that shear spreads; heights as they were pressed with.
  PressedCells pressed_cells(const Face& face, const double* heights, Workspace& workspace) const;
  // The wrench of forces on the cells.
  static void sum(const Workspace& workspace, std::size_t cells, const double* forces, double* carried);
  // Nodal forces (nodes y, nodes x, 3) [N] of forces on the cells.
  void nodal_forces(const Face& face, const SurfaceGrid& grid, const double* forces, Workspace& workspace,
                    double* nodal) const;

  // Make the parts of a linear contact on a flat face, of which weights() and part_forces() tell; false where that fails.
  bool make_parts(const Face& face, const ContactLaw& law, Workspace& workspace);
  // Weights of the parts under another wrench, (parts()); false where other cells press, or more than the strength.
  bool weights(const Face& face, const LawOptions& options, const double* wrench, std::vector<double>& weights,
               Workspace& workspace) const;
  // Parts of a load on a flat face: pressures, one per resultant, and three of shear for each: a unit motion times that
  // pressure.
  std::size_t parts() const { return 4 * motions(); }
  // Forces on the cells of a sum of parts, (cells, 3) [N].
  void part_forces(const Face& face, const std::vector<double>& weights, double* forces) const;
  // The wrench that the parts carry in place of another.
  void carried(const Face& face, const double* wrench, double* carried) const;

  const std::vector<std::uint8_t>& pressed() const { return found_.pressed; }
  double pressed_area() const { return pressed_area_; }  // [m^2]
  double pressed_with() const { return force_; }         // pressing force [N]
  // Of the surface under a cell, by its law [m]; `between`: the workspace's matrix, as the cells were placed.
  double depth(const Face& face, const ContactLaw& law, const Matrix& between, std::size_t cell) const {
    return law.depth(face, found_, between, cell);
  }
  double indentation() const { return indentation_; }    // of the surface where it is deepest [m]
  double energy() const { return energy_; }              // of the surface, as deep as it lies [J]
  // Tilt of the body under what was pressed with, along x and y; 0 where the contact leaves it open.
  const double* slopes() const { return found_.slopes; }
  // Normal forces on the cells under what was pressed with [N].
  const std::vector<double>& normal() const { return found_.normal; }

 private:
  void resultants(const Face& face, const double* wrench, double* resultants) const;
  Point through(const double* wrench) const;
  bool bound_pressure(const ContactLaw& law, const LawProblem& problem, Workspace& workspace);
  void fill_nearest(const Face& face, const double* wrench, Workspace& workspace);
  void measure(const Face& face, const ContactLaw& law, const Matrix& between);
  std::size_t motions() const { return tilting_ ? 3 : 1; }

  Placement placement_;
  std::vector<Point> points_;     // of the cells, from their middle, over the face's length; pad axes
  Point centre_ = {0.0, 0.0};     // middle of the cells in the pad frame [m]
  bool tilting_ = true, curved_ = false, linear_ = false, exact_ = false;
  double pressed_area_ = 0.0, force_ = 0.0, length_ = 1.0, strength_ = 0.0;
  double indentation_ = 0.0, energy_ = 0.0, wanted_[kMostMotions] = {};
  LawContact found_;
  std::vector<double> gram_;      // motions times motions of the shear under each of the pressures
};

}  // namespace mjtactile
