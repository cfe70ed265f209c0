// A flat face pressed at one place: on its own cells or, if these are coarse for the part in contact, on cells there.
#pragma once

#include <cstdint>
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

  const CellContact& contact() const { return on_part_ ? part_.contact() : whole_; }
  // Integrals of shear over pairs of cells, in the frame of face().
  void integrate_shear(ShearIntegrals& integrals) const {
    if (on_part_) {
      part_.integrate_shear(integrals);
    } else {
      integrate_edges(*face_, integrals);
    }
  }
  // Heights of the body above the cells (cells) [m]; null if the contact is on the face's own cells.
  const double* heights() const { return on_part_ ? part_.heights().data() : nullptr; }
  // Plane from which these heights are measured.
  const HeightWindow& view() const { return part_.view(); }
  const Face& face() const { return on_part_ ? part_.face() : *face_; }
  // Whether the body sinks in or tilts as far as parts beside the face may touch.
  bool reaches(const Onset& onset) const;
  // How far the face comes down where it is deepest at most, if the load passes through a point [m].
  InclinedPlane lowered(const Point& at) const;

 private:
  const Face* face_ = nullptr;
  bool on_part_ = false;
  CellContact whole_;
  PatchPress part_;
  FlatMap map_;
  std::vector<Segment> outline_;
  std::vector<std::uint8_t> at_end_;   // a member, so that no step allocates it anew
};

// Whether a contact ends within a face in cells that are large for it, so that finer cells are needed. Sets `at_end` to
// whether each cell presses beside one that does not.
bool ends_coarsely(const Face& face, const CellContact& contact, std::vector<std::uint8_t>& at_end);

}  // namespace mjtactile
