#pragma once

#include <boost/describe.hpp>

#include "core/groom/groom.hpp"
#include "schema/wire/messages.hpp"
#include "schema/wire/recording.hpp"

// The fields of everything that goes over the wire or into a file, in the order of their structs. Tests compare,
// draw and print a struct with this list, so a new struct needs one line here, and a new field one word. equal(),
// RandomMessages and others read the list through for_each_field().
namespace hairnet {

BOOST_DESCRIBE_STRUCT(RigidTransform, (), (rotation, position))
BOOST_DESCRIBE_STRUCT(Pose, (), (bones))
BOOST_DESCRIBE_STRUCT(Material, (),
                      (axial_stiffness_n, attachment_stiffness_n_per_m, damping_ratio, linear_density_kg_per_m,
                       air_drag_ns_per_m2, ether_mass_ratio, ether_stiffness_per_s2, ether_damping_ratio, root_length_m,
                       thickness_m, metaball_potential_j))
BOOST_DESCRIBE_STRUCT(GroupMaterial, (), (group, material))
BOOST_DESCRIBE_STRUCT(LearntWind, (), (weights, max_m_per_s, error, low_error))
BOOST_DESCRIBE_STRUCT(LearntHair, (),
                      (hidden_count, mode_count, input_weights, hidden_weights, bias, output_weights, most, error,
                       low_error, wind))
BOOST_DESCRIBE_STRUCT(MaterialScale, (), (stiffness, damping, density, ether_damping, air_drag, gel_per_s2))
BOOST_DESCRIBE_STRUCT(Wind, (),
                      (mean_m_per_s, gust_ratio, gust_period_s, turbulence_rms_m_per_s, turbulence_scale_m, seed,
                       carried))
BOOST_DESCRIBE_STRUCT(Lattice, (), (origin, spacing, dims))
BOOST_DESCRIBE_STRUCT(LevelGeometry, (),
                      (lattice, active_nodes, trimmed_nodes, trimmed_begin, trimmed_from, trimmed_weights))

BOOST_DESCRIBE_STRUCT(PointRange, (), (begin, end))
BOOST_DESCRIBE_STRUCT(StrandProperties, (), (radius_m, hair_count, root_length_m, group, rooted))
BOOST_DESCRIBE_STRUCT(RootBlend, (), (points))
BOOST_DESCRIBE_STRUCT(Clump, (), (strand, copy_count, radius_m, tip_radius_m))
BOOST_DESCRIBE_STRUCT(Thread, (),
                      (points, group, rooted, root_length_m, radius_m, colour, axial_stiffness_n, damping_time_s,
                       pin_stiffness_n_per_m, linear_density_kg_per_m, air_drag_ns_per_m2))
BOOST_DESCRIBE_STRUCT(HairCard, (), (points, properties))
BOOST_DESCRIBE_STRUCT(Cloth, (),
                      (points, group, triangles, root_distance_m, root_length_m, colour, opacity,
                       stretch_stiffness_n_per_m, shear_stiffness_n_per_m, damping_time_s, pin_stiffness_n_per_m,
                       area_density_kg_per_m2, air_drag_ns_per_m3))
BOOST_DESCRIBE_STRUCT(Knot, (), (points, stiffness_n_per_m, damping_time_s, mass_kg))
BOOST_DESCRIBE_STRUCT(TriangleMesh, (), (vertices, triangles))
BOOST_DESCRIBE_STRUCT(Body, (), (mesh, bone_weights, joints, fitted_from_roots))
BOOST_DESCRIBE_STRUCT(Groom, (),
                      (name, points, strand_begin, strands, group_names, materials, root_blends, clumps, threads, cards,
                       cloths, knots, body))

BOOST_DESCRIBE_STRUCT(SimulationInputs::Add, (), (character, groom, room, levels_ready, level, pose, owner))
BOOST_DESCRIBE_STRUCT(SimulationInputs::Level, (), (character, level))
BOOST_DESCRIBE_STRUCT(SimulationInputs::Material, (), (character, scale))
BOOST_DESCRIBE_STRUCT(SimulationInputs::Stride, (), (character, stride))
BOOST_DESCRIBE_STRUCT(SimulationInputs::Suspension, (), (character, suspended))
BOOST_DESCRIBE_STRUCT(SimulationInputs::State, (), (character, displacements, velocities))
BOOST_DESCRIBE_STRUCT(SimulationInputs::RoomWind, (), (room, wind))
BOOST_DESCRIBE_STRUCT(SimulationInputs::BonePose, (), (character, teleport, pose))
BOOST_DESCRIBE_STRUCT(TouchKey, (), (toucher, number))
BOOST_DESCRIBE_STRUCT(TouchShape, (), (half_size_m, radius_m, is_inside_out))
BOOST_DESCRIBE_STRUCT(TouchBody, (), (key, shape, place, has_jumped, only_own))
BOOST_DESCRIBE_STRUCT(HandShape, (), (from, to, radius_m, is_inside_out))
BOOST_DESCRIBE_STRUCT(Hand, (), (first_number, place, has_jumped, shapes))
BOOST_DESCRIBE_STRUCT(TouchRule, (), (audience, chosen))
BOOST_DESCRIBE_STRUCT(Grab, (), (hand, place, radius_m))
BOOST_DESCRIBE_STRUCT(SimulationInputs::RoomBodies, (), (room, bodies))
BOOST_DESCRIBE_STRUCT(SimulationInputs::Rule, (), (character, rule))
BOOST_DESCRIBE_STRUCT(SimulationInputs::LetGo, (), (character, hand, release))
BOOST_DESCRIBE_STRUCT(SimulationInputs::TakeHold, (), (character, grab))

namespace wire {

BOOST_DESCRIBE_STRUCT(Hello, (),
                      (protocol_version, client_name, room, token, role, session, secret, message_max, redirects,
                       datagram_layout, trace, signs_of_life))
BOOST_DESCRIBE_STRUCT(GroomOffer, (), (hash, byte_count))
BOOST_DESCRIBE_STRUCT(GroomChunk, (), (hash, offset, bytes))
BOOST_DESCRIBE_STRUCT(HairState, (), (step_m, displacements, velocities))
BOOST_DESCRIBE_STRUCT(Srgb, (), (red, green, blue))
BOOST_DESCRIBE_STRUCT(Appearance, (), (hair_root, hair_tip, skin, roughness))
BOOST_DESCRIBE_STRUCT(AddCharacter, (), (character, groom, level, state, tag, appearance))
BOOST_DESCRIBE_STRUCT(SetAppearance, (), (character, tag, appearance))
BOOST_DESCRIBE_STRUCT(SetLevel, (), (character, level))
BOOST_DESCRIBE_STRUCT(RemoveCharacter, (), (character))
BOOST_DESCRIBE_STRUCT(PoseSample, (), (character, sequence, capture_time_ns, teleport, pose))
BOOST_DESCRIBE_STRUCT(HandsSample, (), (sequence, capture_time_ns, hands))
BOOST_DESCRIBE_STRUCT(EarlierPose::Bone, (), (turn, move))
BOOST_DESCRIBE_STRUCT(EarlierPose, (), (captured_before_ns, character, sequence_before, bones))
BOOST_DESCRIBE_STRUCT(PoseBatch, (), (poses, earlier, hands))
BOOST_DESCRIBE_STRUCT(SetTouch, (), (character, audience, chosen))
BOOST_DESCRIBE_STRUCT(TakeHold, (), (member, hand, place, radius_m))
BOOST_DESCRIBE_STRUCT(LetGo, (), (member, hand, release))
BOOST_DESCRIBE_STRUCT(Prop, (), (number, shape, place, has_jumped))
BOOST_DESCRIBE_STRUCT(SetProps, (), (props, removed))
BOOST_DESCRIBE_STRUCT(SetMaterial, (), (character, scale))
BOOST_DESCRIBE_STRUCT(SetWind, (), (wind))
BOOST_DESCRIBE_STRUCT(Observe, (), (mode, count, radius_m, from, members, stride, error_m, bytes_per_s))
BOOST_DESCRIBE_STRUCT(MemberImportance, (), (member, screen_height, in_view))
BOOST_DESCRIBE_STRUCT(ReportImportance, (), (members))
BOOST_DESCRIBE_STRUCT(GroomRequest, (), (hash, offset))
BOOST_DESCRIBE_STRUCT(EvaluateLearnt, (), (groom, learnt))
BOOST_DESCRIBE_STRUCT(Moderate, (), (action, session, subject, seconds, reason))
BOOST_DESCRIBE_STRUCT(ServerAt, (), (host, port))
BOOST_DESCRIBE_STRUCT(Welcome, (),
                      (protocol_version, session, tick_rate_hz, tick, character_count_max, groom_bytes_max, room,
                       secret, resumed, resume_grace_s, pose_delay_ns, may_set_wind, others, signs_of_life, may_touch,
                       may_set_props))
BOOST_DESCRIBE_STRUCT(GroomNeed, (), (hash, offset))
BOOST_DESCRIBE_STRUCT(GroomStatus, (), (hash, state))
BOOST_DESCRIBE_STRUCT(GroomData, (), (hash, byte_count, offset, bytes))
BOOST_DESCRIBE_STRUCT(CharacterAdded, (), (character, groom, level, member, generation))
BOOST_DESCRIBE_STRUCT(MemberJoined, (), (member, session, character, groom, tag, appearance, generation))
BOOST_DESCRIBE_STRUCT(MemberChanged, (), (member, tag, appearance))
BOOST_DESCRIBE_STRUCT(RoomWind, (), (wind, session))
BOOST_DESCRIBE_STRUCT(RoomProps, (), (props, removed, all))
BOOST_DESCRIBE_STRUCT(MemberTouch, (), (member, audience, chosen))
BOOST_DESCRIBE_STRUCT(Held, (), (member, hand, point_count))
BOOST_DESCRIBE_STRUCT(RoomHands::Person, (), (session, hands))
BOOST_DESCRIBE_STRUCT(RoomHands, (), (tick, sample_time_ns, people))
BOOST_DESCRIBE_STRUCT(MemberLeft, (), (member))
BOOST_DESCRIBE_STRUCT(CharacterRemoved, (), (character))
BOOST_DESCRIBE_STRUCT(GroomBasis, (), (groom, basis))
BOOST_DESCRIBE_STRUCT(GroomLearnt, (), (groom, learnt))
BOOST_DESCRIBE_STRUCT(Frame, (), (member, level, discontinuous, asleep, evaluated, step_stride, content))
BOOST_DESCRIBE_STRUCT(FrameBatch, (), (tick, sample_time_ns, frames, generations))
BOOST_DESCRIBE_STRUCT(Redirect, (), (to))
BOOST_DESCRIBE_STRUCT(Error, (), (reason, character, groom, detail))
BOOST_DESCRIBE_STRUCT(Goodbye, (), (reason, detail))

BOOST_DESCRIBE_STRUCT(RecordingHeader, (), (tick_rate_hz, substep_count, iterations, gravity, wind))
BOOST_DESCRIBE_STRUCT(RecordedGroom, (), (bytes))
BOOST_DESCRIBE_STRUCT(RecordedLearnt, (), (groom, hair))
BOOST_DESCRIBE_STRUCT(RecordedTick, (),
                      (tick, sample_time_ns, removed, added, levels, materials, strides, suspensions, states, winds,
                       poses, touch_rules, bodies, releases, grabs, state_hash))

}  // namespace wire

// Calls visit(name, pointer to member) for each field of T, in order.
template <class T>
void for_each_field(auto&& visit) {
  boost::mp11::mp_for_each<boost::describe::describe_members<T, boost::describe::mod_public>>(
      [&](auto field) { visit(field.name, field.pointer); });
}

}  // namespace hairnet
