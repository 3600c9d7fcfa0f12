#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/pose/motion.hpp"
#include "core/result.hpp"

namespace hairnet::fidelity {

// Names of real hairstyles and motions, which tables and tests go through. Their files are in ../shared/data beside
// the checkout (has_real_data()), and corpus.cpp says how each is read.
inline constexpr std::string_view kRealGrooms[] = {"yuksel", "ponytail", "harolongo", "sintel"};
inline constexpr std::string_view kRealMotions[] = {"cmu_131_01", "cmu_131_02", "dance_a",  "spinkick", "run",
                                                    "jump",       "cartwheel",  "backflip", "spin",     "getup_faceup"};
bool has_real_data();
// Returns the names of all hairstyles that client/assets/made generates, each as made:NAME.
std::vector<std::string> made_grooms();

// Loads a hairstyle by a name of kRealGrooms or made:NAME; any other name is the path of a file. `made_strand_count`
// is the number of strands of a made one; 0 means the style's own number. The error is one line.
Result<Groom> load_groom(std::string_view name, std::size_t made_strand_count = 0);

// Loads a motion by a name of kRealMotions or made:NAME; any other name is the path of a file. `body` says where the
// trunk is when a clip lacks bones.
Result<Motion> load_motion(std::string_view name, const Body& body);

// A motion as tests step lattices through it: one pose for each tick, rounded as poses are when they are sent. The
// first pose is upright at rest.
struct Clip {
  std::string name;
  double rate_hz = 0;
  std::vector<Pose> poses;
  // The motion itself starts after these ticks; no measurement may include them.
  std::size_t lead_in_ticks = 0;

  // A tick is a step from one pose to the next, so there is one less than poses.
  [[nodiscard]] std::size_t tick_count() const { return poses.size() - 1; }
};

// Samples a motion at `rate_hz`. The clip begins with a second of easing from upright rest into the motion's first
// pose, so that no run begins with a jump. At most `duration_s` of the motion follow.
Clip make_clip(const Motion& motion, double rate_hz, double duration_s);

}  // namespace hairnet::fidelity
