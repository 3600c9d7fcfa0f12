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

// The largest of a figure, and when it was, in seconds from the motion's start.
struct Worst {
  double value = 0, time_s = 0;
};

// Measures of the hair after the head is upright and still again. Points are strand points.
struct RestFigures {
  double speed_m_per_s = 0;     // of the fastest point
  double deep_share = 0;        // of points more than kTooDeep_m deeper in the body than designed
  double rms_m = 0, p99_m = 0;  // distance of points from the design
  double inverted_share = 0;    // of points, those where the lattice is turned inside out: det(dx/dX) < 0
};

// Measures of one hairstyle in one motion.
struct MotionFigures {
  std::string groom, motion;
  LevelIndex level = LevelIndex::high;
  double deep_share = 0;  // mean over ticks, of points more than kTooDeep_m deeper in the body than designed
  Worst deep{};           // the same in the worst tick
  double length_p50 = 1, length_p99 = 1;  // of a strand in the lattice over its design's, over strands and ticks
  Worst length{1, 0};
  double drawn_p99 = 1;  // of a strand as it is drawn (core/ffd/strand_lengths.hpp)
  // Of a point in two ticks, |x(t) - 2 x(t-1) + x(t-2)| in the world, beyond that of the same point of the design
  // moving rigidly with the head.
  double jump_p999_m = 0;
  Worst jump_m{};
  double hanging_rad = std::numeric_limits<double>::quiet_NaN();  // lower halves of strands, median from vertical
  std::optional<RestFigures> rest{};                              // empty when it was not asked for
};

struct MotionFigureOptions {
  Environment environment{};       // during the motion; calm after it
  double rest_after_s = 5;         // upright and still after the motion, before the rest is measured; 0: it is not
  std::size_t point_count = 4000;  // of the hairstyle for depth and jumps, about
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
