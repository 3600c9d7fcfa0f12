#pragma once

#include <algorithm>
#include <tuple>

#include "core/groom/groom.hpp"
#include "schema/wire/messages.hpp"
#include "schema/wire/recording.hpp"

// Compares field by field and bit by bit (no tolerance).
namespace hairnet::wire {

inline bool equal(const RigidTransform& a, const RigidTransform& b) {
  return a.rotation.coeffs() == b.rotation.coeffs() && a.position == b.position;
}

inline bool equal(const Pose& a, const Pose& b) {
  return std::equal(a.bones.begin(), a.bones.end(), b.bones.begin(),
                    [](const RigidTransform& x, const RigidTransform& y) { return equal(x, y); });
}

inline bool equal(const StrandProperties& a, const StrandProperties& b) {
  const auto all = [](const StrandProperties& s) {
    return std::tie(s.radius_m, s.hair_count, s.root_length_m, s.group, s.rooted);
  };
  return all(a) == all(b);
}

inline bool equal(const PointRange& a, const PointRange& b) {
  return a.begin == b.begin && a.end == b.end;
}
inline bool equal(const RootBlend& a, const RootBlend& b) {
  return a.points == b.points;
}
inline bool equal(const Clump& a, const Clump& b) {
  const auto all = [](const Clump& c) { return std::tie(c.strand, c.copy_count, c.radius_m, c.tip_radius_m); };
  return all(a) == all(b);
}
inline bool equal(const Thread& a, const Thread& b) {
  const auto all = [](const Thread& t) {
    return std::tie(t.group, t.rooted, t.root_length_m, t.radius_m, t.colour, t.axial_stiffness_n, t.damping_time_s,
                    t.pin_stiffness_n_per_m, t.linear_density_kg_per_m, t.air_drag_ns_per_m2);
  };
  return equal(a.points, b.points) && all(a) == all(b);
}
inline bool equal(const HairCard& a, const HairCard& b) {
  return equal(a.points, b.points) && equal(a.properties, b.properties);
}
inline bool equal(const FarCard& a, const FarCard& b) {
  const auto all = [](const FarCard& s) { return std::tie(s.root_length_m, s.strand_count, s.group, s.rooted); };
  return equal(a.points, b.points) && all(a) == all(b);
}
inline bool equal(const Cloth& a, const Cloth& b) {
  const auto all = [](const Cloth& c) {
    return std::tie(c.group, c.triangles, c.root_distance_m, c.root_length_m, c.colour, c.opacity,
                    c.stretch_stiffness_n_per_m, c.shear_stiffness_n_per_m, c.damping_time_s, c.pin_stiffness_n_per_m,
                    c.area_density_kg_per_m2, c.air_drag_ns_per_m3);
  };
  return equal(a.points, b.points) && all(a) == all(b);
}
inline bool equal(const Knot& a, const Knot& b) {
  const auto all = [](const Knot& k) { return std::tie(k.points, k.stiffness_n_per_m, k.damping_time_s, k.mass_kg); };
  return all(a) == all(b);
}

template <class T>
bool equal(const std::vector<T>& a, const std::vector<T>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const T& x, const T& y) {
    if constexpr (requires { x == y; }) {
      return x == y;
    } else {
      return equal(x, y);
    }
  });
}

inline bool equal(const Hello& a, const Hello& b) {
  const auto all = [](const Hello& h) {
    return std::tie(h.protocol_version, h.client_name, h.room, h.token, h.role, h.session, h.secret);
  };
  return all(a) == all(b);
}
inline bool equal(const HairState& a, const HairState& b) {
  const auto all = [](const HairState& s) { return std::tie(s.level, s.step_m, s.displacements, s.velocities); };
  return all(a) == all(b);
}
inline bool equal(const GroomOffer& a, const GroomOffer& b) {
  return a.hash == b.hash && a.byte_count == b.byte_count;
}
inline bool equal(const GroomChunk& a, const GroomChunk& b) {
  return a.hash == b.hash && a.offset == b.offset && a.bytes == b.bytes;
}
inline bool equal(const AddCharacter& a, const AddCharacter& b) {
  return a.character == b.character && a.groom == b.groom && a.level == b.level &&
         a.state.has_value() == b.state.has_value() && (!a.state || equal(*a.state, *b.state));
}
inline bool equal(const SetLevel& a, const SetLevel& b) {
  return a.character == b.character && a.level == b.level;
}
inline bool equal(const RemoveCharacter& a, const RemoveCharacter& b) {
  return a.character == b.character;
}
inline bool equal(const PoseSample& a, const PoseSample& b) {
  return std::tie(a.character, a.sequence, a.capture_time_ns, a.teleport) ==
             std::tie(b.character, b.sequence, b.capture_time_ns, b.teleport) &&
         equal(a.pose, b.pose);
}
inline bool equal(const PoseBatch& a, const PoseBatch& b) {
  return equal(a.poses, b.poses);
}
inline bool equal(const Welcome& a, const Welcome& b) {
  const auto all = [](const Welcome& w) {
    return std::tie(w.protocol_version, w.session, w.tick_rate_hz, w.tick, w.character_count_max, w.groom_bytes_max,
                    w.room, w.secret, w.resumed, w.resume_grace_s, w.pose_delay_ns);
  };
  return all(a) == all(b);
}
inline bool equal(const GroomNeed& a, const GroomNeed& b) {
  return a.hash == b.hash && a.offset == b.offset;
}
inline bool equal(const GroomStatus& a, const GroomStatus& b) {
  return a.hash == b.hash && a.state == b.state;
}
inline bool equal(const CharacterAdded& a, const CharacterAdded& b) {
  return a.character == b.character && a.groom == b.groom && a.level == b.level && a.member == b.member;
}
inline bool equal(const CharacterRemoved& a, const CharacterRemoved& b) {
  return a.character == b.character;
}
inline bool equal(const LevelGeometry& a, const LevelGeometry& b) {
  const auto all = [](const LevelGeometry& g) {
    return std::tie(g.lattice.dims, g.active_nodes, g.trimmed_nodes, g.trimmed_begin, g.trimmed_from,
                    g.trimmed_weights);
  };
  return a.lattice.origin == b.lattice.origin && a.lattice.spacing == b.lattice.spacing && all(a) == all(b);
}
inline bool equal(const LevelRecord& a, const LevelRecord& b) {
  return a.groom == b.groom && a.level == b.level && equal(a.geometry, b.geometry);
}
inline bool equal(const Frame& a, const Frame& b) {
  const auto all = [](const Frame& f) {
    return std::tie(f.member, f.level, f.error_class, f.discontinuous, f.asleep, f.velocities, f.order, f.stride,
                    f.step_stride);
  };
  return all(a) == all(b) && std::equal(a.content.begin(), a.content.end(), b.content.begin(), b.content.end());
}
inline bool equal(const FrameBatch& a, const FrameBatch& b) {
  return a.tick == b.tick && a.sample_time_ns == b.sample_time_ns && equal(a.frames, b.frames);
}
inline bool equal(const Observe& a, const Observe& b) {
  const auto all = [](const Observe& o) {
    return std::tie(o.mode, o.count, o.radius_m, o.from, o.members, o.error_class, o.stride, o.velocities);
  };
  return all(a) == all(b);
}
inline bool equal(const MemberImportance& a, const MemberImportance& b) {
  return a.member == b.member && a.screen_height == b.screen_height && a.in_view == b.in_view;
}
inline bool equal(const ReportImportance& a, const ReportImportance& b) {
  return equal(a.members, b.members);
}
inline bool equal(const RequestKeyframes& a, const RequestKeyframes& b) {
  return a.members == b.members;
}
inline bool equal(const GroomRequest& a, const GroomRequest& b) {
  return a.hash == b.hash && a.offset == b.offset;
}
inline bool equal(const GroomData& a, const GroomData& b) {
  return a.hash == b.hash && a.byte_count == b.byte_count && a.offset == b.offset && a.bytes == b.bytes;
}
inline bool equal(const MemberJoined& a, const MemberJoined& b) {
  return a.member == b.member && a.session == b.session && a.character == b.character && a.groom == b.groom;
}
inline bool equal(const MemberLeft& a, const MemberLeft& b) {
  return a.member == b.member;
}
inline bool equal(const Error& a, const Error& b) {
  return std::tie(a.reason, a.character, a.groom, a.detail) == std::tie(b.reason, b.character, b.groom, b.detail);
}
inline bool equal(const Goodbye& a, const Goodbye& b) {
  return a.reason == b.reason && a.detail == b.detail;
}

inline bool equal(const SetMaterial& a, const SetMaterial& b) {
  return a.character == b.character && a.scale == b.scale;
}
inline bool equal(const Wind& a, const Wind& b) {
  const auto all = [](const Wind& w) {
    return std::tie(w.mean_m_per_s, w.gust_ratio, w.gust_period_s, w.turbulence_rms_m_per_s, w.turbulence_scale_m,
                    w.seed);
  };
  return all(a) == all(b);
}
inline bool equal(const SetWind& a, const SetWind& b) {
  return equal(a.wind, b.wind);
}

inline bool equal(const Groom& a, const Groom& b) {
  const auto all = [](const Groom& g) {
    return std::tie(g.name, g.group_names, g.points, g.strand_begin, g.body.mesh.vertices, g.body.mesh.triangles,
                    g.body.bone_weights, g.body.joints, g.body.fitted_from_roots, g.materials);
  };
  return all(a) == all(b) && equal(a.strands, b.strands) && equal(a.root_blends, b.root_blends) &&
         equal(a.clumps, b.clumps) && equal(a.threads, b.threads) && equal(a.cards, b.cards) &&
         equal(a.cloths, b.cloths) && equal(a.knots, b.knots) && a.far_cards.points == b.far_cards.points &&
         equal(a.far_cards.cards, b.far_cards.cards);
}

inline bool equal(const RecordingHeader& a, const RecordingHeader& b) {
  const auto all = [](const RecordingHeader& h) {
    return std::tie(h.tick_rate_hz, h.substep_count, h.iterations, h.gravity);
  };
  return all(a) == all(b) && equal(a.wind, b.wind);
}
inline bool equal(const RecordedGroom& a, const RecordedGroom& b) {
  return a.bytes == b.bytes;
}
inline bool equal(const RecordedAdd& a, const RecordedAdd& b) {
  return std::tie(a.character, a.groom, a.room, a.levels_ready, a.level) ==
             std::tie(b.character, b.groom, b.room, b.levels_ready, b.level) &&
         equal(a.pose, b.pose);
}
inline bool equal(const RecordedLevel& a, const RecordedLevel& b) {
  return a.character == b.character && a.level == b.level;
}
inline bool equal(const RecordedMaterial& a, const RecordedMaterial& b) {
  return a.character == b.character && a.scale == b.scale;
}
inline bool equal(const RecordedPose& a, const RecordedPose& b) {
  return a.character == b.character && a.teleport == b.teleport && equal(a.pose, b.pose);
}
inline bool equal(const RecordedStride& a, const RecordedStride& b) {
  return a.character == b.character && a.stride == b.stride;
}
inline bool equal(const RecordedSuspension& a, const RecordedSuspension& b) {
  return a.character == b.character && a.suspended == b.suspended;
}
inline bool equal(const RecordedState& a, const RecordedState& b) {
  return a.character == b.character && a.displacements == b.displacements && a.velocities == b.velocities;
}
inline bool equal(const RecordedWind& a, const RecordedWind& b) {
  return a.room == b.room && equal(a.wind, b.wind);
}
inline bool equal(const RecordedTick& a, const RecordedTick& b) {
  return std::tie(a.tick, a.sample_time_ns, a.state_hash, a.removed) ==
             std::tie(b.tick, b.sample_time_ns, b.state_hash, b.removed) &&
         equal(a.added, b.added) && equal(a.levels, b.levels) && equal(a.poses, b.poses) &&
         equal(a.materials, b.materials) && equal(a.strides, b.strides) && equal(a.suspensions, b.suspensions) &&
         equal(a.states, b.states) && equal(a.winds, b.winds);
}

// Two variants of the same alternative.
template <class... T>
bool equal(const std::variant<T...>& a, const std::variant<T...>& b) {
  return a.index() == b.index() &&
         std::visit([&](const auto& x) { return equal(x, std::get<std::decay_t<decltype(x)>>(b)); }, a);
}

}  // namespace hairnet::wire
