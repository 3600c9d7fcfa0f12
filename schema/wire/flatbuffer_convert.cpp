#include "schema/wire/flatbuffer_convert.hpp"

namespace hairnet::wire {

// Core has its own TouchAudience, Release and LevelIndex. They must have the numbers of enums.fbs, since conversions
// only cast.
static_assert(kTouchAudienceNames[3] == "everyone" && TouchAudience::everyone == TouchAudience{3});
static_assert(kReleaseNames[2] == "unpin" && Release::unpin == Release{2});
static_assert(kLevelNames == kLevelIndexNames, "core/levels/level.hpp and enums.fbs list the same levels");

fb::Transform to_flatbuffer(const RigidTransform& bone) {
  // Coordinates are doubles in core and floats on the wire. The conversion is the rounding that rounded_to_wire()
  // repeats.
  const Eigen::Vector4f q = bone.rotation.coeffs().cast<float>();
  const Vec3f p = bone.position.cast<float>();
  return {fb::Quaternion(q.x(), q.y(), q.z(), q.w()), to_flatbuffer(p)};
}

RigidTransform from_flatbuffer(const fb::Transform& bone) {
  const fb::Quaternion& q = bone.rotation();
  return {Quat(q.w(), q.x(), q.y(), q.z()), from_flatbuffer(bone.position()).cast<double>()};
}

fb::Hash to_flatbuffer(const GroomHash& hash) {
  fb::Hash flat;
  static_assert(sizeof flat == sizeof hash);
  // The struct of 32 bytes has no padding, and no byte order.
  std::memcpy(&flat, hash.data(), sizeof flat);
  return flat;
}

GroomHash from_flatbuffer(const fb::Hash& hash) {
  GroomHash out;
  std::memcpy(out.data(), &hash, sizeof out);
  return out;
}

fb::Secret to_flatbuffer(const SessionSecret& secret) {
  fb::Secret flat;
  static_assert(sizeof flat == sizeof secret);
  std::memcpy(&flat, secret.data(), sizeof flat);
  return flat;
}

SessionSecret from_flatbuffer(const fb::Secret& secret) {
  SessionSecret out;
  std::memcpy(out.data(), &secret, sizeof out);
  return out;
}

fb::Bones to_flatbuffer(const Pose& pose) {
  return {to_flatbuffer(pose[Bone::head]), to_flatbuffer(pose[Bone::neck]), to_flatbuffer(pose[Bone::left_shoulder]),
          to_flatbuffer(pose[Bone::right_shoulder]), to_flatbuffer(pose[Bone::upper_trunk])};
}

Pose from_flatbuffer(const fb::Bones& bones) {
  Pose pose;
  pose[Bone::head] = from_flatbuffer(bones.head());
  pose[Bone::neck] = from_flatbuffer(bones.neck());
  pose[Bone::left_shoulder] = from_flatbuffer(bones.left_shoulder());
  pose[Bone::right_shoulder] = from_flatbuffer(bones.right_shoulder());
  pose[Bone::upper_trunk] = from_flatbuffer(bones.upper_trunk());
  return pose;
}

AlignedBytes::AlignedBytes(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
  // Most packets come aligned from the PacketSplitter, and cost no copy.
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(std::uint64_t) == 0) return;
  copy_.resize((bytes.size() + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t));
  std::memcpy(copy_.data(), bytes.data(), bytes.size());
  HAIRNET_ASSERT(copy_.size() * sizeof(std::uint64_t) >= bytes.size());
  bytes_ = {reinterpret_cast<const std::uint8_t*>(copy_.data()), bytes.size()};
}

fb::MaterialScale to_flatbuffer(const MaterialScale& s) {
  return {s.stiffness, s.damping, s.density, s.ether_damping, s.air_drag, s.gel_per_s2};
}

MaterialScale from_flatbuffer(const fb::MaterialScale& s) {
  return {s.stiffness(), s.damping(), s.density(), s.ether_damping(), s.air_drag(), s.gel_per_s2()};
}

fb::Appearance to_flatbuffer(const Appearance& appearance) {
  const auto srgb = [](const Srgb& c) { return fb::Srgb(c.red, c.green, c.blue); };
  return {srgb(appearance.hair_root), srgb(appearance.hair_tip), srgb(appearance.skin), appearance.roughness};
}

Appearance from_flatbuffer(const fb::Appearance& appearance) {
  const auto srgb = [](const fb::Srgb& c) { return Srgb{c.red(), c.green(), c.blue()}; };
  return {srgb(appearance.hair_root()), srgb(appearance.hair_tip()), srgb(appearance.skin()), appearance.roughness()};
}

fb::Wind to_flatbuffer(const Wind& w) {
  const Vec3& mean = w.mean_m_per_s;
  return {mean.x(), mean.y(), mean.z(), w.gust_ratio, w.gust_period_s, w.turbulence_rms_m_per_s, w.turbulence_scale_m,
          w.seed};
}

Wind from_flatbuffer(const fb::Wind& w, bool carried) {
  return {{w.mean_x(), w.mean_y(), w.mean_z()},
          w.gust_ratio(),
          w.gust_period_s(),
          w.turbulence_rms_m_per_s(),
          w.turbulence_scale_m(),
          w.seed(),
          carried};
}

}  // namespace hairnet::wire
