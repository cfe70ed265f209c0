// Readings of one pad from what touches it: the fast path of every step.
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

#include "basis_cache.hpp"
#include "cell_contact.hpp"
#include "closing_press.hpp"
#include "face.hpp"
#include "flat_press.hpp"
#include "linear_traction.hpp"
#include "pad.hpp"

namespace mjtactile {

// A body that presses on the pad.
struct Touch {
  int body;
  Pose pose;          // of the body in the pad frame
  double wrench[6];   // on the pad, about its origin, pad frame [N, N m]
};

// What there is to know of a body's geometry, in its own frame. Immutable, shared.
struct BodyGeometry {
  RigidBody curved;             // its shapes, none where only the host knows them
  GapLimits limits;
  std::vector<double> facing;   // unit vectors that point up from the pad when it lies on one of its faces, (faces, 3)
};

// What reading needs besides: it may take milliseconds, and is asked only where nothing faster is known.
class Host {
 public:
  virtual ~Host() = default;
  // A body's geometry; null where only the host presses it.
  virtual std::shared_ptr<const BodyGeometry> body(int body) = 0;
  // One of its faces, by number; null where it is no flat face that could press by itself.
  virtual std::shared_ptr<const Face> face(int body, int number) = 0;
  // The part of it over the sheet, when it stands at (x, y) [m], turned by an angle [rad]; null for none.
  virtual std::shared_ptr<const Face> cut_face(int body, int number, const double* place) = 0;
  // Nodal forces (nodes y, nodes x, 3) [N] of one body's contact; false where it has none.
  virtual bool nodal_forces(const Touch& touch, double* forces) = 0;
  // A contact has left the range of small strains: mean pressure [Pa], indentation [m].
  virtual void beyond_range(const Touch& touch, double pressure, double approach) = 0;
  // A force passes beside what it presses through; the nearest that the contact carries is read.
  virtual void not_carried(const Touch& touch) = 0;
};

// Numbers kept with the simulation's state.
struct Steadiness {
  double pose = 0.0;    // of all touching bodies, rounded and hashed
  double steps = 0.0;   // for which it has been the same
};

// One pad in one simulation.
template <typename Value>
class PadSensor {
 public:
  // `native`: whether faces are pressed here; otherwise the host does all of it. Tolerance: of poses [m or rad].
  PadSensor(std::shared_ptr<const Pad> pad, LawOptions options, bool native, double tolerance);

  // Response to everything that touches; readings() and stress() look at it.
  void press(const Touch* touches, std::size_t count, const Steadiness& before, Host& host);
  void readings(double* readings);   // (taxels) [Pa]
  void stress(double* stress);       // (6, taxels) [Pa]; the pad must have it
  // What to keep with the state for the next step.
  Steadiness after(const Steadiness& before) const;

 private:
  struct KnownBody {
    int number;
    std::shared_ptr<const BodyGeometry> geometry;
    std::vector<std::pair<bool, std::shared_ptr<const Face>>> faces;  // whether asked for, and the answer
  };
  void press_one(const Touch& touch, bool steady, Host& host);
  bool press_face(const Touch& touch, KnownBody& body, bool steady, Host& host, bool& faced);
  bool press_steady(const Touch& touch, const std::shared_ptr<const Face>& face, Host& host);
  bool press_uniform(const Touch& touch, const Face& face, const Placement& placement, Host& host);
  bool press_curved(const Touch& touch, const BodyGeometry& geometry, Host& host);
  void warn_not_carried(const Touch& touch, Host& host);
  void warn_beyond_range(const Touch& touch, double pressure, double approach, Host& host);
  void add(const double* forces);
  KnownBody& known_body(int number, Host& host);
  int face_towards(const Touch& touch, KnownBody& body, Host& host, Placement& placement) const;
  std::shared_ptr<const Face> cut_face_of(const Touch& touch, int face, const Placement& placement, Host& host);
  bool over_sheet(const Face& face, const Placement& placement) const;

  std::shared_ptr<const Pad> pad_;
  LawOptions options_;
  bool native_;
  double tolerance_, key_ = 0.0;
  bool touched_ = false, warned_range_ = false, warned_carried_ = false;
  struct CutFace {
    int body, number;
    std::array<std::int64_t, 3> place;
    std::shared_ptr<const Face> face;
  };
  std::vector<KnownBody> bodies_;
  std::list<CutFace> cut_faces_;  // latest used first
  std::vector<Value> response_, mean_response_;
  std::vector<double> forces_, weights_, means_;
  FlatPress flat_;
  GapMap gap_;
  ClosingPress curved_;
  LinearTraction traction_;
  CellContact::Workspace workspace_;
  typename StressMap<Value>::Workspace map_workspace_;
  std::vector<std::uint32_t> every_;
  std::vector<Value> part_weights_;
};

}  // namespace mjtactile
