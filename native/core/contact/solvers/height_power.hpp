// Bodies whose height grows with a power of the radius, such as cones and balls.
#pragma once

#include <algorithm>
#include <cmath>

#include "linalg/angles.hpp"

namespace mjtactile {

// The power of a body whose area below `higher` times the level is `more` times that below the level; 0 if it is not
// determined.
inline double height_power(double higher, double more) {
  // Heights over the level below this ratio do not determine the power. Sharper cusps than the least power are rare.
  constexpr double kHigherAtLeast = 1.01, kLeastPower = 0.5;
  if (!(higher > kHigherAtLeast) || !(more > 1.0) || !std::isfinite(higher) || !std::isfinite(more)) return 0.0;
  return std::max(2.0 * std::log(higher) / std::log(more), kLeastPower);
}

// Height at which the contact of a body ends, over the level, which is the depth of a flat punch that carries the load.
// The body's height grows with the radius to the power m. With c_m = sqrt(pi) Gamma(m/2 + 1) / Gamma(m/2 + 1/2), it
// sinks in c_m times as deep as this height. The force is 2 m c_m / (m + 1) times that of a flat punch of the contact's
// area at this depth (Sneddon, Int. J. Engng Sci. 3, 1965).
inline double end_over_level(double m) {
  constexpr double kCorrection = 1.25;   // from contacts of cones and paraboloids
  const double c = std::sqrt(kHalfTurn / 2 * (m + 0.5));  // accurate to 2 % for m >= 1
  return kCorrection * std::pow((m + 1.0) / (m * c), m / (m + 1.0));
}

}  // namespace mjtactile
