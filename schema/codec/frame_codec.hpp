#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/pose/pose.hpp"
#include "schema/enums.hpp"

// One character's frame as bits: poses and displacements quantised to integers, and the integers coded without loss.
// Pure: no clock, no state except the arguments, the same bits on every machine.
namespace hairnet::codec {

// By the step of the quantisation; a coordinate's error is at most half a step (and float rounding).
using wire::ErrorClass;
inline constexpr std::size_t kErrorClassCount = wire::kErrorClassNames.size();
inline constexpr std::array<float, kErrorClassCount> kStep_m{0.25e-3f, 0.5e-3f, 1e-3f};

// 5 bones: position x y z in units of kPositionStep_m, quaternion x y z w in units of kRotationStep.
inline constexpr std::size_t kIntegersPerBone = 7;
inline constexpr std::size_t kBoneIntegers = kIntegersPerBone * kBoneCount;
inline constexpr double kPositionStep_m = 1.0 / (1 << 14);
inline constexpr double kRotationStep = 1.0 / (1 << 15);

// The coded data. The caller must make sure that frames of one character have the same level and class.
struct FrameIntegers {
  std::array<std::int32_t, kBoneIntegers> bones{};
  std::vector<std::int16_t> nodes;  // 3 an active node (x y z), in units of the class's step; empty: rigid
  // like `nodes`, in units of kVelocityStepsPer_s steps a second; empty: not sent
  std::vector<std::int16_t> velocities;
};
inline constexpr float kVelocityStepsPer_s = 32;  // a velocity unit is 32 steps a second: 16 mm/s in class half_mm

// `pose` must be valid and within the wire's bounds. `last` may be null; it selects the sign of each quaternion, since
// q and -q are the same rotation.
void quantise_pose(const Pose& pose, const FrameIntegers* last, FrameIntegers& out);
// The pose for steps, frames and clients, rounded to float like rounded_to_wire.
Pose dequantise_pose(const FrameIntegers& integers);
// Returns false when a coordinate does not fit 16 bits in that class (use a coarser class; class one_mm clamps it).
bool quantise_nodes(std::span<const Vec3f> displacement, ErrorClass error_class, std::vector<std::int16_t>& out);
void dequantise_nodes(std::span<const std::int16_t> nodes, ErrorClass error_class, std::vector<Vec3f>& displacement);
// m/s, head space; clamped to 16 bits.
void quantise_velocities(std::span<const Vec3f> velocity, ErrorClass error_class, std::vector<std::int16_t>& out);
void dequantise_velocities(std::span<const std::int16_t> velocities, ErrorClass error_class,
                           std::vector<Vec3f>& velocity);

// The nodes of a frame, coded earlier, from which a node is predicted. Derived from a level's grid, so both ends have
// the same. Immutable.
class Neighbours {
 public:
  explicit Neighbours(const LevelGeometry& geometry);
  [[nodiscard]] std::size_t node_count() const;  // active nodes

 private:
  friend struct NeighbourAccess;
  std::vector<std::array<std::uint32_t, 3>> nodes_;
};

// Earlier frames of the same character, level and class, at equal distances in time, newest first: t-s, t-2s, t-3s.
// Empty: intra. All must have the frame's number of nodes.
using History = std::span<const FrameIntegers* const>;
inline constexpr std::size_t kHistoryMax = 3;

// Appends the frame's content to `out`. `neighbours`: of the frame's level; null exactly when it has no nodes.
void encode_frame(const FrameIntegers& frame, History history, const Neighbours* neighbours,
                  std::vector<std::uint8_t>& out);

// For any bytes, returns true and a frame equal to the encoded one, or false (then `out` is unspecified). `bytes` is
// exactly one content; trailing bytes are refused. `history` and `neighbours` must be those of the encoder.
// `has_velocities`: the frame has velocities.
[[nodiscard]] bool decode_frame(std::span<const std::uint8_t> bytes, History history, const Neighbours* neighbours,
                                bool has_velocities, FrameIntegers& out);

// For datagrams: a part of a frame's nodes, of at most `bytes_max` bytes, that can be decoded alone (with the same
// history). The first range includes the bones.
struct NodeRange {
  std::uint32_t first = 0, count = 0;  // active nodes
};
inline constexpr std::size_t kRangeBytesMin = 640;  // enough for any bones and any node
struct EncodedRange {
  NodeRange nodes;
  std::vector<std::uint8_t> bytes;
};
// `bytes_max`: at least kRangeBytesMin.
std::vector<EncodedRange> encode_ranges(const FrameIntegers& frame, History history, const Neighbours* neighbours,
                                        std::size_t bytes_max);
// Fills the range's part of `out`, which already has all nodes of the level. `with_bones`: it is the first range.
[[nodiscard]] bool decode_range(std::span<const std::uint8_t> bytes, NodeRange range, bool with_bones, History history,
                                const Neighbours* neighbours, bool has_velocities, FrameIntegers& out);

}  // namespace hairnet::codec
