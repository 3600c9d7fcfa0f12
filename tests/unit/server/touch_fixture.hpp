#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <utility>
#include <vector>

#include "server/tick/scheduler.hpp"
#include "tests/support/contact_places.hpp"
#include "tests/support/levels.hpp"

namespace hairnet::server {

inline constexpr std::int64_t kTouchStart_ns = 1'000'000'000'000, kTick_ns = 33'333'333, kDelay_ns = 25'000'000;
inline constexpr wire::GroomHash kGroom{7};
inline const Vec3 kHead{0, 1.5, 0};
// This place is within the hair, in front of the face.
inline const Vec3 kInHair = kHead + Vec3(0, -0.07, 0.11);
// Ann owns the character, Ben has the hands, and Eve looks on.
inline constexpr SessionId kAnn = 1, kBen = 2, kEve = 3;

// Stores the messages and the hands that a session gets; frames are left out.
class FakeTouchSink final : public ObserverSink {
 public:
  void push(const wire::Message& message, std::int64_t) override { messages.push_back(message); }
  void push_encoded(const wire::Message& message, std::vector<std::uint8_t> packet, std::int64_t) override {
    EXPECT_EQ(wire::decode_packet(packet).envelope.message.index(), message.index());
    messages.push_back(message);
  }
  void push_frames(std::vector<FramePacket> packets) override {
    for (const FramePacket& packet : packets) {
      if (packet.frame_count > 0) continue;
      EXPECT_EQ(packet.may_be_lost, packet.bytes.size() <= datagram_max);
      hands.push_back(std::get<wire::RoomHands>(wire::decode_packet(packet.bytes).envelope.message));
    }
  }
  bool drop_if_congested() override { return false; }
  [[nodiscard]] std::size_t datagram_bytes_max() const override { return datagram_max; }
  [[nodiscard]] bool takes_room_hands() const override { return knows_hands; }

  template <class Message>
  [[nodiscard]] std::vector<Message> all() const {
    std::vector<Message> found;
    for (const wire::Message& message : messages) {
      if (const auto* one = std::get_if<Message>(&message)) found.push_back(*one);
    }
    return found;
  }
  std::vector<wire::Message> messages;
  std::vector<wire::RoomHands> hands;
  std::size_t datagram_max = 0;
  bool knows_hands = true;
};

inline std::shared_ptr<const LevelSet> make_touch_levels() {
  auto levels = std::make_shared<LevelSet>();
  for (std::size_t i = 0; i < 4; ++i) {
    levels->levels[i] = support::make_random_level({.nodes_per_axis = 6 - static_cast<int>(i),
                                                    .spring_stiffness = 0.2f,
                                                    .attachment_stiffness = 0.5f,
                                                    .contact_count = 300});
  }
  return levels;
}

inline Hand ball_hand(const Vec3& place) {
  return {0, {Quat::Identity(), place}, false, {{Vec3::Zero(), Vec3::Zero(), 0.04}}};
}

inline wire::Prop ball_prop(std::uint8_t number, const Vec3& place) {
  return {number, sphere(0.04), {Quat::Identity(), place}};
}

// A scheduler with its queue of commands. A test calls tick() to let a thirtieth of a second pass.
class TouchTest : public testing::Test {
 protected:
  TouchTest() { start(nullptr); }
  void start(Recorder* recorder) {
    scheduler_ = std::make_unique<Scheduler>(SchedulerDef{}, commands_, room_counters_, counters_, recorder);
    commands_.put(GroomReady{kGroom, levels_, nullptr});
  }
  std::shared_ptr<FakeTouchSink> open(SessionId session, std::vector<wire::Prop> props = {}, bool resumed = false) {
    auto sink = std::make_shared<FakeTouchSink>();
    OpenSession open{session, sink, "hall"};
    open.props = std::move(props);
    open.resumed = resumed;
    commands_.put(std::move(open));
    return sink;
  }
  void say(SessionId session, wire::ClientMessage message) { commands_.put(FromClient{session, std::move(message)}); }
  // Adds character 1 of the session with one pose, so its head does not move.
  void add(SessionId session, const Vec3& head = kHead) {
    say(session, wire::AddCharacter{1, kGroom, LevelIndex::high});
    const std::int64_t at_ns = next_ns() - kDelay_ns;
    commands_.put(PutPoses{session, next_ns(), {{1, 1, at_ns, false, rigid_pose({Quat::Identity(), head})}}});
  }
  void put_hands(SessionId session, std::vector<Hand> hands) {
    commands_.put(PutHands{session, next_ns(), {++sequence_, next_ns() - kDelay_ns, std::move(hands)}});
  }
  void tick() {
    scheduler_->run_tick({tick_, next_ns()}, next_ns());
    ++tick_;
  }
  void ticks(int count) {
    for (int t = 0; t < count; ++t) tick();
  }
  // Ben's hand moves evenly from one place to another.
  void move(const Vec3& from, const Vec3& to, int tick_count) {
    for (int t = 1; t <= tick_count; ++t) {
      put_hands(kBen, {ball_hand(from + (to - from) * t / tick_count)});
      tick();
    }
  }
  void stroke() { move(kInHair - Vec3(0.1, 0, 0), kInHair + Vec3(0.1, 0, 0), 20); }
  [[nodiscard]] std::int64_t next_ns() const { return kTouchStart_ns + static_cast<std::int64_t>(tick_) * kTick_ns; }
  [[nodiscard]] LatticeView hair(SessionId owner = kAnn) const {
    return scheduler_->simulation().lattice(character_key(owner, 1));
  }
  [[nodiscard]] std::vector<Vec3f> displacement(SessionId owner = kAnn) const {
    const auto displacement = hair(owner).displacement;
    return {displacement.begin(), displacement.end()};
  }
  [[nodiscard]] std::vector<Vec3> points() const { return support::contact_places(hair()); }
  [[nodiscard]] std::uint32_t held_count() const {
    return scheduler_->simulation().held_count(character_key(kAnn, 1), {kBen, 0});
  }
  // Ann allows everyone to touch her hair, and Ben's hand takes hold of all hair within 8 cm.
  void take_hold() {
    say(kAnn, wire::SetTouch{1, TouchAudience::everyone});
    put_hands(kBen, {ball_hand(kInHair)});
    say(kBen, wire::TakeHold{1, 0, Vec3f::Zero(), 0.08f});
    tick();
    ASSERT_GT(held_count(), 0u);
  }

  const std::shared_ptr<const LevelSet> levels_ = make_touch_levels();
  CommandQueue commands_{1 << 20};
  RoomCounters room_counters_;
  TickCounters counters_;
  std::unique_ptr<Scheduler> scheduler_;
  std::uint64_t tick_ = 1;
  std::uint32_t sequence_ = 0;
};

}  // namespace hairnet::server
