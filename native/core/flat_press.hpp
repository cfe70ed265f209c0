// A flat face pressed at one place: on its own cells, or where little of it presses, on cells that lie there.
#pragma once

#include <cstddef>
#include <vector>

#include "cell_contact.hpp"
#include "closing_press.hpp"
#include "face.hpp"

namespace mjtactile {

class FlatPress {
 public:
  // contact() has the answer, on face(). False where the readable reference has to.
  bool solve(const Face& face, const Placement& placement, const SurfaceCompliance& compliance,
             const LawOptions& options, const double* wrench, CellContact::Workspace& workspace);

  const CellContact& contact() const { return small_ ? part_.contact() : whole_; }
  const Face& face() const { return small_ ? part_.face() : *face_; }
  // The wrench with its force's line moved onto the face, where it passes beside it.
  const double* carried() const { return carried_; }
  // Whether a wrench's force passes through the face.
  bool carries(const double* wrench) const { return whole_.carries(*face_, wrench); }

 private:
  const Face* face_ = nullptr;
  bool small_ = false;
  double carried_[6] = {};
  CellContact whole_;
  ClosingPress part_;
  std::vector<Point> outline_;
};

// Whether so few of a face's cells press that they are too coarse.
bool is_small(const CellContact& contact);

}  // namespace mjtactile
