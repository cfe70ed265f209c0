// Body of kernels_*.cpp: included once per instruction set, inside its own namespace, after `Lanes` of that set.
// Lanes<T> holds `width` numbers of type T; load() widens Half and Byte.

constexpr std::size_t kColumnsAtOnce = 8;
constexpr std::size_t kRowsAtOnce = 1024;  // their sums stay in the first-level cache
constexpr std::size_t kAhead = 4;  // columns by which prefetching is ahead of arithmetic

// Add all columns to a tile of kVectors vectors. Its sums stay in registers. kApart columns at a time have separate
// sums, so that an addition need not wait for the one before.
template <std::size_t kVectors, std::size_t kApart, typename Stored, typename Value>
void add_tile(const Stored* const* columns, const Value* weights, std::size_t count, std::size_t first, Value* sums) {
  using L = Lanes<Value>;
  typename L::Type tile[kApart][kVectors];
  for (std::size_t v = 0; v < kVectors; ++v) {
    tile[0][v] = L::load(sums + first + v * L::width);
    for (std::size_t a = 1; a < kApart; ++a) tile[a][v] = L::all(0);
  }
  std::size_t j = 0;
  for (; j + kApart <= count; j += kApart) {
    for (std::size_t a = 0; a < kApart; ++a) {
      const typename L::Type weight = L::all(weights[j + a]);
      const Stored* column = columns[j + a] + first;
      if (j + a + kAhead < count) {
        const char* next = reinterpret_cast<const char*>(columns[j + a + kAhead] + first);
        for (std::size_t at = 0; at < kVectors * L::width * sizeof(Stored); at += 64) prefetch(next + at);
      }
      for (std::size_t v = 0; v < kVectors; ++v) {
        tile[a][v] = L::multiply_add(weight, L::load(column + v * L::width), tile[a][v]);
      }
    }
  }
  for (; j < count; ++j) {
    const typename L::Type weight = L::all(weights[j]);
    for (std::size_t v = 0; v < kVectors; ++v) {
      tile[0][v] = L::multiply_add(weight, L::load(columns[j] + first + v * L::width), tile[0][v]);
    }
  }
  for (std::size_t v = 0; v < kVectors; ++v) {
    for (std::size_t a = 1; a < kApart; ++a) tile[0][v] = L::multiply_add(L::all(1), tile[a][v], tile[0][v]);
    L::store(sums + first + v * L::width, tile[0][v]);
  }
}

// Number of columns with separate sums in a tile of so many vectors: as many as the latency of an addition needs.
constexpr std::size_t columns_apart(std::size_t vectors) {
  return vectors >= kSumVectors / 2 ? 1 : vectors >= kSumVectors / 4 ? 2 : 4;
}

// Add all columns to the last `vectors` vectors of the sums. There are at most kVectors of them.
template <std::size_t kVectors, typename Stored, typename Value>
void add_last_tile(const Stored* const* columns, const Value* weights, std::size_t count, std::size_t first,
                   std::size_t vectors, Value* sums) {
  if constexpr (kVectors > 0) {
    if (vectors < kVectors) {
      return add_last_tile<kVectors - 1>(columns, weights, count, first, vectors, sums);
    }
    add_tile<kVectors, columns_apart(kVectors)>(columns, weights, count, first, sums);
  }
}

// Add columns of numbers that need no widening. Eight columns at a time are read from end to end, which is fastest for
// memory.
template <typename Stored, typename Value>
void stream_columns(const Stored* const* columns, const Value* weights, std::size_t count, std::size_t rows,
                    Value* sums) {
  using L = Lanes<Value>;
  for (std::size_t first = 0; first < rows; first += kRowsAtOnce) {
    const std::size_t last = first + kRowsAtOnce < rows ? first + kRowsAtOnce : rows;
    const std::size_t whole = first + (last - first) / L::width * L::width;
    std::size_t j = 0;
    for (; j + kColumnsAtOnce <= count; j += kColumnsAtOnce) {
      typename L::Type w[kColumnsAtOnce];
      for (std::size_t i = 0; i < kColumnsAtOnce; ++i) w[i] = L::all(weights[j + i]);
      const Stored* const* c = columns + j;
      for (std::size_t r = first; r < whole; r += L::width) {
        typename L::Type sum = L::load(sums + r);
        for (std::size_t i = 0; i < kColumnsAtOnce; ++i) sum = L::multiply_add(w[i], L::load(c[i] + r), sum);
        L::store(sums + r, sum);
      }
    }
    for (; j < count; ++j) {
      const typename L::Type w = L::all(weights[j]);
      for (std::size_t r = first; r < whole; r += L::width) {
        L::store(sums + r, L::multiply_add(w, L::load(columns[j] + r), L::load(sums + r)));
      }
    }
  }
}

template <typename Stored, typename Value>
void add_columns(const Stored* const* columns, const Value* weights, std::size_t count, std::size_t rows,
                 Value* sums) {
  std::size_t first = 0;
  if constexpr (sizeof(Stored) < sizeof(Value)) {
    // For numbers that are widened, arithmetic takes longer than memory.
    constexpr std::size_t kRows = kSumVectors * Lanes<Value>::width;
    for (; first + kRows <= rows; first += kRows) {
      add_tile<kSumVectors, columns_apart(kSumVectors)>(columns, weights, count, first, sums);
    }
    const std::size_t vectors = (rows - first) / Lanes<Value>::width;
    add_last_tile<kSumVectors - 1>(columns, weights, count, first, vectors, sums);
    first += vectors * Lanes<Value>::width;
  } else {
    first = rows / Lanes<Value>::width * Lanes<Value>::width;
    stream_columns(columns, weights, count, first, sums);
  }
  for (std::size_t r = first; r < rows; ++r) {
    Value sum = sums[r];
    for (std::size_t i = 0; i < count; ++i) sum += weights[i] * widened<Value>(columns[i][r]);
    sums[r] = sum;
  }
}

// With kEnds, only the first `count` numbers of the vector exist.
template <std::size_t kVectors, bool kEnds>
void add_window_tile(const double* from, std::size_t rows, std::size_t row, std::size_t columns, std::size_t column,
                     const double* weights, std::size_t count, bool anew, double* sums) {
  using L = Lanes<double>;
  const auto load = [count](const double* at) { return kEnds ? L::load_first(at, count) : L::load(at); };
  typename L::Type tile[kVectors];
  for (std::size_t v = 0; v < kVectors; ++v) tile[v] = anew ? L::all(0) : load(sums + v * L::width);
  for (std::size_t i = 0; i < rows; ++i) {
    const double* line = from + i * row;
    for (std::size_t j = 0; j < columns; ++j, line += column) {
      const typename L::Type weight = L::all(*weights++);
      for (std::size_t v = 0; v < kVectors; ++v) tile[v] = L::multiply_add(weight, load(line + v * L::width), tile[v]);
    }
  }
  for (std::size_t v = 0; v < kVectors; ++v) {
    if (kEnds) {
      L::store_first(sums + v * L::width, count, tile[v]);
    } else {
      L::store(sums + v * L::width, tile[v]);
    }
  }
}

inline void add_window(const double* from, std::size_t rows, std::size_t row, std::size_t columns, std::size_t column,
                       const double* weights, std::size_t count, bool anew, double* sums) {
  constexpr std::size_t kWidth = Lanes<double>::width;
  std::size_t r = 0;
  for (; r + 4 * kWidth <= count; r += 4 * kWidth) {
    add_window_tile<4, false>(from + r, rows, row, columns, column, weights, 0, anew, sums + r);
  }
  for (; r + 2 * kWidth <= count; r += 2 * kWidth) {
    add_window_tile<2, false>(from + r, rows, row, columns, column, weights, 0, anew, sums + r);
  }
  for (; r + kWidth <= count; r += kWidth) {
    add_window_tile<1, false>(from + r, rows, row, columns, column, weights, 0, anew, sums + r);
  }
  if (r < count) add_window_tile<1, true>(from + r, rows, row, columns, column, weights, count - r, anew, sums + r);
}

// One tile of c += a b: kRows rows of kVectors vectors, whose sums stay in registers.
template <std::size_t kRows, std::size_t kVectors>
void multiply_tile(const double* a, std::size_t a_row, std::size_t a_column, const double* b, std::size_t b_row,
                   double* c, std::size_t c_row, std::size_t depth) {
  using L = Lanes<double>;
  typename L::Type sums[kRows][kVectors];
  for (std::size_t i = 0; i < kRows; ++i) {
    for (std::size_t v = 0; v < kVectors; ++v) sums[i][v] = L::load(c + i * c_row + v * L::width);
  }
  for (std::size_t k = 0; k < depth; ++k) {
    typename L::Type of_b[kVectors];
    for (std::size_t v = 0; v < kVectors; ++v) of_b[v] = L::load(b + k * b_row + v * L::width);
    for (std::size_t i = 0; i < kRows; ++i) {
      const typename L::Type of_a = L::all(a[i * a_row + k * a_column]);
      for (std::size_t v = 0; v < kVectors; ++v) sums[i][v] = L::multiply_add(of_a, of_b[v], sums[i][v]);
    }
  }
  for (std::size_t i = 0; i < kRows; ++i) {
    for (std::size_t v = 0; v < kVectors; ++v) L::store(c + i * c_row + v * L::width, sums[i][v]);
  }
}

// Multiply tile by tile down the rows. Returns the first row that is left because it does not fill a tile.
template <std::size_t kRows, std::size_t kVectors>
std::size_t multiply_down(const double* a, std::size_t a_row, std::size_t a_column, const double* b, std::size_t b_row,
                          double* c, std::size_t c_row, std::size_t first, std::size_t rows, std::size_t depth) {
  for (; first + kRows <= rows; first += kRows) {
    multiply_tile<kRows, kVectors>(a + first * a_row, a_row, a_column, b, b_row, c + first * c_row, c_row, depth);
  }
  return first;
}

// Most columns are covered by wide tiles of few rows. Columns that do not fill them are covered by narrow tiles of more
// rows, so that as many sums are independent.
inline void multiply_add_matrices(const double* a, std::size_t a_row, std::size_t a_column, const double* b,
                                  std::size_t b_row, double* c, std::size_t c_row, std::size_t rows,
                                  std::size_t columns, std::size_t depth) {
  using L = Lanes<double>;
  std::size_t j = 0;
  for (; j + kTileVectors * L::width <= columns; j += kTileVectors * L::width) {
    std::size_t i = multiply_down<4, kTileVectors>(a, a_row, a_column, b + j, b_row, c + j, c_row, 0, rows, depth);
    multiply_down<1, kTileVectors>(a, a_row, a_column, b + j, b_row, c + j, c_row, i, rows, depth);
  }
  for (; j + L::width <= columns; j += L::width) {
    std::size_t i = multiply_down<kTallRows, 1>(a, a_row, a_column, b + j, b_row, c + j, c_row, 0, rows, depth);
    i = multiply_down<4, 1>(a, a_row, a_column, b + j, b_row, c + j, c_row, i, rows, depth);
    multiply_down<1, 1>(a, a_row, a_column, b + j, b_row, c + j, c_row, i, rows, depth);
  }
  for (std::size_t i = 0; i < rows; ++i) {
    for (std::size_t k = j; k < columns; ++k) {
      double sum = c[i * c_row + k];
      for (std::size_t d = 0; d < depth; ++d) sum += a[i * a_row + d * a_column] * b[d * b_row + k];
      c[i * c_row + k] = sum;
    }
  }
}

// Eliminate in one column of vectors. All rows stay in registers.
inline void eliminate_column(const double (*shares)[kFactorRows], double* c, std::size_t c_row) {
  using L = Lanes<double>;
  typename L::Type rows[kFactorRows];
  for (std::size_t i = 0; i < kFactorRows; ++i) rows[i] = L::load(c + i * c_row);
  for (std::size_t i = 0; i < kFactorRows; ++i) {
    rows[i] = L::multiply(L::all(shares[i][i]), rows[i]);
    L::store(c + i * c_row, rows[i]);
    for (std::size_t below = i + 1; below < kFactorRows; ++below) {
      rows[below] = L::multiply_add(L::all(shares[i][below]), rows[i], rows[below]);
    }
  }
}

inline void eliminate(const double* upper, std::size_t upper_row, double* c, std::size_t c_row, std::size_t columns) {
  using L = Lanes<double>;
  double shares[kFactorRows][kFactorRows];  // factor by which each row is added to those below it
  for (std::size_t i = 0; i < kFactorRows; ++i) {
    shares[i][i] = 1.0 / upper[i * upper_row + i];
    for (std::size_t below = i + 1; below < kFactorRows; ++below) shares[i][below] = -upper[i * upper_row + below];
  }
  std::size_t j = 0;
  for (; j + L::width <= columns; j += L::width) eliminate_column(shares, c + j, c_row);
  for (; j < columns; ++j) {
    for (std::size_t i = 0; i < kFactorRows; ++i) {
      const double value = c[i * c_row + j] *= shares[i][i];
      for (std::size_t below = i + 1; below < kFactorRows; ++below) c[below * c_row + j] += shares[i][below] * value;
    }
  }
}

inline bool factor_small(double* upper, std::size_t upper_row, std::size_t size) {
  // The matrix is copied to a square of fixed size, because the compiler vectorises loops of known length.
  double u[kFactorRows][kFactorRows] = {};
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t j = i; j < size; ++j) u[i][j] = upper[i * upper_row + j];
  }
  for (std::size_t i = 0; i < size; ++i) {
    if (!(u[i][i] > 0.0) || !std::isfinite(u[i][i])) return false;
    const double inverse = 1.0 / std::sqrt(u[i][i]);
    for (std::size_t j = 0; j < kFactorRows; ++j) u[i][j] *= inverse;
    for (std::size_t below = i + 1; below < size; ++below) {
      const double share = u[i][below];
      for (std::size_t j = 0; j < kFactorRows; ++j) u[below][j] -= share * u[i][j];
    }
  }
  for (std::size_t i = 0; i < size; ++i) {
    for (std::size_t j = i; j < size; ++j) upper[i * upper_row + j] = u[i][j];
  }
  return true;
}

inline double dot(const double* a, const double* b, std::size_t count) {
  using L = Lanes<double>;
  constexpr std::size_t kSums = 4;  // independent sums, so that an addition need not wait for the one before
  typename L::Type sums[kSums];
  for (std::size_t s = 0; s < kSums; ++s) sums[s] = L::all(0);
  std::size_t i = 0;
  for (; i + kSums * L::width <= count; i += kSums * L::width) {
    for (std::size_t s = 0; s < kSums; ++s) {
      sums[s] = L::multiply_add(L::load(a + i + s * L::width), L::load(b + i + s * L::width), sums[s]);
    }
  }
  for (; i + L::width <= count; i += L::width) {
    sums[0] = L::multiply_add(L::load(a + i), L::load(b + i), sums[0]);
  }
  double parts[L::width], sum = 0.0;
  for (std::size_t s = 0; s < kSums / 2; ++s) sums[s] = L::multiply_add(L::all(1.0), sums[s], sums[kSums / 2 + s]);
  L::store(parts, L::multiply_add(L::all(1.0), sums[0], sums[1]));
  for (std::size_t half = L::width / 2; half > 0; half /= 2) {
    for (std::size_t k = 0; k < half; ++k) parts[k] += parts[half + k];
  }
  sum = parts[0];
  for (; i < count; ++i) sum += a[i] * b[i];
  return sum;
}

inline void tangential_row(const double* const* integrals, const double* per_area, const double* turn, double share,
                           std::size_t count, double* const* rows) {
  constexpr std::size_t kAtOnce = 8, kIntegrals = 4, kRows = 3;
  const double cc = turn[0] * turn[0], cs = turn[0] * turn[1], ss = turn[1] * turn[1];
  const auto block = [&](std::size_t first, std::size_t taken) {
    // The numbers are copied to arrays of fixed length, because the compiler vectorises loops over them.
    double in[kIntegrals][kAtOnce] = {}, area[kAtOnce] = {}, out[kRows][kAtOnce];
    for (std::size_t k = 0; k < kIntegrals; ++k) std::memcpy(in[k], integrals[k] + first, taken * sizeof(double));
    std::memcpy(area, per_area + first, taken * sizeof(double));
    for (std::size_t j = 0; j < kAtOnce; ++j) {
      const double distance = in[0][j], xx = in[1][j], xy = in[2][j], yy = in[3][j];
      out[0][j] = area[j] * (distance + share * (ss * xx + 2.0 * cs * xy + cc * yy));
      out[1][j] = -area[j] * share * (cs * (xx - yy) + (cc - ss) * xy);
      out[2][j] = area[j] * (distance + share * (cc * xx - 2.0 * cs * xy + ss * yy));
    }
    for (std::size_t k = 0; k < kRows; ++k) std::memcpy(rows[k] + first, out[k], taken * sizeof(double));
  };
  std::size_t first = 0;
  for (; first + kAtOnce <= count; first += kAtOnce) block(first, kAtOnce);
  if (first < count) block(first, count - first);
}

inline void solve_upper(const double* upper, std::size_t upper_row, std::size_t size, double* x) {
  for (std::size_t i = size; i-- > 0;) {
    const double* row = upper + i * upper_row;
    x[i] = (x[i] - dot(row + i + 1, x + i + 1, size - i - 1)) / row[i];
  }
}

// Four numbers at once, such as the three components of a force and one unused number.
struct Four {
#ifdef __AVX2__
  __m256d lanes;
  static Four load(const double* at) { return {_mm256_loadu_pd(at)}; }
  static Four load_three(const double* at) { return {_mm256_maskload_pd(at, _mm256_setr_epi64x(-1, -1, -1, 0))}; }
  static Four all(double value) { return {_mm256_set1_pd(value)}; }
  static Four of(double a, double b, double c, double d) { return {_mm256_setr_pd(a, b, c, d)}; }
  static void transpose(Four rows[4]) {
    const __m256d a = _mm256_unpacklo_pd(rows[0].lanes, rows[1].lanes);
    const __m256d b = _mm256_unpackhi_pd(rows[0].lanes, rows[1].lanes);
    const __m256d c = _mm256_unpacklo_pd(rows[2].lanes, rows[3].lanes);
    const __m256d d = _mm256_unpackhi_pd(rows[2].lanes, rows[3].lanes);
    rows[0].lanes = _mm256_permute2f128_pd(a, c, 0x20), rows[1].lanes = _mm256_permute2f128_pd(b, d, 0x20);
    rows[2].lanes = _mm256_permute2f128_pd(a, c, 0x31), rows[3].lanes = _mm256_permute2f128_pd(b, d, 0x31);
  }
  void store(double* at) const { _mm256_storeu_pd(at, lanes); }
  void store_three(double* at) const {
    _mm_storeu_pd(at, _mm256_castpd256_pd128(lanes));
    _mm_store_sd(at + 2, _mm256_extractf128_pd(lanes, 1));
  }
  Four operator+(const Four& b) const { return {_mm256_add_pd(lanes, b.lanes)}; }
  Four operator-(const Four& b) const { return {_mm256_sub_pd(lanes, b.lanes)}; }
  Four operator*(const Four& b) const { return {_mm256_mul_pd(lanes, b.lanes)}; }
  Four plus(const Four& a, const Four& b) const { return {_mm256_fmadd_pd(a.lanes, b.lanes, lanes)}; }
  Four or_size_of(const Four& b) const {
    return {_mm256_max_pd(_mm256_andnot_pd(_mm256_set1_pd(-0.0), b.lanes), lanes)};
  }
#else
  double lanes[4];
  template <typename Of>
  static Four each(Of&& of) {
    return {{of(0), of(1), of(2), of(3)}};
  }
  static Four load(const double* at) { return {{at[0], at[1], at[2], at[3]}}; }
  static Four load_three(const double* at) { return {{at[0], at[1], at[2], 0.0}}; }
  static Four all(double value) { return {{value, value, value, value}}; }
  static Four of(double a, double b, double c, double d) { return {{a, b, c, d}}; }
  static void transpose(Four rows[4]) {
    for (int i = 0; i < 4; ++i) {
      for (int j = 0; j < i; ++j) std::swap(rows[i].lanes[j], rows[j].lanes[i]);
    }
  }
  void store(double* at) const { std::memcpy(at, lanes, sizeof lanes); }
  void store_three(double* at) const { std::memcpy(at, lanes, 3 * sizeof *lanes); }
  Four operator+(const Four& b) const {
    return each([&](int k) { return lanes[k] + b.lanes[k]; });
  }
  Four operator-(const Four& b) const {
    return each([&](int k) { return lanes[k] - b.lanes[k]; });
  }
  Four operator*(const Four& b) const {
    return each([&](int k) { return lanes[k] * b.lanes[k]; });
  }
  // This plus a times b.
  Four plus(const Four& a, const Four& b) const {
    return each([&](int k) { return lanes[k] + a.lanes[k] * b.lanes[k]; });
  }
  // The larger of this and the absolute value of b.
  Four or_size_of(const Four& b) const {
    return each([&](int k) { return lanes[k] < std::abs(b.lanes[k]) ? std::abs(b.lanes[k]) : lanes[k]; });
  }
#endif
};

// Squares of four by four at once, then the remaining numbers one by one.
inline void transpose(const double* from, std::size_t from_row, std::size_t rows, std::size_t columns, double* to,
                      std::size_t to_row) {
  constexpr std::size_t kFour = 4;
  for (std::size_t i = 0; i < rows; i += kFour) {
    const std::size_t taken = rows - i < kFour ? rows - i : kFour;
    std::size_t j = 0;
    for (; taken == kFour && j + kFour <= columns; j += kFour) {
      Four square[kFour];
      for (std::size_t k = 0; k < kFour; ++k) square[k] = Four::load(from + (i + k) * from_row + j);
      Four::transpose(square);
      for (std::size_t k = 0; k < kFour; ++k) square[k].store(to + (j + k) * to_row + i);
    }
    for (; j < columns; ++j) {
      for (std::size_t k = 0; k < taken; ++k) to[j * to_row + i + k] = from[(i + k) * from_row + j];
    }
  }
}

// Three lanes are the powers of xi. The fourth is the moment for the elements on the left. Three Gauss points are
// exact, because an integrand along an edge has degree 5.
inline void add_edge_moments(const double* start, const double* end, const double* origin, const double* per,
                             const double* from, const double* traction, double* moments) {
  constexpr double kOutward = 0.38729833462074168852, kThird = 1.0 / 3.0;
  constexpr double kGauss[3] = {0.5 - kOutward, 0.5, 0.5 + kOutward};
  constexpr double kShares[3] = {5.0 / 18.0, 8.0 / 18.0, 5.0 / 18.0};
  const double half = 1.0 / per[0], along[2] = {end[0] - start[0], end[1] - start[1]};
  Four sums[3] = {Four::all(0.0), Four::all(0.0), Four::all(0.0)};
  for (int g = 0; g < 3; ++g) {
    const double at = (start[0] + kGauss[g] * along[0] - origin[0]) * per[0] - 1.0;
    const double xi = at < -1.0 ? -1.0 : at > 1.0 ? 1.0 : at, square = xi * xi;
    const double eta = (start[1] + kGauss[g] * along[1] - origin[1]) * per[1] - 1.0;
    const Four left = Four::of(half * (xi - from[0]), half * (square - from[1]) * 0.5,
                               half * (square * xi - from[2]) * kThird, 1.0);
    const double power = along[1] * kShares[g], next = power * eta;
    sums[0] = sums[0].plus(Four::all(power), left);
    sums[1] = sums[1].plus(Four::all(next), left);
    sums[2] = sums[2].plus(Four::all(next * eta), left);
  }
  for (int m = 0; m < 3; ++m) {
    const Four own = Four::all(traction[m]);
    for (int b = 0; b < 3; ++b, moments += 4) Four::load(moments).plus(own, sums[b]).store(moments);
  }
}

// Integrals of the three quadratic shape functions on [-1, 1], from the moments of 1, xi and xi^2.
inline void on_shapes(const Four& constant, const Four& linear, const Four& square, Four* sums) {
  const Four half = Four::all(0.5);
  sums[0] = half * (square - linear);
  sums[1] = constant - square;
  sums[2] = half * (square + linear);
}

inline void add_element_forces(const double* moments, double half, const double* part, double* right, std::size_t row,
                               double* forces) {
  const Four whole = Four::of(2.0 * half, 0.0, half * (2.0 / 3.0), 0.0);
  const Four before = Four::of(half * part[0], half * part[1], half * part[2], 0.0);
  Four across[3][3];  // by force: sums with the shape functions along y
  for (int m = 0; m < 3; ++m) {
    Four along[3];
    for (int b = 0; b < 3; ++b, moments += 4, ++right) {
      along[b] = Four::load(moments).plus(Four::all(*right), whole).plus(Four::all(moments[3]), before);
      *right += moments[3];
    }
    on_shapes(along[0], along[1], along[2], across[m]);
  }
  for (std::size_t k = 0; k < 3; ++k) {
    Four powers[4] = {across[0][k], across[1][k], across[2][k], Four::all(0.0)}, nodes[3];
    Four::transpose(powers);
    on_shapes(powers[0], powers[1], powers[2], nodes);
    double* to = forces + k * row;
    for (std::size_t l = 0; l < 3; ++l, to += 3) (Four::load_three(to) + nodes[l]).store_three(to);
  }
}

inline void sum_weighted_vectors(const double* from, const std::uint32_t* starts, const std::uint32_t* nodes,
                          const double* weights, std::size_t corners, double* to) {
  for (std::size_t c = 0; c < corners; ++c, to += 3) {
    Four sum = Four::all(0.0);
    for (std::uint32_t i = starts[c]; i < starts[c + 1]; ++i) {
      sum = sum.plus(Four::all(weights[i]), Four::load_three(from + 3 * std::size_t{nodes[i]}));
    }
    sum.store_three(to);
  }
}

inline void fold_row(const double* upper, const double* lower, std::size_t middle, const double (*signs)[2][4],
                     const double* const* allowed, double* const* to, double* largest) {
  constexpr std::size_t kFolds = 4;
  Four most[kFolds], across[kFolds], along[kFolds];
  for (std::size_t c = 0; c < kFolds; ++c) {
    most[c] = Four::all(0.0);
    across[c] = Four::load(signs[c][0]);
    along[c] = Four::load(signs[c][1]);
  }
  for (std::size_t x = 0; x <= middle; ++x) {
    const std::size_t right = 3 * (middle + x), left = 3 * (middle - x);
    const Four u = Four::load_three(upper + right), l = Four::load_three(lower + right);
    const Four other_u = x > 0 ? Four::load_three(upper + left) : Four::all(0.0);
    const Four other_l = x > 0 ? Four::load_three(lower + left) : Four::all(0.0);
    for (std::size_t c = 0; c < kFolds; ++c) {
      const Four force = u.plus(along[c], l).plus(across[c], other_u.plus(along[c], other_l)) *
                         Four::load_three(allowed[c] + 3 * x);
      force.store(to[c] + 3 * x);
      most[c] = most[c].or_size_of(force);
    }
  }
  for (std::size_t c = 0; c < kFolds; ++c) {
    double parts[4];
    most[c].store(parts);
    for (const double part : parts) largest[c] = largest[c] < part ? part : largest[c];
  }
}

template <typename Value>
std::size_t select(const double* forces, const std::uint32_t* columns, std::size_t count, double least, double factor,
                 std::uint32_t* places, Value* weights) {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    // Every number is written, and the next one overwrites it if it is not kept. A branch would often be mispredicted.
    places[kept] = columns[i];
    weights[kept] = static_cast<Value>(forces[i] * factor);
    kept += static_cast<std::size_t>(!(std::abs(forces[i]) < least) & (forces[i] != 0.0));
  }
  return kept;
}

// When a triangle counts: its least barycentric coordinate at the point, and its least height there.
struct Counting {
  double least, floor;
};

// The less of a height and that of a triangle over the same point, if it counts there. `s`, `t`: two of the point's
// barycentric coordinates; `here`: the triangle's height.
inline double lowered(double s, double t, double here, const Counting& counting, double height) {
  const double rest = 1.0 - (s + t), less = s < t ? s : t, inside = less < rest ? less : rest;
  const double lower = here < height ? here : height, within = inside >= counting.least ? lower : height;
  return here >= counting.floor ? within : height;
}

inline void lower_by_triangle(const TriangleBlock& block, std::size_t k, double least, double floor,
                              const PointRows& points, double* heights) {
  constexpr std::size_t kAtOnce = 8;
  const double second[3] = {block.second[0][k], block.second[1][k], block.second[2][k]};
  const double third[3] = {block.third[0][k], block.third[1][k], block.third[2][k]};
  const double height = block.height[k], second_rise = block.second_rise[k], third_rise = block.third_rise[k];
  for (std::size_t row = 0; row < points.rows; ++row) {
    const double *x = points.x + row * points.row, *y = points.y + row * points.row;
    double* to = heights + row * points.row;
    for (std::size_t i = 0; i < points.count; i += kAtOnce) {
      double found[kAtOnce];
      for (std::size_t j = 0; j < kAtOnce; ++j) {
        const double s = second[0] * x[i + j] + second[1] * y[i + j] + second[2];
        const double t = third[0] * x[i + j] + third[1] * y[i + j] + third[2];
        found[j] = lowered(s, t, height + second_rise * s + third_rise * t, {least, floor}, to[i + j]);
      }
      std::memcpy(to + i, found, sizeof found);
    }
  }
}

inline void place_triangles(const double* corners, std::size_t count, const double* rotation, const double* position,
                            const TriangleWindow& window, TriangleBlock& block, TriangleBounds& bounds) {
  // Local copies, so that the compiler knows that writing one number does not change another.
  const TriangleWindow seen = window;
  double x[3][kTriangles], y[3][kTriangles], z[3][kTriangles];   // by corner
  double* const along[3] = {x[0], y[0], z[0]};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const double *row = rotation + 3 * axis, start = position[axis];
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const double* from = corners + 3 * kTriangles * corner;
      double* to = along[axis] + kTriangles * corner;
      for (std::size_t k = 0; k < kTriangles; ++k) {
        to[k] = start + row[0] * from[k] + row[1] * from[kTriangles + k] + row[2] * from[2 * kTriangles + k];
      }
    }
  }
  const auto less = [](double a, double b) { return a < b ? a : b; };
  const auto more = [](double a, double b) { return a > b ? a : b; };
  constexpr double kNone = std::numeric_limits<double>::infinity();
  for (std::size_t k = 0; k < kTriangles; ++k) {
    const double ax = x[1][k] - x[0][k], ay = y[1][k] - y[0][k], az = z[1][k] - z[0][k];
    const double bx = x[2][k] - x[0][k], by = y[2][k] - y[0][k], bz = z[2][k] - z[0][k];
    const double normal[3] = {ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx};
    const double square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
    const double per = 1.0 / normal[2];
    block.second[0][k] = by * per, block.second[1][k] = -bx * per;
    block.third[0][k] = -ay * per, block.third[1][k] = ax * per;
    block.second[2][k] = -(block.second[0][k] * x[0][k] + block.second[1][k] * y[0][k]);
    block.third[2][k] = -(block.third[0][k] * x[0][k] + block.third[1][k] * y[0][k]);
    block.second_rise[k] = az, block.third_rise[k] = bz;
    const double west = less(less(x[0][k], x[1][k]), x[2][k]), east = more(more(x[0][k], x[1][k]), x[2][k]);
    const double south = less(less(y[0][k], y[1][k]), y[2][k]), north = more(more(y[0][k], y[1][k]), y[2][k]);
    const double low = less(less(z[0][k], z[1][k]), z[2][k]), high = more(more(z[0][k], z[1][k]), z[2][k]);
    const bool over = (west <= seen.east) & (east >= seen.west) & (south <= seen.north) & (north >= seen.south);
    const bool faces = (normal[2] * normal[2] > seen.steepest * seen.steepest * square) & (normal[2] <= seen.upward);
    const bool counts = over & faces & (low <= seen.ceiling) & (high >= seen.floor);
    block.height[k] = counts ? z[0][k] : std::numeric_limits<double>::quiet_NaN();
    bounds.west[k] = counts ? west : kNone, bounds.east[k] = counts ? east : -kNone;
    bounds.south[k] = counts ? south : kNone, bounds.north[k] = counts ? north : -kNone;
    bounds.low[k] = counts ? low : kNone;
  }
  for (std::size_t k = count; k < kTriangles; ++k) {
    block.height[k] = std::numeric_limits<double>::quiet_NaN();
    bounds.west[k] = bounds.south[k] = bounds.low[k] = kNone, bounds.east[k] = bounds.north[k] = -kNone;
  }
}

inline double lowest_of_triangles(const TriangleBlock& block, double x, double y, double least, double floor,
                                  double height) {
  double found[kTriangles];
  for (std::size_t k = 0; k < kTriangles; ++k) {
    const double s = block.second[0][k] * x + block.second[1][k] * y + block.second[2][k];
    const double t = block.third[0][k] * x + block.third[1][k] * y + block.third[2][k];
    const double here = block.height[k] + s * block.second_rise[k] + t * block.third_rise[k];
    found[k] = lowered(s, t, here, {least, floor}, height);
  }
  for (std::size_t half = kTriangles / 2; half > 0; half /= 2) {
    for (std::size_t k = 0; k < half; ++k) found[k] = found[k + half] < found[k] ? found[k + half] : found[k];
  }
  return found[0];
}

// Rows are sets of bits. There is an edge wherever neighbouring bits differ.
inline PointsBelow count_below(const double* heights, std::size_t rows, std::size_t columns, double level) {
  using L = Lanes<double>;
  PointsBelow found = {0, 0, 0};
  const typename L::Type bound = L::all(level);
  const std::size_t whole = columns - columns % L::width;   // columns that fill vectors
  const std::uint32_t last = (std::uint32_t{1} << (columns - whole)) - 1;
  std::uint32_t before = 0;
  const auto count = [](std::uint32_t bits) { return static_cast<std::size_t>(__builtin_popcount(bits)); };
  for (std::size_t row = 0; row < rows; ++row, heights += columns) {
    std::uint32_t under = 0;
    for (std::size_t column = 0; column < whole; column += L::width) {
      under |= L::up_to(L::load(heights + column), bound) << column;
    }
    if (last != 0) {
      under |= (L::up_to(L::load_first(heights + whole, columns - whole), bound) & last) << whole;
    }
    found.points += count(under);
    found.edges_x += count(under ^ (under << 1));
    found.edges_y += count(under ^ before);
    before = under;
  }
  found.edges_y += count(before);
  return found;
}

template <typename Value>
void norms_of(const Value* const* classes, const Value* signs, std::size_t points, Value* norms) {
  using L = Lanes<Value>;
  // If the points do not fill whole vectors, the last vector overlaps the one before it.
  const std::size_t whole = points < L::width ? 0 : points;
  for (std::size_t at = 0; at < whole; at += L::width) {
    const std::size_t p = at + L::width <= points ? at : points - L::width;
    typename L::Type squares[4] = {L::all(0), L::all(0), L::all(0), L::all(0)};
    for (std::size_t k = 0; k < 5; ++k) {
      typename L::Type c[4];
      for (std::size_t i = 0; i < 4; ++i) c[i] = L::load(classes[i] + k * points + p);
      for (std::size_t q = 0; q < 4; ++q) {
        typename L::Type value = L::multiply(L::all(signs[4 * q]), c[0]);
        for (std::size_t i = 1; i < 4; ++i) value = L::multiply_add(L::all(signs[4 * q + i]), c[i], value);
        squares[q] = L::multiply_add(value, value, squares[q]);
      }
    }
    for (std::size_t q = 0; q < 4; ++q) L::store(norms + q * points + p, L::root(squares[q]));
  }
  for (std::size_t p = whole; p < points; ++p) {
    for (std::size_t q = 0; q < 4; ++q) {
      Value square = 0;
      for (std::size_t k = 0; k < 5; ++k) {
        Value value = 0;
        for (std::size_t i = 0; i < 4; ++i) value += signs[4 * q + i] * classes[i][k * points + p];
        square += value * value;
      }
      norms[q * points + p] = std::sqrt(square);
    }
  }
}

// Natural logarithm of a positive, normal number. It has no branch, so that the compiler vectorises loops over it. With
// the number m 2^k and sqrt(1/2) <= m < sqrt(2), log m = 2 atanh((m - 1) / (m + 1)) by its power series, which is
// accurate to rounding.
inline double logarithm(double value) {
  constexpr double kLogTwo = 0.693147180559945309417;
  constexpr std::uint64_t kMantissa = 0x000fffffffffffffu, kOne = 0x3ff0000000000000u, kRoot = 0x3fe6a09e667f3bcdu;
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  bits += kOne - kRoot;  // now the exponent changes at sqrt(1/2), not at 1
  // Writing an integer n < 2^52 into the mantissa of 2^52 gives the number 2^52 + n.
  const std::uint64_t shifted = (bits >> 52) | 0x4330000000000000u, scaled = (bits & kMantissa) + kRoot;
  double exponent, mantissa;
  std::memcpy(&exponent, &shifted, sizeof exponent);
  std::memcpy(&mantissa, &scaled, sizeof mantissa);
  exponent -= 4503599627370496.0 + 1023.0;
  const double s = (mantissa - 1.0) / (mantissa + 1.0), square = s * s;
  double series = 1.0 / 21.0;
  for (int k = 19; k >= 1; k -= 2) series = series * square + 1.0 / k;
  return exponent * kLogTwo + 2.0 * s * series;
}

// 1 / sqrt(value) of a positive, normal number to rounding, by Newton's method from a first guess of its bits (Lomont,
// Fast inverse square root, 2003). Its products are pipelined, whereas square roots and divisions wait for each other.
inline double inverse_root(double value) {
  std::uint64_t bits;
  std::memcpy(&bits, &value, sizeof bits);
  bits = 0x5fe6eb50c7b537a9u - (bits >> 1);
  double root;
  std::memcpy(&root, &bits, sizeof root);
  const double half = 0.5 * value;
  for (int step = 0; step < 4; ++step) root *= 1.5 - half * root * root;
  return root;
}

// The value is (x y^2 asinh(x / |y|) + y x^2 asinh(y / |x|)) / 2 - r^3 / 6, with r = |(x, y)|. Its fourth derivative,
// twice along x and twice along y, is 1/r.
inline void integrate_inverse_distance(const double* x, const double* y, std::size_t count, double* values) {
  constexpr double kLeast = 1e-140;  // keeps logarithms and quotients finite
  for (std::size_t i = 0; i < count; ++i) {
    const double a = std::abs(x[i]), b = std::abs(y[i]), square = a * a + b * b, r = std::sqrt(square);
    const double safe_a = a + kLeast, safe_b = b + kLeast;
    const double along = logarithm((safe_a + r) / safe_b), across = logarithm((safe_b + r) / safe_a);
    values[i] = 0.5 * a * b * (b * along + a * across) - square * r * (1.0 / 6.0);
  }
}

// atan(opposite / adjacent) of a right triangle with opposite >= 0 and adjacent > 0, without a branch. The angle is
// halved three times, so that the power series of the arctangent converges fast.
inline double angle_of(double adjacent, double opposite, double hypotenuse) {
  const double half = opposite / (adjacent + hypotenuse), quarter = half / (1.0 + std::sqrt(1.0 + half * half));
  const double t = quarter / (1.0 + std::sqrt(1.0 + quarter * quarter)), square = t * t;
  double series = 1.0 / 23.0;
  for (int k = 21; k >= 1; k -= 2) series = 1.0 / k - square * series;
  return 8.0 * t * series;
}

// With r = |(x, y)|, A = asinh(y / |x|) and B = asinh(x / |y|), the first three kernels are the second derivatives of
// r. For y^2/r^3 = r_xx the value is r^3 / 6 + x^2 y A / 2 - x^2 r / 2; for -x y/r^3 = r_xy it is x y r / 3 + (x^3 A +
// y^3 B) / 6; for x^2/r^3 = r_yy it is the first one with x and y exchanged. For x/r^2, the x derivative of ln r, it is
// ((3 x y^2 - x^3) ln r + 3 x |x| y atan(y / |x|) + y^3 atan(x / y)) / 6, and for y/r^2 the same with x and y
// exchanged.
inline void integrate_shear_kernels(const double* x, const double* y, std::size_t count, double* const* values) {
  constexpr double kLeast = 1e-140;  // as in integrate_inverse_distance()
  constexpr std::size_t kAtOnce = 8, kRows = 5;
  for (std::size_t first = 0; first < count; first += kAtOnce) {
    const std::size_t taken = count - first < kAtOnce ? count - first : kAtOnce;
    double at_x[kAtOnce] = {}, at_y[kAtOnce] = {}, out[kRows][kAtOnce];
    std::memcpy(at_x, x + first, taken * sizeof(double));
    std::memcpy(at_y, y + first, taken * sizeof(double));
    for (std::size_t k = 0; k < kAtOnce; ++k) {
      const double u = at_x[k], v = at_y[k], a = std::abs(u), b = std::abs(v), a_square = a * a, b_square = b * b;
      const double square = a_square + b_square, r = std::sqrt(square);
      const double safe_a = a + kLeast, safe_b = b + kLeast;
      const double up = logarithm((safe_b + r) / safe_a), right = logarithm((safe_a + r) / safe_b);
      const double cube = square * r * (1.0 / 6.0);
      out[0][k] = cube + 0.5 * a_square * (b * up - r);
      const double both = a * b * r * (1.0 / 3.0) + (a * a_square * up + b * b_square * right) * (1.0 / 6.0);
      out[1][k] = std::copysign(both, u * v);
      out[2][k] = cube + 0.5 * b_square * (a * right - r);
      const double of_x = angle_of(safe_a, b, r), of_y = kRightAngle - of_x;  // atan(b / a) and atan(a / b)
      const double log_r = logarithm(r + kLeast);
      const double for_x = a * (3.0 * b_square - a_square) * log_r + 3.0 * a_square * b * of_x + b * b_square * of_y;
      const double for_y = b * (3.0 * a_square - b_square) * log_r + 3.0 * b_square * a * of_y + a * a_square * of_x;
      out[3][k] = std::copysign(1.0 / 6.0, u) * for_x;
      out[4][k] = std::copysign(1.0 / 6.0, v) * for_y;
    }
    for (std::size_t k = 0; k < kRows; ++k) std::memcpy(values[k] + first, out[k], taken * sizeof(double));
  }
}

// Four points of a list at once. If the list ends before, the missing ones have weight zero.
struct FourPoints {
  static constexpr std::size_t count = 4;

  FourPoints(const double* from_x, const double* from_y, std::size_t first, std::size_t all) {
    for (std::size_t k = 0; k < count; ++k) {
      const std::size_t at = first + k < all ? first + k : first;
      x[k] = from_x[at], y[k] = from_y[at], share[k] = first + k < all ? 1.0 : 0.0;
    }
  }

  double x[count], y[count], share[count];
};

inline void scale_to_surface_distances(const double* from, const double* x, const double* y, const double* z,
                                 std::size_t count, double* numbers) {
  for (std::size_t j = 0; j < count; ++j) {
    const double along = from[0] - x[j], across = from[1] - y[j], apart = from[2] - z[j];
    const double flat = along * along + across * across;
    numbers[j] *= std::sqrt(flat / (flat + apart * apart));
  }
}

inline void integrate_far(const RectangleNumbers& own, const RectangleRows& others, std::size_t count, double* values) {
  const double *x = others.x, *y = others.y, *xx = others.xx, *xy = others.xy, *yy = others.yy;
  const double *area = others.area, *near_radius = others.near_radius;
  for (std::size_t j = 0; j < count; ++j) {
    const double u = x[j] - own.x, v = y[j] - own.y, square = u * u + v * v, near = own.near_radius + near_radius[j];
    const double root = inverse_root(square > near * near ? square : 1.0), inverse = root * root;
    const double a = own.xx + xx[j], b = own.xy + xy[j], c = own.yy + yy[j];
    const double bend = (3.0 * (a * u * u + 2.0 * b * u * v + c * v * v) * inverse - (a + c)) * 0.5 * inverse;
    const double found = own.area * area[j] * root * (1.0 + bend);
    values[j] = square > near * near ? found : 0.0;
  }
}

inline void press_springs(const SpringRows& springs, const double* motion, std::size_t count, double* depths,
                          double* forces, double* stiffness) {
  const double *own = springs.stiffness, *most = springs.most, *heights = springs.heights;
  const double *first = springs.modes[0], *second = springs.modes[1], *third = springs.modes[2];
  const double moves[3] = {motion[0], motion[1], motion[2]};
  for (std::size_t i = 0; i < count; ++i) {
    const double depth = first[i] * moves[0] + second[i] * moves[1] + third[i] * moves[2] - heights[i];
    const double force = own[i] * depth, bounded = force > most[i] ? most[i] : force;
    const double elastic = force > most[i] ? 0.0 : own[i];
    depths[i] = depth;
    forces[i] = depth > 0.0 ? bounded : 0.0;
    stiffness[i] = depth > 0.0 ? elastic : 0.0;
  }
}

// Each point of the first list is paired with four of the second list at once.
inline double sum_inverse_distances(const double* x, const double* y, std::size_t count, const double* to_x,
                                    const double* to_y, std::size_t to_count, double least) {
  double sums[FourPoints::count] = {};
  for (std::size_t j = 0; j < to_count; j += FourPoints::count) {
    const FourPoints to(to_x, to_y, j, to_count);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < FourPoints::count; ++k) {
        const double away = to.x[k] - x[i], aside = to.y[k] - y[i], square = away * away + aside * aside;
        sums[k] += to.share[k] / std::sqrt(square > least ? square : least);
      }
    }
  }
  return (sums[0] + sums[1]) + (sums[2] + sums[3]);
}

inline void shear_of_point(double from_x, double from_y, double weight, const double* x, const double* y,
                           const double* weights, std::size_t count, double* const* rows) {
  constexpr std::size_t kAtOnce = 8, kRows = 5;
  const auto block = [&](std::size_t first, std::size_t taken) {
    double at_x[kAtOnce], at_y[kAtOnce], share[kAtOnce], out[kRows][kAtOnce];
    for (std::size_t k = 0; k < kAtOnce; ++k) at_x[k] = from_x + 1.0, at_y[k] = from_y, share[k] = 0.0;
    std::memcpy(at_x, x + first, taken * sizeof(double));
    std::memcpy(at_y, y + first, taken * sizeof(double));
    std::memcpy(share, weights + first, taken * sizeof(double));
    for (std::size_t k = 0; k < kAtOnce; ++k) {
      const double u = from_x - at_x[k], v = from_y - at_y[k], inverse = 1.0 / (u * u + v * v);
      const double own = weight * share[k], flat = own * inverse, cube = flat * std::sqrt(inverse);
      out[0][k] = v * v * cube, out[1][k] = -u * v * cube, out[2][k] = u * u * cube;
      out[3][k] = u * flat, out[4][k] = v * flat;
    }
    for (std::size_t k = 0; k < kRows; ++k) std::memcpy(rows[k] + first, out[k], taken * sizeof(double));
  };
  std::size_t first = 0;
  for (; first + kAtOnce <= count; first += kAtOnce) block(first, kAtOnce);
  if (first < count) block(first, count - first);
}

// The same pairing as in sum_inverse_distances().
inline void sum_shear(const double* x, const double* y, std::size_t count, const double* to_x, const double* to_y,
                      std::size_t to_count, double least, double* sums) {
  constexpr std::size_t kSums = 5;
  double parts[kSums][FourPoints::count] = {};
  for (std::size_t j = 0; j < to_count; j += FourPoints::count) {
    const FourPoints to(to_x, to_y, j, to_count);
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t k = 0; k < FourPoints::count; ++k) {
        const double u = x[i] - to.x[k], v = y[i] - to.y[k], square = u * u + v * v;
        const double flat = to.share[k] / (square > least ? square : least), cube = flat * std::sqrt(flat);
        parts[0][k] += v * v * cube, parts[1][k] -= u * v * cube, parts[2][k] += u * u * cube;
        parts[3][k] += u * flat, parts[4][k] += v * flat;
      }
    }
  }
  for (std::size_t m = 0; m < kSums; ++m) sums[m] = (parts[m][0] + parts[m][1]) + (parts[m][2] + parts[m][3]);
}

constexpr Kernels kernels_named(const char* name, decltype(Kernels::select_float) select_floats) {
  return {name,
          add_columns<Byte, float>,
          add_columns<Half, float>,
          add_columns<float, float>,
          add_columns<double, double>,
          add_window,
          multiply_add_matrices,
          shear_of_point,
          sum_shear,
          dot,
          tangential_row,
          factor_small,
          eliminate,
          solve_upper,
          transpose,
          lower_by_triangle,
          place_triangles,
          lowest_of_triangles,
          count_below,
          add_edge_moments,
          add_element_forces,
          sum_weighted_vectors,
          fold_row,
          select_floats,
          select<double>,
          norms_of<float>,
          norms_of<double>,
          integrate_inverse_distance,
          integrate_shear_kernels,
          scale_to_surface_distances,
          integrate_far,
          press_springs,
          sum_inverse_distances};
}
