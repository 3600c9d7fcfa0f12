#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/groom/groom.hpp"

// The bulk of a groom file of version 3: positions, bone weights and indices as integers. Each integer is
// predicted from those before it, and what remains lies in three byte planes, so that deflate finds small numbers
// side by side. Decoding uses integers alone, and one multiplication for each number: every machine gets the same
// floats. Encoding what was decoded gives the same integers again. For groom_file.cpp and groom_features.cpp.
namespace hairnet::wire {

// The step of each coordinate. Rounding to it moves a point by at most 0.043 mm.
inline constexpr double kGroomStep_m = 5e-5;
// The integer that stands for a bone weight of 1.
inline constexpr std::int32_t kGroomWeightMax = 4095;
// How many earlier steps along a run predict the next one, each with a weight. One more weight is that of the reference
// run.
inline constexpr std::size_t kGroomTaps = 4;
inline constexpr std::size_t kGroomWeightsPerRow = kGroomTaps + 1;

// The points [begin, end) of one strand, thread, card or cloth. Those of a card come in pairs: stride 2.
struct PointRun {
  std::size_t begin = 0, end = 0, stride = 1;
  // The points of an earlier run of similar shape, which predicts this one; empty for none. It is set while coding.
  PointRange reference;
};
std::vector<PointRun> point_runs(const Groom& groom);

struct EncodedPoints {
  // kGroomWeightsPerRow of each number of a point in its run, in 1/4096: of the steps before, then of the reference;
  // 0 where there are no more.
  std::vector<std::int16_t> weights;
  // How many runs before each run its reference is, in byte planes; 0 means none. It may be empty.
  std::vector<std::uint8_t> references;
  std::vector<std::uint8_t> planes;
};
// `runs` cover the points in order. A coordinate that is not finite or too far from the head stays so.
EncodedPoints encode_points(std::span<const Vec3f> points, std::vector<PointRun> runs);
// Returns an empty string, or one line about what is wrong.
std::string decode_points(std::span<const std::int16_t> weights, std::span<const std::uint8_t> references,
                          std::span<const std::uint8_t> planes, std::vector<PointRun> runs, std::vector<Vec3f>& points);

// The weights of a vertex keep their sum of 1 exactly.
std::vector<std::uint8_t> encode_bone_weights(std::span<const std::array<float, kBoneCount>> weights);
std::string decode_bone_weights(std::span<const std::uint8_t> planes,
                                std::vector<std::array<float, kBoneCount>>& weights);

// An index too large for any groom stays so.
std::vector<std::uint8_t> encode_indices(std::span<const std::uint32_t> indices);
std::string decode_indices(std::span<const std::uint8_t> planes, std::vector<std::uint32_t>& indices);

}  // namespace hairnet::wire
