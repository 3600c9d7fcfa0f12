#pragma once

#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"
#include "core/solver/step.hpp"
#include "tests/support/corpus.hpp"

namespace hairnet::fidelity {

// The largest value of a figure, and its time, in seconds from the motion's start.
struct Worst {
  double value = 0, time_s = 0;
};

// Measures of the hair after the head is upright and still again. Points are strand points.
struct RestFigures {
  // The speed of the fastest point.
  double speed_m_per_s = 0;
  // The share of points more than kTooDeep_m deeper in the body than designed.
  double deep_share = 0;
  // The distances of points from the design.
  double rms_m = 0, p99_m = 0;
  // The share of points where the lattice is turned inside out: det(dx/dX) < 0.
  double inverted_share = 0;
};

// Measures of one hairstyle in one motion.
struct MotionFigures {
  std::string groom, motion;
  LevelIndex level = LevelIndex::high;
  // The mean over ticks of the share of points more than kTooDeep_m deeper in the body than designed.
  double deep_share = 0;
  // The same share in the worst tick.
  Worst deep{};
  // The length of a strand in the lattice over that of its design, over all strands and ticks.
  double length_p50 = 1, length_p99 = 1;
  Worst length{1, 0};
  // The same ratio of a strand as it is drawn (core/ffd/strand_lengths.hpp).
  double drawn_p99 = 1;
  // A jump is |x(t) - 2 x(t-1) + x(t-2)| of a point in the world, beyond that of the same point of the design moving
  // rigidly with the head.
  double jump_p999_m = 0;
  Worst jump_m{};
  // The median angle of the lower halves of strands from vertical.
  double hanging_rad = std::numeric_limits<double>::quiet_NaN();
  // It is empty when it was not asked for.
  std::optional<RestFigures> rest{};
};

struct MotionFigureOptions {
  // The gravity and the wind during the motion. After the motion the air is still.
  Environment environment{};
  // The time upright and still after the motion, before the rest is measured; zero leaves it out.
  double rest_after_s = 5;
  // The approximate number of the hairstyle's points at which depth and jumps are measured.
  std::size_t point_count = 4000;
};

// A hairstyle ready to be measured.
struct Subject {
  Groom groom;
  std::vector<LevelIndex> indices;
  std::shared_ptr<const LevelSet> levels;
};
Subject make_subject(Groom groom, const std::vector<LevelIndex>& indices);

// Plays the clip through a World with its default settings, a character on each level. Whether hair hangs is measured
// at the end of `hangs` clips, before the head goes upright.
std::vector<MotionFigures> measure_motion_figures(const Subject& subject, const Clip& clip, bool hangs,
                                                  const MotionFigureOptions& options,
                                                  const std::function<void(double)>& progress = {});

}  // namespace hairnet::fidelity
