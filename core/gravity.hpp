#pragma once

namespace hairnet {

// The earth's acceleration of gravity, m/s^2. It acts along -y of the world, and of the head in the design.
inline constexpr double kGravity_m_per_s2 = 9.81;

}  // namespace hairnet
