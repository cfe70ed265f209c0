// The C interface to contacts without MuJoCo: footprints pressed as the plugin presses bodies.
#include <algorithm>
#include <cmath>
#include <limits>
#include <memory>
#include <vector>

#include "api/handles.hpp"
#include "linalg/small.hpp"

using namespace mjtactile;

namespace {

// A cell slips if its shear is within this fraction of friction times pressure.
constexpr double kSlips = 1e-6;
// Time that the solution for shear may take, over that in a step of a simulation.
constexpr double kPatience = 1e4;
// If the least pivot is below this fraction of the largest entry, the pressed cells do not determine the tilt.
constexpr double kOpen = 1e-12;

// A height map that calls a function of the caller.
class CalledMap : public HeightMap {
 public:
  CalledMap(mjt_heights call, const Rectangle& bounds) : heights_(call), bounds_(bounds) {}

  double height(double x, double y) const override {
    std::vector<double> found;
    heights({{x, y}}, found);
    return found.front();
  }
  void heights(const std::vector<Point>& points, std::vector<double>& to) const override {
    to.assign(points.size(), kNowhere);
    coordinates_.clear();
    for (const Point& at : points) coordinates_.insert(coordinates_.end(), {at.x, at.y});
    heights_(points.size(), coordinates_.data(), to.data());
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!bounds_.holds(points[i].x, points[i].y)) to[i] = kNowhere;
    }
  }
  Rectangle bounds() const override { return bounds_; }

 private:
  mutable std::vector<double> coordinates_;
  mjt_heights heights_;
  Rectangle bounds_;
};

}  // namespace

struct mjt_footprint {
  std::shared_ptr<const Face> face;
  Placement placement = kUnmoved;
  std::unique_ptr<CalledMap> map;
};

struct mjt_press {
  std::shared_ptr<const Pad> pad;
  LawOptions options;
  PadSensor sensor;
  std::vector<Touch> touches;
  std::vector<SolvedCells> solved;   // of each body; valid until the next press
  std::vector<std::vector<Segment>> rims;    // of each body: edges of its area under pressure
  CellContact basis;                 // the contact of the last mjt_press_parts(), and its face
  std::shared_ptr<const Face> basis_face;
  CellContact::Workspace workspace;
  BentCells::Workspace bent;
  std::vector<double> forces;
};

namespace {

// Depth of the surface under a cell below the undeformed surface [m].
double depth(const mjt_press& press, const SolvedCells& solved, std::size_t cell) {
  const std::size_t cells = solved.face->cells();
  double sum = 0.0;
  if (solved.full != nullptr) {
    double force[3];
    const double* row = solved.full->normal_row(cell);
    for (std::size_t j = 0; j < cells; ++j) {
      solved.forces.at(j, force);
      for (std::size_t k = 0; k < 3; ++k) sum -= row[k * cells + j] * force[k];
    }
    return sum;
  }
  return solved.contact->depth(*solved.face, *press.options.law, solved.workspace->matrix, cell);
}

// Height of the undisplaced body above a cell [m].
double height(const SolvedCells& solved, std::size_t cell) {
  double above = solved.heights == nullptr ? 0.0 : solved.heights[cell];
  if (solved.sunk != nullptr) above += solved.sunk[cell];
  if (solved.view == nullptr) return above;
  return solved.view->unmeasured(solved.face->centroids[cell], above);
}

// Set the body's indentation at a point and its slopes. They follow by least squares from the depths of the pressed
// cells, where the body touches the surface.
void set_motion(const mjt_press& press, const SolvedCells& solved, const double* point, mjt_pressed& to) {
  const double* placed = solved.workspace->placed.data();
  double gram[9] = {}, right[3] = {};
  const double length = solved.face->length;
  double at[3] = {point[0], point[1], 0.0};
  if (solved.bent != nullptr) {   // the cells are in the frame of a tangent plane
    const TangentPlane& plane = solved.bent->plane();
    const double on_surface[3] = {point[0], point[1], plane.surface().at(point[0], point[1]).z};
    plane.into(on_surface, at);
  }
  for (std::size_t i = 0; i < solved.face->cells(); ++i) {
    if (!(solved.forces.forces[3 * i + 2] < 0.0)) continue;
    const double modes[3] = {1.0, (placed[2 * i] - at[0]) / length, (placed[2 * i + 1] - at[1]) / length};
    const double down = depth(press, solved, i) + height(solved, i);
    for (std::size_t a = 0; a < 3; ++a) {
      for (std::size_t b = 0; b < 3; ++b) gram[3 * a + b] += modes[a] * modes[b];
      right[a] += modes[a] * down;
    }
  }
  const double mean = right[0] / gram[0];
  to.slopes[0] = to.slopes[1] = 0.0;
  to.indentation = mean;
  if (!press.options.tilting || !solve_small(3, gram, right, 1, kOpen)) return;
  to.indentation = right[0];
  to.slopes[0] = right[1] / length;
  to.slopes[1] = right[2] / length;
  if (solved.bent == nullptr) return;
  // Convert the rotation from the plane's axes to the pad's.
  const double turn[3] = {-to.slopes[1], to.slopes[0], 0.0};
  double on_pad[3];
  solved.bent->plane().turn_out_of(turn, on_pad);
  to.slopes[0] = on_pad[1], to.slopes[1] = -on_pad[0];
}

// Area of a cell on the pad's surface [m^2].
double area(const SolvedCells& solved, std::size_t cell) {
  return solved.bent == nullptr ? solved.face->areas[cell] : solved.face->areas[cell] * solved.bent->stretches()[cell];
}

void describe(const mjt_press& press, const SolvedCells& solved, const double* point, mjt_pressed& to) {
  const Face& face = *solved.face;
  for (std::size_t i = 0; i < face.cells(); ++i) {
    const double* force = solved.forces.forces + 3 * i;
    if (!(force[2] < 0.0)) continue;
    to.area += area(solved, i);
    to.peak = std::max(to.peak, -force[2] / face.areas[i]);
    if (std::hypot(force[0], force[1]) < (1.0 - kSlips) * press.options.friction * -force[2]) {
      to.stick += area(solved, i);
    }
  }
  std::copy(solved.carried, solved.carried + 6, to.carried);
  to.approximated = solved.contact->exact() ? 0 : 1;
  to.cells = static_cast<std::int32_t>(face.cells());
  if (press.options.law->shapes() && to.area > 0.0) set_motion(press, solved, point, to);
}

// Press all touches, and write the results of the bodies from `first` to before `last`.
void press_once(mjt_press& press, std::size_t first, std::size_t last, const double* points, double* nodal_forces,
                mjt_pressed* pressed) {
  press.sensor.press(press.touches.data(), press.touches.size(), {});
  const std::size_t nodes = 3 * press.pad->surface().nodes_x() * press.pad->surface().nodes_y();
  for (std::size_t body = first; body < last; ++body) {
    const SolvedCells solved = press.sensor.solved_cells(body);
    double* nodal = nodal_forces + body * nodes;
    mjt_pressed& to = pressed[body];
    to = {};
    to.indentation = to.slopes[0] = to.slopes[1] = std::numeric_limits<double>::quiet_NaN();
    for (const Pressed::Note& note : press.sensor.pressed().notes) {
      if (note.body != static_cast<int>(body)) continue;
      if (note.event == Event::refused) to.refused = 1;
      if (note.event == Event::approximated && solved.contact != nullptr && solved.contact->exact()) to.simplified = 1;
    }
    press.solved[body] = solved;
    if (solved.contact != nullptr) describe(press, solved, points + 2 * body, to);
    if (last - first == 1) {   // all nodal forces are its own
      std::copy(press.sensor.nodal_forces().begin(), press.sensor.nodal_forces().end(), nodal);
      if (solved.contact == nullptr) {   // law "uniform" without cells, or no contact
        to.area = press.sensor.pressed().area;
        to.peak = press.sensor.pressed().peak;
        std::copy(press.sensor.pressed().carried, press.sensor.pressed().carried + 6, to.carried);
      }
    } else if (solved.contact == nullptr) {
      std::fill(nodal, nodal + nodes, 0.0);
    } else if (solved.bent == nullptr) {
      mjtactile::nodal_forces(*solved.face, solved.contact->placement(), press.pad->surface(), solved.forces,
                              press.workspace.tractions, nodal);
    } else {
      solved.bent->nodal_forces(*solved.face, press.pad->surface(), solved.forces, to.carried, press.bent, nodal);
    }
    const std::vector<Segment>& rim = press.rims[body] = press.sensor.rims()[body];
    to.edges = static_cast<std::int32_t>(rim.size());
  }
}

}  // namespace

mjt_footprint* mjt_footprint_flat(const mjt_cells* cells, const double* place) {
  auto made = std::make_unique<mjt_footprint>();
  made->face = cells->face;
  made->placement = {std::cos(place[2]), std::sin(place[2]), {place[0], place[1]}};
  return made.release();
}

mjt_footprint* mjt_footprint_heights(mjt_heights heights, const double* bounds) {
  auto made = std::make_unique<mjt_footprint>();
  made->map = std::make_unique<CalledMap>(heights, Rectangle{bounds[0], bounds[1], bounds[2], bounds[3]});
  return made.release();
}

void mjt_footprint_free(mjt_footprint* footprint) { delete footprint; }

mjt_press* mjt_press_new(const mjt_pad* pad, const char* law, const char* tangential, int tilting, double friction,
                         size_t cells, double strength, double narrowest) {
  LawOptions options = law_options(law, tangential, tilting, friction, cells, strength);
  options.narrowest = narrowest;
  options.any_torsion = true;
  // Footprints have no body geometry: their lowest part is known, so that the facing gap is 0, and no pose is rounded.
  auto* made =
      new mjt_press{pad->pad, options, PadSensor(pad->pad, options, 0.0, 1e-6), {}, {}, {}, {}, {}, {}, {}, {}};
  made->sensor.keep_nodal_forces(true, true);
  made->sensor.set_patience(kPatience);
  return made;
}

void mjt_press_free(mjt_press* press) { delete press; }

void mjt_press_bodies(mjt_press* press, size_t count, const mjt_footprint* const* footprints, const double* wrenches,
                      const double* points, double* nodal_forces, mjt_pressed* pressed) {
  press->touches.resize(count);
  press->solved.assign(count, {});
  press->rims.resize(count);
  for (size_t i = 0; i < count; ++i) {
    Touch& touch = press->touches[i];
    touch = {};
    touch.body = static_cast<int>(i);
    touch.face = footprints[i]->face;
    touch.placement = footprints[i]->placement;
    touch.map = footprints[i]->map.get();
    touch.friction = press->options.friction;
    if (press->options.law->couples()) std::copy(wrenches + 6 * i, wrenches + 6 * i + 6, touch.wrench);
  }
  if (press->options.law->couples()) {
    press_once(*press, 0, count, points, nodal_forces, pressed);
    return;
  }
  // The sensor gives the sum of all bodies' nodal forces. To get those of each body, press it alone, at its own index.
  for (size_t i = 0; i < count; ++i) {
    double* wrench = press->touches[i].wrench;
    std::copy(wrenches + 6 * i, wrenches + 6 * i + 6, wrench);
    press_once(*press, i, i + 1, points, nodal_forces, pressed);
    std::fill(wrench, wrench + 6, 0.0);
  }
}

void mjt_press_cells(const mjt_press* press, size_t body, double* centroids, double* areas, double* forces,
                     double* heights) {
  const SolvedCells& solved = press->solved[body];
  if (solved.contact == nullptr) return;
  const size_t cells = solved.face->cells();
  const auto& placed = solved.bent == nullptr ? solved.workspace->placed : solved.bent->on_pad();
  if (centroids != nullptr) {
    std::copy(placed.begin(), placed.begin() + static_cast<std::ptrdiff_t>(2 * cells), centroids);
  }
  for (size_t i = 0; areas != nullptr && i < cells; ++i) areas[i] = area(solved, i);
  for (size_t i = 0; forces != nullptr && i < cells; ++i) {
    if (solved.bent == nullptr) {
      solved.forces.at(i, forces + 3 * i);
    } else {
      solved.bent->force_on(i, solved.forces, forces + 3 * i);
    }
  }
  for (size_t i = 0; heights != nullptr && i < cells; ++i) heights[i] = height(solved, i);
}

size_t mjt_press_edges(const mjt_press* press, size_t body, double* ends, int32_t* sides) {
  const SolvedCells& solved = press->solved[body];
  if (solved.contact == nullptr) return 0;
  for (const CellEdge& edge : solved.face->edges) {
    if (ends == nullptr) break;
    for (const Point& end : {edge.start, edge.end}) {
      const Point at = on_pad(solved, end);
      *ends++ = at.x, *ends++ = at.y;
    }
    *sides++ = edge.left, *sides++ = edge.right;
  }
  return solved.face->edges.size();
}

void mjt_press_rim(const mjt_press* press, size_t body, double* ends) {
  copy_edges(press->rims[body], ends);
}

size_t mjt_press_parts(mjt_press* press, size_t body, double* nodal_forces) {
  const SolvedCells& solved = press->solved[body];
  const LawOptions& options = press->options;
  const bool plain = !options.tangential->couples() && options.friction < 0.0;
  // Only a whole flat face has cells that do not depend on the load.
  if (solved.contact == nullptr || !plain || solved.view != nullptr || !solved.contact->linear()) return 0;
  const size_t parts = solved.contact->parts();
  const size_t nodes = 3 * press->pad->surface().nodes_x() * press->pad->surface().nodes_y();
  if (nodal_forces == nullptr) return parts;
  press->basis_face = nullptr;
  press->basis = *solved.contact;
  press->workspace = *solved.workspace;
  if (!press->basis.make_parts(*solved.face, *options.law, press->workspace)) return 0;
  press->basis_face = press->touches[body].face;
  press->forces.resize(3 * solved.face->cells());
  for (size_t p = 0; p < parts; ++p) {
    press->basis.part_forces(*solved.face, p, press->forces.data());
    mjtactile::nodal_forces(*solved.face, press->basis.placement(), press->pad->surface(), {press->forces.data()},
                            press->workspace.tractions, nodal_forces + p * nodes);
  }
  return parts;
}

int mjt_press_weights(mjt_press* press, const double* wrench, double* weights) {
  if (press->basis_face == nullptr) return 0;
  std::vector<double> found;
  if (!press->basis.weights(*press->basis_face, press->options, wrench, found, press->workspace)) return 0;
  std::copy(found.begin(), found.end(), weights);
  return 1;
}
