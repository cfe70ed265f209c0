#include "plugin/simulations.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

namespace mjtactile::mujoco {
namespace {

// Threads are woken for sensors that took longer than this together, without the one that took longest [s]. To wake
// them takes about a third of it.
constexpr double kWorthThreads = 1e-4;

}  // namespace

double* state_of(const Model* model, Data* data, int instance) {
  return field<double*>(data, layout.data_plugin_state) + ints(model, layout.model_plugin_stateadr)[instance];
}

Instance* Simulation::find(int number) {
  const auto found = members_.find(number);
  return found == members_.end() ? nullptr : found->second.instance.get();
}

std::unique_ptr<Instance> Simulation::take(int number) {
  const auto taken = members_.extract(number);
  return taken.empty() ? nullptr : std::move(taken.mapped().instance);
}

void Simulation::compute(const Model* model, Data* data, int number) {
  if (number == members_.begin()->first) all_computed_ = compute_all(model, data);
  if (all_computed_) return;
  if (Instance* found = find(number)) found->compute(model, data, state_of(model, data, number));
}

// False if the simulation has no other threads. Sensors that took longest are computed first, because the threads then
// end at about the same time.
bool Simulation::compute_all(const Model* model, Data* data) {
  const int count = static_cast<int>(members_.size());
  if (count < 2 || functions.dispatch == nullptr || functions.thread_count(data) < 2) return false;
  queue_.clear();
  for (auto& member : members_) queue_.push_back(&member);
  std::sort(queue_.begin(), queue_.end(), [](const auto* a, const auto* b) { return a->second.took > b->second.took; });
  double others = 0.0;
  for (int task = 1; task < count; ++task) others += queue_[static_cast<std::size_t>(task)]->second.took;
  if (others > kWorthThreads) {
    functions.dispatch(model, data, compute_one, this, count);
  } else {
    for (int task = 0; task < count; ++task) compute_one(model, data, this, 0, task);
  }
  return true;
}

void Simulation::compute_one(const Model* model, Data* data, void* simulation, int, int task) {
  auto& [number, member] = *static_cast<Simulation*>(simulation)->queue_[static_cast<std::size_t>(task)];
  const auto start = std::chrono::steady_clock::now();
  // The simulation may be stepped with a model that has fewer instances.
  const bool exists = number < field<int>(model, layout.model_nplugin);
  member.instance->compute(model, data, exists ? state_of(model, data, number) : nullptr);
  member.took = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Simulation* Simulations::find(const Data* data) {
  const std::shared_lock<std::shared_mutex> lock(mutex_);
  const auto found = simulations_.find(data);
  return found == simulations_.end() ? nullptr : found->second.get();
}

Instance* Simulations::find(const Data* data, int instance) {
  Simulation* found = find(data);
  return found == nullptr ? nullptr : found->find(instance);
}

void Simulations::keep(const Data* data, int instance, std::unique_ptr<Instance> made) {
  const std::unique_lock<std::shared_mutex> lock(mutex_);
  std::unique_ptr<Simulation>& simulation = simulations_[data];
  if (simulation == nullptr) simulation = std::make_unique<Simulation>();
  simulation->keep(instance, std::move(made));
}

void Simulations::drop(const Data* data, int instance) {
  std::unique_ptr<Instance> dropped;  // destroyed after the lock is released, because its destructor calls Python
  const std::unique_lock<std::shared_mutex> lock(mutex_);
  const auto found = simulations_.find(data);
  if (found == simulations_.end()) return;
  dropped = found->second->take(instance);
  if (found->second->empty()) simulations_.erase(found);
}

// Never destroyed, because simulations may end after this library's static objects.
Simulations& simulations() {
  static auto* const all = new Simulations;
  return *all;
}

}  // namespace mjtactile::mujoco
