// Wrench bases: responses of pads to the load parts of flat faces that stand still, kept for all pads of this process.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <unordered_map>
#include <variant>
#include <vector>

#include "contact/cells/face.hpp"
#include "contact/laws/cell_contact.hpp"
#include "contact/pad.hpp"

namespace mjtactile {

// A solved contact and the pad's responses to its parts, one column per part (see CellContact::parts), in the precision
// of its maps.
struct Basis {
  std::shared_ptr<const Face> face;
  std::shared_ptr<const Pad> pad;
  CellContact contact;
  std::variant<Columns<float>, Columns<double>> responses;

  std::size_t bytes() const {
    return std::visit([](const auto& columns) { return columns.bytes(); }, responses);
  }
};

// The contact to which a basis belongs.
struct BasisKey {
  const Pad* pad;
  const Face* face;
  std::array<std::int64_t, 12> pose;   // rounded to multiples of the tolerance
  LawOptions options;

  bool operator==(const BasisKey& other) const;
  std::uint64_t hash() const;
};

// The wrench bases of this process. Beyond a limit of memory, the least recently used ones are dropped. Its functions
// may be called from several threads.
class BasisCache {
 public:
  static BasisCache& shared();

  // A basis whose parts add up to a wrench (6) [N, N m], and the weights of the parts (parts); null if none is kept.
  std::shared_ptr<const Basis> find(const BasisKey& key, const double* wrench, std::vector<double>& weights,
                                    CellContact::Workspace& workspace);
  void keep(const BasisKey& key, std::shared_ptr<const Basis> basis);
  // Memory of all bases.
  std::size_t bytes();

 private:
  struct Entry {
    BasisKey key;
    std::shared_ptr<const Basis> basis;
    std::uint64_t used;  // number of the search that met it last
  };
  std::shared_ptr<const Basis> take(const BasisKey& key, std::size_t number);

  std::mutex mutex_;
  std::list<Entry> entries_;  // latest used first
  std::unordered_multimap<std::uint64_t, typename std::list<Entry>::iterator> places_;
  std::size_t bytes_ = 0;
  std::uint64_t searches_ = 0;
};

}  // namespace mjtactile
