// Readings of one pad from the bodies that touch it, computed in every step of the simulation.
//
// The response to a flat face that stands still is a combination of a few fixed parts, the wrench basis. The contact of
// a body that moves is solved anew. The caller keeps a few numbers with the simulation's state (Steadiness); they alone
// decide between the two. A basis belongs to a pose rounded to the tolerance. So the same states give the same bits,
// whatever was read before and in whatever order.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <variant>
#include <vector>

#include "contact/basis_cache.hpp"
#include "contact/body_geometry.hpp"
#include "contact/cells/face.hpp"
#include "contact/cells/face_cells.hpp"
#include "contact/cells/tangential.hpp"
#include "contact/flat_press.hpp"
#include "contact/laws/cell_contact.hpp"
#include "contact/laws/uniform_press.hpp"
#include "contact/pad.hpp"
#include "contact/patch_press.hpp"
#include "contact/point_press.hpp"
#include "geometry/gap_map.hpp"
#include "geometry/surface_map.hpp"

namespace mjtactile {

// A body that presses on the pad.
struct Touch {
  int body;
  std::vector<int> links;  // bodies that are welded to one another and touch, ascending; the first is `body`
  std::shared_ptr<BodyGeometry> geometry;  // null where the geometry is not known
  Pose pose;            // of the body in the pad frame
  double wrench[6];     // on the pad, about the pad's origin, pad frame [N, N m]
  double friction;      // largest sliding friction coefficient of its contacts [-]
  double sunk;          // deepest overlap of body and pad where the body presses [m]; infinite if that is not known
  std::vector<ContactPoint> points;
  // The side that faces the pad, if the caller gives it in place of the geometry: a flat face with its placement, or
  // the heights of the body.
  std::shared_ptr<const Face> face;
  Placement placement = kUnmoved;
  const HeightMap* map = nullptr;
};

// The solution of one body's contact on its cells. All pointers are null if the contact was not solved on cells.
struct SolvedCells {
  const CellContact* contact = nullptr;
  const Face* face = nullptr;
  Placement placement = kUnmoved;
  const BentCells* bent = nullptr;         // how the cells lie on a curved pad; null on a flat pad
  const double* carried = nullptr;         // wrench (6) that the cells carry, as Touch::wrench [N, N m]
  // The view from which heights are measured; null for cells of a flat face.
  const HeightWindow* view = nullptr;
  const double* heights = nullptr;         // of the body above the cells (cells) [m]; null for a flat face
  const double* sunk = nullptr;            // lowering of the surface by other bodies (cells) [m]; null for none
  CellForces forces = {nullptr};           // on the cells; on a curved pad in the tangent plane's frame
  const FullCompliance* full = nullptr;    // compliance with which shear was solved; null for none
  const CellContact::Workspace* workspace = nullptr;
};

// The point of the surface, along x and y in the pad frame, of a point of the cells' face [m].
Point on_pad(const SolvedCells& solved, const double* at);

// Numbers that the caller keeps with the simulation's state.
struct Steadiness {
  double pose = 0.0;    // hash of the rounded poses of all touching bodies
  double steps = 0.0;   // number of steps since this hash changed last
};

// What happened to a body's contact: its strains are beyond the linear range; it carries only a part of the wrench; the
// law found no solution, and a simpler distribution carries the wrench; or it was refused and carries nothing. And what
// happened to the pad: its geom no longer has the size for which its tables were built; or a body touches its back.
enum class Event { beyond_range, not_carried, approximated, refused, resized, behind };
constexpr std::size_t kEvents = 6;

// Summary of one step's contacts.
struct Pressed {
  double carried[6] = {};   // wrench that the readings carry, about the pad's origin, pad frame [N, N m]
  // Largest pressure, shear counted, or indentation of a contact over its limit for small strains [-].
  double range = 0.0;
  double indentation = 0.0, area = 0.0, peak = 0.0;   // deepest [m], under pressure [m^2], largest pressure [Pa]
  struct Note {
    Event event;
    int body;
    double pressure, indentation;   // mean pressure [Pa] and indentation [m]
  };
  std::vector<Note> notes;
};

// One pad in one simulation.
class PadSensor {
 public:
  // `facing_gap`: parts of a body up to this height above its first touch face the pad [m]. `tolerance`: poses that
  // differ by less are the same [m or rad].
  PadSensor(std::shared_ptr<const Pad> pad, LawOptions options, double facing_gap, double tolerance);

  // Compute the response to all touching bodies. The functions below give its parts.
  void press(const Touch* touches, std::size_t count, const Steadiness& before);
  const Pressed& pressed() const { return pressed_; }
  void readings(double* readings);   // (taxels) [Pa]
  void stress(double* stress);       // (6, taxels) [Pa]; the pad must have tables for it
  // Sum of the nodal forces of all contacts (nodes y, nodes x, 3) [N], if keep_nodal_forces() asked for them.
  const std::vector<double>& nodal_forces() const { return total_; }
  // Edges of the areas under pressure, which are on their left, in the pad frame [m], if nodal forces are kept. By
  // touch; there may be more, which are empty.
  const std::vector<std::vector<Segment>>& rims() const { return rims_; }
  // Keep nodal forces from now on. With `only`, the response is not computed, and there are no readings.
  void keep_nodal_forces(bool keep, bool only = false) { keeps_forces_ = keep, only_forces_ = only; }
  // Let the solution for shear take `times` as long as a simulation step allows.
  void set_patience(double times) { shear_.set_patience(times); }
  // Carry any torsion if no friction coefficient bounds it, however large the shear becomes.
  void carry_any_torsion() { any_torsion_ = true; }
  // Solution of a touch of the last press().
  SolvedCells solved_cells(std::size_t touch) const;
  // Numbers to keep with the state until the next step.
  Steadiness after(const Steadiness& before) const;

 private:
  // One body's contact on its cells.
  struct BodyPress {
    bool flat = false;
    FlatPress face;
    PatchPress patch;
    GapMap gap;
    PatchPress other_patch;              // a second candidate for the contact, which may be better
    GapMap other_gap;
    CellContact::Workspace workspace;
    std::shared_ptr<const Face> keeps;   // the face in use
    std::shared_ptr<const Face> sheared; // the face to which the integrals belong; null for none
    ShearIntegrals integrals;
    FullCompliance full;
    std::vector<double> forces, sunk;    // on the cells [N]; lowering of the surface by other bodies [m]
    std::vector<double> pressing;        // forces on the cells along the surface's normals [N]
    std::vector<Point> leans;            // of the cells [-]; empty if none leans
    double carried[6] = {};              // wrench that the cells carry, pad frame [N, N m]
    // On a curved pad: the plane in which the contact is solved, the body's heights over the surface there, and the
    // touch in the plane's frame.
    TangentPlane plane;
    SurfaceMap over;
    TurnedMap turned;
    Touch here;
    BentCells::Workspace bent;

    const BentCells& laid() const { return patch.bent(); }
    const CellContact& contact() const { return flat ? face.contact() : patch.contact(); }
    const Face& cells() const { return flat ? face.face() : patch.face(); }
    Placement placement() const { return flat ? face.placement() : kUnmoved; }
    CellForces on_cells() const { return {forces.data(), leans.empty() ? nullptr : leans.data()}; }
    const double* heights() const { return flat ? face.heights() : patch.heights().data(); }
  };
  struct CutFace {
    int body;
    std::size_t side;
    std::array<std::int64_t, 3> place;
    std::weak_ptr<const BodyGeometry> geometry;  // unlike an address, never that of a later geometry
    std::shared_ptr<const Face> face;
  };
  // The response of the sample points to all contacts, in the precision of the pad's maps.
  template <typename Value>
  struct Response {
    const Pad::Maps<Value>* maps;
    AlignedVector<Value> deviatoric, mean;
    typename StressMap<Value>::Workspace workspace;
    std::vector<Value> weights, next;   // of kept_.basis, and of the present load

    Response(const Pad::Maps<Value>& of, bool has_mean)
        : maps(&of), deviatoric(of.deviatoric.response_size), mean(has_mean ? of.mean.response_size : 0) {}
  };
  // What response_ holds: the response of a steady contact to weights of its basis. As long as a body rests, the
  // weights change by less than the rounding errors of the response, and neither it nor the readings change.
  struct KeptResponse {
    std::weak_ptr<const Basis> basis;   // unlike an address, never that of a later basis; expired: none
    std::vector<double> readings;       // empty if they were not asked for yet
  };
  bool press_steady(const Touch& touch, const std::shared_ptr<const Face>& face);
  bool press_linear(const Touch& touch, const Face& face, const Placement& placement, std::size_t place);
  void begin(std::size_t count);
  double key_of(const Touch* touches, std::size_t count) const;
  void press_alone(const Touch& seen, std::size_t place, bool steady);
  bool solve(const Touch& touch, BodyPress& press, const std::shared_ptr<const Face>& face,
             const Placement& placement);
  bool press_shapes(const Touch& touch, BodyPress& press);
  double press_above(const Touch& touch, BodyPress& press, double floor);
  double press_within(const Touch& touch, BodyPress& press, double floor, double reach);
  bool touches_beyond(double reach, const Touch& touch, BodyPress& press) const;
  bool press_points(const Touch& seen, const BodyPress& press, std::size_t place);
  bool press_map(const Touch& touch, BodyPress& press);
  const Touch& turned(const Touch& touch, BodyPress& press) const;
  const TangentPlane* plane_of(const BodyPress& press) const { return curved() ? &press.plane : nullptr; }
  bool curved() const { return !pad_->outer().is_flat(); }
  void couple(const Touch* touches, std::size_t count);
  void sink(const BodyPress& other, BodyPress& press);
  void finish(const Touch& touch, BodyPress& press);
  void put_on_curved_nodes(BodyPress& press);
  const std::vector<Point>* gradients(const BodyPress& press) const;
  void balance_leans(BodyPress& press);
  bool shear(const Touch& touch, BodyPress& press);
  void note(Event event, const Touch& touch, double pressure, double indentation);
  void note_contact(const Touch& touch, const double* force, double area, double indentation);
  void note_range(const Touch& touch, const double* force, double area, double indentation);
  void note_carried(const Touch& touch, const double* carried);
  std::shared_ptr<const Basis> make_basis(const BasisKey& key, const std::shared_ptr<const Face>& face,
                                          const double* wrench);
  template <typename Value>
  Columns<Value> responses_to_parts(const CellContact& contact, const Face& face, Response<Value>& response);
  template <typename Value>
  void combine(const std::shared_ptr<const Basis>& basis, Response<Value>& response);
  void add_forces();
  void set_response(double value);
  void make_readings(double* readings);
  std::shared_ptr<const Face> face_towards(const Touch& touch, Placement& placement);
  std::shared_ptr<const Face> cut_face(const Touch& touch, std::size_t side, const Placement& placement);
  bool over_sheet(const Face& face, const Placement& placement) const;
  bool may_cover(const FlatSide& side, const Placement& placement) const;
  Rectangle sheet() const { return pad_->surface().sheet(); }
  // The surface as contacts over a part of it see it.
  ContactSurface surface(const Rectangle& part, const TangentPlane* plane = nullptr) const {
    return {part, pad_->compliance(), options_, plane};
  }

  std::shared_ptr<const Pad> pad_;
  LawOptions options_;
  double facing_gap_, tolerance_, key_ = 0.0;
  bool touched_ = false, keeps_forces_ = false, only_forces_ = false, any_torsion_ = false;
  int power_ = 0;   // forces far from 1 N are scaled by this power of two
  Pressed pressed_;
  std::list<CutFace> cut_faces_;  // latest used first
  std::vector<std::unique_ptr<BodyPress>> presses_;
  std::vector<std::uint8_t> solved_;
  FaceCells cutter_;
  SurfaceShear shear_;
  std::variant<Response<float>, Response<double>> response_;
  bool begun_ = false;   // whether response_ is that of the last press(), and not of one before
  KeptResponse kept_;
  std::vector<std::vector<Segment>> rims_;
  std::vector<double> forces_, total_, weights_, means_, part_forces_;
  PointPress points_;
  UniformPress uniform_;
  CellContact::Workspace workspace_;
  SurfaceCompliance::Workspace others_;
  std::vector<std::uint32_t> every_;
};

}  // namespace mjtactile
