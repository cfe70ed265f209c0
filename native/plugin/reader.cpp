#include "plugin/reader.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

namespace mjtactile::mujoco {
namespace {

// Readings that take longer than these are counted [s].
constexpr double kSlow = 1e-3, kVerySlow = 5e-3;
// The body of a note that is about the pad alone.
constexpr int kNoBody = -1;

LawOptions options_of(const mjt_instance& resolved) {
  LawOptions options = law_options(resolved.law, resolved.tangential, resolved.tilting, resolved.friction,
                                   static_cast<std::size_t>(resolved.cells), resolved.strength);
  options.widest = resolved.widest;
  return options;
}

}  // namespace

Reader::Reader(const mjt_instance& resolved, std::shared_ptr<const Pad> pad, int geom,
               std::shared_ptr<Context> context)
    : geom_(geom),
      size_tolerance_(resolved.size_tolerance),
      context_(std::move(context)),
      geometry_(side_limits(options_of(resolved), resolved.facing_gap)),
      pad_(std::move(pad)),
      sensor_(pad_, options_of(resolved), resolved.facing_gap, resolved.tolerance) {}

void Reader::read(const Model* model, const Data* data, const Steadiness& before, bool press) {
  before_ = before;
  presses_ = press;
  if (pieces_.empty()) pieces_ = pad_pieces(model, geom_);
  // The last contacts do not belong to a simulation that was reset or set to a state without contact.
  const bool touched = before.pose != 0.0 || before.steps != 0.0;
  contacts_.gather(model, data, pieces_, pad_->outer(), touched);
  for (const int body : contacts_.behind) tell({Event::behind, body, 0.0, 0.0});
  if (contacts_.passive || has_unlisted_flex(model, pieces_)) context_->warn({kUntoldForces, kNoBody, 0.0, 0.0});
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

Steadiness Reader::after() const {
  if (!contacts_.any()) return {};
  const Steadiness after = presses_ ? sensor_.after(before_) : Steadiness{};
  return after.steps > 0.0 ? after : Steadiness{0.0, 1.0};
}

void Reader::tell(const Pressed::Note& note) {
  health_[1 + static_cast<std::size_t>(note.event)] += 1.0;
  if (context_ != nullptr) context_->warn(note);
}

// Whether the geom of a flat pad is as large as the pad. It was when the simulation was made, but models can change.
bool Reader::has_own_size(const Model* model) const {
  if (!pad_->outer().is_flat()) return true;
  const double* half = doubles(model, layout.model_geom_size) + 3 * geom_;
  const Rectangle sheet = pad_->surface().sheet();
  const double own[3] = {sheet.east - sheet.west, sheet.north - sheet.south, pad_->depth()};
  const double most = size_tolerance_;
  return std::equal(own, own + 3, half, [most](double a, double b) { return std::abs(a - 2.0 * b) <= most; });
}

}  // namespace mjtactile::mujoco
