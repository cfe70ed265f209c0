// Readings of one pad from what touches it: the path of every step.
//
// Where a body stands still over the pad, its response is a fixed combination of a few parts, the wrench basis; where
// it moves, its contact is solved anew. Which of the two answers is decided by numbers the caller keeps with the
// simulation's state, and a basis belongs to a pose rounded to the tolerance: the same states give the same bits,
// whatever was read before, in whatever order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <vector>

#include "contact/basis_cache.hpp"
#include "contact/body_geometry.hpp"
#include "contact/cells/face.hpp"
#include "contact/cells/tangential.hpp"
#include "contact/flat_press.hpp"
#include "contact/laws/cell_contact.hpp"
#include "contact/laws/uniform_press.hpp"
#include "contact/pad.hpp"
#include "contact/patch_press.hpp"
#include "geometry/gap_map.hpp"
#include "geometry/surface_map.hpp"

namespace mjtactile {

// A point at which a body presses, in the pad frame.
struct ContactPoint {
  double x, y;    // [m]
  double force;   // pressing [N]
};

// A body that presses on the pad.
struct Touch {
  int body;
  std::shared_ptr<BodyGeometry> geometry;  // null where nothing is known of it
  Pose pose;            // of the body in the pad frame
  double wrench[6];     // on the pad, about its origin, pad frame [N, N m]
  double friction;      // largest sliding friction of its contacts [-]
  double sunk;          // deepest overlap of body and pad where it presses [m]
  std::vector<ContactPoint> points;
  // What of it faces the pad, where that is known without its geometry: a flat face and where it stands, or its heights.
  std::shared_ptr<const Face> face;
  Placement placement = kHere;
  const HeightMap* map = nullptr;
};

// How one body's contact was solved on its cells; null where it was not, or needed none.
struct SolvedCells {
  const CellContact* contact = nullptr;
  const Face* face = nullptr;
  Placement placement = kHere;
  const BentCells* bent = nullptr;         // how the cells lie on a curved pad, null on a flat one
  const double* carried = nullptr;         // of the wrench, pad frame [N, N m]
  const PatchFace::View* view = nullptr;   // from which heights are seen, null for a flat face's own cells
  const double* heights = nullptr;         // of the body above the cells, null where flat [m]
  const double* sunk = nullptr;            // by how much others bend the surface there [m], null for none
  const double* forces = nullptr;          // on the cells, (cells, 3) [N]; of a curved pad along its tangent plane
  const Matrix* full = nullptr;            // compliance that shear was solved with, null for none
  const CellContact::Workspace* workspace = nullptr;
};

// Numbers kept with the simulation's state.
struct Steadiness {
  double pose = 0.0;    // of all touching bodies, rounded and hashed
  double steps = 0.0;   // for which it has been the same
};

// What happened to a body's contact.
enum class Event { beyond_range, not_carried, bounded, refused };
constexpr std::size_t kEvents = 4;

// What was read.
struct Pressed {
  double carried[6] = {};   // wrench that the readings carry, about the pad's origin [N, N m]
  double range = 0.0;       // largest share that a contact takes of the range of small strains [-]
  double indentation = 0.0, area = 0.0, peak = 0.0;   // deepest [m], under pressure [m^2], largest pressure [Pa]
  struct Note {
    Event event;
    int body;
    double pressure, indentation;   // mean [Pa] and [m]
  };
  std::vector<Note> notes;
};

// One pad in one simulation.
template <typename Value>
class PadSensor {
 public:
  // Tolerance: of poses [m or rad].
  PadSensor(std::shared_ptr<const Pad> pad, LawOptions options, double facing_gap, double tolerance);

  // Response to everything that touches; readings() and stress() look at it.
  void press(const Touch* touches, std::size_t count, const Steadiness& before);
  const Pressed& pressed() const { return pressed_; }
  void readings(double* readings);   // (taxels) [Pa]
  void stress(double* stress);       // (6, taxels) [Pa]; the pad must have it
  const std::vector<double>& nodal_forces() const { return total_; }  // of all contacts, where they are kept [N]
  // With `only`, the response is left out: there are no readings then.
  void keep_nodal_forces(bool keep, bool only = false) { keeps_forces_ = keep, only_forces_ = only; }
  // Shear may take so many times as long as a step of a simulation may.
  void set_patience(double times) { shear_.set_patience(times); }
  // Torsion is carried whatever shear it takes, where no friction bounds it.
  void carry_any_torsion() { any_torsion_ = true; }
  // Of what was pressed last.
  SolvedCells solved_cells(std::size_t touch) const;
  const UniformPress& uniform() const { return uniform_; }   // of what was pressed without cells
  // What to keep with the state for the next step.
  Steadiness after(const Steadiness& before) const;

 private:
  // One body's contact on its cells.
  struct BodyPress {
    bool flat = false;
    FlatPress face;
    PatchPress patch;
    GapMap gap;
    FlatMap spots;
    CellContact::Workspace workspace;
    std::shared_ptr<const Face> keeps;   // the face in use
    std::shared_ptr<const Face> sheared; // the face that the integrals belong to; null for none
    ShearIntegrals integrals;
    Matrix full;
    std::vector<double> forces, sunk;    // on the cells [N]; by how much others bend the surface there [m]
    double carried[6] = {};              // of the wrench, pad frame
    // On a curved pad: the plane in which the contact is solved, the body over the surface there, and what touches as it
    // is seen from the plane.
    TangentPlane plane;
    SurfaceMap over;
    TurnedMap turned;
    Touch here;
    BentCells::Workspace bent;

    const BentCells& laid() const { return patch.bent(); }
    const CellContact& contact() const { return flat ? face.contact() : patch.contact(); }
    const Face& cells() const { return flat ? face.face() : patch.face(); }
    Placement placement() const { return flat ? face.placement() : kHere; }
    const double* heights() const { return flat ? face.heights() : patch.heights().data(); }
  };
  struct CutFace {
    int body;
    std::size_t side;
    std::array<std::int64_t, 3> place;
    const BodyGeometry* geometry;
    std::shared_ptr<const Face> face;
  };
  bool press_steady(const Touch& touch, const std::shared_ptr<const Face>& face);
  bool press_linear(const Touch& touch, const Face& face, const Placement& placement);
  bool solve(const Touch& touch, BodyPress& press, const std::shared_ptr<const Face>& face,
             const Placement& placement);
  double press_above(const Touch& touch, BodyPress& press, double floor);
  bool press_points(const Touch& touch, BodyPress& press);
  bool press_map(const Touch& touch, BodyPress& press);
  const Touch& turned(const Touch& touch, BodyPress& press) const;
  const TangentPlane* plane_of(const BodyPress& press) const { return curved() ? &press.plane : nullptr; }
  bool curved() const { return !pad_->outer().is_flat(); }
  void couple(const Touch* touches, std::size_t count);
  void sink(const BodyPress& other, BodyPress& press);
  void finish(const Touch& touch, BodyPress& press);
  void put_on_curved_nodes(BodyPress& press);
  bool shear(const Touch& touch, BodyPress& press);
  void bound_stress(const Face& cells, double* forces) const;
  void note(Event event, const Touch& touch, double pressure, double indentation);
  void note_range(const Touch& touch, double force, double area, double indentation);
  void note_carried(const Touch& touch, const double* carried);
  void add(const double* forces);
  std::shared_ptr<const Face> face_towards(const Touch& touch, Placement& placement);
  std::shared_ptr<const Face> cut_face(const Touch& touch, std::size_t side, const Placement& placement);
  bool over_sheet(const Face& face, const Placement& placement) const;
  Rectangle sheet() const;

  std::shared_ptr<const Pad> pad_;
  LawOptions options_;
  double facing_gap_, tolerance_, key_ = 0.0;
  bool touched_ = false, keeps_forces_ = false, only_forces_ = false, any_torsion_ = false;
  int power_ = 0;   // of two, by which forces far from 1 N are brought there
  Pressed pressed_;
  std::list<CutFace> cut_faces_;  // latest used first
  std::vector<std::unique_ptr<BodyPress>> presses_;
  std::vector<std::uint8_t> solved_;
  FaceCells cutter_;
  SurfaceShear shear_;
  AlignedVector<Value> response_, mean_response_;
  std::vector<double> forces_, total_, weights_, means_, part_forces_;
  std::vector<Point> starts_, ends_;
  UniformPress uniform_;
  CellContact::Workspace workspace_;
  SurfaceCompliance::Workspace others_;
  typename StressMap<Value>::Workspace map_workspace_;
  std::vector<std::uint32_t> every_;
  std::vector<Value> part_weights_;
};

}  // namespace mjtactile
