// Readings of one pad from the bodies that touch it, computed in every step of the simulation.
//
// The response to a flat face that stands still is a combination of a few fixed parts, the wrench basis. The contact of
// a body that moves is solved anew. The caller keeps a few numbers with the simulation's state (Steadiness); they alone
// decide between the two. A basis belongs to a pose rounded to the tolerance. So the same states give the same bits,
// whatever was read before and in whatever order.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <variant>
#include <vector>

#include "contact/basis_cache.hpp"
#include "contact/body_press.hpp"
#include "contact/facing_faces.hpp"
#include "contact/laws/uniform_press.hpp"
#include "contact/pad.hpp"
#include "contact/point_press.hpp"
#include "contact/touch.hpp"

namespace mjtactile {

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
  // Solution of a touch of the last press().
  SolvedCells solved_cells(std::size_t touch) const;
  // Numbers to keep with the state until the next step.
  Steadiness after(const Steadiness& before) const;

 private:
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
  bool press_points(const Touch& seen, const BodyPress& press, std::size_t place);
  void couple(const Touch* touches, std::size_t count);
  void finish(const Touch& touch, BodyPress& press);
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
  Rectangle sheet() const { return pad_->surface().sheet(); }

  std::shared_ptr<const Pad> pad_;
  LawOptions options_;
  double facing_gap_, tolerance_, key_ = 0.0;
  bool touched_ = false, keeps_forces_ = false, only_forces_ = false;
  int power_ = 0;   // forces far from 1 N are scaled by this power of two
  Pressed pressed_;
  FacingFaces faces_;
  std::vector<std::unique_ptr<BodyPress>> presses_;
  std::vector<std::uint8_t> solved_;
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
