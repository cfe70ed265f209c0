#include "plugin/notes.hpp"

#include <deque>

namespace mjtactile::mujoco {
namespace {

// Queue of warnings until Python fetches them. It may be used from several threads.
class Notes {
 public:
  void add(const mjt_note& note, bool calls) {
    const std::lock_guard<std::mutex> lock(mutex_);
    waiting_.push_back(note);
    if (calls && !scheduled_ && python_runs) scheduled_ = python.schedule(python.deliver, nullptr) == 0;
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

}  // namespace

bool next_note(mjt_note& note) { return notes().next(note); }

Context::~Context() {
  if (python_runs) python.release(number_);
}

void Context::warn(const Pressed::Note& note) {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    if (!warned_.insert({note.event, note.body}).second) return;
  }
  notes().add({number_, static_cast<int>(note.event), note.body, note.pressure, note.indentation}, calls_);
}

}  // namespace mjtactile::mujoco
