// Wrench bases: responses to a face that stands still, kept for all pads of this process.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <vector>

#include "contact/cells/face.hpp"
#include "contact/laws/cell_contact.hpp"
#include "contact/pad.hpp"

namespace mjtactile {

// A solved contact and the responses of its parts.
template <typename Value>
struct Basis {
  std::shared_ptr<const Face> face;
  std::shared_ptr<const Pad> pad;
  CellContact contact;
  Columns<Value> responses;
};

struct BasisKey {
  const Pad* pad;
  const Face* face;
  std::array<std::int64_t, 12> pose;
  LawOptions options;

  bool operator==(const BasisKey& other) const;
  std::uint64_t hash() const;
};

// Bases of all pads in this process: those used lately, up to a limit of memory.
template <typename Value>
class BasisCache {
 public:
  static BasisCache& shared();

  // A basis that makes up a wrench, and its weights; null if none is known.
  std::shared_ptr<const Basis<Value>> find(const BasisKey& key, const Face& face, const double* wrench,
                                           std::vector<double>& weights, CellContact::Workspace& workspace);
  void keep(const BasisKey& key, std::shared_ptr<const Basis<Value>> basis, std::size_t bytes);
  std::size_t bytes();

 private:
  struct Entry {
    BasisKey key;
    std::shared_ptr<const Basis<Value>> basis;
    std::size_t bytes;
    std::uint64_t used;  // the search that found it last
  };
  std::mutex mutex_;
  std::list<Entry> entries_;  // latest used first
  std::unordered_multimap<std::uint64_t, typename std::list<Entry>::iterator> places_;
  std::size_t bytes_ = 0;
  std::uint64_t searches_ = 0;
};

// Mix a number into a hash.
inline std::uint64_t mixed(std::uint64_t hash, std::uint64_t value) {
  hash ^= value + 0x9e3779b97f4a7c15u + (hash << 6) + (hash >> 2);
  hash *= 0xff51afd7ed558ccdu;
  return hash ^ (hash >> 33);
}

}  // namespace mjtactile
