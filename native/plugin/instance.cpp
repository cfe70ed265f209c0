#include "plugin/instance.hpp"

#include <algorithm>
#include <cstring>
#include <limits>
#include <utility>

namespace mjtactile::mujoco {
namespace {

// Thickness [m] and opacity of a heat map's tiles.
constexpr double kTileThickness = 2e-5;
constexpr float kOpacity = 0.75f;

// The attributes of an instance in a model, and which sensors it has where.
std::string settings_of(const Model* model, int number) {
  std::string settings;
  for (const char* name : kAttributes) {
    const char* value = functions.plugin_config(model, number, name);
    settings += value == nullptr ? "" : value;
    settings += '\n';
  }
  for (int i = 0; i < field<int>(model, layout.model_nsensor); ++i) {
    if (ints(model, layout.model_sensor_plugin)[i] != number) continue;
    for (const auto offset : {layout.model_sensor_objid, layout.model_sensor_adr, layout.model_sensor_dim}) {
      settings += std::to_string(ints(model, offset)[i]) + ' ';
    }
  }
  return settings;
}

}  // namespace

Instance::Instance(const mjt_instance& resolved, std::shared_ptr<const Pad> pad, int geom, std::vector<int> addresses,
                   std::shared_ptr<Context> context)
    : resolved_(resolved),
      addresses_(std::move(addresses)),
      reader_(resolved, std::move(pad), geom, std::move(context)) {
  const int* outputs = resolved_.outputs;
  needs_stress_ = resolved_.visual != 0 || std::any_of(outputs, outputs + resolved_.output_count,
                                                       [](int output) { return output != MJT_WRENCH; });
  if (resolved_.visual == 0) return;
  const int* const shown = std::find(outputs, outputs + resolved_.output_count, MJT_VON_MISES);
  if (shown == outputs + resolved_.output_count) {
    readings_.assign(static_cast<std::size_t>(resolved_.taxels), 0.0);
  } else {
    shown_ = addresses_.front();
    for (const int* output = outputs; output != shown; ++output) shown_ += output_size(*output, resolved_.taxels);
  }
}

int output_size(int output, int taxels) {
  switch (output) {
    case MJT_WRENCH:
    case MJT_CARRIED: return 6;
    case MJT_RANGE: return 1;
    case MJT_STRESS: return static_cast<int>(kTensor) * taxels;
    default: return taxels;
  }
}

void Instance::prepare(const Model* model, int number) {
  number_ = number;
  settings_ = settings_of(model, number);
  fitting_ = model;
  fitting_addresses_ = ints(model, layout.model_sensor_adr);
  reader_.prepare(model);
}

// A model that is made after another was freed may have its address, but hardly those of its arrays as well.
bool Instance::fits(const Model* model) {
  const int* const addresses = ints(model, layout.model_sensor_adr);
  if (model == fitting_ && addresses == fitting_addresses_) return true;
  if (settings_of(model, number_) != settings_) return false;
  fitting_ = model, fitting_addresses_ = addresses;
  return true;
}

// Write what is no number, and warn: the tables are those of another sensor.
void Instance::refuse(const Model* model, Data* data) {
  double* sensordata = field<double*>(data, layout.data_sensordata);
  for (int i = 0; i < field<int>(model, layout.model_nsensor); ++i) {
    if (ints(model, layout.model_sensor_plugin)[i] != number_) continue;
    std::fill_n(sensordata + ints(model, layout.model_sensor_adr)[i], ints(model, layout.model_sensor_dim)[i],
                std::numeric_limits<double>::quiet_NaN());
  }
  reader_.context()->warn({kOtherSettings, -1, 0.0, 0.0});
}

void Instance::take(const Instance& other) {
  reader_.take_sleeping(other.reader_);
  readings_ = other.readings_;
}

std::unique_ptr<Instance> Instance::another() const {
  auto made = std::make_unique<Instance>(resolved_, reader_.pad(), reader_.geom(), addresses_, reader_.context());
  made->number_ = number_;
  made->settings_ = settings_;
  return made;
}

void Instance::compute(const Model* model, Data* data, const double* state) {
  if (!fits(model)) return refuse(model, data);
  reader_.read(model, data, {state[0], state[1]}, needs_stress_);
  computed_ = true;
  double* sensordata = field<double*>(data, layout.data_sensordata);
  for (const int address : addresses_) {
    double* to = sensordata + address;
    for (int i = 0; i < resolved_.output_count; ++i) {
      write(resolved_.outputs[i], to);
      to += output_size(resolved_.outputs[i], resolved_.taxels);
    }
  }
  if (!readings_.empty()) reader_.sensor().readings(readings_.data());
}

void Instance::advance(double* state) {
  if (!computed_) return;  // sensors are switched off
  computed_ = false;
  const Steadiness after = reader_.after();
  state[0] = after.pose;
  state[1] = after.steps;
}

void Instance::visualize(const Model* model, const Data* data, Scene* scene) {
  if (resolved_.visual == 0) return;
  const double* sensordata = doubles(data, layout.data_sensordata);
  const double* readings = shown_ < 0 ? readings_.data() : sensordata + shown_;
  const std::vector<Tile>& tiles = reader_.pad()->tiles();
  double most = 0.0;
  for (const Tile& tile : tiles) most = std::max(most, readings[tile.reading]);
  if (!(most > 0.0)) return;
  const Pose frame = pad_frame(model, data, reader_.geom());
  int& count = field<int>(scene, layout.scene_ngeom);
  char* geoms = field<char*>(scene, layout.scene_geoms);
  for (const Tile& tile : tiles) {
    if (count >= field<int>(scene, layout.scene_maxgeom)) return;
    const Pose at = composed(frame, tile.pose);
    const double size[3] = {tile.half_size[0], tile.half_size[1], kTileThickness / 2};
    const auto heat = static_cast<float>(readings[tile.reading] / most);
    const float rgba[4] = {std::min(1.0f, 2 * heat), std::max(0.0f, 2 * heat - 1.0f), 1.0f - heat, kOpacity};
    // What MuJoCo leaves as it was in an earlier scene: a tile stands for no object, and has no colour of segmentation.
    char* drawn = geoms + count * layout.drawn_size;
    std::memset(drawn, 0, static_cast<std::size_t>(layout.drawn_size));
    functions.init_geom(drawn, static_cast<int>(layout.geom_box), size, at.position, at.rotation, rgba);
    field<int>(drawn, layout.drawn_objid) = field<int>(drawn, layout.drawn_segid) = -1;
    field<int>(drawn, layout.drawn_category) = static_cast<int>(layout.category_decor);
    ++count;
  }
}

void Instance::write(int output, double* to) {
  PadSensor& sensor = reader_.sensor();
  switch (output) {
    case MJT_STRESS: sensor.stress(to); break;
    case MJT_WRENCH: std::copy(reader_.wrench(), reader_.wrench() + 6, to); break;
    case MJT_CARRIED: std::copy(sensor.pressed().carried, sensor.pressed().carried + 6, to); break;
    case MJT_RANGE: *to = sensor.pressed().range; break;
    default: sensor.readings(to); break;
  }
}

}  // namespace mjtactile::mujoco
