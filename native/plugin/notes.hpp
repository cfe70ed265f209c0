// Warnings on their way to Python, each given once.
#pragma once

#include <atomic>
#include <cstdint>
#include <mutex>
#include <set>
#include <utility>

#include "contact/pad_sensor.hpp"
#include "plugin/plugin.h"

namespace mjtactile::mujoco {

// Python's functions, as it handed them over when it registered the plugin.
inline mjt_plugin_host python = {};
// Whether Python still runs. It may end while other threads take steps.
inline std::atomic<bool> python_runs = false;

// Events beside those of the core: the simulation is stepped with a model whose sensor has other settings; a flex
// touches the pad, or may touch it, with forces that MuJoCo does not tell.
constexpr Event kOtherSettings{kEvents}, kUntoldForces{kEvents + 1};

// Take the next warning from the queue. False if there is none. It may be called from several threads.
bool next_note(mjt_note& note);

// Python's part of an instance, which copies of a simulation share, and the warnings that were given for it.
class Context {
 public:
  // `calls`: whether Python is called to fetch warnings. Otherwise it fetches them itself after each reading.
  Context(std::int64_t number, bool calls) : number_(number), calls_(calls) {}
  ~Context();
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  // Queue a warning, unless one of the same kind was given for the same body.
  void warn(const Pressed::Note& note);

 private:
  const std::int64_t number_;
  const bool calls_;
  std::mutex mutex_;
  std::set<std::pair<Event, int>> warned_;
};

}  // namespace mjtactile::mujoco
