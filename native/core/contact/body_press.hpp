// The contact of one body with a pad, on cells.
//
// A body that faces the pad with a flat face is pressed on the cells of that face. If it tips over, or has no such
// face, its shape is pressed. Of several candidates for the contact the best is taken.
#pragma once

#include <memory>
#include <utility>
#include <vector>

#include "contact/cells/bent_cells.hpp"
#include "contact/cells/face.hpp"
#include "contact/cells/tangential.hpp"
#include "contact/flat_press.hpp"
#include "contact/laws/cell_contact.hpp"
#include "contact/pad.hpp"
#include "contact/patch_press.hpp"
#include "contact/touch.hpp"
#include "geometry/gap_map.hpp"
#include "geometry/surface_map.hpp"
#include "geometry/tangent_plane.hpp"

namespace mjtactile {

// The solution of one body's contact on its cells. All pointers are null if the contact was not solved on cells.
struct SolvedCells {
  const CellContact* contact = nullptr;
  const Face* face = nullptr;
  const BentCells* bent = nullptr;         // how the cells lie on a curved pad; null on a flat pad
  const double* carried = nullptr;         // wrench (6) that the cells carry, as Touch::wrench [N, N m]
  // The view from which heights are measured; null for cells of a flat face.
  const HeightWindow* view = nullptr;
  const double* heights = nullptr;         // of the body above the cells (cells) [m]; null for a flat face
  const double* sunk = nullptr;            // lowering of the surface by other bodies (cells) [m]; null for none
  CellForces forces = {nullptr};           // on the cells; on a curved pad in the tangent plane's frame
  const FullCompliance* full = nullptr;    // compliance with which shear was solved; null for none
  const CellContact::Workspace* workspace = nullptr;
};

// The point of the surface, along x and y in the pad frame, of a point of the cells' face [m].
Point on_pad(const SolvedCells& solved, const Point& at);

class BodyPress {
 public:
  BodyPress(std::shared_ptr<const Pad> pad, const LawOptions& options) : pad_(std::move(pad)), options_(options) {}

  // On a curved pad, set the plane in which a touch is solved: the tangent plane at its centre of pressure.
  void turn(const Touch& touch);
  // A touch as the functions below see it: in the frame of that plane, or as it is on a flat pad.
  const Touch& turned(const Touch& touch) const { return is_curved() ? here_ : touch; }
  // That plane; null on a flat pad.
  const TangentPlane* plane() const { return is_curved() ? &plane_ : nullptr; }
  // The part of the plane, or of the flat pad, that contacts may cover [m].
  Rectangle sheet() const { return is_curved() ? plane_.whole().bounds : pad_->surface().sheet(); }

  // Solve the contact as if the body were alone. `face`: the flat face with which the body faces the pad; null if it
  // has none. False if the body's geometry does not face the pad.
  bool solve(const Touch& touch, const std::shared_ptr<const Face>& face, const Placement& placement);
  // Let no other body lower the surface.
  void clear_sunk() { sunk_.assign(cells().cells(), 0.0); }
  // Add how far another body lowers the surface under this one's cells.
  void sink(const BodyPress& other, SurfaceCompliance::Workspace& workspace);
  // Solve again on the same cells, on the surface as lowered by others. Returns the largest change of a cell's normal
  // force [N].
  double press_again(const Touch& touch);
  // Compute the forces on the cells, and from them `nodal` (nodes y, nodes x, 3) [N]. False if the law found no
  // solution, and a simpler distribution carries the wrench.
  bool find_forces(const Touch& touch, SurfaceShear& shear, double* nodal);

  const CellContact& contact() const { return is_flat_ ? flat_.contact() : patch_.contact(); }
  const Face& cells() const { return is_flat_ ? flat_.face() : patch_.face(); }
  // After find_forces(): forces on the cells (cells, 3) [N], and the wrench (6) that they carry, as Touch::wrench.
  const std::vector<double>& forces() const { return forces_; }
  const double* carried() const { return carried_; }
  // The solution. `coupled`: whether other bodies lower the surface.
  SolvedCells solved(bool coupled) const;

 private:
  bool is_curved() const { return !pad_->outer().is_flat(); }
  ContactSurface surface() const { return {sheet(), pad_->compliance(), options_, plane()}; }
  // How the cells lie on a curved pad; null on a flat one.
  const BentCells* bent() const { return is_curved() ? &patch_.bent() : nullptr; }
  const double* heights() const { return is_flat_ ? flat_.heights() : patch_.heights().data(); }
  CellForces on_cells() const { return {forces_.data(), leans_.empty() ? nullptr : leans_.data()}; }
  // Whether the cells are those of the face, which is not cut to another one.
  bool on_whole_face() const { return is_flat_ && &cells() == face_.get(); }
  bool others_touch(const Touch& touch) const;
  bool press_shapes(const Touch& touch);
  double press_above(const Touch& touch, double floor);
  double press_within(const Touch& touch, double floor, double reach);
  bool touches_beyond(const Touch& touch, double reach);
  bool press_map(const Touch& touch);
  bool solve_over(const HeightMap& map, const Touch& touch, double floor, double ceiling);
  bool find_on_flat(const Touch& touch, SurfaceShear& shear, double* nodal);
  bool find_on_curved(SurfaceShear& shear, double* nodal);
  bool set_forces(const Touch& touch, SurfaceShear& shear);
  ShearOutcome solve_shear(const Touch& touch, SurfaceShear& shear);
  void integrate_shear();
  const std::vector<Point>* gradients() const;
  void balance_leans();

  std::shared_ptr<const Pad> pad_;
  LawOptions options_;
  std::shared_ptr<const Face> face_;       // the face in use
  bool is_flat_ = false;                   // whether the contact is on its cells
  FlatPress flat_;
  PatchPress patch_, other_patch_;         // a contact by the body's shape, and a second candidate for it
  GapMap gap_, other_gap_;                 // the shape's heights for them
  CellContact::Workspace workspace_;
  std::shared_ptr<const Face> sheared_;    // the face to which the integrals belong; null for none
  ShearIntegrals integrals_;
  FullCompliance full_;
  std::vector<double> forces_, sunk_;      // on the cells [N]; lowering of the surface by other bodies [m]
  std::vector<double> pressing_;           // forces on the cells along the surface's normals [N]
  std::vector<Point> leans_;               // of the cells [-]; empty if none leans
  double carried_[6] = {};                 // wrench that the cells carry, pad frame [N, N m]
  // On a curved pad: the plane in which the contact is solved, the body's heights over the surface there, and the touch
  // in the plane's frame.
  TangentPlane plane_;
  SurfaceMap over_;
  TurnedMap turned_;
  Touch here_;
  BentCells::Workspace bending_;
};

}  // namespace mjtactile
