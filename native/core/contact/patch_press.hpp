// A body of any shape pressed on a pad: spots where it may touch, cells on them, and the contact they carry.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "contact/contact_search.hpp"
#include "contact/laws/cell_contact.hpp"
#include "contact/patch_face.hpp"
#include "geometry/height_map.hpp"

namespace mjtactile {

class PatchPress {
 public:
  // Press a body; contact() has the answer, on face(). Looks again with finer or wider cells a bounded number of times.
  // False where nothing of the body faces the pad, or the force does not press. On a curved pad, all is seen from a tangent
  // plane, over the surface.
  bool solve(const HeightMap& map, const Rectangle& sheet, const SurfaceCompliance& compliance,
             const LawOptions& options, const double* wrench, CellContact::Workspace& workspace,
             const TangentPlane* plane = nullptr);
  // The same contact on its cells where the surface has sunk by so much under each, as others bend it [m].
  void press_again(const SurfaceCompliance& compliance, const LawOptions& options, const double* wrench,
                   const std::vector<double>& sunk, CellContact::Workspace& workspace);

  // Put the cells into a workspace, in which others may have been placed since.
  void place(const SurfaceCompliance& compliance, const LawOptions& options, CellContact::Workspace& workspace);

  const CellContact& contact() const { return laid_.contact; }
  // How the cells lie on a curved pad.
  const BentCells& bent() const { return laid_.bent; }
  // Of the body above the cells, seen from where it tilts to [m].
  const std::vector<double>& heights() const { return laid_.heights; }
  const Face& face() const { return laid_.cells.face(); }
  // From where the heights are seen.
  const PatchFace::View& view() const { return laid_.seen; }
  void integrate_shear(ShearIntegrals& integrals) const { laid_.cells.integrate_shear(integrals); }
  // Slope by which the body tilts from where it stands [-].
  double tilt() const;

 private:
  // What is changed from look to look.
  struct View {
    Plane plane;
    double generosity;   // cells reach up to so many times the level of the spots
    double sinks;        // but no higher than the body was found to sink in; 0 where that is not known [m]
    double reaches;      // and at least so high, where they ended before the contact did; 0 where that is not known [m]
    double touches;      // up to where spots are gathered that may touch, as the last look found; 0 where none was [m]
    double from[2];      // slopes that the last look found away from its plane; 0 where none was
  };
  // What contacts found by different looks are compared by; all 0 where they are not.
  struct Merit {
    double missed, energy, elastic;   // elastic: energy in the surface alone [J]
  };
  // What is pressed on what: the arguments of solve(), and what follows from them.
  struct Problem {
    const HeightMap& map;
    const Rectangle& sheet;
    const SurfaceCompliance& compliance;
    const LawOptions& options;
    const double* wrench;
    CellContact::Workspace& workspace;
    const TangentPlane* plane;    // null on a flat pad
    SearchLoad load;
    std::vector<Point> hull;      // of what the body covers; none where it may not tilt
  };
  // Where the search for the best contact stands.
  struct Looks {
    View view, best, onward;      // the last, that of the best contact so far, and the one that this leads to
    Merit most = {kNowhere, 0.0, 0.0};   // of the best contact
    bool goes_on = false;         // whether `onward` is another view than the best
    bool last_is_best = true, ended = false;        // of the last contact; whether it goes on beyond its cells
    bool rested = false, resting_tried = false;     // whether a view was where springs rest; whether the last one was
  };
  // Where another part of the body touches, outside of all spots: after which share of a tilt, and how high above the
  // lowest point it stands then [m].
  struct NextPart {
    double share, height;
  };
  static SearchLoad load_of(const double* wrench, const SurfaceCompliance& compliance, const LawOptions& options);
  View first_view(const Problem& problem) const;
  bool look_first(const Problem& problem, Looks& looks);
  bool turn(const Problem& problem, Looks& looks);
  void rest(const Problem& problem, Looks& looks);
  void find_spots(const Problem& problem, const View& view);
  bool press(const Problem& problem, const View& view);
  void judge(const Problem& problem, bool pressed, bool more, Looks& looks) const;
  // Whether all cells press, and no other would: the body has nothing else over the sheet.
  bool presses_all() const;
  // Whether the contact is one spot that is neither long nor open, nor hardly larger than a cell.
  bool compact(const LawOptions& options) const;
  double likely_height() const;
  Plane first_plane(const SearchLoad& load, const std::vector<Point>& hull) const;
  void set_heights();
  bool add_cells(const HeightMap& map, const Rectangle& sheet, const LawOptions& options, const View& view);
  void reach_out();
  Lattice lattice_over(std::size_t number, const LawOptions& options, const View& view, double wanted,
                       double coarser) const;
  const std::vector<Region>& taken_by_others(std::size_t number);
  bool goes_beyond() const;
  bool ends_early() const;
  double sinks() const;
  NextPart next_part() const;
  bool next_view(const Merit& found, double narrowest, View& view) const;
  // Elastic energy of the contact and what is left to the load by how high the body stands [J]: of contacts that carry it
  // the one that has least is the body's, whatever cells it was looked for on.
  double energy(const SearchLoad& load) const;
  // How far from the load the pressure is centred [m]; 0 where that is nothing that taxels see.
  double missed(const SearchLoad& load, double narrowest) const;
  Merit merit(const SearchLoad& load, const LawOptions& options) const;
  // A contact that carries the load is better than one that misses it, and of two that do the one of less energy.
  static bool is_worse(const Merit& one, const Merit& other);

  // Cells as a look laid them, and the contact on them.
  struct Laid {
    PatchFace cells;
    BentCells bent;
    CellContact contact;
    PatchFace::View seen = {};
    std::vector<double> heights;
  };

  ContactSearch search_;
  Laid laid_, best_;   // of the last look; of the best one, while another is taken
  bool bends_ = false;
  std::vector<Spot> spots_;
  std::vector<Region> regions_, taken_;
  mutable std::vector<Region> wider_;   // kept: nothing is allocated in a step
  std::vector<std::uint8_t> start_;
};

}  // namespace mjtactile
