// One sensor in one simulation: what it puts out, keeps as state and draws.
#pragma once

#include <memory>
#include <vector>

#include "plugin/mujoco_view.hpp"
#include "plugin/notes.hpp"
#include "plugin/plugin.h"
#include "plugin/reader.hpp"

namespace mjtactile::mujoco {

class Instance {
 public:
  // `addresses`: of the sensor's outputs in mjData's sensordata.
  Instance(const mjt_instance& resolved, int geom, std::vector<int> addresses, std::shared_ptr<Context> context);
  void prepare(const Model* model) { reader_.prepare(model); }
  void take_sleeping(const Instance& other) { reader_.take_sleeping(other.reader_); }
  // An instance of the same pad for another simulation, with its own memory.
  std::unique_ptr<Instance> another() const;

  // Write the outputs. `state`: the two numbers that the plugin keeps in mjData.
  void compute(const Model* model, Data* data, const double* state);
  // Bring the state to the end of the step.
  void advance(double* state) const;
  // Draw the heat map, if it is wanted.
  void visualize(const Model* model, const Data* data, Scene* scene);
  const double* health() const { return reader_.health(); }

 private:
  double* write(int output, double* to);

  mjt_instance resolved_;
  std::vector<int> addresses_;
  Reader reader_;
  bool needs_stress_ = true;  // false if only the contact wrench is wanted
  std::vector<double> readings_;
};

}  // namespace mjtactile::mujoco
