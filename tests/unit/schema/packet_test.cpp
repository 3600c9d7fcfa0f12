#include <gtest/gtest.h>

#include <cstring>
#include <deque>
#include <limits>
#include <numeric>

#include "schema/codec/hand_code.hpp"
#include "schema/wire/earlier_pose.hpp"
#include "schema/wire/messages.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/unit/schema/equal.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Bytes encode(const Message& message) {
  return encode_packet({1, message});
}

// The decoder's error for a message that is encoded unchanged.
DecodeError round_trip_error(const Message& message) {
  return decode_packet(encode(message)).error;
}

// Decodes each packet on its own heap block, so that a sanitizer detects a read past the end.
DecodeError decode_error(const Bytes& packet) {
  return decode_packet(packet).error;
}

// Each kind of message is drawn 200 times, with random values in all of its fields.
TEST(Packet, gives_back_every_message_of_random_content) {
  RandomMessages random(1);
  for (int round = 0; round < 200; ++round) {
    for (std::size_t kind = 0; kind < kMessageKinds; ++kind) {
      const Envelope sent = random.envelope(kind);
      ASSERT_EQ(sent.message.index(), kind);
      const Bytes packet = encode_packet(sent);
      const DecodedPacket got = decode_packet(packet);
      ASSERT_EQ(got.error, DecodeError::none) << "kind " << kind << ": " << got.detail;
      EXPECT_EQ(got.envelope.clock_ns, sent.clock_ns);
      EXPECT_TRUE(equal(got.envelope.message, sent.message)) << "kind " << kind;
    }
  }
}

TEST(Packet, has_its_size_and_identifier_where_the_protocol_says) {
  RandomMessages random(2);
  for (std::size_t kind = 0; kind < kMessageKinds; ++kind) {
    const Bytes packet = encode_packet(random.envelope(kind));
    ASSERT_GE(packet.size(), kPacketBytesMin);
    const std::uint32_t counted = packet[0] | packet[1] << 8 | packet[2] << 16 | packet[3] << 24;
    EXPECT_EQ(counted, packet.size() - 4);
    EXPECT_EQ(std::memcmp(packet.data() + 8, "HNET", 4), 0);
  }
}

TEST(Packet, is_the_same_bytes_for_the_same_message) {
  for (std::size_t kind = 0; kind < kMessageKinds; ++kind) {
    RandomMessages once(3 + kind), again(3 + kind);
    EXPECT_EQ(encode_packet(once.envelope(kind)), encode_packet(again.envelope(kind)));
  }
}

TEST(Packet, is_refused_at_every_truncation) {
  RandomMessages random(4);
  for (std::size_t kind = 0; kind < kMessageKinds; ++kind) {
    const Bytes packet = encode_packet(random.envelope(kind));
    for (std::size_t n = 0; n < packet.size(); ++n)
      EXPECT_EQ(decode_error(Bytes(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(n))),
                DecodeError::malformed);
  }
}

// Cuts a packet and corrects its size prefix, so that only the decoder can notice. FlatBuffers may pad the end by up to
// 7 bytes, whose loss changes nothing; any other cut must be refused.
TEST(Packet, loses_nothing_but_padding_by_a_truncation_whose_prefix_agrees) {
  RandomMessages random(5);
  for (std::size_t kind = 0; kind < kMessageKinds; ++kind) {
    const Envelope sent = random.envelope(kind);
    const Bytes packet = encode_packet(sent);
    for (std::size_t n = 4; n < packet.size(); ++n) {
      Bytes cut(packet.begin(), packet.begin() + static_cast<std::ptrdiff_t>(n));
      const auto counted = static_cast<std::uint32_t>(n - 4);
      std::memcpy(cut.data(), &counted, 4);
      const DecodedPacket got = decode_packet(cut);
      if (n + 8 > packet.size() && got.error == DecodeError::none) {
        EXPECT_TRUE(equal(got.envelope.message, sent.message)) << "kind " << kind << ", " << n << " bytes";
      } else {
        EXPECT_EQ(got.error, DecodeError::malformed) << "kind " << kind << ", " << n << " bytes";
      }
    }
  }
}

TEST(Packet, is_refused_with_extra_bytes) {
  RandomMessages random(6);
  for (std::size_t kind = 0; kind < kMessageKinds; ++kind) {
    Bytes packet = encode_packet(random.envelope(kind));
    packet.push_back(0);
    EXPECT_EQ(decode_error(packet), DecodeError::malformed);
  }
}

TEST(Packet, is_refused_with_another_identifier) {
  Bytes packet = encode(RemoveCharacter{7});
  std::memcpy(packet.data() + 8, "HNGR", 4);
  EXPECT_EQ(decode_error(packet), DecodeError::malformed);
}

// A buffer may begin at any address, while FlatBuffers read aligned numbers. The eight shifts are all alignments of 8
// bytes.
TEST(Packet, is_decoded_at_any_address) {
  RandomMessages random(7);
  for (std::size_t kind = 0; kind < kMessageKinds; ++kind) {
    const Envelope sent = random.envelope(kind);
    const Bytes packet = encode_packet(sent);
    for (std::size_t shift = 0; shift < 8; ++shift) {
      Bytes shifted(shift, 0xFF);
      shifted.insert(shifted.end(), packet.begin(), packet.end());
      const DecodedPacket got = decode_packet(std::span(shifted).subspan(shift));
      ASSERT_EQ(got.error, DecodeError::none);
      EXPECT_TRUE(equal(got.envelope.message, sent.message));
    }
  }
}

// A packet with a single flipped bit is refused, or gives a valid message that can be encoded again.
TEST(Packet, survives_every_flipped_bit) {
  RandomMessages random(8);
  for (std::size_t kind = 0; kind < kMessageKinds; ++kind) {
    Bytes packet = encode_packet(random.envelope(kind));
    for (std::size_t bit = 0; bit < 8 * packet.size(); ++bit) {
      const auto mask = static_cast<std::uint8_t>(1u << bit % 8);
      packet[bit / 8] ^= mask;
      const DecodedPacket got = decode_packet(packet);
      EXPECT_EQ(got.error == DecodeError::none, got.detail.empty());
      if (got.error == DecodeError::none) {
        EXPECT_EQ(decode_packet(encode_packet(got.envelope)).error, DecodeError::none) << "kind " << kind;
      }
      packet[bit / 8] ^= mask;
    }
  }
}

TEST(Packet, above_the_limit_is_too_large_with_any_content) {
  EXPECT_EQ(decode_error(Bytes(kPacketBytesMax + 1)), DecodeError::too_large);
  EXPECT_EQ(decode_error(Bytes(kPacketBytesMax)), DecodeError::malformed);
}

TEST(Packet, is_not_written_above_the_limit) {
  FrameBatch batch;
  const Bytes content(110);
  // 40 000 frames of 110 bytes are 4.4 MB, above kPacketBytesMax of 4 194 304.
  for (std::uint32_t member = 1; member <= 40'000; ++member) {
    batch.frames.emplace_back().member = member;
    batch.frames.back().content = content;
  }
  EXPECT_TRUE(encode(batch).empty());
}

// A server fills a packet by frame_bytes(). If the sum were too low, the packet could not be written, and all frames
// of a tick would be lost.
TEST(Packet, carries_as_many_frames_as_frame_bytes_promises) {
  RandomMessages random(9);
  FrameBatch batch;
  std::size_t bytes = 0;
  std::deque<Bytes> contents;
  while (true) {
    Frame frame = random.frame(contents.emplace_back());
    frame.content = contents.back();
    frame.member = batch.frames.empty() ? 1 : batch.frames.back().member + 1000;
    bytes += frame_bytes(frame);
    if (bytes > kPacketBytesMax - kPacketOverheadBytesMax) break;
    batch.frames.push_back(frame);
  }
  const Bytes packet = encode(batch);
  EXPECT_FALSE(packet.empty());
  EXPECT_EQ(decode_error(packet), DecodeError::none);
}

TEST(Packet, carries_the_largest_chunk_and_pose_batch) {
  EXPECT_EQ(round_trip_error(GroomChunk{{}, 0, Bytes(kGroomChunkBytesMax)}), DecodeError::none);
  EXPECT_EQ(round_trip_error(GroomChunk{{}, 0, Bytes(kGroomChunkBytesMax + 1)}), DecodeError::invalid);
  EXPECT_EQ(round_trip_error(GroomChunk{{}, 0, {}}), DecodeError::invalid);
  PoseBatch batch;
  batch.poses.resize(kPosesPerBatchMax);
  EXPECT_EQ(round_trip_error(batch), DecodeError::none);
  batch.poses.resize(kPosesPerBatchMax + 1);
  EXPECT_EQ(round_trip_error(batch), DecodeError::invalid);
}

TEST(Packet, of_hands_that_are_encoded_already_is_that_of_the_hands) {
  RandomMessages random(5);
  RoomHands hands{9, 8, {}};
  EncodedRoomHands encoded{9, 8, {}};
  std::deque<std::vector<std::uint8_t>> bytes;
  for (std::uint64_t session = 1; session <= 64; ++session) {
    hands.people.push_back({session, random.hands()});
    encoded.people.push_back({session, bytes.emplace_back(codec::encode_hands(hands.people.back().hands))});
  }
  EXPECT_EQ(encode_room_hands(7, encoded), encode_packet({7, hands}));
}

TEST(Packet, carries_hands_of_as_many_people_as_a_message_may_name) {
  RoomHands hands;
  const Hand ball{0, {}, false, {{Vec3::Zero(), Vec3::Zero(), 0.04}}};
  for (std::uint64_t session = 1; session <= kMembersPerMessageMax; ++session)
    hands.people.push_back({session, {ball}});
  const DecodedPacket decoded = decode_packet(encode_packet({7, hands}));
  ASSERT_EQ(decoded.error, DecodeError::none) << decoded.detail;
  EXPECT_EQ(std::get<RoomHands>(decoded.envelope.message).people.size(), kMembersPerMessageMax);
}

TEST(Packet, with_an_enum_out_of_range_is_invalid) {
  const auto no_level = static_cast<LevelIndex>(kLevelCount);
  EXPECT_EQ(round_trip_error(AddCharacter{1, {}, no_level}), DecodeError::invalid);
  EXPECT_EQ(round_trip_error(SetLevel{1, no_level}), DecodeError::invalid);
  EXPECT_EQ(round_trip_error(CharacterAdded{1, {}, no_level}), DecodeError::invalid);
  EXPECT_EQ(round_trip_error(GroomStatus{{}, static_cast<GroomState>(4)}), DecodeError::invalid);
  EXPECT_EQ(round_trip_error(Error{static_cast<ErrorReason>(static_cast<int>(kErrorReasonLast) + 1), 0, {}, {}}),
            DecodeError::invalid);
  EXPECT_EQ(round_trip_error(Error{}), DecodeError::invalid) << "an error without a reason";
  EXPECT_EQ(round_trip_error(Goodbye{static_cast<GoodbyeReason>(static_cast<int>(kGoodbyeReasonLast) + 1), {}}),
            DecodeError::invalid);
  EXPECT_EQ(round_trip_error(Goodbye{}), DecodeError::invalid) << "a goodbye without a reason";
}

TEST(Packet, with_a_time_out_of_range_is_invalid) {
  // Times may have an absolute value of at most kTimeMax_ns, which is 2^61.
  constexpr std::int64_t kFar_ns = std::numeric_limits<std::int64_t>::max();
  EXPECT_EQ(decode_error(encode_packet({kFar_ns, RemoveCharacter{1}})), DecodeError::invalid);
  EXPECT_EQ(decode_error(encode_packet({-kFar_ns, RemoveCharacter{1}})), DecodeError::invalid);
  EXPECT_EQ(round_trip_error(FrameBatch{0, kFar_ns, {}}), DecodeError::invalid);
  EXPECT_EQ(round_trip_error(PoseBatch{{PoseSample{1, 1, kFar_ns, false, {}}}}), DecodeError::invalid);
}

TEST(Packet, with_an_unusable_welcome_or_offer_is_invalid) {
  // The third number of a Welcome is the tick rate, from 1 to kTickRateMax_hz.
  EXPECT_EQ(round_trip_error(Welcome{1, 1, 0, 0, 1, 1}), DecodeError::invalid);
  EXPECT_EQ(round_trip_error(Welcome{1, 1, kTickRateMax_hz + 1, 0, 1, 1}), DecodeError::invalid);
  EXPECT_EQ(round_trip_error(GroomOffer{{}, 0}), DecodeError::invalid);
}

// The decoder accepts a pose that is not valid. One bad pose must not cost the others of its batch, so the session
// checks each.
TEST(Packet, delivers_invalid_poses_for_the_session_to_judge) {
  PoseBatch batch;
  batch.poses.resize(2);
  batch.poses[0].pose[Bone::neck].position.x() = kNan;
  const DecodedPacket got = decode_packet(encode(batch));
  ASSERT_EQ(got.error, DecodeError::none);
  const auto& poses = std::get<PoseBatch>(got.envelope.message).poses;
  EXPECT_EQ(validate_pose(poses[0].pose), PoseRefusal::not_finite);
  EXPECT_EQ(validate_pose(poses[1].pose), PoseRefusal::none);
}

TEST(Packet, delivers_invalid_materials_and_winds_for_the_session_to_judge) {
  SetMaterial material{7, {}};
  material.scale.density = static_cast<float>(kNan);
  SetWind wind;
  wind.wind.mean_m_per_s.x() = 1e9;
  const DecodedPacket got_material = decode_packet(encode(material)), got_wind = decode_packet(encode(wind));
  ASSERT_EQ(got_material.error, DecodeError::none);
  ASSERT_EQ(got_wind.error, DecodeError::none);
  EXPECT_NE(validate(std::get<SetMaterial>(got_material.envelope.message).scale), "");
  EXPECT_NE(validate(std::get<SetWind>(got_wind.envelope.message).wind), "");
}

TEST(Packet, rounds_poses_as_rounded_to_wire_does) {
  RandomMessages random(11);
  Pose pose = random.pose();
  for (RigidTransform& bone : pose.bones) {
    // The factor changes the doubles, but is far below the precision of the numbers on the wire.
    bone.position *= 1 + 1e-10;
    bone.rotation.coeffs() *= 1 + 1e-10;
  }
  const DecodedPacket got = decode_packet(encode(PoseBatch{{PoseSample{1, 1, 0, false, pose}}}));
  const Pose received = std::get<PoseBatch>(got.envelope.message).poses.at(0).pose;
  EXPECT_TRUE(equal(received, rounded_to_wire(pose)));
  EXPECT_FALSE(equal(received, pose));
}

TEST(Packet, carries_earlier_poses_rounded) {
  RandomMessages random(12);
  for (int i = 0; i < 200; ++i) {
    const PoseSample later{7, 2, 50'000'000, false, random.pose()};
    PoseSample earlier{7, 0xffffffff, 20'000'000, false, later.pose};
    for (RigidTransform& bone : earlier.pose.bones) {
      const Vec3 axis(random.real(-1, 1), random.real(-1, 1), random.real(0.1, 1));
      bone.rotation = Quat(Eigen::AngleAxisd(random.real(-2, 2), axis.normalized())) * bone.rotation;
      bone.position += Vec3(random.real(-1.6, 1.6), random.real(-1.6, 1.6), random.real(-1.6, 1.6));
    }
    const auto fitting = to_earlier(earlier, later);
    ASSERT_TRUE(fitting);
    const DecodedPacket got = decode_packet(encode(PoseBatch{{later}, {*fitting}}));
    ASSERT_EQ(got.error, DecodeError::none) << got.detail;
    const auto& batch = std::get<PoseBatch>(got.envelope.message);
    ASSERT_EQ(batch.earlier.size(), 1u);
    const PoseSample sample = from_earlier(batch.earlier[0], batch.poses.at(0));
    EXPECT_EQ(sample.character, 7u);
    EXPECT_EQ(sample.sequence, 0xffffffffu);
    EXPECT_EQ(sample.capture_time_ns, 20'000'000);
    EXPECT_FALSE(sample.teleport);
    EXPECT_TRUE(equal(sample.pose, rounded_to_wire(sample.pose)));
    for (std::size_t b = 0; b < kBoneCount; ++b) {
      const RigidTransform &is = sample.pose.bones[b], &was = earlier.pose.bones[b];
      // These are the errors that from_earlier() promises: rotations of 0.1 mrad, positions of 0.025 mm an axis, and
      // the rounding to floats.
      EXPECT_LE(2 * (is.rotation * was.rotation.conjugate()).vec().norm(), 1e-4);
      const double rounding_m = 2.5e-5 + 1e-7 * was.position.cwiseAbs().maxCoeff() + 1e-9;
      EXPECT_LE((is.position - was.position).cwiseAbs().maxCoeff(), rounding_m);
    }
  }
}

// An earlier pose is sent as its difference from a later one in few bits. The limits are 1.6 m, 120 degrees, 4 s (2^32
// ns) and 65535 of the sequence; the earlier pose must not be the later one.
TEST(EarlierPose, is_none_of_a_pose_that_differs_too_much) {
  const PoseSample later{7, 100'000, 5'000'000'000, false, rigid_pose({})};
  const auto fits = [&](auto&& change) {
    PoseSample sample = later;
    --sample.sequence;
    change(sample);
    return to_earlier(sample, later).has_value();
  };
  EXPECT_TRUE(fits([](PoseSample&) {}));
  EXPECT_FALSE(fits([](PoseSample& p) { p.capture_time_ns += 1; }));
  EXPECT_FALSE(fits([](PoseSample& p) { p.capture_time_ns -= std::int64_t{1} << 32; }));
  EXPECT_FALSE(fits([](PoseSample& p) { ++p.sequence; }));
  // With the one that `fits` takes off, the sequences differ by 65536.
  EXPECT_FALSE(fits([](PoseSample& p) { p.sequence -= 65'535; }));
  EXPECT_FALSE(fits([](PoseSample& p) { p.pose[Bone::neck].position.x() = 1.7; }));
  EXPECT_FALSE(fits([](PoseSample& p) { p.pose[Bone::neck].position.x() = kNan; }));
  EXPECT_FALSE(fits([](PoseSample& p) { p.pose[Bone::neck].rotation.coeffs().setConstant(kNan); }));
  // The quaternion's w is below 0.5, so the turn is of more than 120 degrees.
  const Quat too_far(0.49, 0, std::sqrt(1 - 0.49 * 0.49), 0);
  EXPECT_FALSE(fits([&](PoseSample& p) { p.pose[Bone::neck].rotation = too_far; }));
  EXPECT_TRUE(fits([](PoseSample& p) { p.pose[Bone::head].rotation.coeffs() *= -1; })) << "the same rotation";
}

TEST(Packet, with_earlier_poses_of_no_pose_or_with_too_many_is_invalid) {
  const auto pose = [](std::uint32_t character) { return PoseSample{character, 9, 0, false, rigid_pose({})}; };
  const auto before = [](std::uint32_t character, std::uint16_t sequence_before) {
    EarlierPose earlier;
    earlier.character = character;
    earlier.sequence_before = sequence_before;
    return earlier;
  };
  // An earlier pose counts back from the character's own pose in the batch, by at least one sequence number, and its
  // time is not before -kTimeMax_ns.
  PoseBatch batch{{pose(7), pose(8)}, {before(8, 1)}};
  EXPECT_EQ(round_trip_error(batch), DecodeError::none);
  batch.earlier = {before(9, 1)};
  EXPECT_EQ(round_trip_error(batch), DecodeError::invalid);
  batch.earlier = {before(8, 0)};
  EXPECT_EQ(round_trip_error(batch), DecodeError::invalid);
  batch.earlier.assign(kEarlierPosesMax, before(7, 1));
  EXPECT_EQ(round_trip_error(batch), DecodeError::none);
  batch.earlier.push_back(before(7, 1));
  EXPECT_EQ(round_trip_error(batch), DecodeError::invalid);
  batch.earlier = {before(7, 1)};
  batch.earlier[0].captured_before_ns = 1;
  batch.poses[0].capture_time_ns = -kTimeMax_ns;
  EXPECT_EQ(round_trip_error(batch), DecodeError::invalid);
}

TEST(Packet, with_generations_of_some_frames_only_is_invalid) {
  FrameBatch batch;
  for (const std::uint32_t member : {5u, 6u}) batch.frames.emplace_back().member = member;
  batch.generations = {0xa7, 0xb8};
  Bytes packet = encode(batch);
  EXPECT_EQ(std::get<FrameBatch>(decode_packet(packet).envelope.message).generations, batch.generations);
  // The generations lie in the packet as their number, 2, and their bytes. A number of 1 leaves one of the two frames
  // without a generation.
  const Bytes vector{2, 0, 0, 0, 0xa7, 0xb8};
  const auto found = std::ranges::search(packet, vector);
  ASSERT_FALSE(found.empty());
  *found.begin() = 1;
  EXPECT_EQ(decode_packet(packet).error, DecodeError::invalid);
}

TEST(Packet, with_a_bad_frame_is_invalid) {
  const Bytes content{1, 2, 3};
  Frame valid;
  valid.level = LevelIndex::low;
  valid.content = content;
  const auto error_of = [&](auto&& corrupt) {
    Frame first = valid, second = valid;
    first.member = 5;
    second.member = 6;
    corrupt(second);
    return round_trip_error(FrameBatch{1, 1, {first, second}, nullptr});
  };
  EXPECT_EQ(error_of([](Frame&) {}), DecodeError::none);
  EXPECT_EQ(error_of([](Frame& f) { f.member = 5; }), DecodeError::invalid) << "twice the same";
  EXPECT_EQ(error_of([](Frame& f) { f.member = 4; }), DecodeError::invalid) << "descending";
  EXPECT_EQ(error_of([](Frame& f) { f.level = static_cast<LevelIndex>(kLevelCount); }), DecodeError::invalid);
  EXPECT_EQ(error_of([](Frame& f) { f.step_stride = 8; }), DecodeError::invalid);
}

// Replaces each four bytes of a valid packet by a huge number, so that each count and offset is wrong once. A packet
// that is still accepted must have no more frames than the valid one.
TEST(Packet, with_an_absurd_count_is_refused_without_the_memory_for_it) {
  FrameBatch batch;
  batch.frames.resize(1);
  batch.frames[0].member = 1;
  const Bytes valid = encode(batch);
  for (std::size_t at = 0; at + 4 <= valid.size(); at += 4) {
    for (const std::uint32_t count : {0x7FFFFFFFu, 0xFFFFFFFFu, 0x10000000u}) {
      Bytes packet = valid;
      std::memcpy(packet.data() + at, &count, 4);
      const DecodedPacket got = decode_packet(packet);
      if (got.error != DecodeError::none) continue;
      EXPECT_LE(std::get<FrameBatch>(got.envelope.message).frames.size(), 1u);
    }
  }
}

TEST(Packet, makes_text_fit_to_travel) {
  const auto sent_name = [](std::string name) {
    const DecodedPacket got = decode_packet(encode(Hello{1, std::move(name), {}, {}, Role::participant, 0, {}}));
    EXPECT_EQ(got.error, DecodeError::none);
    return std::get<Hello>(got.envelope.message).client_name;
  };
  EXPECT_EQ(sent_name("plain"), "plain");
  // Control characters would let a name write escape sequences to a terminal, so each becomes a question mark.
  EXPECT_EQ(sent_name(std::string("a\0b\x1b[31m\n", 9)), "a?b?[31m?");
  EXPECT_EQ(sent_name("\xff\xc3"), "??");
  EXPECT_EQ(sent_name(std::string(kTextBytesMax + 100, 'x')).size(), kTextBytesMax);
}

TEST(Packet, has_a_name_for_every_reason) {
  for (std::uint8_t r = 0; r <= static_cast<std::uint8_t>(kErrorReasonLast); ++r)
    EXPECT_STRNE(to_string(static_cast<ErrorReason>(r)), "unknown");
  for (std::uint8_t r = 0; r <= static_cast<std::uint8_t>(kGoodbyeReasonLast); ++r)
    EXPECT_STRNE(to_string(static_cast<GoodbyeReason>(r)), "unknown");
  // The last DecodeError and the last PoseRefusal have the number 3.
  for (std::uint8_t r = 0; r <= 3; ++r) EXPECT_STRNE(to_string(static_cast<DecodeError>(r)), "unknown");
  for (std::uint8_t r = 0; r <= 3; ++r) EXPECT_STRNE(to_string(static_cast<PoseRefusal>(r)), "unknown");
}

}  // namespace
}  // namespace hairnet::wire
