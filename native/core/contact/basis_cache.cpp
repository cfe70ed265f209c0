#include "contact/basis_cache.hpp"

#include <utility>

#include "geometry/hash.hpp"

namespace mjtactile {
namespace {

// Bases that were not used in this many searches are dropped, because their poses belong to the past.
constexpr std::uint64_t kForgotten = 10000;
constexpr std::size_t kMostBasisBytes = std::size_t{256} << 20;

}  // namespace

bool BasisKey::operator==(const BasisKey& other) const {
  return pad == other.pad && face == other.face && pose == other.pose &&
         options == other.options;
}

std::uint64_t BasisKey::hash() const {
  std::uint64_t hash = mixed(reinterpret_cast<std::uintptr_t>(pad), reinterpret_cast<std::uintptr_t>(face));
  for (const std::int64_t one : pose) hash = mixed(hash, static_cast<std::uint64_t>(one));
  return hash;
}

BasisCache& BasisCache::shared() {
  static BasisCache cache;
  return cache;
}

// Of the bases of a contact, the one with this number; null if there are not so many.
std::shared_ptr<const Basis> BasisCache::take(const BasisKey& key, std::size_t number) {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (number == 0) ++searches_;
  const auto range = places_.equal_range(key.hash());
  for (auto place = range.first; place != range.second; ++place) {
    const auto entry = place->second;
    if (!(entry->key == key) || number-- > 0) continue;
    entries_.splice(entries_.begin(), entries_, entry);
    entry->used = searches_;
    return entry->basis;
  }
  return nullptr;
}

std::shared_ptr<const Basis> BasisCache::find(const BasisKey& key, const double* wrench, std::vector<double>& weights,
                                              CellContact::Workspace& workspace) {
  for (std::size_t number = 0;; ++number) {
    std::shared_ptr<const Basis> basis = take(key, number);
    if (basis == nullptr || basis->contact.weights(*key.face, key.options, wrench, weights, workspace)) return basis;
  }
}

void BasisCache::keep(const BasisKey& key, std::shared_ptr<const Basis> basis) {
  const std::lock_guard<std::mutex> lock(mutex_);
  bytes_ += basis->bytes();
  entries_.push_front({key, std::move(basis), searches_});
  places_.emplace(key.hash(), entries_.begin());
  while (entries_.size() > 1) {
    const auto last = std::prev(entries_.end());
    if (bytes_ <= kMostBasisBytes && searches_ - last->used < kForgotten) break;
    const auto range = places_.equal_range(last->key.hash());
    for (auto place = range.first; place != range.second; ++place) {
      if (place->second == last) {
        places_.erase(place);
        break;
      }
    }
    bytes_ -= last->basis->bytes();
    entries_.pop_back();
  }
}

std::size_t BasisCache::bytes() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return bytes_;
}

}  // namespace mjtactile
