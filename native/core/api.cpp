#include "api.h"

#include <algorithm>
#include <vector>

#include "kernels.hpp"
#include "pad.hpp"
#include "rigid_contact.hpp"

using namespace mjtactile;

struct mjt_pad {
  Pad pad;
};

namespace {

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

void copy(const Matrix& from, double* to) { std::copy(from.data(), from.data() + from.rows() * from.columns(), to); }

}  // namespace

int mjt_version(void) { return 1; }

const char* mjt_kernels(void) { return kernels().name; }

int mjt_use_kernels(const char* name) { return use_kernels(name) ? 1 : 0; }

mjt_pad* mjt_pad_new(int precision, double thickness, size_t count_x, const double* ends_x, size_t count_y,
                     const double* ends_y, double factor, size_t patches_x, const double* patch_ends_x,
                     const double* spline_x, size_t patches_y, const double* patch_ends_y, const double* spline_y,
                     const double* remainder, const double* quadrant_signs) {
  const size_t patches = patches_x * patches_y;
  Matrix smooth(patches, patches);
  std::copy(remainder, remainder + patches * patches, smooth.data());
  AveragingSpline x({patch_ends_x, patch_ends_x + patches_x + 1}, {spline_x, spline_x + 3 * patches_x * patches_x});
  AveragingSpline y({patch_ends_y, patch_ends_y + patches_y + 1}, {spline_y, spline_y + 3 * patches_y * patches_y});
  SurfaceGrid surface({ends_x, ends_x + count_x}, {ends_y, ends_y + count_y});
  SurfaceCompliance compliance(factor, std::move(x), std::move(y), std::move(smooth));
  auto* made = new mjt_pad{Pad(std::move(surface), std::move(compliance), static_cast<Precision>(precision), thickness)};
  made->pad.set_signs(quadrant_signs);
  return made;
}

void mjt_pad_add_layer(mjt_pad* pad, size_t points, size_t taxels, const int32_t* starts, const int32_t* places,
                       const double* weights) {
  pad->pad.add_layer({points, taxels, starts, places, weights});
}

void mjt_pad_set_class(mjt_pad* pad, int symmetry_class, size_t columns, const int32_t* column_of,
                       const double* signs, const size_t* ranks, const double* const* left,
                       const double* const* right) {
  const size_t layers = pad->pad.twofold() ? pad->pad.twofold_map().layers.size() : pad->pad.map().layers.size();
  std::vector<MatrixFactors> factors;
  for (size_t k = 0; k < layers; ++k) factors.push_back({ranks[k], left[k], right[k]});
  pad->pad.set_class(static_cast<size_t>(symmetry_class), columns, column_of, signs, factors.data());
}

void mjt_pad_free(mjt_pad* pad) { delete pad; }

size_t mjt_pad_bytes(const mjt_pad* pad) { return pad->pad.bytes(); }

size_t mjt_pad_response_size(const mjt_pad* pad) { return pad->pad.response_size(); }

void mjt_readings(const mjt_pad* pad, const double* forces, double* readings) {
  Scratch& kept = scratch();
  if (pad->pad.twofold()) {
    read(pad->pad.twofold_map(), kept.twofold_map, kept.twofold_response, forces, readings);
  } else {
    read(pad->pad.map(), kept.map, kept.response, forces, readings);
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
  pad->pad.compliance().normal(centroids, areas, cells, inverse_distance, scale, kept.compliance, kept.matrix);
  for (size_t i = 0; i < cells; ++i) {
    for (size_t j = i; j < cells; ++j) compliance[i * cells + j] = compliance[j * cells + i] = kept.matrix[i][j];
  }
}

int mjt_rigid_contact(size_t cells, size_t motions, const double* compliance, const double* modes,
                      const double* heights, const double* resultants, const uint8_t* start, uint8_t* pressed,
                      double* map_forces, double* map_motion, double* map_separation) {
  Scratch& kept = scratch();
  kept.matrix.resize(cells, cells);
  std::copy(compliance, compliance + cells * cells, kept.matrix.data());
  if (!kept.contact.solve(kept.matrix, modes, motions, heights, resultants, start)) return 0;
  std::copy(kept.contact.pressed().begin(), kept.contact.pressed().end(), pressed);
  copy(kept.contact.map_forces(), map_forces);
  copy(kept.contact.map_motion(), map_motion);
  copy(kept.contact.map_separation(), map_separation);
  return 1;
}
