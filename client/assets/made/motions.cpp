#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "client/assets/made/easing.hpp"
#include "client/assets/made/everyday_motions.hpp"
#include "client/assets/made/gait.hpp"
#include "client/assets/made/made.hpp"
#include "client/assets/made/rig.hpp"
#include "client/assets/made/variation.hpp"
#include "core/random.hpp"

namespace hairnet {
namespace {

using made::add_gait;
using made::bump;
using made::Gesture;
using made::MotionVariation;
using made::smootherstep;
using made::wave;

// All gestures are eased in from rest at the begin of a clip and out again at its end, within these times.
constexpr double kEaseIn_s = 0.5;
constexpr double kEaseOut_s = 0.8;

// A gaze that moves from one random direction to the next, one glance at a time. Sixty-one targets serve for more than
// a minute before they repeat.
struct Glances {
  static constexpr double kGlance_s = 1.1, kTurn_s = 0.55;
  explicit Glances(std::uint32_t seed) {
    // The second number is the stream of random numbers for glances; other parts of a motion use others of the same
    // seed.
    Random random(seed, 11);
    for (auto& target : targets)
      target = {random.between(-1.1, 1.1), random.between(-0.45, 0.4), random.between(-0.2, 0.2)};
    targets[0].setZero();
  }
  [[nodiscard]] Vec3 at(double t) const {
    const auto glance = static_cast<std::size_t>(t / kGlance_s);
    const Vec3 &from = targets[glance % targets.size()], &to = targets[(glance + 1) % targets.size()];
    // The head rests for the first half of each glance, and turns in the second.
    return from +
           smootherstep(kGlance_s - kTurn_s, kGlance_s, t - static_cast<double>(glance) * kGlance_s) * (to - from);
  }
  // Each target has a yaw, a pitch and a roll, in radians.
  std::array<Vec3, 61> targets;
};

// In the functions below angles are in radians and lengths in metres, as in Gesture; wave() takes a frequency in Hz,
// and factors are the size of each movement. The braces of add_gait() hold steps a second, bob and sway (Gait).

Gesture still(const MotionVariation&, std::uint32_t, double) {
  return {};
}

Gesture nod(const MotionVariation& variation, std::uint32_t, double t) {
  return {.head_pitch = variation.size * 0.45 * wave(1.1 * variation.tempo, t)};
}

Gesture shake(const MotionVariation& variation, std::uint32_t, double t) {
  const double yaw = variation.size * wave(1.25 * variation.tempo, t);
  return {.trunk_yaw = 0.08 * yaw, .head_yaw = 0.8 * yaw, .head_roll = 0.06 * wave(2.5 * variation.tempo, t)};
}

Gesture look_around(const MotionVariation&, std::uint32_t seed, double t) {
  const Vec3 gaze = Glances(seed).at(t);
  return {.trunk_yaw = 0.25 * gaze[0], .head_yaw = 0.75 * gaze[0], .head_pitch = gaze[1], .head_roll = gaze[2]};
}

Gesture walk(const MotionVariation& variation, std::uint32_t, double t) {
  Gesture g;
  add_gait(g, variation, t, {1.9 * variation.tempo, 0.045 * variation.size, 0.02});
  g.speed_m_per_s = 1.35 * variation.tempo;
  return g;
}

Gesture run(const MotionVariation& variation, std::uint32_t, double t) {
  Gesture g;
  add_gait(g, variation, t, {2.7 * variation.tempo, 0.11 * variation.size, 0.025});
  g.trunk_pitch = 0.16;
  g.head_pitch -= 0.10;
  g.speed_m_per_s = 3.4 * variation.tempo;
  return g;
}

// A crouch before the jump, the flight, and a crouch on landing. bump((x - c) / w) is centred at the share c of the
// cycle of 1.3 s, and takes the share w of it.
Gesture jump(const MotionVariation& variation, std::uint32_t, double t) {
  const double cycle = t * variation.tempo / 1.3;
  const double x = cycle - std::floor(cycle);
  const double crouch = bump((x - 0.24) / 0.42) + 0.8 * bump((x - 0.82) / 0.34);
  const double flight = bump((x - 0.55) / 0.5);
  Gesture g;
  // The lift is not a parabola, as its acceleration would jump at take-off and landing.
  g.lift_m = variation.size * (0.42 * flight - 0.16 * crouch);
  g.trunk_pitch = 0.30 * crouch;
  g.head_pitch = -0.18 * crouch + 0.08 * flight;
  g.left_shoulder = g.right_shoulder = -0.25 * flight;
  return g;
}

// A bar has four beats. The turn takes beats 1 to 2.6 of each bar, and each second bar turns back.
Gesture dance(const MotionVariation& variation, std::uint32_t, double t) {
  // Two beats a second are 120 a minute.
  const double beat = t * variation.tempo * 2;
  const auto bar = std::floor(beat / 4);
  // Half a turn to one side and back, every other bar.
  const bool away = static_cast<long>(bar) % 2 == 0;
  const double turn = smootherstep(1.0, 2.6, beat - 4 * bar);
  Gesture g;
  g.trunk_yaw = 2.4 * (away ? turn : 1 - turn) + 0.15 * wave(0.5, beat, variation.phase);
  g.trunk_roll = variation.size * 0.14 * wave(0.25, beat, variation.phase);
  g.trunk_pitch = 0.08 * wave(0.5, beat);
  g.head_yaw = variation.size * 0.45 * wave(0.5, beat, variation.phase + 0.2);
  g.head_roll = variation.size * 0.28 * wave(0.25, beat, variation.phase + 0.1);
  g.head_pitch = variation.size * 0.20 * wave(1, beat);
  g.lift_m = 0.07 * (wave(1, beat) - 1) / 2;
  g.sway_m = 0.16 * wave(0.25, beat, variation.phase);
  g.left_shoulder = 0.2 * wave(1, beat);
  g.right_shoulder = 0.2 * wave(1, beat, 0.5);
  return g;
}

// Goes into a posture within a second and a half, then stays still, then goes back.
double posture(double t) {
  return smootherstep(0.4, 1.9, t) * (1 - smootherstep(4.6, 6.1, t));
}

// These three are hard cases for gravity and contact: hair hangs in directions for which it was not designed.
Gesture lean(const MotionVariation&, std::uint32_t, double t) {
  return {.trunk_roll = 1.2 * posture(t)};
}

Gesture lie_down(const MotionVariation&, std::uint32_t, double t) {
  // A quarter of a turn backwards, on the back, with the whole person 0.6 m lower.
  return {.lift_m = -0.6 * posture(t), .trunk_pitch = -0.5 * std::numbers::pi * posture(t)};
}

Gesture upside_down(const MotionVariation&, std::uint32_t, double t) {
  // A pitch of 2.9 rad is 166 degrees: nearly half a turn forwards.
  return {.lift_m = -0.3 * posture(t), .trunk_pitch = 2.9 * posture(t)};
}

Gesture shrug(const MotionVariation& variation, std::uint32_t, double t) {
  const double up = 0.35 * variation.size * (1 - wave(0.6 * variation.tempo, t, 0.25)) / 2;
  return {.head_yaw = 0.9 * wave(0.3 * variation.tempo, t), .shoulders_up = up};
}

// Every 1.5 s at another place, facing another direction. The place and the direction depend on the seed and the number
// of the place alone.
Gesture teleport(const MotionVariation& variation, std::uint32_t seed, double t) {
  Gesture g = look_around(variation, seed, t);
  const auto place = static_cast<std::uint32_t>(t / 1.5);
  Random random(seed, 100 + place);
  // The first place is where other motions begin.
  if (place > 0) {
    g.place = Vec3(random.between(-3, 3), 0, random.between(-3, 3));
    g.facing = random.between(-3, 3);
  }
  g.place_index = place;
  return g;
}

struct Recipe {
  MadeName name;
  double duration_s;
  Gesture (*gesture)(const MotionVariation&, std::uint32_t seed, double t);
};

// A row has a name, what the motion shows, its own duration, s, and its gesture. Programs list the motions in this
// order.
constexpr std::array<Recipe, 21> kRecipes{{
    {{"still", "upright, at rest"}, 2, still},
    {{"nod", "yes, about once a second"}, 5, nod},
    {{"shake", "no, with lively turns of the head"}, 5, shake},
    {{"look_around", "glances here and there"}, 8, look_around},
    {{"walk", "straight ahead"}, 6, walk},
    {{"run", "straight ahead, fast"}, 6, run},
    {{"jump", "again and again on the spot"}, 6, jump},
    {{"dance", "turns, tilts and bounces at 120 beats a minute"}, 8, dance},
    {{"shrug", "shoulders up and down, the head turning over them"}, 7, shrug},
    {{"lean", "far to the side, held, and back"}, 7, lean},
    {{"lie_down", "on the back, held, and up again"}, 7, lie_down},
    {{"upside_down", "head over, held, and back"}, 7, upside_down},
    {{"walk_and_stop", "walks, stops, stands for two seconds, walks again"}, 13, made::walk_and_stop},
    {{"side_step", "30 cm aside and back, standing still between"}, 16, made::side_step},
    {{"glide", "moved by a thumbstick: 1.4 m/s at once, at once to a stop"}, 13, made::glide},
    {{"dash", "sprints and brakes"}, 13, made::dash},
    {{"turn_on_spot", "half a turn of the whole body, held, and the next"}, 15, made::turn_on_spot},
    {{"lift", "up and down as in a lift, 1.5 m/s"}, 13, made::lift},
    {{"late_nod", "nods after four seconds of stillness"}, 14, made::late_nod},
    {{"look", "left, right, up and down, a pause at each"}, 13, made::look},
    {{"teleport", "glances, and every 1.5 s somewhere else"}, 7, teleport},
}};

constexpr auto kNames = [] {
  std::array<MadeName, kRecipes.size()> names;
  for (std::size_t i = 0; i < names.size(); ++i) names[i] = kRecipes[i].name;
  return names;
}();

// The bounds allow at most 144 001 poses, and leave time to ease in and out.
std::string error_of(const MotionOptions& options) {
  if (!(options.duration_s == 0 || (options.duration_s >= 2 && options.duration_s <= 600)))
    return "duration of a made motion must be 2 to 600 s";
  if (!(options.rate_hz >= 10 && options.rate_hz <= 240)) return "rate of a made motion must be 10 to 240 Hz";
  return {};
}

}  // namespace

std::span<const MadeName> motion_names() {
  return kNames;
}

Result<Motion> make_motion(std::string_view name, const MotionOptions& options) {
  const auto recipe = std::ranges::find(kRecipes, name, [](const Recipe& r) { return r.name.name; });
  if (recipe == kRecipes.end()) {
    std::string known;
    for (const Recipe& r : kRecipes) known += (known.empty() ? "" : ", ") + std::string(r.name.name);
    return Refusal("no made motion is called '" + std::string(name) + "'; there are " + known);
  }
  if (std::string error = error_of(options); !error.empty()) return Refusal(std::move(error));

  const double duration_s = options.duration_s > 0 ? options.duration_s : recipe->duration_s;
  // One pose more than intervals, so the clip lasts exactly `duration_s`.
  const auto pose_count = static_cast<std::size_t>(std::lround(duration_s * options.rate_hz)) + 1;
  const MotionVariation variation(options.seed);
  Motion motion{std::string(name), options.rate_hz, {}, {}};
  double travelled_m = 0;
  std::uint32_t place = 0;
  for (std::size_t i = 0; i < pose_count; ++i) {
    const double t = static_cast<double>(i) / options.rate_hz;
    // All gestures are eased to rest at both ends, so that any clip can follow another. The last 0.1 s are at rest.
    const double ease =
        smootherstep(0, kEaseIn_s, t) * (1 - smootherstep(duration_s - kEaseOut_s, duration_s - 0.1, t));
    Gesture gesture = recipe->gesture(variation, options.seed, t);
    // The speed is summed with its ease, so the person starts from rest and comes to rest.
    travelled_m += ease * gesture.speed_m_per_s / options.rate_hz;
    motion.poses.push_back(made::pose_of(gesture, ease, travelled_m));
    // Only the first pose at a new place is a teleport.
    motion.teleports.push_back(gesture.place_index != place);
    place = gesture.place_index;
  }
  return motion;
}

}  // namespace hairnet
