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

mjt_mesh* mjt_mesh_new(size_t count, const float* vertices, size_t triangles, const int32_t* faces) {
  return new mjt_mesh{make_mesh(vertices, count, faces, triangles)};
}

mjt_mesh* mjt_mesh_new_field(size_t rows, size_t columns, const double* size, const float* data) {
  return new mjt_mesh{make_height_field(rows, columns, size, data)};
}

void mjt_mesh_free(mjt_mesh* mesh) { delete mesh; }

void mjt_mesh_data(const mjt_mesh* mesh, double gap, size_t* counts, double* vertices, int32_t* faces, double* planes,
                   size_t* loops, double* points) {
  const TriangleMesh& held = mesh->mesh;
  counts[0] = held.vertices.size() / 3, counts[1] = held.faces.size() / 3, counts[2] = held.closed ? 1 : 0;
  counts[3] = counts[4] = counts[5] = 0;
  if (vertices != nullptr) {
    std::copy(held.vertices.begin(), held.vertices.end(), vertices);
    std::copy(held.faces.begin(), held.faces.end(), faces);
  }
  for (const Facet& facet : flat_facets(held, gap)) {
    for (const auto& loop : facet.loops) {
      if (vertices != nullptr) {
        *loops++ = counts[3], *loops++ = loop.size();
        for (const auto& point : loop) points = std::copy(point.begin(), point.end(), points);
      }
      ++counts[4], counts[5] += loop.size();
    }
    if (vertices != nullptr) {
      planes = std::copy(facet.normal, facet.normal + 3, planes);
      *planes++ = facet.offset, *planes++ = facet.area;
    }
    ++counts[3];
  }
}

size_t mjt_mesh_shadow(const mjt_mesh* mesh, const double* pose, const double* part, double floor, double reach,
                       size_t count, const double* points, double* heights, double* lowest, size_t most,
                       double* bottoms) {
  static thread_local TriangleShadow shadow;   // keeps its memory between calls
  shadow.cast(mesh->mesh, pose_of(pose), {part[0], part[1], part[2], part[3]}, floor, reach, -kNowhere);
  std::vector<Point> asked(count);
  for (size_t i = 0; i < count; ++i) asked[i] = {points[2 * i], points[2 * i + 1]};
  std::fill(heights, heights + count, kNowhere);
  shadow.lower(asked, floor, heights);
  *lowest = shadow.lowest();
  std::vector<std::array<double, 3>> found;
  if (most > 0) shadow.bottoms(found);
  for (size_t i = 0; i < std::min(found.size(), most); ++i) {
    std::copy(found[i].begin(), found[i].end(), bottoms + 3 * i);
  }
  return found.size();
}
