#include "tests/tools/web_learnt.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "client/link/learnt_track.hpp"
#include "core/assert.hpp"
#include "schema/wire/learnt_file.hpp"
#include "schema/wire/packing.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/mutation.hpp"
#include "tests/tools/hex.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_random.hpp"

namespace hairnet {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Json = nlohmann::ordered_json;

constexpr int kLearntMutations = 600, kLearntFrames = 240;
constexpr std::size_t kLearntModes = 16;  // of the basis; the network drives fewer

// Of all that a file holds, or null.
Json learnt_checksum(const Bytes& file) {
  const auto got = wire::decode_learnt(file);
  if (!got) return nullptr;
  std::uint32_t sum = 0;
  const auto add = [&](std::uint32_t word) { sum = (sum ^ word) * 16'777'619u; };
  add(static_cast<std::uint32_t>(got->hidden_count));
  add(static_cast<std::uint32_t>(got->mode_count));
  for (const auto* weights : {&got->input_weights, &got->hidden_weights, &got->bias, &got->output_weights})
    for (const float weight : *weights) add(std::bit_cast<std::uint32_t>(weight));
  for (const float most : got->most) add(std::bit_cast<std::uint32_t>(most));
  add(std::bit_cast<std::uint32_t>(got->error));
  add(std::bit_cast<std::uint32_t>(got->low_error));
  return sum;
}

Json spoilt_learnt() {
  const LearntHair good = support::random_learnt_hair(5, 4, 4);
  const Bytes file = wire::encode_learnt(good), table = wire::unpack(file, wire::kPackedLearnt).value();
  Json all = Json::array();
  const auto add = [&](const std::string& name, const Bytes& spoilt) {
    all.push_back({{"name", name}, {"file", hex(spoilt)}, {"checksum", learnt_checksum(spoilt)}});
  };
  // Replaces a number of the table that lies like `before`.
  const auto add_number = [&](const std::string& name, const auto& before, const auto& after) {
    static_assert(sizeof before == sizeof after);
    Bytes spoilt = table;
    const auto* from = reinterpret_cast<const std::uint8_t*>(&before);
    const auto at = std::search(spoilt.begin(), spoilt.end(), from, from + sizeof before);
    HAIRNET_ASSERT(at != spoilt.end());
    std::memcpy(&*at, &after, sizeof after);
    add(name, wire::pack(spoilt, wire::kPackedLearnt));
  };
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNaN = std::numeric_limits<float>::quiet_NaN();
  for (const float value : {0.0f, 1e6f, -1e6f, 1.001e6f, -2e6f, kInfinity, -kInfinity, kNaN}) {
    const std::string is = " is " + std::to_string(value);
    add_number("an input weight" + is, good.input_weights[5], value);
    add_number("a hidden weight" + is, good.hidden_weights[7], value);
    add_number("a bias" + is, good.bias[2], value);
    add_number("an output weight" + is, good.output_weights[9], value);
    add_number("a range" + is, good.most[0], value);
  }
  // Lengths of vectors: of the input weights and of the range.
  add_number("fewer input weights", std::uint32_t{288}, std::uint32_t{287});
  add_number("a shorter range", std::uint32_t{24}, std::uint32_t{23});
  for (std::size_t size = 0; size < file.size(); size += file.size() / 16)
    add("cut off after " + std::to_string(size), Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size)));
  add("the table, not packed", table);
  add("packed as a basis", wire::pack(table, wire::kPackedBasis));
  std::mt19937 random(24);
  for (int n = 0; n < kLearntMutations; ++n)
    add("mutation " + std::to_string(n), wire::pack(wire::mutated(random, table), wire::kPackedLearnt));
  return all;
}

Pose learnt_pose(int tick) {
  const double t = tick / 30.0;
  const auto turned = [](double angle, const Vec3& axis, const Vec3& shift) {
    return RigidTransform{Quat(Eigen::AngleAxisd(angle, axis.normalized())), shift};
  };
  Pose pose = rigid_pose(turned(0.8 * std::sin(4 * t), {0.2, 1, 0.1}, {0.3 * std::sin(2 * t), 1.6, 0.2 * t}));
  for (std::size_t bone = 1; bone < kBoneCount; ++bone)
    pose.bones[bone] = pose.bones[bone] * turned(0.2 * std::sin(3 * t + static_cast<double>(bone)), {1, 0.3, 0.5},
                                                 {0.01 * std::sin(t), 0, 0.02 * std::cos(2 * t)});
  // A jump that nobody announces.
  if (tick > 150) pose.bones[0].position.x() += 2;
  return rounded_to_wire(pose);
}

// With lost frames, gaps, jumps, other levels, and times with and without coefficients.
Json learnt_frames(const LearntHair& hair) {
  const auto shared = std::make_shared<const LearntHair>(hair);
  WebRandom random(25);
  link::LearntTrack track;
  Json all = Json::array();
  Pose last;
  std::vector<float> before;
  int last_tick = -1;
  for (int tick = 0; tick < kLearntFrames; ++tick) {
    if (tick % 7 == 3 || (tick > 100 && tick < 112)) continue;
    const Pose pose = learnt_pose(tick);
    link::LearntFrame frame;
    frame.from = last_tick < 0 ? nullptr : &last;
    frame.to = &pose;
    frame.ticks = last_tick < 0 ? 0 : static_cast<std::uint64_t>(tick - last_tick);
    frame.is_learnt = tick < 60 || tick > 75;
    frame.evaluated = frame.is_learnt && tick > 30 && tick % 50 > 12;
    frame.discontinuous = tick == 90 || tick == 180;
    std::vector<float> coded;
    for (std::size_t k = 0; k < kLearntModes; ++k) coded.push_back(frame.evaluated ? 0 : random.real(0.02f));
    Json one{{"tick", tick},
             {"pose", to_json(pose)},
             {"isLearnt", frame.is_learnt},
             {"evaluated", frame.evaluated},
             {"discontinuous", frame.discontinuous},
             {"coded", coded}};
    auto motion = track.begin(shared, frame);
    if (motion) step_learnt(hair, {&*motion, 1});
    track.finish(frame, before, coded);
    one["shown"] = coded;
    all.push_back(std::move(one));
    before = coded;
    last = pose;
    last_tick = tick;
  }
  return all;
}

}  // namespace

Json learnt_cases() {
  const LearntHair hair = support::random_learnt_hair(5, 20, 12);
  const Bytes file = wire::encode_learnt(hair);
  return {{"file", hex(file)},
          {"checksum", learnt_checksum(file)},
          {"frames", learnt_frames(hair)},
          {"spoilt", spoilt_learnt()}};
}

}  // namespace hairnet
