// Contact cells under a body as one view sees it, and the contact on them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/cells/bent_cells.hpp"
#include "contact/laws/cell_contact.hpp"
#include "contact/patch_face.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

class LaidCells {
 public:
  // Begin another view. Its lattices are laid next, then lay() makes the cells.
  SampledLattices& see(const HeightWindow& view);
  // Make the cells of the lattices and place them on the pad. False if there are none.
  bool lay(const ContactSurface& surface, CellContact::Workspace& workspace);
  // The same with the chosen cells split into up to four each, see PatchFace. Sets `start` to the new cells that are
  // parts of cells which pressed.
  bool split(const std::vector<std::uint8_t>& chosen, const ContactSurface& surface, std::vector<std::uint8_t>& start,
             CellContact::Workspace& workspace);
  // Place the cells in a workspace again, after others were placed there.
  void place(const ContactSurface& surface, CellContact::Workspace& workspace);
  // Press the body on the cells, beginning with those of `start` if it has at least three. `overloads`: whether the
  // pressure is likely bounded.
  void press(const ContactSurface& surface, const double* wrench, const std::vector<std::uint8_t>& start,
             bool overloads, CellContact::Workspace& workspace);
  // Press again where other bodies have lowered the surface under the cells by `sunk` (cells) [m].
  void press_again(const ContactSurface& surface, const double* wrench, const std::vector<double>& sunk,
                   CellContact::Workspace& workspace);

  const PatchFace& cells() const { return cells_; }
  const Face& face() const { return cells_.face(); }
  std::size_t count() const { return heights_.size(); }
  // How the cells lie on a curved pad.
  const BentCells& bent() const { return bent_; }
  // Heights of the body above the cells, measured in the view (cells) [m]; on a curved pad along each cell's normal.
  const std::vector<double>& heights() const { return heights_; }
  const HeightWindow& view() const { return view_; }
  const CellContact& contact() const { return contact_; }
  const std::vector<std::uint8_t>& pressed() const { return contact_.pressed(); }

  // Difference of height that a tilt makes between the pressed cells [m].
  double lifted(const double* slopes) const;
  // Whether the pressed cells leave the tilt open: they lie in one row across it, and it raises their sides by more
  // than the depth of the contact.
  bool tilts_openly() const;
  // The centre of pressure. False if no cell presses.
  bool centre(Point& at) const;
  // Elastic energy of the contact plus the potential energy of the load at the body's height [J]. Of all contacts that
  // carry the load, the true one has the least, whatever the cells.
  double energy(double force) const;
  // Whether cells that were cut off at the largest height press, so that the contact extends beyond them.
  bool goes_beyond() const;
  // Whether it certainly extends beyond them.
  bool ends_early() const;
  // Whether all cells press and none was cut off at the largest height.
  bool all_press() const;
  // Height up to which the body touches [m].
  double touched_height(bool tilting) const;
  // How far the body comes down over the origin, from the pose in which the view sees it [m]. Over other points it
  // comes down by the tilt's rise more.
  double lowered_at_origin() const;
  // The plane, in the pose of the simulation, below which parts of the body touch the undeformed surface [m].
  InclinedPlane reached() const;
  // Slope by which the body tilts from its pose in the simulation [-].
  double tilt() const;

 private:
  void position(const ContactSurface& surface, CellContact::Workspace& workspace);
  void set_heights();

  PatchFace cells_;
  BentCells bent_;
  CellContact contact_;
  HeightWindow view_ = {};
  std::vector<double> heights_;
  bool bends_ = false;               // whether the pad is curved
  std::vector<std::size_t> from_;    // members, so that no step allocates them anew
};

}  // namespace mjtactile
