#include "plugin/plugin.h"

#include <algorithm>
#include <cstring>
#include <iterator>
#include <memory>
#include <utility>
#include <vector>

#include "plugin/instance.hpp"
#include "plugin/model_geometry.hpp"
#include "plugin/mujoco_view.hpp"
#include "plugin/notes.hpp"
#include "plugin/reader.hpp"
#include "plugin/simulations.hpp"

namespace mjtactile::mujoco {
namespace {

constexpr std::size_t kAttributeCount = std::size(kAttributes);

// What interrupted Python, by Ctrl-C for example, until Python raises it. MuJoCo has no way to pass it on. So the model
// or data that is being made gets no sensors, and Python raises the exception before it can use what it was given. No
// Python code may run before that, since the exception would be raised there.
struct Interruption {
  void* type = nullptr;
  void* exception = nullptr;
};
thread_local Interruption interruption;

int raise_interruption(void*) {
  const Interruption raised = std::exchange(interruption, {});
  python.raise(raised.type, raised.exception);
  python.drop(raised.exception);
  return -1;
}

// Have Python interpret an instance's attributes. With `geom` < 0, only what the output's size depends on. False if the
// attributes are wrong, in which case `resolved` has the error, or if Python was interrupted.
bool resolve(const Model* model, int instance, int geom, mjt_instance& resolved) {
  if (interruption.exception != nullptr) return false;
  const char* values[kAttributeCount];
  for (std::size_t i = 0; i < kAttributeCount; ++i) {
    const char* value = functions.plugin_config(model, instance, kAttributes[i]);
    values[i] = value == nullptr ? "" : value;
  }
  std::memset(&resolved, 0, sizeof resolved);
  if (python.resolve(geom < 0 ? nullptr : static_cast<const void*>(model), geom, values, &resolved) != 0) return true;
  if (resolved.exception == nullptr) return false;
  if (python.schedule(raise_interruption, nullptr) == 0) {
    interruption = {resolved.exception_type, resolved.exception};
  } else {
    python.drop(resolved.exception);
  }
  return false;
}

// A geom that may collide with the pad but has no usable shape, or -1.
int unseen_geom(const Model* model, int pad) {
  const int* body = ints(model, layout.model_geom_bodyid);
  for (int k = 0; k < field<int>(model, layout.model_nbody); ++k) {
    const int first = ints(model, layout.model_body_geomadr)[k];
    for (int geom = first; geom < first + ints(model, layout.model_body_geomnum)[k]; ++geom) {
      if (body[geom] == body[pad] || can_be_seen(model, geom)) continue;
      if (may_collide(model, geom, pad)) return geom;
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
    size += output_size(resolved.outputs[i], resolved.taxels);
  }
  return size;
}

int init(const Model* model, Data* data, int instance) {
  int geom = -1;
  std::vector<int> addresses;
  for (int i = 0; i < field<int>(model, layout.model_nsensor); ++i) {
    if (ints(model, layout.model_sensor_plugin)[i] != instance) continue;
    const int type = ints(model, layout.model_sensor_objtype)[i];
    const int object = ints(model, layout.model_sensor_objid)[i];
    if (type != layout.object_geom || (geom >= 0 && object != geom)) {
      functions.warning("%s", "mjtactile.pad reads one geom, a box or a curved pad's mesh: write objtype=\"geom\" "
                              "objname=\"name of the pad's geom\" in the sensor, and give every pad an instance of its "
                              "own.");
      return -1;
    }
    if (layout.model_sensor_history >= 0 && ints(model, layout.model_sensor_history)[2 * i] > 0) {
      functions.warning("%s", "a sensor of mjtactile.pad asks for a history (nsample, interval, delay), for which "
                              "MuJoCo makes too little room where sensors are plugins, and would write beyond it. "
                              "Leave these attributes out; to read a pad less often than every step, leave its sensor "
                              "out and ask "
                              "mjtactile.TactileSensor(model, geom=...).read(data) when a reading is needed.");
      return -1;
    }
    geom = object;
    addresses.push_back(ints(model, layout.model_sensor_adr)[i]);
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
                      unseen, names + ints(model, layout.model_name_geomadr)[unseen]);
    return -1;
  }
  mjt_instance resolved;
  if (!resolve(model, instance, geom, resolved)) {
    if (interruption.exception != nullptr) return 0;
    functions.warning("%s", resolved.error);
    return -1;
  }
  auto made = std::make_unique<Instance>(resolved, resolved.pad->pad, geom, std::move(addresses),
                                         std::make_shared<Context>(resolved.context, true));
  made->prepare(model, instance);
  simulations().keep(data, instance, std::move(made));
  return 0;
}

void destroy(Data* data, int instance) { simulations().drop(data, instance); }

// MuJoCo copies the plugin's state and outputs. A simulation that was made without `init` needs a new instance, too.
void copy(Data* to, const Model*, const Data* from, int instance) {
  const Instance* original = simulations().find(from, instance);
  if (original == nullptr) return;
  Instance* known = simulations().find(to, instance);
  if (known == nullptr) {
    simulations().keep(to, instance, original->another());
    known = simulations().find(to, instance);
  }
  known->take(*original);
}

void reset(const Model*, double* state, void*, int) { state[0] = state[1] = 0.0; }

void compute(const Model* model, Data* data, int instance, int capability) {
  if ((capability & layout.capability_sensor) == 0) return;
  if (Simulation* found = simulations().find(data)) found->compute(model, data, instance);
}

void advance(const Model* model, Data* data, int instance) {
  if (Instance* found = simulations().find(data, instance)) found->advance(state_of(model, data, instance));
}

void visualize(const Model* model, Data* data, const Option*, Scene* scene, int instance) {
  if (Instance* found = simulations().find(data, instance)) found->visualize(model, data, scene);
}

}  // namespace
}  // namespace mjtactile::mujoco

using namespace mjtactile;
using namespace mjtactile::mujoco;

size_t mjt_plugin_attributes(const char* const** names) {
  *names = kAttributes;
  return kAttributeCount;
}

void mjt_plugin_leave(void) { python_runs = false; }

int mjt_plugin_next_note(mjt_note* note) { return next_note(*note) ? 1 : 0; }

int mjt_plugin_health(const void* data, int instance, double* health) {
  const Instance* found = simulations().find(static_cast<const Data*>(data), instance);
  if (found == nullptr) return 0;
  std::copy(found->health(), found->health() + MJT_HEALTH, health);
  return 1;
}

struct mjt_reader {
  Reader reader;
};

mjt_reader* mjt_reader_new(const mjt_instance* instance, int geom) {
  auto context = std::make_shared<Context>(instance->context, false);
  return new mjt_reader{Reader(*instance, instance->pad->pad, geom, std::move(context))};
}

void mjt_reader_read(mjt_reader* reader, const void* model, const void* data, double* readings, double* stress,
                     double* forces, double* wrench, double* carried, double* state) {
  Reader& own = reader->reader;
  PadSensor& sensor = own.sensor();
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

size_t mjt_reader_rim(const mjt_reader* reader, double* ends) {
  std::size_t count = 0;
  for (const std::vector<Segment>& rim : reader->reader.sensor().rims()) {
    count += rim.size();
    if (ends != nullptr) ends = copy_edges(rim, ends);
  }
  return count;
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
  python_runs = true;
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
