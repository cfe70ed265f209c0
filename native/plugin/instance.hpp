// One sensor in one simulation: what it puts out, keeps as state and draws.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "plugin/mujoco_view.hpp"
#include "plugin/notes.hpp"
#include "plugin/plugin.h"
#include "plugin/reader.hpp"

namespace mjtactile::mujoco {

// Attributes of an instance, in the order in which their values reach Python.
inline constexpr const char* kAttributes[] = {"pad", "fidelity", "output", "law", "tangential", "friction", "tilt",
                                              "visual"};

// Number of values of an output.
int output_size(int output, int taxels);

class Instance {
 public:
  // `addresses`: of the sensor's outputs in mjData's sensordata.
  Instance(const mjt_instance& resolved, std::shared_ptr<const Pad> pad, int geom, std::vector<int> addresses,
           std::shared_ptr<Context> context);
  // Get ready for the model that the simulation was made for, in which the instance has this number.
  void prepare(const Model* model, int number);
  // Take over from the same pad in a simulation of which this one is now a copy: contacts of sleeping bodies, and the
  // readings that are shown. A viewer draws a copy in which no sensor computes anything.
  void take(const Instance& other);
  // An instance of the same pad for another simulation, with its own memory.
  std::unique_ptr<Instance> another() const;

  // Write the outputs. `state`: the two numbers that the plugin keeps in mjData; unused with a model that does not fit.
  void compute(const Model* model, Data* data, const double* state);
  // Bring the state to the end of the step. It stays as it is if the pad was not read since the last step.
  void advance(double* state);
  // Draw the heat map, if it is wanted.
  void visualize(const Model* model, const Data* data, Scene* scene);
  const double* health() const { return reader_.health(); }

 private:
  void write(int output, double* to);
  // Whether the settings are those of a model with which the simulation is stepped.
  bool fits(const Model* model);
  void refuse(const Model* model, Data* data);

  mjt_instance resolved_;
  std::vector<int> addresses_;
  Reader reader_;
  bool needs_stress_ = true;  // false if only the contact wrench is wanted
  int number_ = -1;
  std::string settings_;      // in the model that the simulation was made for
  const Model* fitting_ = nullptr;              // the last model that had these settings,
  const int* fitting_addresses_ = nullptr;      // and where its sensors' addresses are
  bool computed_ = false;     // whether outputs were written since the state was brought to the end of a step
  // The readings that a heat map shows: their address in sensordata, or they themselves if they are no output.
  int shown_ = -1;
  std::vector<double> readings_;
};

}  // namespace mjtactile::mujoco
