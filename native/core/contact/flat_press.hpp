// A flat face pressed at one place: on its own cells or, if only a small part is in contact, on finer cells there.
#pragma once

#include <cstddef>
#include <vector>

#include "contact/cells/face.hpp"
#include "contact/laws/cell_contact.hpp"
#include "contact/patch_press.hpp"
#include "geometry/gap_map.hpp"

namespace mjtactile {

class FlatPress {
 public:
  // contact() has the answer, on face(). False where the force does not press.
  bool solve(const Face& face, const Placement& placement, const ContactSurface& surface, const double* wrench,
             CellContact::Workspace& workspace);
  // See PatchPress.
  void press_again(const ContactSurface& surface, const double* wrench, const std::vector<double>& sunk,
                   CellContact::Workspace& workspace);

  const CellContact& contact() const { return small_ ? part_.contact() : whole_; }
  // Integrals of shear over pairs of cells, in the frame of face().
  void integrate_shear(ShearIntegrals& integrals) const {
    if (small_) {
      part_.integrate_shear(integrals);
    } else {
      integrate_edges(*face_, integrals);
    }
  }
  // Heights of the body above the cells [m]; null where it is flat.
  const double* heights() const { return small_ ? part_.heights().data() : nullptr; }
  // Plane from which heights are measured, if there are any.
  const PatchFace::HeightWindow& view() const { return part_.view(); }
  const Face& face() const { return small_ ? part_.face() : *face_; }
  const Placement& placement() const { return small_ ? kUnmoved : placement_; }
  // Whether the body tilts so far that other parts of it may touch as well.
  bool tips_over() const;

 private:
  const Face* face_ = nullptr;
  Placement placement_ = kUnmoved;
  bool small_ = false;
  CellContact whole_;
  PatchPress part_;
  FlatMap map_;
  std::vector<Point> starts_, ends_;
};

// Whether so few of a face's cells are in contact that they are too coarse.
bool is_small(const CellContact& contact);

}  // namespace mjtactile
