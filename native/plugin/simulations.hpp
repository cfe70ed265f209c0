// The sensors of every simulation.
#pragma once

#include <map>
#include <memory>
#include <shared_mutex>
#include <unordered_map>
#include <utility>
#include <vector>

#include "plugin/instance.hpp"
#include "plugin/mujoco_view.hpp"

namespace mjtactile::mujoco {

// The two numbers that the plugin keeps in mjData for an instance.
double* state_of(const Model* model, Data* data, int instance);

// The sensors of one simulation. MuJoCo computes them one after the other, in the order of their numbers. If the
// simulation has a pool of threads (mju_threadpool), the first one has all of them computed, on these threads.
class Simulation {
 public:
  bool empty() const { return members_.empty(); }
  // Null if there is none.
  Instance* find(int number);
  void keep(int number, std::unique_ptr<Instance> made) { members_[number].instance = std::move(made); }
  // Remove a sensor. Null if there is none.
  std::unique_ptr<Instance> take(int number);
  // Write the outputs of a sensor, unless the first one has had that done.
  void compute(const Model* model, Data* data, int number);

 private:
  struct Member {
    std::unique_ptr<Instance> instance;
    double took = 0.0;   // time that it took last, if it was computed with the others [s]
  };
  using Members = std::map<int, Member>;   // by number

  bool compute_all(const Model* model, Data* data);
  static void compute_one(const Model* model, Data* data, void* simulation, int thread, int task);

  Members members_;
  std::vector<Members::value_type*> queue_;   // in the order in which they are computed
  bool all_computed_ = false;                 // whether the first one had all of them computed
};

// All simulations. The plugin's pointers in mjData are not used: a simulation that is restored from a pickle has those
// of the simulation it was made from.
class Simulations {
 public:
  // Null if there is none.
  Simulation* find(const Data* data);
  Instance* find(const Data* data, int instance);
  void keep(const Data* data, int instance, std::unique_ptr<Instance> made);
  void drop(const Data* data, int instance);

 private:
  std::shared_mutex mutex_;
  std::unordered_map<const Data*, std::unique_ptr<Simulation>> simulations_;
};

Simulations& simulations();

}  // namespace mjtactile::mujoco
