#include "plugin.h"

#include <algorithm>
#include <functional>
#include <memory>
#include <mutex>
#include <shared_mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "contacts.hpp"
#include "handles.hpp"
#include "mujoco_view.hpp"

namespace mjtactile::mujoco {
namespace {

const char* const kAttributes[] = {"pad", "fidelity", "output", "law", "tangential", "friction", "tilt", "visual"};
constexpr std::size_t kAttributeCount = sizeof kAttributes / sizeof kAttributes[0];
// Of a heat map: thickness of its tiles and how high they hover [m], their share of the pitch, and their opacity.
constexpr double kTileThickness = 2e-5, kHover = 5e-5, kTileShare = 0.46;
constexpr float kOpacity = 0.75f;

Layout layout;
Functions functions;
mjt_plugin_host python;

// Python's part of an instance, which copies of a simulation share.
struct Context {
  explicit Context(std::int64_t id) : number(id) {}
  ~Context() {
    if (python.release != nullptr) python.release(number);
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  const std::int64_t number;
};

// One pad in one simulation.
class Instance {
 public:
  Instance(const mjt_instance& resolved, int geom, std::vector<int> addresses, std::shared_ptr<Context> context)
      : resolved_(resolved),
        geom_(geom),
        addresses_(std::move(addresses)),
        context_(std::move(context)),
        host_(python.host, context_->number),
        sensor_(resolved.pad->pad,
                {static_cast<Law>(resolved.law), resolved.tilting != 0, resolved.friction,
                 static_cast<std::size_t>(resolved.cells)},
                resolved.native != 0,
                resolved.tolerance) {
    const int* outputs = resolved_.outputs;
    needs_stress_ = resolved_.visual != 0 || std::any_of(outputs, outputs + resolved_.output_count,
                                                         [](int output) { return output != MJT_WRENCH; });
  }
  // The same pad in another simulation, which keeps memory of its own.
  std::unique_ptr<Instance> another() const {
    return std::make_unique<Instance>(resolved_, geom_, addresses_, context_);
  }

  void compute(const Model* model, Data* data, const double* state) {
    gather(layout, functions, model, data, geom_, touches_);
    std::fill(wrench_, wrench_ + 6, 0.0);
    for (const Touch& touch : touches_) {
      for (int k = 0; k < 6; ++k) wrench_[k] += touch.wrench[k];
    }
    if (needs_stress_) press(state);
    double* sensordata = field<double*>(data, layout.data_sensordata);
    for (const int address : addresses_) {
      double* to = sensordata + address;
      for (int i = 0; i < resolved_.output_count; ++i) to = write(resolved_.outputs[i], to);
    }
  }

  void advance(double* state) const {
    if (!needs_stress_) return;
    const Steadiness after = sensor_.after(before_);
    state[0] = after.pose;
    state[1] = after.steps;
  }

  void visualize(const Model* model, const Data* data, Scene* scene) {
    if (resolved_.visual == 0) return;
    readings_.resize(static_cast<std::size_t>(resolved_.taxels));
    sensor_.readings(readings_.data());
    const std::size_t surface = static_cast<std::size_t>(resolved_.rows * resolved_.columns);
    const double most = *std::max_element(readings_.begin(), readings_.begin() + static_cast<std::ptrdiff_t>(surface));
    if (!(most > 0.0)) return;
    const Frame frame = pad_frame(layout, model, data, geom_);
    const double size[3] = {kTileShare * resolved_.pitch[0], kTileShare * resolved_.pitch[1], kTileThickness / 2};
    int& count = field<int>(scene, layout.scene_ngeom);
    char* geoms = field<char*>(scene, layout.scene_geoms);
    for (int row = 0; row < resolved_.rows; ++row) {
      for (int column = 0; column < resolved_.columns; ++column) {
        if (count >= field<int>(scene, layout.scene_maxgeom)) return;
        const double at[3] = {resolved_.centre[0] + (column - (resolved_.columns - 1) / 2.0) * resolved_.pitch[0],
                              resolved_.centre[1] + (row - (resolved_.rows - 1) / 2.0) * resolved_.pitch[1], kHover};
        double position[3];
        for (int i = 0; i < 3; ++i) {
          position[i] = frame.origin[i];
          for (int j = 0; j < 3; ++j) position[i] += frame.rotation[3 * i + j] * at[j];
        }
        const auto heat = static_cast<float>(readings_[static_cast<std::size_t>(row * resolved_.columns + column)] / most);
        const float rgba[4] = {std::min(1.0f, 2 * heat), std::max(0.0f, 2 * heat - 1.0f), 1.0f - heat, kOpacity};
        functions.init_geom(geoms + count * layout.scene_geom_size, static_cast<int>(layout.geom_box), size, position,
                            frame.rotation, rgba);
        ++count;
      }
    }
  }

 private:
  void press(const double* state) {
    // Flexes have no footprint that is modelled; their wrench counts all the same.
    const Touch* first = touches_.data();
    std::size_t count = touches_.size();
    if (count > 0 && first->body < 0) ++first, --count;
    before_ = {state[0], state[1]};
    sensor_.press(first, count, before_, host_);
  }

  double* write(int output, double* to) {
    switch (output) {
      case MJT_STRESS:
        sensor_.stress(to);
        return to + kTensor * static_cast<std::size_t>(resolved_.taxels);
      case MJT_WRENCH:
        return std::copy(wrench_, wrench_ + 6, to);
      default:
        sensor_.readings(to);
        return to + resolved_.taxels;
    }
  }

  mjt_instance resolved_;
  int geom_;
  std::vector<int> addresses_;
  std::shared_ptr<Context> context_;
  CallbackHost host_;
  AnySensor sensor_;
  bool needs_stress_ = true;  // or contact forces alone, which MuJoCo has solved
  Steadiness before_;
  std::vector<Touch> touches_;
  std::vector<double> readings_;
  double wrench_[6] = {};
};

// Instances by simulation. MuJoCo has a place for a pointer in each mjData, but a simulation restored from a pickle
// holds the pointers of the one it was made from: they cannot be trusted, and stay unused.
class Registry {
 public:
  Instance* find(const Data* data, int instance) {
    const std::shared_lock<std::shared_mutex> lock(mutex_);
    const auto found = instances_.find({data, instance});
    return found == instances_.end() ? nullptr : found->second.get();
  }
  void keep(const Data* data, int instance, std::unique_ptr<Instance> made) {
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    instances_[{data, instance}] = std::move(made);
  }
  void drop(const Data* data, int instance) {
    std::unique_ptr<Instance> dropped;  // outlives the lock: its end calls Python
    const std::unique_lock<std::shared_mutex> lock(mutex_);
    const auto found = instances_.find({data, instance});
    if (found == instances_.end()) return;
    dropped = std::move(found->second);
    instances_.erase(found);
  }

 private:
  using Key = std::pair<const Data*, int>;
  struct Hash {
    std::size_t operator()(const Key& key) const {
      return std::hash<const Data*>()(key.first) ^ (static_cast<std::size_t>(key.second) * 0x9e3779b97f4a7c15u);
    }
  };
  std::shared_mutex mutex_;
  std::unordered_map<Key, std::unique_ptr<Instance>, Hash> instances_;
};

// Never destroyed: simulations may end after this library's own statics.
Registry& registry() {
  static auto* const all = new Registry;
  return *all;
}

double* state_of(const Model* model, Data* data, int instance) {
  return field<double*>(data, layout.data_plugin_state) +
         field<const int*>(model, layout.model_plugin_stateadr)[instance];
}

// What an instance's attributes mean, the host's part included where `geom` is one; false, and the error, if wrong.
bool resolve(const Model* model, int instance, int geom, mjt_instance& resolved) {
  const char* values[kAttributeCount];
  for (std::size_t i = 0; i < kAttributeCount; ++i) {
    const char* value = functions.plugin_config(model, instance, kAttributes[i]);
    values[i] = value == nullptr ? "" : value;
  }
  std::memset(&resolved, 0, sizeof resolved);
  return python.resolve(geom < 0 ? nullptr : static_cast<const void*>(model), geom, values, &resolved) != 0;
}

int nstate(const Model*, int) { return 2; }

int nsensordata(const Model* model, int instance, int) {
  mjt_instance resolved;
  if (!resolve(model, instance, -1, resolved)) return 0;  // init will say why
  int size = 0;
  for (int i = 0; i < resolved.output_count; ++i) {
    const int output = resolved.outputs[i];
    size += output == MJT_WRENCH ? 6 : output == MJT_STRESS ? static_cast<int>(kTensor) * resolved.taxels : resolved.taxels;
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
      functions.warning("%s", "mjtactile.pad reads one box geom: write objtype=\"geom\" objname=\"name of the pad's geom\" "
                              "in the sensor, and give every pad an instance of its own.");
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
  mjt_instance resolved;
  if (!resolve(model, instance, geom, resolved)) {
    functions.warning("%s", resolved.error);
    return -1;
  }
  registry().keep(data, instance,
                  std::make_unique<Instance>(resolved, geom, std::move(addresses),
                                             std::make_shared<Context>(resolved.context)));
  return 0;
}

void destroy(Data* data, int instance) { registry().drop(data, instance); }

// Every simulation keeps its own memory, the state is MuJoCo's: only a copy that was made without `init` needs more.
void copy(Data* to, const Model*, const Data* from, int instance) {
  const Instance* original = registry().find(from, instance);
  if (original != nullptr && registry().find(to, instance) == nullptr) {
    registry().keep(to, instance, original->another());
  }
}

void reset(const Model*, double* state, void*, int) { state[0] = state[1] = 0.0; }

void compute(const Model* model, Data* data, int instance, int capability) {
  if ((capability & layout.capability_sensor) == 0) return;
  if (Instance* found = registry().find(data, instance)) found->compute(model, data, state_of(model, data, instance));
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

void mjt_plugin_leave(void) { python.release = nullptr; }

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
