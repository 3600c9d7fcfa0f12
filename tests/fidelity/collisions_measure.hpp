#pragma once

#include <array>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "core/build/level.hpp"
#include "core/groom/groom.hpp"
#include "tests/fidelity/corpus.hpp"

namespace hairnet::fidelity {

inline constexpr double kTooDeep_m = 0.003;  // beyond the depth in the design

// Strand points of one run that lie too deep in the body, as shares of all points, over the ticks looked at.
struct Depths {
  std::string groom, motion;
  LevelIndex level = LevelIndex::high;
  bool metaballs = true;
  std::size_t ticks = 0;
  double mean_share = 0, worst_share = 0;
  std::array<double, kBoneCount> mean_share_by_bone{};  // of the nearest skin; they sum to mean_share
  double mean_share_inside = 0;                         // moved mostly by nodes that lie in the body in the design
  double deepest_m = 0;                                 // beyond the design
};

// A hairstyle ready to be measured: its levels, and the same without their metaballs.
struct Subject {
  Groom groom;
  std::vector<LevelIndex> levels;
  std::shared_ptr<const LevelSet> with, without;
};
Subject make_subject(Groom groom, const std::vector<LevelIndex>& levels);

// Plays the clip through a World with its default settings, each level with and without metaballs, and measures every
// third tick after the lead-in. Entries: level by level, without metaballs first.
std::vector<Depths> measure_depths(const Subject& subject, const Clip& clip,
                                   const std::function<void(double)>& progress);

}  // namespace hairnet::fidelity
