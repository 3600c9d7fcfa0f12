#include "tests/bench/workload.hpp"

#include <algorithm>
#include <cmath>

namespace hairnet::bench {
namespace {

// After this time the hair moves as in the middle of a motion.
constexpr double kLeadIn_s = 1;

// One frame like in the service: substeps of the shipped length.
void lead(const Level& level, const Pose& from, const Pose& to, double frame_s, int iterations, StepScratch& scratch,
          LatticeState& state) {
  const int step_count = substep_count_for(frame_s);
  StepInput input;
  input.step_s = frame_s / step_count;
  input.to = from;
  for (int s = 1; s <= step_count; ++s) {
    input.from = input.to;
    input.to = interpolate(from, to, static_cast<double>(s) / step_count);
    if (!step(level, input, {.iterations = iterations}, scratch, state)) reset_to_rest(level, state);
  }
}

}  // namespace

// Characters begin at times that are spread evenly over the motion, such that each has `span_s` left.
double start_time_s(const Motion& motion, std::size_t index, std::size_t count, double span_s) {
  const double free_s = std::max(0.0, motion.duration_s() - span_s);
  return free_s * static_cast<double>(index) / static_cast<double>(count);
}

Workload make_workload(const Level& level, const Motion& motion, const WorkloadSpec& spec, int iterations) {
  Workload cast{1 / spec.rate_hz, spec.frame_count, {}};
  const auto lead_frames = static_cast<std::size_t>(std::ceil(kLeadIn_s * spec.rate_hz));
  const double span_s = static_cast<double>(lead_frames + spec.frame_count) * cast.frame_s;
  StepScratch scratch;
  for (std::size_t c = 0; c < spec.player_count; ++c) {
    BenchCharacter& character = cast.characters.emplace_back();
    reset_to_rest(level, character.state);
    const double start_s = start_time_s(motion, c, spec.player_count, span_s);
    Pose from = motion.sample(start_s);
    for (std::size_t frame = 1; frame <= lead_frames + spec.frame_count; ++frame) {
      const Pose to = motion.sample(start_s + static_cast<double>(frame) * cast.frame_s);
      if (frame <= lead_frames) {
        lead(level, from, to, cast.frame_s, iterations, scratch, character.state);
      } else {
        character.poses.push_back(from);
      }
      from = to;
    }
    character.poses.push_back(from);
  }
  return cast;
}

StepInput step_input(const Workload& cast, const BenchCharacter& character, std::size_t frame, int step,
                     int step_count) {
  const Pose &from = character.poses[frame], &to = character.poses[frame + 1];
  StepInput input;
  input.step_s = cast.frame_s / step_count;
  input.from = interpolate(from, to, static_cast<double>(step) / step_count);
  input.to = interpolate(from, to, static_cast<double>(step + 1) / step_count);
  return input;
}

}  // namespace hairnet::bench
