// A rigid body on contact cells: the forces on the cells that carry a wrench, also as a sum of fixed parts.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/bent_cells.hpp"
#include "contact/laws/contact_law.hpp"
#include "contact/laws/surface_shear.hpp"

namespace mjtactile {

// How contacts are solved.
struct LawOptions {
  const ContactLaw* law = nullptr;   // never null in use
  const TangentialChoice* tangential = nullptr;
  bool tilting = true;      // whether the body may tilt under its load
  double friction = -1.0;   // coefficient that bounds shear and torsion [-]; negative: no bound
  std::size_t cells = 0;    // wanted number of contact cells
  double widest = 0.0;      // flat faces get more cells where these would be wider [m], see FaceCells; 0: never
  double strength = 0.0;    // largest pressure on a cell [Pa]; 0: no bound
  double facing_gap = 0.0;  // law "uniform" presses with parts of a body up to this height above the first touch [m]
  double narrowest = 0.0;   // least width of cells that taxels can resolve [m]
  bool any_torsion = false; // whether any torsion is carried that friction does not bound, however large its shear

  bool operator==(const LawOptions& other) const {
    return law == other.law && tangential == other.tangential && tilting == other.tilting &&
           friction == other.friction && cells == other.cells && widest == other.widest && strength == other.strength &&
           facing_gap == other.facing_gap && narrowest == other.narrowest && any_torsion == other.any_torsion;
  }
};

// A pad's surface, and how bodies are pressed on it.
struct ContactSurface {
  Rectangle sheet;                       // that contacts may cover [m]; of a curved pad in the tangent plane
  const SurfaceCompliance& compliance;
  const LawOptions& options;
  const TangentPlane* plane = nullptr;   // from which everything is seen on a curved pad; null on a flat one
};

// A body that is pressed on cells. Pointers belong to the caller and are used during press() only.
struct PressedBody {
  const double* wrench;                  // force [N], which presses, and moment about the pad's origin [N m]
  const double* heights = nullptr;       // of the body above each cell at first touch [m]; null for a flat face
  const std::uint8_t* start = nullptr;   // cells that are likely pressed; null for all
  bool overloads = false;                // whether the pressure is likely bounded
};

// A body pressed at one place. Shear is proportional to the pressure, plus a rotation that carries the torsion.
class CellContact {
 public:
  struct Workspace {
    SurfaceCompliance::Workspace compliance;
    TractionWork tractions;
    Matrix matrix;   // compliance between the cells that were placed last
    std::vector<double> placed, quadrature, modes, forces, most;
    std::vector<std::size_t> order;
    std::vector<Point> points;
  };

  // Place cells on the pad. press() may follow any number of times. `bent`: how the cells lie on a curved pad; null on
  // a flat pad.
  void place(const Face& face, const Placement& placement, const ContactSurface& surface, Workspace& workspace,
             const BentCells* bent = nullptr);
  // The cells on the pad, since place().
  static SurfaceCells on_surface(const Face& face, const Workspace& workspace, const BentCells* bent);
  // Find the pressed cells. If no contact is found, or none that keeps to the pad's strength, the cells nearest to the
  // force's line of action carry it, and exact() is false.
  void press(const Face& face, const ContactSurface& surface, const PressedBody& body, Workspace& workspace);

  // Whether the forces are linear in the resultants while the same cells are pressed.
  bool linear() const { return linear_; }
  // Whether the contact law was solved, see press().
  bool exact() const { return exact_; }
  // Forces on the cells (cells, 3) [N], pad frame, under the wrench of press(). Shear is proportional to the pressure.
  void forces(const Face& face, const double* wrench, double* forces) const;
  // The cells and the normal forces on them, for other tangential choices; `heights` as in press().
  PressedCells pressed_cells(const Face& face, const double* heights, Workspace& workspace) const;
  // Wrench (6), about the pad's origin [N, N m], of forces on the cells (cells, 3) [N].
  static void sum(const Workspace& workspace, std::size_t cells, const double* forces, double* carried);

  // Make the parts of a linear contact on a flat face, for weights() and part_forces(). False if that fails.
  bool make_parts(const Face& face, const ContactLaw& law, Workspace& workspace);
  // Weights (parts()) of the parts under another wrench. False if other cells would press, or a pressure would be above
  // the strength.
  bool weights(const Face& face, const LawOptions& options, const double* wrench, std::vector<double>& weights,
               Workspace& workspace) const;
  // Number of parts of a load on a flat face: one pressure per resultant, and three shears for each pressure, which are
  // the pressure times a unit motion along the surface.
  std::size_t parts() const { return 4 * motions(); }
  // Forces on the cells (cells, 3) [N] of one part.
  void part_forces(const Face& face, std::size_t part, double* forces) const;
  // Wrench (6) that the parts carry when the given one is wanted [N, N m].
  void carried(const Face& face, const double* wrench, double* carried) const;

  const Placement& placement() const { return placement_; }
  const std::vector<std::uint8_t>& pressed() const { return found_.pressed; }
  double pressed_area() const { return pressed_area_; }  // [m^2]
  double pressed_with() const { return force_; }         // pressing force [N]
  // Depth of the surface under a cell, by the contact law [m]; `between`: the workspace's matrix since place().
  double depth(const Face& face, const ContactLaw& law, const Matrix& between, std::size_t cell) const {
    return law.depth(face, found_, between, cell);
  }
  double indentation() const { return indentation_; }    // largest depth of the surface [m]
  // How far the body comes down where it comes down most, from the surface at first touch [m]: depth plus height. Under
  // a cell whose pressure is at its bound, the surface gives way less than the body comes down.
  double lowered() const { return lowered_; }
  double energy() const { return energy_; }              // elastic energy of the surface [J]
  // Slopes of the body's tilt along x and y after press() [-]; 0 if the contact leaves them open.
  const double* slopes() const { return found_.slopes; }
  // Normal forces on the cells after press() (cells) [N].
  const std::vector<double>& normal() const { return found_.normal; }

 private:
  void drop_open_tilt(double most, double* slopes) const;
  // The line on which cells in a row lie. Forces at their middles have no moment about it, so no tilt about it is
  // determined. Rounding of their places must not seem to determine one.
  class Row {
   public:
    Row() = default;
    // The row of points about their mean; none if they are not in a row.
    explicit Row(const std::vector<Point>& points);
    // The nearest point on the row; the point itself if there is none.
    Point operator()(const Point& at) const;

   private:
    Point along_ = {0.0, 0.0};
    bool is_row_ = false;
  };

  void resultants(const Face& face, const double* wrench, double* resultants) const;
  Point through(const double* wrench) const;
  bool solve(const ContactLaw& law, const LawProblem& problem, bool overloads, Workspace& workspace);
  bool fills_all(const LawProblem& problem) const;
  void set_most(const std::vector<double>& areas, Workspace& workspace) const;
  bool bound_pressure(const ContactLaw& law, const LawProblem& problem, Workspace& workspace);
  void fill_nearest(const Face& face, const double* wrench, Workspace& workspace);
  void measure(const Face& face, const ContactLaw& law, const Matrix& between, const double* heights);
  std::size_t motions() const { return tilting_ ? 3 : 1; }

  Placement placement_ = kUnmoved;
  std::vector<Point> points_;     // of the cells, from their middle, over the face's length; pad axes
  Point centre_ = {0.0, 0.0};     // middle of the cells in the pad frame [m]
  Row on_row_;
  bool tilting_ = true, has_heights_ = false, linear_ = false, exact_ = false;
  double pressed_area_ = 0.0, force_ = 0.0, length_ = 1.0, strength_ = 0.0;
  double indentation_ = 0.0, lowered_ = 0.0, energy_ = 0.0, wanted_[kMostMotions] = {};
  LawContact found_;
  std::vector<double> gram_;      // motions times motions of the shear under each of the pressures
};

}  // namespace mjtactile
