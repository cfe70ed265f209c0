// Angles [rad]. A half turn is pi.
#pragma once

#include <cmath>

namespace mjtactile {

constexpr double kRightAngle = 1.57079632679489661923, kHalfTurn = 2.0 * kRightAngle, kTurn = 4.0 * kRightAngle;

// Direction in which second moments about a mean are largest.
inline double principal_angle(double xx, double xy, double yy) { return 0.5 * std::atan2(2.0 * xy, xx - yy); }

}  // namespace mjtactile
