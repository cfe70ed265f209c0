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

template <typename Value>
BasisCache<Value>& BasisCache<Value>::shared() {
  static BasisCache cache;
  return cache;
}

template <typename Value>
std::shared_ptr<const Basis<Value>> BasisCache<Value>::find(const BasisKey& key, const Face& face,
                                                            const double* wrench, std::vector<double>& weights,
                                                            CellContact::Workspace& workspace) {
  const std::lock_guard<std::mutex> lock(mutex_);
  ++searches_;
  const auto range = places_.equal_range(key.hash());
  for (auto place = range.first; place != range.second; ++place) {
    const auto entry = place->second;
    if (entry->key == key && entry->basis->contact.weights(face, key.options, wrench, weights, workspace)) {
      entries_.splice(entries_.begin(), entries_, entry);
      entry->used = searches_;
      return entry->basis;
    }
  }
  return nullptr;
}

template <typename Value>
void BasisCache<Value>::keep(const BasisKey& key, std::shared_ptr<const Basis<Value>> basis, std::size_t bytes) {
  const std::lock_guard<std::mutex> lock(mutex_);
  entries_.push_front({key, std::move(basis), bytes, searches_});
  places_.emplace(key.hash(), entries_.begin());
  bytes_ += bytes;
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
    bytes_ -= last->bytes;
    entries_.pop_back();
  }
}

template <typename Value>
std::size_t BasisCache<Value>::bytes() {
  const std::lock_guard<std::mutex> lock(mutex_);
  return bytes_;
}

template class BasisCache<float>;
template class BasisCache<double>;

}  // namespace mjtactile
