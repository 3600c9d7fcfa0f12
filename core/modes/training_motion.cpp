#include "core/modes/training_motion.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "core/random.hpp"
#include "core/smoothstep.hpp"

namespace hairnet {
namespace {

constexpr double kPi = std::numbers::pi;

// A number over time: it moves from one value to the next and rests at each for a while. An oscillation may be added to
// it.
class Channel {
 public:
  struct Range {
    // Values lie between -most and most.
    double most = 0;
    // The greatest mean speed of a move from one value to the next, in units a second.
    double speed_max = 0;
    // The greatest amplitude of the oscillation that is added to the values.
    double swing_max = 0;
  };

  Channel(const Range& range, double duration_s, Random& random) {
    double time_s = 0, value = 0;
    keys_.push_back({0, 0, false});
    while (time_s < duration_s) {
      // Three times in ten the number does not rest, so motions also run into each other.
      time_s += random.unit() < 0.3 ? 0 : random.between(0.05, 1.2);
      keys_.push_back({time_s, value, false});
      const double next = range.most * random.symmetric();
      const double shortest_s = std::abs(next - value) / std::max(range.speed_max, 1e-9);
      // A move takes from 0.08 to 1.2 s, evenly spread on a logarithmic scale, or longer where the speed asks for it.
      time_s += std::max(shortest_s, 0.08 * std::pow(15.0, random.unit()));
      value = next;
      // Three moves in ten are sharp.
      keys_.push_back({time_s, value, random.unit() < 0.3});
    }
    // Four channels in ten oscillate, at 0.5 to 3 Hz.
    if (random.unit() < 0.4) swing_ = range.swing_max * random.unit();
    swing_hz_ = random.between(0.5, 3);
    swing_phase_ = random.unit();
  }

  [[nodiscard]] double at(double time_s) const {
    const auto next = std::ranges::upper_bound(keys_, time_s, {}, &Key::time_s);
    // The oscillation begins softly, as every motion starts at rest.
    const double swing = swing_ * std::sin(2 * kPi * (swing_hz_ * time_s + swing_phase_)) *
                         smoothstep(std::clamp(time_s / 0.3, 0.0, 1.0));
    if (next == keys_.end()) return keys_.back().value + swing;
    const Key& before = *(next - 1);
    const double share = (time_s - before.time_s) / (next->time_s - before.time_s);
    return before.value + (next->value - before.value) * (next->is_sharp ? share : smoothstep(share)) + swing;
  }

 private:
  struct Key {
    double time_s, value;
    // The value is reached at constant speed: the motion to it starts and stops at once.
    bool is_sharp;
  };
  std::vector<Key> keys_;
  double swing_ = 0, swing_hz_ = 1, swing_phase_ = 0;
};

// The numbers of which a pose is made; each has a Channel.
enum Part : std::size_t {
  trunk_yaw,
  trunk_pitch,
  trunk_roll,
  trunk_x,
  trunk_y,
  trunk_z,
  head_yaw,
  head_pitch,
  head_roll,
  neck_x,
  neck_y,
  neck_z,
  left_lift,
  left_forward,
  right_lift,
  right_forward,
  part_count
};
using Ranges = std::array<Channel::Range, part_count>;

enum class Liveliness { looking, everyday, lively, wild, posture };

// Angles are in rad and positions in m, speeds in rad/s and m/s. The three arrays have a factor for each Liveliness, in
// its order: how far the body walks, how far it turns about the vertical, and how far it bends.
Ranges ranges_of(Liveliness liveliness) {
  const double go = std::array{0.1, 0.5, 1.0, 1.4, 0.4}[static_cast<std::size_t>(liveliness)];
  const double turn = std::array{0.1, 0.5, 1.0, 3.0, 0.7}[static_cast<std::size_t>(liveliness)];
  const double bend = std::array{0.1, 0.25, 0.6, 2.2, 1.9}[static_cast<std::size_t>(liveliness)];
  const double neck = liveliness == Liveliness::everyday ? 0.7 : 1;
  Ranges ranges;
  ranges[trunk_yaw] = {2 * turn, 5 * turn, 0.3 * turn};
  ranges[trunk_pitch] = {bend, 1.5 + 2 * bend, 0.2 * bend};
  ranges[trunk_roll] = {0.8 * bend, 1.5 + 2 * bend, 0.2 * bend};
  ranges[trunk_x] = ranges[trunk_z] = {go, 2.5 * go, 0.1 * go};
  ranges[trunk_y] = {0.4 * go, 2.5 * go, 0.06 * go};
  ranges[head_yaw] = {1.2 * neck, 6 * neck, 0.6 * neck};
  ranges[head_pitch] = {0.8 * neck, 5 * neck, 0.4 * neck};
  ranges[head_roll] = {0.6 * neck, 4 * neck, 0.2 * neck};
  ranges[neck_x] = ranges[neck_y] = ranges[neck_z] = {0.015, 0.2, 0};
  ranges[left_lift] = ranges[right_lift] = {0.04, 0.4, 0.01};
  ranges[left_forward] = ranges[right_forward] = {0.04, 0.4, 0.01};
  return ranges;
}

RigidTransform turned_about(const Vec3& joint, const Quat& turn, const Vec3& shift = Vec3::Zero()) {
  return {turn, joint - turn * joint + shift};
}

Quat turn_of(double yaw, double pitch, double roll) {
  return Quat(Eigen::AngleAxisd(yaw, Vec3::UnitY()) * Eigen::AngleAxisd(pitch, Vec3::UnitX()) *
              Eigen::AngleAxisd(roll, Vec3::UnitZ()));
}

// The pose for one value of each Part.
Pose pose_at(const std::array<double, part_count>& at, const Body& body) {
  // The trunk turns about the hips, which lie 0.6 m below the head joint at rest. The head joint is 1.6 m above the
  // floor.
  const Vec3 hips(0, -0.6, -0.05);
  const RigidTransform trunk = turned_about(hips, turn_of(at[trunk_yaw], at[trunk_pitch], at[trunk_roll]),
                                            Vec3(at[trunk_x], 1.6 + at[trunk_y], at[trunk_z]));
  // Neck and head joint take one half of the head's turn each.
  const Quat half = Quat::Identity().slerp(0.5, turn_of(at[head_yaw], at[head_pitch], at[head_roll]));
  const RigidTransform neck =
      trunk * turned_about(body.joint(Bone::neck), half, Vec3(at[neck_x], at[neck_y], at[neck_z]));
  const auto shoulder = [&](Bone bone, double lift, double forward) {
    return trunk * turned_about(body.joint(bone),
                                turn_of(2 * forward, 0, (bone == Bone::left_shoulder ? 3 : -3) * lift),
                                Vec3(0, lift, forward));
  };
  Pose pose;
  pose[Bone::upper_trunk] = trunk;
  pose[Bone::neck] = neck;
  pose[Bone::head] = neck * turned_about(body.joint(Bone::head), half);
  pose[Bone::left_shoulder] = shoulder(Bone::left_shoulder, at[left_lift], at[left_forward]);
  pose[Bone::right_shoulder] = shoulder(Bone::right_shoulder, at[right_lift], at[right_forward]);
  return pose;
}

Wind make_wind(Random& random) {
  const double speed = random.between(1, 10);
  const double from = 2 * kPi * random.unit();
  Wind wind;
  wind.mean_m_per_s = speed * Vec3(std::sin(from), 0.2 * random.symmetric(), std::cos(from));
  wind.gust_ratio = 0.6;
  wind.gust_period_s = random.between(0.8, 3);
  wind.turbulence_rms_m_per_s = 0.3 * speed * random.unit();
  wind.seed = random.next();
  return wind;
}

// Hair is anything between wet and limp, and stiff and gelled.
MaterialScale make_material(Random& random) {
  MaterialScale material;
  material.stiffness = static_cast<float>(std::pow(4.0, random.symmetric()));
  material.density = static_cast<float>(std::pow(2.0, random.symmetric()));
  material.damping = static_cast<float>(std::pow(2.0, random.symmetric()));
  material.gel_per_s2 = random.unit() < 0.5 ? 0 : static_cast<float>(random.between(0, 60));
  return material;
}

}  // namespace

TrainingMotion make_training_motion(std::uint32_t number, const Body& body, double tick_s, std::size_t tick_count) {
  using enum Liveliness;
  // The kinds repeat every eight motions. Of each four motions, the second has wind, and the third another material.
  constexpr std::array kKinds{everyday, lively, posture, wild, everyday, lively, posture, looking};
  // The seed is fixed, so the same number always gives the same motion.
  Random random(20040, number);
  const Ranges ranges = ranges_of(kKinds[number % kKinds.size()]);
  std::vector<Channel> channels;
  for (const Channel::Range& range : ranges) {
    channels.emplace_back(range, static_cast<double>(tick_count) * tick_s, random);
  }
  TrainingMotion motion;
  for (std::size_t tick = 0; tick < tick_count; ++tick) {
    std::array<double, part_count> values{};
    for (std::size_t part = 0; part < part_count; ++part) {
      values[part] = channels[part].at(static_cast<double>(tick) * tick_s);
    }
    motion.poses.push_back(pose_at(values, body));
  }
  if (number % 4 == 1) motion.wind = make_wind(random);
  if (number % 4 == 2) motion.material = make_material(random);
  return motion;
}

}  // namespace hairnet
