#include "api/api.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "api/handles.hpp"
#include "contact/cells/edge_integrals.hpp"
#include "contact/cells/face_cells.hpp"
#include "contact/cells/linear_traction.hpp"
#include "contact/cells/placed_cells.hpp"
#include "contact/cells/tangential.hpp"
#include "contact/laws/by_name.hpp"
#include "geometry/flat_facets.hpp"
#include "linalg/kernels.hpp"

using namespace mjtactile;

namespace {

// Functions keep memory for each thread between calls.

template <typename Value>
void read(const StressMap<Value>& map, const double* forces, double* readings) {
  static thread_local typename StressMap<Value>::Workspace workspace;
  static thread_local std::vector<Value> response;
  response.assign(map.response_size, Value(0));
  map.add_response(forces, workspace, response.data());
  map.readings(response.data(), workspace, readings);
}

void copy(const double* from, Matrix& to) {
  for (size_t i = 0; i < to.rows(); ++i) std::copy(from + i * to.columns(), from + (i + 1) * to.columns(), to[i]);
}

}  // namespace

int mjt_version(void) { return 19; }

int mjt_knows(const char* law, const char* tangential) {
  return law_named(law) != nullptr && tangential_named(tangential) != nullptr;
}

const char* mjt_kernels(void) { return kernels().name; }

int mjt_use_kernels(const char* name) { return use_kernels(name) ? 1 : 0; }

mjt_pad* mjt_pad_new(int precision, int corners, size_t count_x, const double* ends_x, size_t count_y,
                     const double* ends_y, int mirror_x, int mirror_y, const double* image_signs) {
  const CornerSpread spread({ends_x, ends_x + count_x}, {ends_y, ends_y + count_y});
  auto* made = new mjt_pad{std::make_shared<Pad>(SurfaceGrid({ends_x, ends_x + count_x}, {ends_y, ends_y + count_y}),
                                                 static_cast<Precision>(precision), corners ? &spread : nullptr)};
  made->pad->set_mirrors(mirror_x != 0, mirror_y != 0, image_signs);
  return made;
}

mjt_outer* mjt_outer_quadric(const double* sheet, double p, double q, double c) {
  return new mjt_outer{OuterSurface::quadric({sheet[0], sheet[1], sheet[2], sheet[3]}, p, q, c)};
}

mjt_outer* mjt_outer_patch(const double* sheet, size_t count_x, size_t count_y, const double* jets) {
  return new mjt_outer{OuterSurface::patch({sheet[0], sheet[1], sheet[2], sheet[3]}, count_x, count_y, jets)};
}

void mjt_outer_free(mjt_outer* outer) { delete outer; }

int mjt_centre_of_pressure(const mjt_outer* outer, const double* wrench, double* centre) {
  Point found;
  if (!centre_of_pressure(outer->surface, wrench, found)) return 0;
  centre[0] = found.x, centre[1] = found.y, centre[2] = outer->surface.at(found.x, found.y).z;
  return 1;
}

void mjt_pad_set_outer(mjt_pad* pad, const mjt_outer* outer) { pad->pad->set_outer(outer->surface); }

void mjt_pad_set_range(mjt_pad* pad, const double* range, const double* saturation) {
  pad->pad->set_range({range[0], range[1], range[2]}, {saturation, saturation + pad->pad->layers()});
}

void mjt_pad_set_compliance(mjt_pad* pad, double factor, size_t count_x, const double* ends_x, size_t count_y,
                            const double* ends_y, const double* remainder) {
  QuadraticSplines x({ends_x, ends_x + count_x}), y({ends_y, ends_y + count_y});
  const size_t splines = x.count() * y.count();
  Matrix smooth(splines, splines);
  copy(remainder, smooth);
  pad->pad->set_compliance(SurfaceCompliance(factor, std::move(x), std::move(y), std::move(smooth)));
}

void mjt_pad_set_tiles(mjt_pad* pad, size_t count, const double* tiles, const int32_t* readings) {
  std::vector<Tile> made(count);
  for (size_t i = 0; i < count; ++i, tiles += 14) {
    made[i].pose = pose_of(tiles);
    std::copy(tiles + 12, tiles + 14, made[i].half_size);
    made[i].reading = static_cast<size_t>(readings[i]);
  }
  pad->pad->set_tiles(std::move(made));
}

void mjt_pad_add_layer(mjt_pad* pad, int precision, size_t points, size_t taxels, const int32_t* starts,
                       const int32_t* places, const double* weights) {
  pad->pad->add_layer({points, taxels, starts, places, weights}, static_cast<Precision>(precision));
}

void mjt_pad_set_class(mjt_pad* pad, int symmetry_class, size_t columns, const int32_t* column_of,
                       const double* signs, const size_t* ranks, const double* const* left,
                       const double* const* right, int mean) {
  std::vector<MatrixFactors> factors;
  for (size_t k = 0; k < pad->pad->layers(); ++k) factors.push_back({ranks[k], left[k], right[k]});
  pad->pad->set_class(static_cast<size_t>(symmetry_class), columns, column_of, signs, factors.data(), mean != 0);
}

void mjt_pad_set_foundation(mjt_pad* pad, size_t count, const double* areas, const double* stiffnesses) {
  pad->pad->compliance().set_foundation({areas, areas + count}, {stiffnesses, stiffnesses + count});
}

void mjt_pad_free(mjt_pad* pad) { delete pad; }

void mjt_readings(const mjt_pad* pad, const double* forces, double* readings) {
  std::visit([&](const auto& maps) { read(maps.deviatoric, forces, readings); }, pad->pad->maps());
}

void mjt_traction_forces(size_t count_x, const double* ends_x, size_t count_y, const double* ends_y, size_t count,
                         const double* edges, const double* tractions, double* forces) {
  static thread_local SurfaceGrid::Workspace workspace;
  static thread_local std::vector<TractionEdge> made;
  const SurfaceGrid grid({ends_x, ends_x + count_x}, {ends_y, ends_y + count_y});
  made.resize(count);
  for (size_t i = 0; i < count; ++i) {
    const double* edge = edges + 4 * i;
    const double* traction = tractions + 3 * i;
    made[i] = {{edge[0], edge[1]}, {edge[2], edge[3]}, {traction[0], traction[1], traction[2]}};
  }
  grid.traction_forces(made.data(), count, workspace, forces);
}

void mjt_nodal_integrals(size_t count_x, const double* ends_x, size_t count_y, const double* ends_y, size_t count,
                         const double* edges, double* integrals) {
  constexpr double kCoefficients[9] = {1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0};
  std::vector<Segment> outline(count);
  for (size_t i = 0; i < count; ++i) {
    const double* edge = edges + 4 * i;
    outline[i] = {{edge[0], edge[1]}, {edge[2], edge[3]}};
  }
  LinearTraction traction;
  traction.cover(std::move(outline));
  traction.nodal_forces({{ends_x, ends_x + count_x}, {ends_y, ends_y + count_y}}, kCoefficients, integrals);
}

int mjt_rigid_contact(size_t cells, size_t motions, const double* compliance, const double* modes,
                      const double* heights, const double* resultants, double* forces) {
  Matrix between(cells, cells);
  copy(compliance, between);
  RigidContact contact;
  if (!contact.solve({&between, modes, motions, heights, resultants}, nullptr)) return 0;
  std::copy(contact.forces().begin(), contact.forces().end(), forces);
  return 1;
}

mjt_body* mjt_body_new(void) { return new mjt_body; }

void mjt_body_add_shape(mjt_body* body, int kind, const double* size, const double* pose) {
  body->shapes.push_back({static_cast<ShapeKind>(kind), {size[0], size[1], size[2]}, pose_of(pose), nullptr});
}

void mjt_body_add_mesh(mjt_body* body, const double* pose, size_t vertices, const float* points, size_t triangles,
                       const int32_t* corners) {
  auto mesh = std::make_shared<TriangleMesh>(make_mesh(points, vertices, corners, triangles));
  mesh->facets = flat_facets(*mesh, 5e-5);
  body->shapes.push_back({ShapeKind::triangles, {0.0, 0.0, 0.0}, pose_of(pose), std::move(mesh)});
}

void mjt_body_free(mjt_body* body) { delete body; }

int mjt_body_heights(const mjt_body* body, const double* pose, const double* sheet, double floor, double ceiling,
                     size_t count, const double* points, double* heights) {
  static thread_local GapMap gap;
  const Rectangle part = {sheet[0], sheet[1], sheet[2], sheet[3]};
  if (!gap.place(body->shapes, pose_of(pose), part, {floor, ceiling, 0.0, ceiling})) return 0;
  std::vector<Point> asked(count);
  for (size_t i = 0; i < count; ++i) asked[i] = {points[2 * i], points[2 * i + 1]};
  std::vector<double> found;
  gap.heights(asked, found);
  std::copy(found.begin(), found.end(), heights);
  return 1;
}

int mjt_body_press(const mjt_pad* pad, const mjt_body* body, const double* pose, const double* wrench, double sunk,
                   const char* law, const char* tangential, int tilting, double friction, double strength,
                   double facing_gap, size_t cells, double* nodal_forces, double* carried) {
  const LawOptions options = law_options(law, tangential, tilting, friction, cells, strength);
  Touch touch = {};
  touch.geometry = std::make_shared<BodyGeometry>(body->shapes, side_limits(options, facing_gap));
  touch.pose = pose_of(pose);
  std::copy(wrench, wrench + 6, touch.wrench);
  touch.sunk = sunk;
  PadSensor sensor(pad->pad, options, facing_gap, 1e-6);
  sensor.keep_nodal_forces(true);
  sensor.press(&touch, 1, {});
  std::copy(sensor.nodal_forces().begin(), sensor.nodal_forces().end(), nodal_forces);
  std::copy(sensor.pressed().carried, sensor.pressed().carried + 6, carried);
  for (const Pressed::Note& note : sensor.pressed().notes) {
    if (note.event == Event::refused) return 0;
  }
  return 1;
}

size_t mjt_basis_bytes(void) { return BasisCache::shared().bytes(); }

namespace {

Outline outline_of(size_t rings, const size_t* begins, const double* corners) {
  Outline outline;
  for (size_t k = 0; k < rings; ++k) {
    outline.rings.emplace_back();
    for (size_t i = begins[k]; i < begins[k + 1]; ++i) {
      outline.rings.back().push_back({corners[2 * i], corners[2 * i + 1]});
    }
  }
  return outline;
}

double* copy(const std::vector<Point>& points, double* to) {
  for (const Point& point : points) *to++ = point.x, *to++ = point.y;
  return to;
}

}  // namespace

mjt_cells* mjt_face_cells(size_t rings, const size_t* begins, const double* corners, size_t count, double angle) {
  static thread_local FaceCells maker;
  auto face = std::make_shared<Face>();
  if (!maker.make(outline_of(rings, begins, corners), {count}, *face, angle)) return nullptr;
  return new mjt_cells{std::move(face)};
}

mjt_cells* mjt_placed_cells(size_t rings, const size_t* begins, const double* corners, size_t count, double widest,
                            double* place) {
  PlacedCells found = placed_cells(outline_of(rings, begins, corners), {count, widest});
  if (found.face == nullptr) return nullptr;
  place[0] = found.at.x, place[1] = found.at.y, place[2] = found.angle;
  return new mjt_cells{std::move(found.face)};
}

void mjt_face_cells_copy(const mjt_cells* cells, size_t* sizes, double* centroids, double* areas,
                         double* inverse_distance, double* ends, int32_t* sides, double* corners, double* hull,
                         double* quadrature, double* length) {
  const Face& face = *cells->face;
  sizes[0] = face.cells(), sizes[1] = face.edges.size();
  sizes[2] = face.corners.size(), sizes[3] = face.hull.size(), sizes[4] = face.convex ? 1 : 0;
  if (centroids == nullptr) return;
  copy(face.centroids, centroids);
  std::copy(face.areas.begin(), face.areas.end(), areas);
  std::copy(face.inverse_distance.begin(), face.inverse_distance.end(), inverse_distance);
  for (const CellEdge& edge : face.edges) {
    for (const Point& end : {edge.start, edge.end}) *ends++ = end.x, *ends++ = end.y;
    *sides++ = edge.left, *sides++ = edge.right;
  }
  copy(face.corners, corners);
  copy(face.hull, hull);
  copy(face.quadrature, quadrature);
  *length = face.length;
}

void mjt_face_cells_free(mjt_cells* cells) { delete cells; }

int mjt_clip_outline(size_t rings, const size_t* begins, const double* corners, const double* place,
                     const double* sheet, size_t room, size_t* cut_begins, double* cut_corners) {
  Outline cut;
  const Placement placement = {std::cos(place[2]), std::sin(place[2]), {place[0], place[1]}};
  if (!clip_outline(outline_of(rings, begins, corners), placement, {sheet[0], sheet[1], sheet[2], sheet[3]}, cut)) {
    return 0;
  }
  size_t used = 0;
  *cut_begins = 0;
  for (const std::vector<Point>& ring : cut.rings) {
    used += ring.size();
    if (used > room) return -1;
    *++cut_begins = used;
    cut_corners = copy(ring, cut_corners);
  }
  return static_cast<int>(cut.rings.size());
}

void mjt_pad_set_tangential(mjt_pad* pad, double poisson, const double* remainder) {
  const size_t size = 3 * pad->pad->compliance().splines();
  Matrix whole(size, size);
  copy(remainder, whole);
  pad->pad->compliance().set_tangential(poisson, std::move(whole));
}

void mjt_half_space(size_t cells, size_t edges, const double* ends, const int32_t* sides, double* integrals) {
  static thread_local ShearIntegrals shear;
  Face face;
  face.areas.resize(cells);
  for (size_t i = 0; i < edges; ++i, ends += 4, sides += 2) {
    face.edges.push_back({{ends[0], ends[1]}, {ends[2], ends[3]}, sides[0], sides[1]});
  }
  EdgeIntegrals().inverse_distance(face.edges, cells, face.inverse_distance);
  integrate_edges(face, shear);
  for (const auto* one : std::initializer_list<const std::vector<double>*>{
           &face.inverse_distance, &shear.xx, &shear.xy, &shear.yy, &shear.along, &shear.across}) {
    integrals = std::copy(one->begin(), one->end(), integrals);
  }
}

int mjt_surface_shear(size_t cells, const double* centroids, const double* pressing, const double* heights,
                      const double* frame, int tilting, const double* compliance, const double* wrench,
                      const char* tangential, double friction, double* forces) {
  static thread_local FullCompliance full;
  static thread_local SurfaceShear surface_shear;
  std::vector<Point> points;
  for (size_t i = 0; i < cells; ++i) points.push_back({centroids[2 * i], centroids[2 * i + 1]});
  if (compliance != nullptr) copy(compliance, full.given(cells));
  const PressedCells pressed = {cells, points.data(), pressing, heights, {frame[0], frame[1]}, frame[2], tilting != 0,
                                nullptr};
  const ShearProblem problem = {pressed, compliance == nullptr ? nullptr : &full, wrench, friction};
  const ShearOutcome outcome = surface_shear.solve(*tangential_named(tangential), problem, forces);
  return (outcome.refused ? 1 : 0) | (outcome.slides ? 2 : 0) | (outcome.simplified ? 4 : 0);
}
