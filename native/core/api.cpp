#include "api.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <vector>

#include "handles.hpp"
#include "kernels.hpp"

using namespace mjtactile;

namespace {

// Area of a face's convex hull, over its own, up to which it counts as convex.
constexpr double kConvex = 1.0 + 1e-6;

// Every thread keeps its memory between calls.
struct Scratch {
  SurfaceGrid::Workspace grid;
  SurfaceCompliance::Workspace compliance;
  StressMap<float>::Workspace map;
  StressMap<double>::Workspace twofold_map;
  std::vector<float> response;
  std::vector<double> twofold_response;
  std::vector<TractionEdge> edges;
  Matrix matrix;
  RigidContact contact;
  FlatPress flat;
  ClosingPress curved;
  LinearTraction traction;
  GapMap gap;
  CellContact::Workspace law;
  std::vector<double> weights;
};

Scratch& scratch() {
  static thread_local Scratch kept;
  return kept;
}

template <typename Value>
void read(const StressMap<Value>& map, typename StressMap<Value>::Workspace& workspace, std::vector<Value>& response,
          const double* forces, double* readings) {
  response.assign(map.response_size, Value(0));
  map.add_response(forces, workspace, response.data());
  map.readings(response.data(), workspace, readings);
}

void copy(const Matrix& from, double* to) {
  for (size_t i = 0; i < from.rows(); ++i) to = std::copy(from[i], from[i] + from.columns(), to);
}

void copy(const double* from, Matrix& to) {
  for (size_t i = 0; i < to.rows(); ++i) std::copy(from + i * to.columns(), from + (i + 1) * to.columns(), to[i]);
}

}  // namespace

int mjt_version(void) { return 4; }

const char* mjt_kernels(void) { return kernels().name; }

int mjt_use_kernels(const char* name) { return use_kernels(name) ? 1 : 0; }

mjt_pad* mjt_pad_new(int precision, int corners, const double* range, size_t count_x, const double* ends_x,
                     size_t count_y, const double* ends_y, double factor, size_t patches_x,
                     const double* patch_ends_x, const double* spline_x, size_t patches_y, const double* patch_ends_y,
                     const double* spline_y, const double* remainder, const double* quadrant_signs) {
  const size_t patches = patches_x * patches_y;
  Matrix smooth(patches, patches);
  copy(remainder, smooth);
  AveragingSpline x({patch_ends_x, patch_ends_x + patches_x + 1}, {spline_x, spline_x + 3 * patches_x * patches_x});
  AveragingSpline y({patch_ends_y, patch_ends_y + patches_y + 1}, {spline_y, spline_y + 3 * patches_y * patches_y});
  SurfaceGrid surface({ends_x, ends_x + count_x}, {ends_y, ends_y + count_y});
  SurfaceCompliance compliance(factor, std::move(x), std::move(y), std::move(smooth));
  const CornerSpread spread({ends_x, ends_x + count_x}, {ends_y, ends_y + count_y});
  auto* made = new mjt_pad{std::make_shared<Pad>(std::move(surface), std::move(compliance),
                                                 static_cast<Precision>(precision), corners ? &spread : nullptr,
                                                 LinearRange{range[0], range[1]})};
  made->pad->set_signs(quadrant_signs);
  return made;
}

void mjt_pad_add_layer(mjt_pad* pad, size_t points, size_t taxels, const int32_t* starts, const int32_t* places,
                       const double* weights) {
  pad->pad->add_layer({points, taxels, starts, places, weights});
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

size_t mjt_pad_bytes(const mjt_pad* pad) { return pad->pad->bytes(); }

void mjt_readings(const mjt_pad* pad, const double* forces, double* readings) {
  Scratch& kept = scratch();
  if (pad->pad->twofold()) {
    read(pad->pad->deviatoric<double>(), kept.twofold_map, kept.twofold_response, forces, readings);
  } else {
    read(pad->pad->deviatoric<float>(), kept.map, kept.response, forces, readings);
  }
}

void mjt_traction_forces(size_t count_x, const double* ends_x, size_t count_y, const double* ends_y, size_t count,
                         const double* edges, const double* tractions, double* forces) {
  Scratch& kept = scratch();
  const SurfaceGrid grid({ends_x, ends_x + count_x}, {ends_y, ends_y + count_y});
  kept.edges.resize(count);
  for (size_t i = 0; i < count; ++i) {
    const double* edge = edges + 4 * i;
    const double* traction = tractions + 3 * i;
    kept.edges[i] = {{edge[0], edge[1]}, {edge[2], edge[3]}, {traction[0], traction[1], traction[2]}};
  }
  grid.traction_forces(kept.edges.data(), count, kept.grid, forces);
}

void mjt_normal_compliance(const mjt_pad* pad, size_t cells, const double* centroids, const double* areas,
                           const double* inverse_distance, double scale, double* compliance) {
  Scratch& kept = scratch();
  pad->pad->compliance().normal(centroids, areas, cells, inverse_distance, scale, kept.compliance, kept.matrix);
  for (size_t i = 0; i < cells; ++i) {
    for (size_t j = i; j < cells; ++j) compliance[i * cells + j] = compliance[j * cells + i] = kept.matrix[i][j];
  }
}

int mjt_rigid_contact(size_t cells, size_t motions, const double* compliance, const double* modes,
                      const double* heights, const double* resultants, const uint8_t* start, uint8_t* pressed,
                      double* map_forces, double* map_motion, double* map_separation) {
  Scratch& kept = scratch();
  kept.matrix.resize(cells, cells);
  copy(compliance, kept.matrix);
  if (!kept.contact.exchange(kept.matrix, modes, motions, heights, resultants, start, false)) return 0;
  std::copy(kept.contact.pressed().begin(), kept.contact.pressed().end(), pressed);
  copy(kept.contact.map_forces(), map_forces);
  copy(kept.contact.map_motion(), map_motion);
  copy(kept.contact.map_separation(), map_separation);
  return 1;
}

mjt_face* mjt_face_new(const double* rotation, double height, double most_slope, size_t cells,
                       const double* centroids, const double* areas, const double* inverse_distance, size_t edges,
                       const double* ends, const int32_t* sides, size_t corners, const double* outline, int cut) {
  auto face = std::make_shared<Face>();
  std::copy(rotation, rotation + 9, face->rotation);
  face->height = height;
  face->most_slope = most_slope;
  face->cut = cut != 0;
  double area = 0.0;
  for (size_t i = 0; i < cells; ++i) {
    face->centroids.push_back({centroids[2 * i], centroids[2 * i + 1]});
    area += areas[i];
  }
  face->areas.assign(areas, areas + cells);
  face->length = std::sqrt(area);
  face->inverse_distance.assign(inverse_distance, inverse_distance + cells * cells);
  for (size_t i = 0; i < edges; ++i) {
    const double* end = ends + 4 * i;
    face->edges.push_back({{end[0], end[1]}, {end[2], end[3]}, sides[2 * i], sides[2 * i + 1]});
  }
  std::vector<Point> points;
  for (size_t i = 0; i < corners; ++i) points.push_back({outline[2 * i], outline[2 * i + 1]});
  face->corners = convex_hull(std::move(points));
  face->hull = convex_hull(face->centroids);
  double hull_area = 0.0;
  for (size_t i = 0; i < face->corners.size(); ++i) {
    const Point &a = face->corners[i], &b = face->corners[(i + 1) % face->corners.size()];
    hull_area += (a.x * b.y - b.x * a.y) / 2;
  }
  face->convex = hull_area <= kConvex * area;
  return new mjt_face{std::move(face)};
}

void mjt_face_free(mjt_face* face) { delete face; }

int mjt_face_press(const mjt_pad* pad, const mjt_face* face, const double* pose, const double* wrench, int law,
                   int tilting, double friction, size_t cells, double* nodal_forces) {
  Scratch& kept = scratch();
  const LawOptions options = {static_cast<Law>(law), tilting != 0, friction, cells};
  Placement placement;
  const Face& flat = *face->face;
  if (!place(flat, pose_of(pose), placement)) return 0;
  if (options.law == Law::uniform) {
    double coefficients[9];
    kept.traction.cover(flat, placement);
    if (friction >= 0.0 || !kept.traction.carry(wrench, coefficients)) return 0;
    kept.traction.nodal_forces(pad->pad->surface(), coefficients, nodal_forces);
    return 1;
  }
  FlatPress& flat_press = kept.flat;
  if (!flat_press.solve(flat, placement, pad->pad->compliance(), options, wrench, kept.law)) return 0;
  if (!flat_press.contact().weights(flat_press.face(), options, flat_press.carried(), kept.weights, kept.law)) return 0;
  flat_press.contact().nodal_forces(flat_press.face(), pad->pad->surface(), kept.weights, kept.law, nodal_forces);
  return 1;
}

mjt_body* mjt_body_new(const double* limits, size_t faces, const double* facing) {
  auto geometry = std::make_shared<BodyGeometry>();
  geometry->limits = {limits[0], limits[1], limits[2]};
  geometry->facing.assign(facing, facing + 3 * faces);
  return new mjt_body{std::move(geometry)};
}

void mjt_body_add_shape(mjt_body* body, int kind, const double* size, const double* pose) {
  body->geometry->curved.shapes.push_back(
      {static_cast<ShapeKind>(kind), {size[0], size[1], size[2]}, pose_of(pose), nullptr});
}

void mjt_body_add_mesh(mjt_body* body, const double* pose, size_t vertices, const double* points, size_t triangles,
                       const int32_t* corners, int closed) {
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->vertices.assign(points, points + 3 * vertices);
  mesh->faces.assign(corners, corners + 3 * triangles);
  mesh->closed = closed != 0;
  body->geometry->curved.shapes.push_back({ShapeKind::triangles, {0.0, 0.0, 0.0}, pose_of(pose), std::move(mesh)});
}

void mjt_body_free(mjt_body* body) { delete body; }

int mjt_body_heights(const mjt_body* body, const double* pose, const double* sheet, size_t count, const double* points,
                     double* heights) {
  GapMap& gap = scratch().gap;
  const BodyGeometry& geometry = *body->geometry;
  if (!gap.place(geometry.curved, pose_of(pose), {sheet[0], sheet[1], sheet[2], sheet[3]}, geometry.limits)) return 0;
  for (size_t i = 0; i < count; ++i) heights[i] = gap.height(points[2 * i], points[2 * i + 1]);
  return 1;
}

int mjt_body_press(const mjt_pad* pad, const mjt_body* body, const double* pose, const double* wrench, int law,
                   int tilting, double friction, size_t cells, const double* region, double* nodal_forces) {
  Scratch& kept = scratch();
  const BodyGeometry& geometry = *body->geometry;
  const SurfaceGrid& grid = pad->pad->surface();
  const Rectangle sheet = {grid.low_x(), grid.low_y(), grid.high_x(), grid.high_y()};
  if (!kept.gap.place(geometry.curved, pose_of(pose), sheet, geometry.limits)) return 0;
  const Region start = region == nullptr ? kept.gap.covered()
                                         : Region{{region[0], region[1]}, region[2], region[3], region[4]};
  const LawOptions options = {static_cast<Law>(law), tilting != 0, friction, cells};
  if (!kept.curved.solve(kept.gap, start, pad->pad->compliance(), options, wrench, kept.law)) return 0;
  const CellContact& contact = kept.curved.contact();
  if (!contact.weights(kept.curved.face(), options, wrench, kept.weights, kept.law)) return 0;
  contact.nodal_forces(kept.curved.face(), grid, kept.weights, kept.law, nodal_forces);
  return 1;
}

size_t mjt_basis_bytes(void) { return BasisCache<float>::shared().bytes() + BasisCache<double>::shared().bytes(); }
