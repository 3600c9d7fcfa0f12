#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

#include "core/pose/complete_pose.hpp"
#include "core/random.hpp"
#include "schema/codec/frame.hpp"
#include "schema/codec/pose_code.hpp"
#include "schema/limits.hpp"
#include "tests/tools/hex.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_modes.hpp"

namespace hairnet {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Json = nlohmann::ordered_json;

constexpr std::size_t kFrames = 160;
constexpr std::size_t kSpoiltFrames = 3000;
constexpr std::size_t kPrefixBytes = 5;

// Of usual hair; of hair that hardly moves, and moves too far for any parameter; of one mode; and at the bounds
// of parameters, with the floats beside them.
std::vector<std::vector<float>> all_deviations() {
  std::vector<std::vector<float>> all{{}, {1e6f, 40, 1, 1e-3f, 1e-6f, 1e-9f, 1e-30f}, {0.05f}, {}};
  for (int k = 0; k < 96; ++k) all[0].push_back(0.15f / static_cast<float>(1 + k));
  for (int exponent = 16; exponent >= -8; --exponent) {
    const auto bound = static_cast<float>(std::ldexp(1 / 1.375, exponent - 14));
    for (const float deviation : {std::nextafter(bound, 1e9f), bound, std::nextafter(bound, 0.0f)})
      all[3].push_back(deviation);
  }
  return all;
}

class Maker {
 public:
  Maker() : random_(11) {
    for (const std::vector<float>& deviation_m : deviations_) codes_.emplace_back(deviation_m);
  }

  Json deviations() const { return deviations_; }

  // A frame of the pose and coefficients of every liveliness and step, in turn.
  Json frame(std::size_t n, Bytes& bytes) {
    const std::size_t code = n % codes_.size();
    const double lively = std::array{1.0, 0.0, 0.02, 0.3, 40.0}[n % 5];
    const std::vector<float> coefficients = draw(deviations_[code], lively);
    const auto step = static_cast<unsigned>(n / codes_.size() % codec::kStepCount);
    codec::EncodedFrame encoded;
    codec::encode_frame(make_pose(n), &codes_[code], coefficients, step, encoded);
    bytes = encoded.bytes;
    Json prefixes = Json::array();
    for (std::size_t size = 0; size < bytes.size(); size += kPrefixBytes)
      prefixes.push_back(coefficients_in(std::span(bytes).first(size), code));
    return {{"code", code}, {"bytes", hex(bytes)}, {"decoded", decoded(bytes, code)}, {"prefixes", prefixes}};
  }

  // The n-th frame's bytes, spoilt; or others, of the basis with most modes, or most of them would be left over.
  Json spoilt(std::size_t n, Bytes bytes) {
    std::size_t code = 0;
    if (n % 3 == 0) {
      bytes = any_bytes();
    } else if (n % 3 == 1) {
      bytes = odd_bytes();
    } else {
      spoil(bytes);
      code = n % codes_.size();
    }
    return {{"code", code}, {"bytes", hex(bytes)}, {"decoded", decoded(bytes, code)}};
  }

 private:
  std::vector<float> draw(std::span<const float> deviation_m, double lively) {
    std::vector<float> out;
    for (const float deviation : deviation_m)
      out.push_back(static_cast<float>(lively * random_.bell()) * std::min(deviation, 100.0f));
    return out;
  }

  Vec3 vector(double most) { return most * Vec3(random_.symmetric(), random_.symmetric(), random_.symmetric()); }
  Quat any_rotation() { return Quat(random_.bell(), random_.bell(), random_.bell(), random_.bell()).normalized(); }

  // A person who looks around: near, or as far away as the wire allows.
  Pose natural_pose(double far_m) {
    const Quat look(Eigen::AngleAxisd(random_.between(-0.6, 0.6), vector(1).normalized()));
    const Vec3 at = vector(far_m) + Vec3(0, 1.6, 0);
    const Quat yaw(Eigen::AngleAxisd(random_.between(-3, 3), Vec3::UnitY()));
    Pose pose = PoseCompletion(Vec3(0, -0.1, -0.02)).complete({look, at}, 0);
    for (RigidTransform& bone : pose.bones) bone = RigidTransform{yaw, at - yaw * at} * bone;
    return pose;
  }

  Pose make_pose(std::size_t n) {
    Pose pose = natural_pose(n % 7 == 0 ? 0.99 * wire::kPositionMax_m : 5);
    switch (n % 9) {
      case 0:
        return rigid_pose({});
      case 1:  // back to front: half of the head's turn is on no side
        pose[Bone::upper_trunk].rotation = pose.head().rotation * Quat(Eigen::AngleAxisd(std::numbers::pi, axis()));
        return pose;
      case 2:
      case 3:
        for (RigidTransform& bone : pose.bones) bone = {any_rotation(), bone.position + vector(0.3)};
        return pose;
      default:
        return pose;
    }
  }
  Vec3 axis() { return Vec3::Unit(static_cast<Eigen::Index>(random_.next() % 3)); }

  Json decoded(std::span<const std::uint8_t> bytes, std::size_t code) const {
    codec::DecodedFrame frame;
    if (!codec::decode_frame(bytes, &codes_[code], frame)) return nullptr;
    return {{"pose", to_json(frame.pose)}, {"coefficients", frame.coefficients}};
  }

  // Up to and with the last that is not 0.
  int coefficients_in(std::span<const std::uint8_t> bytes, std::size_t code) const {
    codec::DecodedFrame frame;
    if (!codec::decode_frame(bytes, &codes_[code], frame)) return -1;
    auto count = static_cast<int>(frame.coefficients.size());
    while (count > 0 && frame.coefficients[static_cast<std::size_t>(count) - 1] == 0) --count;
    return count;
  }

  // A head that is near, and any bytes.
  Bytes any_bytes() {
    Bytes bytes(1 + random_.next() % 80);
    for (std::uint8_t& byte : bytes) byte = static_cast<std::uint8_t>(random_.next());
    bytes[0] &= 0xE7;
    return bytes;
  }

  // A pose that no encoder writes, with any widths and rotations; then any coefficients.
  Bytes odd_bytes() {
    Bytes bytes(codec::kPoseBytesMax + 256);
    codec::BitWriter writer(bytes.data());
    put_point(writer);
    put_rotation(writer);
    for (int turns = 0; turns < 2; ++turns) put_turn(writer);
    for (int points = 0; points < 2; ++points) put_point(writer);
    for (int shoulders = 0; shoulders < 2; ++shoulders) {
      put_turn(writer);
      put_point(writer);
    }
    for (std::uint64_t words = random_.next() % 8; words > 0; --words) put(writer, 56);
    bytes.resize(writer.finish());
    return bytes;
  }
  void put(codec::BitWriter& writer, unsigned bits) {
    writer.put(random_.next() & ((std::uint64_t{1} << bits) - 1), bits);
  }
  // Near, in as many bits as it says.
  void put_point(codec::BitWriter& writer) {
    constexpr unsigned kWidthMax = 30, kNearBits = 12;
    const auto said = static_cast<unsigned>(random_.next() % 32);
    const unsigned width = std::min(said, kWidthMax), used = std::min(width, kNearBits);
    writer.put(said, 5);
    for (int axis = 0; axis < 3; ++axis) {
      put(writer, used);
      writer.put(0, width - used);
    }
  }
  void put_rotation(codec::BitWriter& writer) { put(writer, 2 + 3 * codec::kRotationBits); }
  void put_turn(codec::BitWriter& writer) {
    constexpr unsigned kAnyRotation = 15;
    const auto width = static_cast<unsigned>(random_.next() % 16);
    writer.put(width, 4);
    if (width == kAnyRotation) {
      put_rotation(writer);
    } else {
      put(writer, 3 * width);
    }
  }

  // Another length, or a few other bits.
  void spoil(Bytes& bytes) {
    if (random_.next() % 4 == 0) {
      bytes.resize(random_.next() % (bytes.size() + 4), static_cast<std::uint8_t>(random_.next()));
      return;
    }
    for (std::uint64_t flips = 1 + random_.next() % 4; flips > 0; --flips)
      bytes[random_.next() % bytes.size()] ^= static_cast<std::uint8_t>(1u << random_.next() % 8);
  }

  Random random_;
  std::vector<std::vector<float>> deviations_ = all_deviations();
  std::vector<codec::CoefficientCode> codes_;
};

}  // namespace

Json frame_code_cases() {
  Maker maker;
  Json frames = Json::array(), spoilt = Json::array();
  std::vector<Bytes> all(kFrames);
  for (std::size_t n = 0; n < kFrames; ++n) frames.push_back(maker.frame(n, all[n]));
  for (std::size_t n = 0; n < kSpoiltFrames; ++n) spoilt.push_back(maker.spoilt(n, all[n % kFrames]));
  return {{"deviations", maker.deviations()}, {"frames", frames}, {"spoilt", spoilt}};
}

}  // namespace hairnet
