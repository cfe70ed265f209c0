#include "contact/cells/rectangle_integrals.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

namespace mjtactile {
namespace {

// Distances above which a series about the middles replaces the integral: for rectangles of one lattice, over their
// longer side; for any two, over half the sum of their diagonals. There the series for equal squares is accurate to
// 0.2 %.
constexpr double kFarInLattice = 16.0, kFar = 1.1;
// Rectangles whose angle has a sine below this are treated as parallel. For most neighbours that is accurate to 0.5 %,
// while sums over points of their parts are off by 2 to 5 %.
constexpr double kNearlyParallel = 0.15;
// Largest number of parts along each side into which near, not parallel rectangles are divided.
constexpr int kMostParts = 4;
// Mean of 1/r over all pairs of points of a square, times its side. Parts that coincide interact as a square with
// itself.
constexpr double kOwn = 2.97;

// Common axes of two nearly parallel rectangles: the mean of both directions, and the second's sides along them.
// `shared` is false if the rectangles are not nearly parallel.
struct SharedAxes {
  SharedAxes(const CellRectangle& a, const CellRectangle& b)
      : cosine(a.cosine), sine(a.sine), sides{b.sides[0], b.sides[1]} {
    double along = a.cosine * b.cosine + a.sine * b.sine, across = a.cosine * b.sine - a.sine * b.cosine;
    shared = std::min(std::abs(along), std::abs(across)) < kNearlyParallel;
    if (along == 1.0 || !shared) return;
    if (std::abs(across) > std::abs(along)) {  // a quarter of a turn apart
      std::swap(sides[0], sides[1]);
      std::swap(along, across);
      across = -across;
    }
    if (along < 0.0) along = -along, across = -across;
    // Half the rotation from the first to the second.
    const double length = std::hypot(1.0 + along, across), c = (1.0 + along) / length, s = across / length;
    cosine = c * a.cosine - s * a.sine;
    sine = c * a.sine + s * a.cosine;
  }

  double cosine, sine, sides[2];
  bool shared;
};

// The integral of a kernel over a pair of parallel rectangles is a second difference, along both axes, of the kernel
// integrated twice along each axis. These are the 16 points at which that function is needed.
struct PairCorners {
  static constexpr std::size_t count = 16;

  PairCorners(const CellRectangle& a, const CellRectangle& b, const SharedAxes& axes) {
    const double dx = a.x - b.x, dy = a.y - b.y;
    const double away = axes.cosine * dx + axes.sine * dy, aside = axes.cosine * dy - axes.sine * dx;
    const double sums[2] = {(a.sides[0] + axes.sides[0]) / 2, (a.sides[1] + axes.sides[1]) / 2};
    const double differences[2] = {(a.sides[0] - axes.sides[0]) / 2, (a.sides[1] - axes.sides[1]) / 2};
    const double along[4] = {sums[0], -sums[0], differences[0], -differences[0]};
    const double across[4] = {sums[1], -sums[1], differences[1], -differences[1]};
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) x[4 * i + j] = away + along[i], y[4 * i + j] = aside + across[j];
    }
  }

  static double difference(const double* values) {
    double sum = 0.0;
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < 4; ++j) sum += (i < 2) == (j < 2) ? values[4 * i + j] : -values[4 * i + j];
    }
    return sum;
  }

  double x[count], y[count];
};

double parallel_integral(const CellRectangle& a, const CellRectangle& b, const SharedAxes& axes) {
  const PairCorners corners(a, b, axes);
  double values[PairCorners::count];
  kernels().integrate_inverse_distance(corners.x, corners.y, PairCorners::count, values);
  return PairCorners::difference(values);
}

PairShear parallel_shear(const CellRectangle& a, const CellRectangle& b, const SharedAxes& axes) {
  constexpr std::size_t kKernels = 5;
  const PairCorners corners(a, b, axes);
  double values[kKernels][PairCorners::count], found[kKernels];
  double* const rows[kKernels] = {values[0], values[1], values[2], values[3], values[4]};
  kernels().integrate_shear_kernels(corners.x, corners.y, PairCorners::count, rows);
  for (std::size_t k = 0; k < kKernels; ++k) found[k] = PairCorners::difference(values[k]);
  const auto [xx, xy, yy, along, across] = found;
  const double c = axes.cosine, s = axes.sine, cc = c * c, cs = c * s, ss = s * s;
  return {cc * xx - 2.0 * cs * xy + ss * yy, cs * (xx - yy) + (cc - ss) * xy, ss * xx + 2.0 * cs * xy + cc * yy,
          c * along - s * across, s * along + c * across};
}

// Middles of equal parts of two rectangles that are near each other but not parallel.
struct Parts {
  Parts(const CellRectangle& a, const CellRectangle& b) {
    const double least = std::min({a.sides[0], a.sides[1], b.sides[0], b.sides[1]}), per = 2.0 / least;
    double size = 0.0;  // largest area of a part [m^2]
    for (int k = 0; k < 2; ++k) {
      const CellRectangle& one = k == 0 ? a : b;
      int along[2];
      double from[2], step[2];
      for (int i = 0; i < 2; ++i) {
        const double parts = std::min(std::max(std::ceil(one.sides[i] * per - 1e-6), 2.0), double{kMostParts});
        along[i] = static_cast<int>(parts);
        step[i] = one.sides[i] / parts;
        from[i] = (step[i] - one.sides[i]) / 2;
      }
      for (int i = 0; i < along[0]; ++i) {
        const double u = from[0] + i * step[0];
        for (int j = 0; j < along[1]; ++j) {
          const double v = from[1] + j * step[1];
          x[k][counts[k]] = one.x + one.cosine * u - one.sine * v;
          y[k][counts[k]++] = one.y + one.sine * u + one.cosine * v;
        }
      }
      size = std::max(size, step[0] * step[1]);
    }
    softened = size / (kOwn * kOwn);
  }

  double x[2][kMostParts * kMostParts], y[2][kMostParts * kMostParts];
  std::size_t counts[2] = {};
  double softened;   // lower bound of squared distances, for parts that coincide [m^2]
};

double near_integral(const CellRectangle& a, const CellRectangle& b) {
  const Parts parts(a, b);
  const auto [own, other] = parts.counts;
  const double sum = kernels().sum_inverse_distances(parts.x[0], parts.y[0], own, parts.x[1], parts.y[1], other,
                                                     parts.softened);
  return a.area * b.area * sum / static_cast<double>(own * other);
}

PairShear near_shear(const CellRectangle& a, const CellRectangle& b) {
  const Parts parts(a, b);
  const auto [own, other] = parts.counts;
  double sums[5];
  kernels().sum_shear(parts.x[0], parts.y[0], own, parts.x[1], parts.y[1], other, parts.softened, sums);
  const double weight = a.area * b.area / static_cast<double>(own * other);
  return {weight * sums[0], weight * sums[1], weight * sums[2], weight * sums[3], weight * sums[4]};
}

}  // namespace

CellRectangle::CellRectangle(const Point& middle, double c, double s, const double* lengths)
    : RectangleNumbers{}, cosine(c), sine(s), sides{lengths[0], lengths[1]} {
  const double u = sides[0] * sides[0] / 12, v = sides[1] * sides[1] / 12;
  x = middle.x, y = middle.y, area = sides[0] * sides[1];
  near_radius = kFar * std::sqrt(sides[0] * sides[0] + sides[1] * sides[1]) / 2;
  xx = c * c * u + s * s * v;
  yy = s * s * u + c * c * v;
  xy = c * s * (u - v);
}

bool are_far(const CellRectangle& a, const CellRectangle& b) {
  const double x = b.x - a.x, y = b.y - a.y, near = a.near_radius + b.near_radius;
  return x * x + y * y > near * near;
}

void FarIntegrals::fit(const std::vector<CellRectangle>& kept) {
  count_ = kept.size();
  rows_.resize(7 * count_);
  double* to = rows_.data();
  for (const CellRectangle& one : kept) {
    const double numbers[7] = {one.x, one.y, one.xx, one.xy, one.yy, one.area, one.near_radius};
    for (std::size_t k = 0; k < 7; ++k) to[k * count_] = numbers[k];
    ++to;
  }
}

void FarIntegrals::of(const CellRectangle& own, std::size_t first, double* values) const {
  const double* rows[7];
  for (std::size_t k = 0; k < 7; ++k) rows[k] = rows_.data() + k * count_ + first;
  kernels().integrate_far(own, {rows[0], rows[1], rows[2], rows[3], rows[4], rows[5], rows[6]}, count_ - first, values);
}

double near_inverse_distance(const CellRectangle& a, const CellRectangle& b) {
  const SharedAxes axes(a, b);
  return axes.shared ? parallel_integral(a, b, axes) : near_integral(a, b);
}

PairShear near_shear_integrals(const CellRectangle& a, const CellRectangle& b) {
  const SharedAxes axes(a, b);
  return axes.shared ? parallel_shear(a, b, axes) : near_shear(a, b);
}

namespace {

// Compute the table of inverse_distance_by_offset().
void find_by_offset(std::size_t columns, std::size_t rows, double width, double height, std::vector<double>& table) {
  constexpr double kSecondDifference[3] = {1.0, -2.0, 1.0};
  const double sides[2] = {width, height}, away = kFarInLattice * std::max(width, height);
  // Second differences of neighbouring offsets use the same points.
  const std::size_t across = columns + 2, points = across * (rows + 2);
  std::vector<double> at(2 * points), values(points);
  for (std::size_t row = 0; row < rows + 2; ++row) {
    for (std::size_t column = 0; column < across; ++column) {
      at[row * across + column] = (static_cast<double>(column) - 1.0) * width;
      at[points + row * across + column] = (static_cast<double>(row) - 1.0) * height;
    }
  }
  kernels().integrate_inverse_distance(at.data(), at.data() + points, points, values.data());
  std::vector<CellRectangle> cells;
  cells.reserve(columns * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const Point middle = {static_cast<double>(column) * width, static_cast<double>(row) * height};
      cells.emplace_back(middle, 1.0, 0.0, sides);
    }
  }
  FarIntegrals far;
  far.fit(cells);
  table.resize(columns * rows);
  far.of(cells[0], 0, table.data());
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      const CellRectangle& cell = cells[row * columns + column];
      if (cell.x * cell.x + cell.y * cell.y > away * away) continue;
      double& entry = table[row * columns + column];
      entry = 0.0;
      for (std::size_t i = 0; i < 3; ++i) {
        for (std::size_t j = 0; j < 3; ++j) {
          entry += kSecondDifference[i] * kSecondDifference[j] * values[(row + j) * across + column + i];
        }
      }
    }
  }
}

// Columns and rows of the tables of cells of unit length.
constexpr std::size_t kUnitTable = 128;

// The table of cells of unit length that are 2^power times as long as wide. It is computed when it is first needed.
template <int power>
const double* unit_table() {
  static const std::vector<double> table = [] {
    std::vector<double> found;
    find_by_offset(kUnitTable, kUnitTable, 1.0, std::ldexp(1.0, -power), found);
    return found;
  }();
  return table.data();
}

// The unit table for a lattice; null if there is none. The ratio of a cell's sides is a power of two in most lattices,
// so that these differ from a unit lattice by their size only.
const double* unit_table_for(std::size_t columns, std::size_t rows, double width, double height) {
  constexpr const double* (*kTables[])() = {unit_table<0>, unit_table<1>, unit_table<2>,
                                            unit_table<3>, unit_table<4>, unit_table<5>};
  int power;
  if (columns > kUnitTable || rows > kUnitTable || std::frexp(width / height, &power) != 0.5) return nullptr;
  return power >= 1 && power <= static_cast<int>(std::size(kTables)) ? kTables[power - 1]() : nullptr;
}

}  // namespace

void inverse_distance_by_offset(std::size_t columns, std::size_t rows, double width, double height,
                                std::vector<double>& table) {
  const double* unit = unit_table_for(columns, rows, width, height);
  if (unit == nullptr) {
    find_by_offset(columns, rows, width, height, table);
    return;
  }
  const double cube = width * width * width;
  table.resize(columns * rows);
  for (std::size_t row = 0; row < rows; ++row) {
    for (std::size_t column = 0; column < columns; ++column) {
      table[row * columns + column] = cube * unit[row * kUnitTable + column];
    }
  }
}

}  // namespace mjtactile
