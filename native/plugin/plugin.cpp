#include "plugin/plugin.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <set>
#include <shared_mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "api/handles.hpp"
#include "plugin/contacts.hpp"
#include "plugin/model_geometry.hpp"
#include "plugin/mujoco_view.hpp"

namespace mjtactile::mujoco {
namespace {

const char* const kAttributes[] = {"pad", "fidelity", "output", "law", "tangential", "friction", "tilt", "visual"};
constexpr std::size_t kAttributeCount = sizeof kAttributes / sizeof kAttributes[0];
// Thickness [m] and opacity of a heat map's tiles.
constexpr double kTileThickness = 2e-5;
constexpr float kOpacity = 0.75f;
// Readings that take longer than these are counted [s].
constexpr double kSlow = 1e-3, kVerySlow = 5e-3;
// Threads are woken for sensors that took longer than this together, without the one that took longest [s]. To wake
// them takes about a third of it.
constexpr double kWorthThreads = 1e-4;
// The body of a note that is about the pad alone.
constexpr int kNoBody = -1;

Layout layout;
Functions functions;
mjt_plugin_host python;

// Queue of warnings until Python fetches them. It may be used from several threads.
class Notes {
 public:
  void add(const mjt_note& note) {
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_.push_back(note);
    if (!scheduled_ && python.schedule != nullptr) scheduled_ = python.schedule(python.deliver, nullptr) == 0;
  }
  bool next(mjt_note& note) {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (waiting_.empty()) {
      scheduled_ = false;
      return false;
    }
    note = waiting_.front();
    waiting_.pop_front();
    return true;
  }

 private:
  std::mutex mutex_;
  std::deque<mjt_note> waiting_;
  bool scheduled_ = false;
};

Notes& notes() {
  static auto* const all = new Notes;
  return *all;
}

// Python's part of an instance, which copies of a simulation share, and the warnings that were given for it.
class Context {
 public:
  explicit Context(std::int64_t number) : number_(number) {}
  ~Context() {
    if (python.release != nullptr) python.release(number_);
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  void warn(const Pressed::Note& note) {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (!warned_.insert({note.event, note.body}).second) return;
    }
    notes().add({number_, static_cast<int>(note.event), note.body, note.pressure, note.indentation});
  }

 private:
  const std::int64_t number_;
  std::mutex mutex_;
  std::set<std::pair<Event, int>> warned_;
};

LawOptions options_of(const mjt_instance& resolved) {
  return law_options(resolved.law, resolved.tangential, resolved.tilting, resolved.friction,
                     static_cast<std::size_t>(resolved.cells), resolved.strength);
}

// One pad of a model, read in one simulation.
class Reader {
 public:
  Reader(const mjt_instance& resolved, int geom, std::shared_ptr<Context> context)
      : geom_(geom),
        size_tolerance_(resolved.size_tolerance),
        context_(std::move(context)),
        geometry_(layout, side_limits(options_of(resolved), resolved.facing_gap)),
        pad_(resolved.pad->pad),
        sensor_(resolved.pad->pad, options_of(resolved), resolved.facing_gap, resolved.tolerance) {}
  void prepare(const Model* model) { geometry_.prepare(model, geom_); }
  // Copy the contacts of another reader, so that those of sleeping bodies are known.
  void take_sleeping(const Reader& other) { contacts_ = other.contacts_; }

  // Gather the contacts. With `press`, compute the pad's response as well.
  void read(const Model* model, const Data* data, const Steadiness& before, bool press) {
    before_ = before;
    const bool sleeping = keep_sleeping(model, data);
    if (pieces_.empty()) pieces_ = pad_pieces(layout, model, geom_);
    contacts_.gather(layout, functions, model, data, pieces_, pad_->outer());
    if (sleeping) add_sleeping();
    if (!press) return;
    const auto start = std::chrono::steady_clock::now();
    for (std::size_t i = 0; i < contacts_.count; ++i) {
      Touch& touch = contacts_.touches[i];
      if (touch.body >= 0) touch.geometry = geometry_.body(model, touch.links, geom_);
    }
    sensor_.press(contacts_.touches.data(), contacts_.count, before);
    if (contacts_.count == 0) return;
    health_[0] += 1.0;
    for (const Pressed::Note& note : sensor_.pressed().notes) tell(note);
    if (!has_own_size(model)) tell({Event::resized, kNoBody, 0.0, 0.0});
    const double took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    if (took > kSlow) health_[1 + kEvents] += 1.0;
    if (took > kVerySlow) health_[2 + kEvents] += 1.0;
    health_[3 + kEvents] = std::max(health_[3 + kEvents], took);
  }

  Steadiness after() const { return sensor_.after(before_); }
  const double* wrench() const { return contacts_.wrench; }
  const double* health() const { return health_; }
  AnySensor& sensor() { return sensor_; }
  const std::vector<Tile>& tiles() const { return pad_->tiles(); }
  int geom() const { return geom_; }
  const std::shared_ptr<Context>& context() const { return context_; }

 private:
  void tell(const Pressed::Note& note) {
    health_[1 + static_cast<std::size_t>(note.event)] += 1.0;
    if (context_ != nullptr) context_->warn(note);
  }
  // Whether the geom of a flat pad is as large as the pad. It was when the simulation was made, but models can change.
  bool has_own_size(const Model* model) const {
    if (!pad_->outer().is_flat()) return true;
    const double* half = field<const double*>(model, layout.model_geom_size) + 3 * geom_;
    const SurfaceGrid& surface = pad_->surface();
    const double own[3] = {surface.high_x() - surface.low_x(), surface.high_y() - surface.low_y(), pad_->depth()};
    const double most = size_tolerance_;
    return std::equal(own, own + 3, half, [most](double a, double b) { return std::abs(a - 2.0 * b) <= most; });
  }
  // MuJoCo has no contacts of sleeping bodies. They have not moved, so their last contacts are used.
  bool keep_sleeping(const Model*, const Data* data) {
    sleeping_.clear();
    // The last contacts do not belong to a simulation that was reset or set to a state without contact.
    if (layout.data_body_awake < 0 || (before_.pose == 0.0 && before_.steps == 0.0)) return false;
    const int* awake = field<const int*>(data, layout.data_body_awake);
    for (std::size_t i = 0; i < contacts_.count; ++i) {
      const int body = contacts_.touches[i].body;
      if (body >= 0 && awake[body] == kAsleep) sleeping_.push_back(contacts_.touches[i]);
    }
    return !sleeping_.empty();
  }
  void add_sleeping() {
    for (const Touch& touch : sleeping_) {
      const auto end = contacts_.touches.begin() + static_cast<std::ptrdiff_t>(contacts_.count);
      if (std::any_of(contacts_.touches.begin(), end, [&](const Touch& one) { return one.body == touch.body; })) {
        continue;
      }
      contacts_.touches.insert(end, touch);
      ++contacts_.count;
      for (int k = 0; k < 6; ++k) contacts_.wrench[k] += touch.wrench[k];
    }
    std::sort(contacts_.touches.begin(), contacts_.touches.begin() + static_cast<std::ptrdiff_t>(contacts_.count),
              [](const Touch& a, const Touch& b) { return a.body < b.body; });
  }

  int geom_;
  double size_tolerance_;   // largest difference between the pad's size and its geom's [m]
  std::vector<int> pieces_;   // geoms of the pad; found at the first reading
  std::shared_ptr<Context> context_;
  ModelGeometry geometry_;
  std::shared_ptr<const Pad> pad_;
  AnySensor sensor_;
  Steadiness before_;
  Contacts contacts_;
  std::vector<Touch> sleeping_;
  static_assert(MJT_HEALTH == 4 + kEvents, "readings, events, slow, very slow, slowest");
  double health_[MJT_HEALTH] = {};
};

// One sensor in one simulation.
class Instance {
 public:
  Instance(const mjt_instance& resolved, int geom, std::vector<int> addresses, std::shared_ptr<Context> context)
      : resolved_(resolved), addresses_(std::move(addresses)), reader_(resolved, geom, std::move(context)) {
    const int* outputs = resolved_.outputs;
    needs_stress_ = resolved_.visual != 0 || std::any_of(outputs, outputs + resolved_.output_count,
                                                         [](int output) { return output != MJT_WRENCH; });
  }
  void prepare(const Model* model) { reader_.prepare(model); }
  void take_sleeping(const Instance& other) { reader_.take_sleeping(other.reader_); }
  // An instance of the same pad for another simulation, with its own memory.
  std::unique_ptr<Instance> another() const {
    auto made = std::make_unique<Instance>(resolved_, reader_.geom(), addresses_, reader_.context());
    made->reader_.take_sleeping(reader_);
    return made;
  }

  void compute(const Model* model, Data* data, const double* state) {
    reader_.read(model, data, {state[0], state[1]}, needs_stress_);
    double* sensordata = field<double*>(data, layout.data_sensordata);
    for (const int address : addresses_) {
      double* to = sensordata + address;
      for (int i = 0; i < resolved_.output_count; ++i) to = write(resolved_.outputs[i], to);
    }
  }

  void advance(double* state) const {
    if (!needs_stress_) return;
    const Steadiness after = reader_.after();
    state[0] = after.pose;
    state[1] = after.steps;
  }

  const double* health() const { return reader_.health(); }

  void visualize(const Model* model, const Data* data, Scene* scene) {
    if (resolved_.visual == 0) return;
    readings_.resize(static_cast<std::size_t>(resolved_.taxels));
    reader_.sensor().readings(readings_.data());
    const std::vector<Tile>& tiles = reader_.tiles();
    double most = 0.0;
    for (const Tile& tile : tiles) most = std::max(most, readings_[tile.reading]);
    if (!(most > 0.0)) return;
    const Frame frame = pad_frame(layout, model, data, reader_.geom());
    int& count = field<int>(scene, layout.scene_ngeom);
    char* geoms = field<char*>(scene, layout.scene_geoms);
    for (const Tile& tile : tiles) {
      if (count >= field<int>(scene, layout.scene_maxgeom)) return;
      double position[3], rotation[9];
      for (int i = 0; i < 3; ++i) {
        position[i] = frame.origin[i];
        for (int j = 0; j < 3; ++j) {
          position[i] += frame.rotation[3 * i + j] * tile.position[j];
          rotation[3 * i + j] = 0.0;
          for (int k = 0; k < 3; ++k) rotation[3 * i + j] += frame.rotation[3 * i + k] * tile.rotation[3 * k + j];
        }
      }
      const double size[3] = {tile.half_size[0], tile.half_size[1], kTileThickness / 2};
      const auto heat = static_cast<float>(readings_[tile.reading] / most);
      const float rgba[4] = {std::min(1.0f, 2 * heat), std::max(0.0f, 2 * heat - 1.0f), 1.0f - heat, kOpacity};
      functions.init_geom(geoms + count * layout.scene_geom_size, static_cast<int>(layout.geom_box), size, position,
                          rotation, rgba);
      ++count;
    }
  }

 private:
  double* write(int output, double* to) {
    switch (output) {
      case MJT_STRESS:
        reader_.sensor().stress(to);
        return to + kTensor * static_cast<std::size_t>(resolved_.taxels);
      case MJT_WRENCH:
        return std::copy(reader_.wrench(), reader_.wrench() + 6, to);
      case MJT_CARRIED:
        return std::copy(reader_.sensor().pressed().carried, reader_.sensor().pressed().carried + 6, to);
      case MJT_RANGE:
        *to = reader_.sensor().pressed().range;
        return to + 1;
      default:
        reader_.sensor().readings(to);
        return to + resolved_.taxels;
    }
  }

  mjt_instance resolved_;
  std::vector<int> addresses_;
  Reader reader_;
  bool needs_stress_ = true;  // false if only the contact wrench is wanted
  std::vector<double> readings_;
};

double* state_of(const Model* model, Data* data, int instance) {
  return field<double*>(data, layout.data_plugin_state) +
         field<const int*>(model, layout.model_plugin_stateadr)[instance];
}

// The sensors of one simulation. MuJoCo computes them one after the other, in the order of their numbers. If the
// simulation has a pool of threads (mju_threadpool), the first one has all of them computed, on these threads.
class Simulation {
 public:
  bool empty() const { return members_.empty(); }
  Instance* find(int number) {
    const auto at = place(number);
    return at != members_.end() && at->number == number ? at->instance.get() : nullptr;
  }
  void keep(int number, std::unique_ptr<Instance> made) {
    const auto at = place(number);
    if (at != members_.end() && at->number == number) {
      at->instance = std::move(made);
    } else {
      members_.insert(at, {number, std::move(made), 0.0});
    }
  }
  std::unique_ptr<Instance> take(int number) {
    const auto at = place(number);
    if (at == members_.end() || at->number != number) return nullptr;
    std::unique_ptr<Instance> taken = std::move(at->instance);
    members_.erase(at);
    return taken;
  }

  void compute(const Model* model, Data* data, int number) {
    if (empty()) return;
    if (number == members_.front().number) all_computed_ = compute_all(model, data);
    if (all_computed_) return;
    if (Instance* found = find(number)) found->compute(model, data, state_of(model, data, number));
  }

 private:
  struct Member {
    int number;
    std::unique_ptr<Instance> instance;
    double took;   // time that it took last, if it was computed with the others [s]
  };

  std::vector<Member>::iterator place(int number) {
    return std::lower_bound(members_.begin(), members_.end(), number,
                            [](const Member& member, int other) { return member.number < other; });
  }

  // False if the simulation has no other threads. Sensors that took longest are computed first, because the threads
  // then end at about the same time.
  bool compute_all(const Model* model, Data* data) {
    const int count = static_cast<int>(members_.size());
    if (count < 2 || functions.dispatch == nullptr || functions.thread_count(data) < 2) return false;
    queue_.clear();
    for (Member& member : members_) queue_.push_back(&member);
    std::sort(queue_.begin(), queue_.end(), [](const Member* a, const Member* b) { return a->took > b->took; });
    double others = 0.0;
    for (int task = 1; task < count; ++task) others += queue_[static_cast<std::size_t>(task)]->took;
    if (others > kWorthThreads) {
      functions.dispatch(model, data, compute_one, this, count);
    } else {
      for (int task = 0; task < count; ++task) compute_one(model, data, this, 0, task);
    }
    return true;
  }
  static void compute_one(const Model* model, Data* data, void* simulation, int, int task) {
    Member& member = *static_cast<Simulation*>(simulation)->queue_[static_cast<std::size_t>(task)];
    const auto start = std::chrono::steady_clock::now();
    member.instance->compute(model, data, state_of(model, data, member.number));
    member.took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  std::vector<Member> members_;    // by number
  std::vector<Member*> queue_;     // in the order in which they are computed
  bool all_computed_ = false;      // whether the first one had all of them computed
};

// All simulations. The plugin's pointers in mjData are not used: a simulation that is restored from a pickle has those
// of the simulation it was made from.
class Registry {
 public:
  Simulation* find(const Data* data) {
    const std::shared_lock<std::shared_mutex> lock(mutex_);
    const auto found = simulations_.find(data);
    return found == simulations_.end() ? nullptr : found->second.get();
  }
  Instance* find(const Data* data, int instance) {
    Simulation* found = find(data);
    return found == nullptr ? nullptr : found->find(instance);
  }
  void keep(const Data* data, int instance, std::unique_ptr<Instance> made) {
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    std::unique_ptr<Simulation>& simulation = simulations_[data];
    if (simulation == nullptr) simulation = std::make_unique<Simulation>();
    simulation->keep(instance, std::move(made));
  }
  void drop(const Data* data, int instance) {
    std::unique_ptr<Instance> dropped;  // destroyed after the lock is released, because its destructor calls Python
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    const auto found = simulations_.find(data);
    if (found == simulations_.end()) return;
    dropped = found->second->take(instance);
    if (found->second->empty()) simulations_.erase(found);
  }

 private:
  std::shared_mutex mutex_;
  std::unordered_map<const Data*, std::unique_ptr<Simulation>> simulations_;
};

// Never destroyed, because simulations may end after this library's static objects.
Registry& registry() {
  static auto* const all = new Registry;
  return *all;
}

// Have Python interpret an instance's attributes. With `geom` < 0, only what the output's size depends on. False if the
// attributes are wrong; `resolved` then has the error.
bool resolve(const Model* model, int instance, int geom, mjt_instance& resolved) {
  const char* values[kAttributeCount];
  for (std::size_t i = 0; i < kAttributeCount; ++i) {
    const char* value = functions.plugin_config(model, instance, kAttributes[i]);
    values[i] = value == nullptr ? "" : value;
  }
  std::memset(&resolved, 0, sizeof resolved);
  return python.resolve(geom < 0 ? nullptr : static_cast<const void*>(model), geom, values, &resolved) != 0;
}

// A geom that may collide with the pad but has no usable shape, or -1.
int unseen_geom(const Model* model, int pad) {
  const int* contype = field<const int*>(model, layout.model_geom_contype);
  const int* conaffinity = field<const int*>(model, layout.model_geom_conaffinity);
  const int* body = field<const int*>(model, layout.model_geom_bodyid);
  for (int k = 0; k < field<int>(model, layout.model_nbody); ++k) {
    const int first = field<const int*>(model, layout.model_body_geomadr)[k];
    for (int geom = first; geom < first + field<const int*>(model, layout.model_body_geomnum)[k]; ++geom) {
      const bool collides = (contype[geom] & conaffinity[pad]) != 0 || (contype[pad] & conaffinity[geom]) != 0;
      if (collides && body[geom] != body[pad] && !can_be_seen(layout, model, geom)) return geom;
    }
  }
  return -1;
}

int nstate(const Model*, int) { return 2; }

int nsensordata(const Model* model, int instance, int) {
  mjt_instance resolved;
  if (!resolve(model, instance, -1, resolved)) return 0;  // init() reports the error
  int size = 0;
  for (int i = 0; i < resolved.output_count; ++i) {
    const int output = resolved.outputs[i];
    size += output == MJT_WRENCH || output == MJT_CARRIED ? 6
            : output == MJT_RANGE                         ? 1
            : output == MJT_STRESS                        ? static_cast<int>(kTensor) * resolved.taxels
                                                          : resolved.taxels;
  }
  return size;
}

int init(const Model* model, Data* data, int instance) {
  int geom = -1;
  std::vector<int> addresses;
  for (int i = 0; i < field<int>(model, layout.model_nsensor); ++i) {
    if (field<const int*>(model, layout.model_sensor_plugin)[i] != instance) continue;
    const int type = field<const int*>(model, layout.model_sensor_objtype)[i];
    const int object = field<const int*>(model, layout.model_sensor_objid)[i];
    if (type != layout.object_geom || (geom >= 0 && object != geom)) {
      functions.warning("%s", "mjtactile.pad reads one geom, a box or a curved pad's mesh: write objtype=\"geom\" "
                              "objname=\"name of the pad's geom\" in the sensor, and give every pad an instance of its "
                              "own.");
      return -1;
    }
    if (layout.model_sensor_history >= 0 && field<const int*>(model, layout.model_sensor_history)[2 * i] > 0) {
      functions.warning("%s", "a sensor of mjtactile.pad asks for a history (nsample, interval, delay), for which "
                              "MuJoCo makes too little room where sensors are plugins, and would write beyond it. "
                              "Leave these attributes out; to read a pad less often than every step, leave its sensor "
                              "out and ask "
                              "mjtactile.TactileSensor(model, geom=...).read(data) when a reading is needed.");
      return -1;
    }
    geom = object;
    addresses.push_back(field<const int*>(model, layout.model_sensor_adr)[i]);
  }
  if (geom < 0) {
    functions.warning("%s", "an instance of mjtactile.pad belongs to no sensor. Write <sensor><plugin "
                            "plugin=\"mjtactile.pad\" objtype=\"geom\" objname=\"...\"/></sensor>.");
    return -1;
  }
  if (const int unseen = unseen_geom(model, geom); unseen >= 0) {
    const char* names = field<const char*>(model, layout.model_names);
    functions.warning("mjtactile.pad: geom number %d ('%s') collides with the pad, but has neither a mesh nor a shape "
                      "to look at. Give it a mesh, or keep it from colliding with the pad by contype and conaffinity.",
                      unseen, names + field<const int*>(model, layout.model_name_geomadr)[unseen]);
    return -1;
  }
  mjt_instance resolved;
  if (!resolve(model, instance, geom, resolved)) {
    functions.warning("%s", resolved.error);
    return -1;
  }
  auto made = std::make_unique<Instance>(resolved, geom, std::move(addresses),
                                         std::make_shared<Context>(resolved.context));
  made->prepare(model);
  registry().keep(data, instance, std::move(made));
  return 0;
}

void destroy(Data* data, int instance) { registry().drop(data, instance); }

// MuJoCo copies the plugin's state. A copied simulation also needs the contacts of sleeping bodies, and a new instance
// if it was made without `init`.
void copy(Data* to, const Model*, const Data* from, int instance) {
  const Instance* original = registry().find(from, instance);
  if (original == nullptr) return;
  if (Instance* known = registry().find(to, instance)) {
    known->take_sleeping(*original);
  } else {
    registry().keep(to, instance, original->another());
  }
}

void reset(const Model*, double* state, void*, int) { state[0] = state[1] = 0.0; }

void compute(const Model* model, Data* data, int instance, int capability) {
  if ((capability & layout.capability_sensor) == 0) return;
  if (Simulation* found = registry().find(data)) found->compute(model, data, instance);
}

void advance(const Model* model, Data* data, int instance) {
  if (const Instance* found = registry().find(data, instance)) found->advance(state_of(model, data, instance));
}

void visualize(const Model* model, Data* data, const Option*, Scene* scene, int instance) {
  if (Instance* found = registry().find(data, instance)) found->visualize(model, data, scene);
}

}  // namespace
}  // namespace mjtactile::mujoco

using namespace mjtactile;
using namespace mjtactile::mujoco;

size_t mjt_plugin_attributes(const char* const** names) {
  *names = kAttributes;
  return kAttributeCount;
}

void mjt_plugin_leave(void) {
  python.release = nullptr;
  python.schedule = nullptr;
}

int mjt_plugin_next_note(mjt_note* note) { return notes().next(*note) ? 1 : 0; }

int mjt_plugin_health(const void* data, int instance, double* health) {
  const Instance* found = registry().find(static_cast<const Data*>(data), instance);
  if (found == nullptr) return 0;
  std::copy(found->health(), found->health() + MJT_HEALTH, health);
  return 1;
}

struct mjt_reader {
  Reader reader;
};

mjt_reader* mjt_reader_new(const mjt_instance* instance, int geom) {
  return new mjt_reader{Reader(*instance, geom, std::make_shared<Context>(instance->context))};
}

void mjt_reader_read(mjt_reader* reader, const void* model, const void* data, double* readings, double* stress,
                     double* forces, double* wrench, double* carried, double* state) {
  Reader& own = reader->reader;
  AnySensor& sensor = own.sensor();
  sensor.keep_nodal_forces(forces != nullptr);
  // A reader has no state in the simulation. So a pose never counts as steady, and contacts of sleeping bodies are
  // those of the last reading.
  own.read(static_cast<const Model*>(model), static_cast<const Data*>(data), {1.0, 0.0}, true);
  if (readings != nullptr) sensor.readings(readings);
  if (stress != nullptr) sensor.stress(stress);
  if (forces != nullptr) std::copy(sensor.nodal_forces().begin(), sensor.nodal_forces().end(), forces);
  if (wrench != nullptr) std::copy(own.wrench(), own.wrench() + 6, wrench);
  if (carried != nullptr) std::copy(sensor.pressed().carried, sensor.pressed().carried + 6, carried);
  if (state != nullptr) {
    const Pressed& pressed = sensor.pressed();
    const double numbers[4] = {pressed.range, pressed.indentation, pressed.area, pressed.peak};
    std::copy(numbers, numbers + 4, state);
  }
}

void mjt_reader_health(const mjt_reader* reader, double* health) {
  std::copy(reader->reader.health(), reader->reader.health() + MJT_HEALTH, health);
}

void mjt_reader_free(mjt_reader* reader) { delete reader; }

int mjt_plugin_register(const int64_t* offsets, size_t layout_count, const void* const* pointers,
                        size_t function_count, const mjt_plugin_host* host) {
  if (layout_count * sizeof(int64_t) != sizeof layout || function_count * sizeof(void*) != sizeof functions) return -1;
  std::memcpy(&layout, offsets, sizeof layout);
  std::memcpy(&functions, pointers, sizeof functions);
  python = *host;
  static Plugin plugin = {};
  plugin.name = "mjtactile.pad";
  plugin.nattribute = static_cast<int>(kAttributeCount);
  plugin.attributes = kAttributes;
  plugin.capabilityflags = static_cast<int>(layout.capability_sensor);
  plugin.needstage = static_cast<int>(layout.stage_acc);
  plugin.nstate = nstate;
  plugin.nsensordata = nsensordata;
  plugin.init = init;
  plugin.destroy = destroy;
  plugin.copy = mujoco::copy;
  plugin.reset = reset;
  plugin.compute = compute;
  plugin.advance = advance;
  plugin.visualize = visualize;
  return functions.register_plugin(&plugin);
}
