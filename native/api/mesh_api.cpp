// C functions of triangle meshes, see api.h.
#include <algorithm>

#include "api/api.h"
#include "api/handles.hpp"
#include "geometry/flat_facets.hpp"
#include "geometry/triangles.hpp"

using namespace mjtactile;

struct mjt_mesh {
  TriangleMesh mesh;
};

namespace {

// Memory that each thread keeps between calls.
TriangleShadow& cast(const mjt_mesh* mesh, const double* pose, const double* part, double floor, double reach) {
  static thread_local TriangleShadow kept;
  kept.cast(mesh->mesh, pose_of(pose), {part[0], part[1], part[2], part[3]}, floor, reach);
  return kept;
}

}  // namespace

mjt_mesh* mjt_mesh_new(size_t count, const float* vertices, size_t triangles, const int32_t* faces) {
  return new mjt_mesh{make_mesh(vertices, count, faces, triangles)};
}

mjt_mesh* mjt_mesh_new_field(size_t rows, size_t columns, const double* size, const float* data) {
  return new mjt_mesh{make_height_field(rows, columns, size, data)};
}

void mjt_mesh_free(mjt_mesh* mesh) { delete mesh; }

void mjt_mesh_data(const mjt_mesh* mesh, size_t* counts, double* vertices, int32_t* faces) {
  const TriangleMesh& held = mesh->mesh;
  counts[0] = held.vertices.size() / 3, counts[1] = held.faces.size() / 3;
  counts[2] = held.closed ? 1 : 0, counts[3] = held.dropped;
  if (vertices != nullptr) std::copy(held.vertices.begin(), held.vertices.end(), vertices);
  if (faces != nullptr) std::copy(held.faces.begin(), held.faces.end(), faces);
}

void mjt_mesh_heights(const mjt_mesh* mesh, const double* pose, const double* part, double floor, double reach,
                      size_t count, const double* points, double* heights, double* lowest) {
  TriangleShadow& shadow = cast(mesh, pose, part, floor, reach);
  std::vector<Point> asked(count);
  for (size_t i = 0; i < count; ++i) asked[i] = {points[2 * i], points[2 * i + 1]};
  std::fill(heights, heights + count, kNowhere);
  shadow.lower(asked, floor, heights);
  lowest[0] = shadow.lowest();
  const std::array<double, 3> bottom = shadow.bottom();
  std::copy(bottom.begin(), bottom.end(), lowest + 1);
}

size_t mjt_mesh_bottoms(const mjt_mesh* mesh, const double* pose, const double* part, double floor, double reach,
                        size_t most, double* points) {
  static thread_local std::vector<std::array<double, 3>> found;
  cast(mesh, pose, part, floor, reach).bottoms(found);
  for (size_t i = 0; i < std::min(found.size(), most); ++i) std::copy(found[i].begin(), found[i].end(), points + 3 * i);
  return found.size();
}

void mjt_mesh_facets(const mjt_mesh* mesh, double gap, size_t* counts, double* planes, size_t* loops, double* points) {
  std::fill(counts, counts + 3, size_t{0});
  for (const Facet& facet : flat_facets(mesh->mesh, gap)) {
    for (const auto& loop : facet.loops) {
      if (loops != nullptr) *loops++ = counts[0], *loops++ = loop.size();
      for (const auto& point : loop) {
        if (points != nullptr) points = std::copy(point.begin(), point.end(), points);
      }
      ++counts[1], counts[2] += loop.size();
    }
    if (planes != nullptr) {
      planes = std::copy(facet.normal, facet.normal + 3, planes);
      *planes++ = facet.offset, *planes++ = facet.area;
    }
    ++counts[0];
  }
}
