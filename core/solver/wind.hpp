#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/geometry/rigid_transform.hpp"

namespace hairnet {

// The wind of a room, world axes. The default is still air.
struct Wind {
  Vec3 mean_m_per_s = Vec3::Zero();
  // Gusts vary the mean's speed between (1 - ratio) and (1 + ratio) times its own.
  double gust_ratio = 0;
  // The period of the slowest gust; two quicker ones are added to it.
  double gust_period_s = 4;
  // The RMS of each component.
  double turbulence_rms_m_per_s = 0;
  // The smallest length over which turbulence changes: its wave numbers are 1/(4 scale) to 1/scale rad/m, so the
  // smallest eddies are pi scale across. A lattice cannot represent turbulence below kTurbulenceScaleMin_m.
  double turbulence_scale_m = 0.6;
  std::uint64_t seed = 1;
  // The air goes along with each head, as in a vehicle: hair moves as in a room at rest, however fast the head, and the
  // wind is relative to it. Else the air stands in the room, and who moves has a headwind.
  bool carried = false;
};
inline constexpr double kTurbulenceScaleMin_m = 0.3;

// Empty when every value is finite and in its range; else one line that names the value and the range.
std::string validate(const Wind& wind);
// Whether no air moves.
bool is_still(const Wind& wind);
// The speed that the air seldom exceeds.
double gust_m_per_s(const Wind& wind);

// Air velocity everywhere and at any time, from a Wind; asserts that validate(wind) finds no error. Immutable and
// cheap to copy. The same Wind gives the same bits on every machine: the code uses no sine or distribution of a
// library.
//
//     u(x, t) = mean (1 + ratio g(t)) + sum_m a_m cos(k_m . (x - X(t)) + w_m t + phi_m),     |g| <= 1
//
// Each a_m is perpendicular to its wave vector k_m, so the field is free of divergence. X(t) is the distance that the
// wind has travelled by t: the wind carries turbulence along (Taylor's frozen turbulence), while the eddies' own w_m
// change it on the way.
class WindField {
 public:
  // Makes still air.
  WindField() = default;
  explicit WindField(const Wind& wind);

  [[nodiscard]] bool is_still() const { return !modes_; }
  [[nodiscard]] bool is_carried() const { return is_carried_; }
  // False for still air that stands in the room: the only drag is then that of the hair's own motion.
  [[nodiscard]] bool acts() const { return modes_ || is_carried_; }
  // False when the velocity is the same everywhere.
  [[nodiscard]] bool is_turbulent() const { return modes_ && !modes_->turbulence.empty(); }
  // Returns m/s, exactly zero in still air.
  [[nodiscard]] Vec3 velocity(const Vec3& point_world, double time_s) const;

 private:
  // Phases and frequencies in turns, so that reducing them costs no precision.
  struct Gust {
    double frequency_hz, phase, share;
  };
  struct Eddy {
    // The wave vector in turns a metre.
    Vec3 wave_vector;
    Vec3 amplitude;  // m/s
    double frequency_hz, phase;
  };
  struct Modes {
    Vec3 mean;
    double gust_ratio = 0;
    std::vector<Gust> gusts;
    std::vector<Eddy> turbulence;
  };
  // The gusts and eddies, which copies of the field share; null in still air.
  std::shared_ptr<const Modes> modes_;
  bool is_carried_ = false;
};

// The wind over one lattice: velocities at the eight corners of its box, in head axes, interpolated trilinearly. A
// wave of wave number k has an error of at most (k L)^2 / 8 of its amplitude, where L is the longest side of the box.
// So the RMS error of turbulence is at most (L / scale)^2 / 8 of its RMS.
struct LatticeWind {
  // The velocity at corner i + 2 j + 4 k, where i, j and k are 0 at the low and 1 at the high side of each axis.
  std::array<Vec3f, 8> corners{Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero(),
                               Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero(), Vec3f::Zero()};

  // `fraction` is the position along the box on each axis: node (i, j, k) is at (i / (nx - 1), j / (ny - 1), k / (nz -
  // 1)).
  [[nodiscard]] Vec3f at(const Vec3f& fraction) const;
};

// `head_velocity`: in the head's axes, m/s; carried air has it too. Carried air moves with the head, so hair at rest in
// a vehicle feels no headwind.
LatticeWind wind_on(const WindField& field, const Lattice& lattice, const RigidTransform& head, double time_s,
                    const Vec3& head_velocity = Vec3::Zero());

}  // namespace hairnet
