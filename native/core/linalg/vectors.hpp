// Vectors of three numbers and rotation matrices (3, 3), row-major.
#pragma once

namespace mjtactile {

inline double dot(const double* a, const double* b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

inline void cross(const double* a, const double* b, double* product) {
  product[0] = a[1] * b[2] - a[2] * b[1];
  product[1] = a[2] * b[0] - a[0] * b[2];
  product[2] = a[0] * b[1] - a[1] * b[0];
}

inline void rotate(const double* rotation, const double* vector, double* rotated) {
  for (int i = 0; i < 3; ++i) rotated[i] = dot(rotation + 3 * i, vector);
}

// The product of a rotation and the inverse of another one.
inline void rotate_from(const double* rotation, const double* other, double* product) {
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) product[3 * i + j] = dot(rotation + 3 * i, other + 3 * j);
  }
}

// By the inverse rotation.
inline void rotate_back(const double* rotation, const double* vector, double* rotated) {
  for (int i = 0; i < 3; ++i) {
    rotated[i] = rotation[i] * vector[0] + rotation[3 + i] * vector[1] + rotation[6 + i] * vector[2];
  }
}

}  // namespace mjtactile
