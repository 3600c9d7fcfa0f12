#include "schema/wire/flatbuffer_convert.hpp"

namespace hairnet::wire {
namespace {

fb::Transform flatten(const RigidTransform& bone) {
  const Eigen::Vector4f q = bone.rotation.coeffs().cast<float>();
  const Vec3f p = bone.position.cast<float>();
  return {fb::Quaternion(q.x(), q.y(), q.z(), q.w()), wire::flatten(p)};
}

RigidTransform copy_out(const fb::Transform& bone) {
  const fb::Quaternion& q = bone.rotation();
  return {Quat(q.w(), q.x(), q.y(), q.z()), wire::copy_out(bone.position()).cast<double>()};
}

}  // namespace

fb::Hash flatten(const GroomHash& hash) {
  fb::Hash flat;
  static_assert(sizeof flat == sizeof hash);
  std::memcpy(&flat, hash.data(), sizeof flat);
  return flat;
}

GroomHash copy_out(const fb::Hash& hash) {
  GroomHash out;
  std::memcpy(out.data(), &hash, sizeof out);
  return out;
}

fb::Secret flatten(const SessionSecret& secret) {
  fb::Secret flat;
  static_assert(sizeof flat == sizeof secret);
  std::memcpy(&flat, secret.data(), sizeof flat);
  return flat;
}

SessionSecret copy_out(const fb::Secret& secret) {
  SessionSecret out;
  std::memcpy(out.data(), &secret, sizeof out);
  return out;
}

fb::Bones flatten(const Pose& pose) {
  return {flatten(pose[Bone::head]), flatten(pose[Bone::neck]), flatten(pose[Bone::left_shoulder]),
          flatten(pose[Bone::right_shoulder]), flatten(pose[Bone::upper_trunk])};
}

Pose copy_out(const fb::Bones& bones) {
  Pose pose;
  pose[Bone::head] = copy_out(bones.head());
  pose[Bone::neck] = copy_out(bones.neck());
  pose[Bone::left_shoulder] = copy_out(bones.left_shoulder());
  pose[Bone::right_shoulder] = copy_out(bones.right_shoulder());
  pose[Bone::upper_trunk] = copy_out(bones.upper_trunk());
  return pose;
}

AlignedBytes::AlignedBytes(std::span<const std::uint8_t> bytes) : bytes_(bytes) {
  if (reinterpret_cast<std::uintptr_t>(bytes.data()) % alignof(std::uint64_t) == 0) return;
  copy_.resize((bytes.size() + sizeof(std::uint64_t) - 1) / sizeof(std::uint64_t));
  std::memcpy(copy_.data(), bytes.data(), bytes.size());
  bytes_ = {reinterpret_cast<const std::uint8_t*>(copy_.data()), bytes.size()};
}

fb::MaterialScale flatten(const MaterialScale& s) {
  return {s.stiffness, s.damping, s.density, s.ether_damping, s.air_drag, s.gel_per_s2};
}

MaterialScale copy_out(const fb::MaterialScale& s) {
  return {s.stiffness(), s.damping(), s.density(), s.ether_damping(), s.air_drag(), s.gel_per_s2()};
}

fb::Wind flatten(const Wind& w) {
  const Vec3& mean = w.mean_m_per_s;
  return {mean.x(), mean.y(), mean.z(), w.gust_ratio, w.gust_period_s, w.turbulence_rms_m_per_s, w.turbulence_scale_m,
          w.seed};
}

Wind copy_out(const fb::Wind& w) {
  return {{w.mean_x(), w.mean_y(), w.mean_z()}, w.gust_ratio(),         w.gust_period_s(),
          w.turbulence_rms_m_per_s(),           w.turbulence_scale_m(), w.seed()};
}

}  // namespace hairnet::wire
