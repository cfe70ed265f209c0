// One pad of a model, read in one simulation.
#pragma once

#include <memory>
#include <vector>

#include "api/handles.hpp"
#include "plugin/contacts.hpp"
#include "plugin/model_geometry.hpp"
#include "plugin/notes.hpp"
#include "plugin/plugin.h"

namespace mjtactile::mujoco {

class Reader {
 public:
  Reader(const mjt_instance& resolved, std::shared_ptr<const Pad> pad, int geom, std::shared_ptr<Context> context);
  void prepare(const Model* model) { geometry_.prepare(model, geom_); }
  // Copy the contacts of another reader, so that those of sleeping bodies are known.
  void take_sleeping(const Reader& other) { contacts_ = other.contacts_; }

  // Gather the contacts. With `press`, compute the pad's response as well.
  void read(const Model* model, const Data* data, const Steadiness& before, bool press);

  // The numbers to keep. They are 0 without contacts.
  Steadiness after() const;
  const double* wrench() const { return contacts_.wrench; }
  const double* health() const { return health_; }
  PadSensor& sensor() { return sensor_; }
  const PadSensor& sensor() const { return sensor_; }
  const std::shared_ptr<const Pad>& pad() const { return pad_; }
  int geom() const { return geom_; }
  const std::shared_ptr<Context>& context() const { return context_; }

 private:
  void tell(const Pressed::Note& note);
  bool has_own_size(const Model* model) const;

  int geom_;
  double size_tolerance_;   // largest difference between the pad's size and its geom's [m]
  std::vector<int> pieces_;   // geoms of the pad; found at the first reading
  std::shared_ptr<Context> context_;
  ModelGeometry geometry_;
  std::shared_ptr<const Pad> pad_;
  PadSensor sensor_;
  Steadiness before_;
  bool presses_ = false;    // whether the last reading computed the pad's response
  Contacts contacts_;
  static_assert(MJT_HEALTH == 4 + kEvents, "readings, events, slow, very slow, slowest");
  double health_[MJT_HEALTH] = {};
};

}  // namespace mjtactile::mujoco
