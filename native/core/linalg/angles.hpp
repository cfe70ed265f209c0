// Angles [rad]. A half turn is pi.
#pragma once

namespace mjtactile {

constexpr double kRightAngle = 1.57079632679489661923, kHalfTurn = 2.0 * kRightAngle, kTurn = 4.0 * kRightAngle;

}  // namespace mjtactile
