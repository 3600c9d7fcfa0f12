#pragma once

#include <cstddef>
#include <vector>

#include "core/pose/motion.hpp"
#include "schema/codec/frame_codec.hpp"
#include "tests/bench/subject.hpp"

namespace hairnet::bench {

// A lattice through the subject's motions, as its frames would be sent.
struct CodecClip {
  std::vector<Pose> poses;
  std::vector<std::vector<Vec3f>> displacements;  // of active nodes, m
};
std::vector<CodecClip> step_clips(const Subject& subject, LevelIndex index, double rate_hz, double duration_s);

struct CodecCase {
  codec::ErrorClass error_class = codec::ErrorClass::half_mm;
  std::size_t order = 3, stride = 1;
};
struct CodecResult {
  std::size_t frames = 0;
  double bytes_a_frame = 0, bone_bytes_a_frame = 0;  // of all, and what of it the pose takes
  double share_of_raw = 0;                           // nodes' bytes over 6 a node
  double encode_ns = 0, decode_ns = 0;               // a frame; 0 unless timed
  bool right = true;                                 // every frame came back
};
// `repetitions`: of the times, of which the least counts; 0: none.
CodecResult measure_codec(const LevelGeometry& geometry, const std::vector<CodecClip>& clips, const CodecCase& what,
                          int repetitions);

// For comparison: predicts every coordinate by (19a - 15b + 4c) / 8, Rice coded with one parameter per 16 coordinates.
// The nodes' share of 16-bit raw.
double share_of_prototype(const std::vector<CodecClip>& clips, codec::ErrorClass error_class);

}  // namespace hairnet::bench
