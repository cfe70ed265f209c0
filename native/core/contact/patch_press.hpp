// Contact of a pad with a body of any shape.
//
// A search finds the spots where the body may touch, contact cells are laid on them, and the contact law is solved on
// these cells. The solution shows how the body tilts and how deep it sinks in. If the cells turn out too wide, too
// narrow or in the wrong place, the body is looked at again: each look repeats all of this with another view. Of the
// contacts found, the one of least energy is taken.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/contact_search.hpp"
#include "contact/laid_cells.hpp"
#include "contact/spot_lattices.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

class PatchPress {
 public:
  // Press a body with a wrench (6), about the origin [N, N m]; contact() is the solution on the cells of face(). A
  // bounded number of looks is taken. False if no part of the body faces the pad, or the force does not press. On a
  // curved pad all arguments are in the frame of the surface's plane, and heights are those above the surface.
  bool solve(const HeightMap& map, const ContactSurface& surface, const double* wrench,
             CellContact::Workspace& workspace);
  // After solve(), with the same arguments: press again with cells split at the body's rim, where the pressure of a
  // flat face rises, and where the contact ends. Under laws without coupling, or if there would be too many cells, the
  // contact stays as it is.
  void refine_rim(const HeightMap& map, const ContactSurface& surface, const double* wrench,
                  CellContact::Workspace& workspace);
  // The same, if most of what the body's rim presses is under a flat bottom, as that of a step is.
  void refine_flat_rim(const HeightMap& map, const ContactSurface& surface, const double* wrench,
                       CellContact::Workspace& workspace);
  // Solve again on the same cells, where other bodies have lowered the surface under them by `sunk` (cells) [m].
  void press_again(const ContactSurface& surface, const double* wrench, const std::vector<double>& sunk,
                   CellContact::Workspace& workspace) {
    laid_.press_again(surface, wrench, sunk, workspace);
  }

  // Place the cells in a workspace again, after others were placed there.
  void place(const ContactSurface& surface, CellContact::Workspace& workspace) { laid_.place(surface, workspace); }

  const CellContact& contact() const { return laid_.contact(); }
  // How the cells lie on a curved pad.
  const BentCells& bent() const { return laid_.bent(); }
  // Heights of the body above the cells, measured from its tilted plane (cells) [m].
  const std::vector<double>& heights() const { return laid_.heights(); }
  // Gradients of these heights (cells) [-].
  const std::vector<Point>& gradients() const { return laid_.cells().gradients(); }
  const Face& face() const { return laid_.face(); }
  // The view from which the heights are measured.
  const HeightWindow& view() const { return laid_.view(); }
  void integrate_shear(ShearIntegrals& integrals) const { laid_.cells().integrate_shear(integrals); }
  // Slope by which the body tilts from its pose in the simulation [-].
  double tilt() const { return laid_.tilt(); }
  // The plane, in the pose of the simulation, below which parts of the body touch the undeformed surface [m]. It tells
  // of parts that were left out whether they touch.
  InclinedPlane reached() const { return laid_.reached(); }
  // Whether the contact carries the load and agreed with its view, so that no other look was wanted.
  bool settled() const { return settled_; }
  // Height of the body's lowest point over the sheet, above the surface and without a tilt [m]; infinite if there is
  // none.
  double least() const { return search_.least(); }

 private:
  // The parameters that change from look to look.
  struct Viewpoint {
    Plane plane;         // the tilt from which the body is looked at
    double height_factor;   // cells are laid up to this multiple of the spots' level [-]
    double most_height;     // largest height of cells above the level, because the body came down that far; 0 if not
                            // known [m]
    double end_height;      // height at which the contact ends as seen from this plane; 0 if not known [m]
    double least_height;    // cells are laid at least up to it, because lower ones ended too early; 0: not known [m]
    double spot_height;     // spots are gathered up to this height, from the last look; 0 if there was none [m]
    double spot_end;        // spots end at this height, because the level was above the contact's end; 0: not known [m]
    double last_tilt[2];    // tilt that the last look found, relative to its plane [-]; 0 if there was none
    double finer;           // number of cells over that asked for [-]
    bool everywhere;        // whether cells are laid under all of the body that is low enough, not under spots alone

    bool sees_tilted_as(const Viewpoint& other) const {
      return plane.slopes[0] == other.plane.slopes[0] && plane.slopes[1] == other.plane.slopes[1];
    }
    // Whether a look from here sees the same as one from another view.
    bool sees_as(const Viewpoint& other) const {
      return sees_tilted_as(other) && height_factor == other.height_factor && most_height == other.most_height &&
             end_height == other.end_height && least_height == other.least_height &&
             spot_height == other.spot_height && spot_end == other.spot_end;
    }
  };
  // Measures by which contacts of different looks are compared; all 0 if they are not compared.
  struct Merit {
    double lacks;     // share of the load that the cells are too few to bear [-]
    double missed;    // distance of the centre of pressure from the load [m]
    double energy;    // see LaidCells; more if the body tilts onto a part that has no cells [J]
    double elastic;   // elastic energy of the surface alone [J]
  };
  // The arguments of solve(), and what follows from them.
  struct Problem {
    const HeightMap& map;
    const ContactSurface& surface;
    const LawOptions& options;    // the surface's
    const double* wrench;
    CellContact::Workspace& workspace;
    SearchLoad load;
    std::vector<Point> hull;      // convex hull of the area that the body covers; empty if it may not tilt
  };
  // State of the search for the best contact.
  struct Looks {
    Viewpoint view;                    // the last one
    Viewpoint best;                    // the view that gave the best contact so far
    Viewpoint onward;                  // the view to which the best contact leads
    Merit best_merit = {kNowhere, kNowhere, 0.0, 0.0};   // merit of the best contact
    double too_far[2] = {0.0, 0.0};   // slopes of the last view whose tilt was too large [-]
    bool turned_back = false;     // whether there was one
    int steps_back = 0;           // number of steps back from it since the best view was found
    bool goes_on = false;         // whether `onward` differs from `best`
    bool last_is_best = true;     // whether the last contact is the best one
    bool rested = false;          // whether some view was the tilt at which the body rests on springs
    bool resting_tried = false;   // whether the last view was
    bool moved = false;           // whether the last view was for other parts than those that do not carry the load
    int moves = 0;                // number of such views
    bool nested = false;          // whether the best contact was pressed on nested cells, in vain
  };
  // The next part of the body that touches outside of all spots while the body tilts.
  struct NextPart {
    double share = kNowhere;   // of the tilt after which it touches [-]
    double height = 0.0;       // of the part above the lowest point then [m]
  };
  static SearchLoad load_of(const double* wrench, const ContactSurface& surface);
  Viewpoint first_view(const Problem& problem) const;
  bool look_first(const Problem& problem, Looks& looks);
  bool choose_view(const Problem& problem, Looks& looks);
  void rest_on_springs(const Problem& problem, Looks& looks);
  bool move_to_others(const Problem& problem, Looks& looks);
  bool roll(const SearchLoad& load, Viewpoint& view) const;
  void find_spots(const Problem& problem, const Viewpoint& view);
  bool press(const Problem& problem, const Viewpoint& view);
  bool overloads() const;
  // Whether cells lie along ridges.
  bool along_ridges() const { return laid_.cells().lattices().along_ridges(); }
  void judge(const Problem& problem, bool pressed, Looks& looks) const;
  double exact_depth(const LawOptions& options) const;
  double needs_finer(const LawOptions& options) const;
  bool refine(const Problem& problem, const Looks& looks, double finer);
  bool can_nest(const Problem& problem, const Looks& looks) const;
  bool nests_early(const Problem& problem, const Looks& looks) const;
  bool needs_nested(const LawOptions& options);
  bool press_nested(const Problem& problem, const Looks& looks);
  bool press_generous(const Problem& problem, Viewpoint view);
  bool leaves_uncovered(double share) const;
  void choose_to_split(const LawOptions& options, bool all);
  void add_overlooking(double much);
  bool overlooks();
  double split_count(double narrowest) const;
  bool split_pressed(const Problem& problem);
  // Whether all cells press, and the body has no other part over the sheet that could.
  bool presses_all() const;
  Plane first_plane(const Problem& problem) const;
  double highest_cells(const LawOptions& options, const Viewpoint& view) const;
  double depth_of_tilts() const;
  NextPart next_part() const;
  NextPart next_part(const double* tilt, const Point& centre) const;
  bool reaches_other_part() const;
  void widen_regions(double factor) const;
  Plane seen_plane() const;
  bool next_view(const Merit& found, const NextPart& next, const LawOptions& options, Viewpoint& view) const;
  bool tilts(bool carries, const NextPart& next, const LawOptions& options) const;
  bool tilt_view(bool carries, const NextPart& next, const LawOptions& options, Viewpoint& view) const;
  bool raise_cells(Viewpoint& view) const;
  bool find_other_parts(Viewpoint& view) const;
  bool drop_needless_cells(const LawOptions& options, Viewpoint& view) const;
  bool raise_ends(const LawOptions& options, Viewpoint& view) const;
  // Distance of the centre of pressure from the load [m]; 0 if it is too small for taxels to resolve.
  double missed(const SearchLoad& load) const;
  Merit merit(const SearchLoad& load, const NextPart& next, const LawOptions& options) const;
  // A contact that carries the load is better than one that misses it. Of two that carry it, the one of less energy is
  // better: any pressures that balance the load bound the body's complementary energy from above (Kalker, J. Inst.
  // Maths Applics 20, 199, 1977), so one that leaves out a part of the body has more.
  static bool is_worse(const Merit& one, const Merit& other, double margin);

  ContactSearch search_;
  LaidCells laid_, best_;   // of the last look; of the best look, while another is taken
  bool settled_ = false;
  std::vector<Spot> spots_;
  SpotLattices lattices_;
  mutable std::vector<Region> wider_;   // members, so that no step allocates them anew
  std::vector<std::uint8_t> start_, chosen_;
};

}  // namespace mjtactile
