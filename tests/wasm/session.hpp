#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "client/link/conversation.hpp"
#include "client/room/room.hpp"
#include "tests/wasm/cases.hpp"
#include "tests/wasm/results.hpp"

namespace hairnet::same_bits {

// A client's conversation, step by step: what arrives, what its owner does, and the times.
enum class StepKind : std::uint8_t {
  pass,    // nothing but time
  packet,  // arrives
  add,     // an own character with this groom file
  pose,    // the first own character has it: kPoseNumbers doubles
  lose     // the connection breaks
};
struct Step {
  StepKind kind = StepKind::pass;
  std::int64_t now_ns = 0;
  Bytes bytes = {};
};
// The steps as the bytes of a case, and back. read_steps() asserts that the bytes are whole.
Bytes written(std::span<const Step> steps);
std::vector<Step> read_steps(std::span<const std::uint8_t> bytes);

// A rotation is a quaternion of 4 numbers, and a position has 3.
inline constexpr std::size_t kPoseNumbers = 7 * kBoneCount;
Bytes written(const Pose& pose);
Pose read_pose(std::span<const std::uint8_t> bytes);

// Plays the steps of a session in a Room over a LinkCore, without a network, and collects all that the client sends and
// shows.
class SessionClient {
 public:
  SessionClient();
  // Returns the packets that it sends.
  std::vector<Bytes> take(const Step& step);
  // Writes what record() has collected as lines of results.
  void write(Results& results) const;

 private:
  // Notes what is shown after a step.
  void record();

  // `room_` owns the conversation that `conversation_` points to, and the conversation refers to `core_`.
  link::LinkCore core_;
  link::CoreConversation* conversation_;
  room::Room room_;
  // What record() and take() have collected in all steps: the packets sent, coefficients, nodes, the times that members
  // are shown at, heads, and events as text.
  Bytes sent_;
  std::vector<float> coefficients_;
  std::vector<Vec3f> displacements_;
  std::vector<std::int64_t> times_;
  std::vector<double> poses_;
  std::string events_;
};

}  // namespace hairnet::same_bits
