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
  // Solve the contact of a face under a wrench (6) about the pad's origin [N, N m]. The result is contact(), on the
  // cells of face(). The face must live as long as this result is used. False if the force does not press.
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
  // Heights of the body above the cells (cells) [m]; null if the contact is on the face's own cells.
  const double* heights() const { return small_ ? part_.heights().data() : nullptr; }
  // Plane from which these heights are measured.
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
  std::vector<Segment> outline_;
};

// Whether so few of a face's cells are in contact that finer cells are needed.
bool is_small(const CellContact& contact);

}  // namespace mjtactile
