#include "tests/load/attack_hands.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "schema/codec/hand_code.hpp"

namespace hairnet::load {
namespace {

// A session that the server has ended connects again after this time.
constexpr std::int64_t kRedial_ns = 250'000'000;
// The kHandShapesMax shapes of a sample are hands of four shapes each.
constexpr std::size_t kShapesOfHand = 4;
// The attacker has so many holds at a time. Each further hold waits for the release of the oldest one.
constexpr std::size_t kHeldAtOnce = 8;
// The attacker sends nothing while more bytes than this wait: a server that does not read has defended itself.
constexpr std::size_t kWaitingBytesMax = 1u << 20;

}  // namespace

AttackHands::AttackHands(const AttackContext& context, std::uint32_t host, HandsAttack attack)
    : Attacker(context, host, kRedial_ns),
      attack_(std::move(attack)),
      random_(host),
      hands_(attack_.hands_hz),
      holds_(attack_.holds_hz),
      props_(attack_.props_hz),
      bad_(attack_.bad_hz) {}

void AttackHands::begin(std::int64_t now_ns) {
  welcomed_ = false;
  members_.clear();
  held_.clear();
  wire::Hello hello;
  hello.client_name = "hairnet-load attacker";
  hello.room = attack_.room;
  send(std::move(hello), now_ns);
}

void AttackHands::hear(const wire::Message& message, std::int64_t now_ns) {
  if (std::holds_alternative<wire::Welcome>(message)) {
    welcomed_ = true;
    count("sessions");
    wire::PoseBatch poses;
    for (std::uint32_t character = 1; character <= attack_.characters; ++character) {
      send(wire::AddCharacter{character, context_->groom, LevelIndex::high}, now_ns);
      send(wire::SetTouch{character, TouchAudience::everyone}, now_ns);
      wire::PoseSample& sample = poses.poses.emplace_back();
      sample.character = character;
      sample.sequence = 1;
      sample.capture_time_ns = now_ns;
      sample.pose = rigid_pose({Quat::Identity(), any_place()});
    }
    send(std::move(poses), now_ns);
  } else if (const auto* joined = std::get_if<wire::MemberJoined>(&message)) {
    members_.push_back(joined->member);
  } else if (const auto* added = std::get_if<wire::CharacterAdded>(&message)) {
    members_.push_back(added->member);
  } else if (const auto* held = std::get_if<wire::Held>(&message)) {
    count(held->point_count > 0 ? "holds" : "holds_ended");
  }
}

void AttackHands::proceed(std::int64_t now_ns) {
  if (!welcomed_ || connection().unsent_bytes() > kWaitingBytesMax) return;
  while (const auto captured_ns = hands_.take(now_ns)) send_hands(*captured_ns, now_ns);
  while (holds_.take(now_ns)) send_hold(now_ns);
  while (props_.take(now_ns)) send_props(now_ns);
  while (bad_.take(now_ns)) send_bad(now_ns);
}

// Returns a random place among the heads of a room's clients, which stand in rows (kPlaceSpacing_m in client.cpp).
Vec3 AttackHands::any_place() {
  return {random_.between(-0.5, 5), random_.between(-0.5, 2), random_.between(-0.5, 1)};
}

void AttackHands::send_hands(std::int64_t captured_ns, std::int64_t now_ns) {
  wire::PoseBatch batch;
  wire::HandsSample& sample = batch.hands.emplace();
  sample.sequence = ++turn_;
  sample.capture_time_ns = captured_ns;
  for (std::size_t number = 0; number < kHandShapesMax; number += kShapesOfHand) {
    Hand& hand = sample.hands.emplace_back();
    hand.first_number = static_cast<std::uint8_t>(number);
    const Vec3 axis(random_.bell(), random_.bell(), 1 + random_.unit());
    hand.place = {Quat(Eigen::AngleAxisd(random_.between(-3, 3), axis.normalized())), any_place()};
    hand.has_jumped = random_.unit() < 0.2;
    const double size_m = random_.unit() < 0.1 ? kHandSizeMax_m : 0.1;
    while (hand.shapes.size() < kShapesOfHand) {
      const Vec3 end(size_m * random_.symmetric(), size_m * random_.symmetric(), 0);
      hand.shapes.push_back({end, -end, size_m * random_.between(0.01, 1), random_.unit() < 0.1});
    }
  }
  count("hands");
  send(std::move(batch), now_ns);
}

// Takes a hold, or releases the oldest one. A hold that ended in the tick in which it began would hold nothing, so
// several holds are kept at a time.
void AttackHands::send_hold(std::int64_t now_ns) {
  if (members_.empty()) return;
  if (held_.size() == kHeldAtOnce) {
    const wire::TakeHold& first = held_.front();
    send(wire::LetGo{first.member, first.hand, random_.unit() < 0.5 ? Release::pin : Release::drop}, now_ns);
    return held_.pop_front();
  }
  const std::uint32_t turn = holds_taken_++;
  const auto hand = static_cast<std::uint8_t>(turn % kHandShapesMax);
  held_.push_back({members_[turn % members_.size()], hand, Vec3f::Zero(), static_cast<float>(kGrabRadiusMax_m)});
  send(held_.back(), now_ns);
}

void AttackHands::send_props(std::int64_t now_ns) {
  wire::SetProps set;
  for (std::size_t number = 0; number < wire::kPropsMax; ++number)
    set.props.push_back({static_cast<std::uint8_t>(number), sphere(0.2), {Quat::Identity(), any_place()}, false});
  count("props");
  send(std::move(set), now_ns);
  if (attack_.characters == 0) return;
  const std::uint32_t turn = turn_++;
  const auto audience = turn % 2 == 0 ? TouchAudience::everyone : TouchAudience::oneself;
  send(wire::SetTouch{1 + turn % attack_.characters, audience}, now_ns);
}

void AttackHands::send_bad(std::int64_t now_ns) {
  count("bad_touches");
  const std::uint32_t turn = turn_++;
  if (turn % 4 == 0) {
    const Hand hand{0, {}, false, {{Vec3::Zero(), Vec3::Ones(), 0.1}}};
    wire::PoseBatch batch;
    batch.hands = wire::HandsSample{turn, now_ns, {hand}};
    std::vector<std::uint8_t> packet = wire::encode_packet({now_ns, std::move(batch)});
    // Any other byte could make the packet malformed, which ends the session.
    for (std::uint8_t& byte : std::ranges::search(packet, codec::encode_hands({&hand, 1})))
      byte = static_cast<std::uint8_t>(random_.next());
    return connection().send(packet);
  }
  // These three messages can be decoded, but their values must be refused: a place that is no number, a hand that does
  // not exist with a negative radius, and a character and a session that do not exist.
  const float nan = std::numeric_limits<float>::quiet_NaN();
  if (turn % 4 == 1)
    send(wire::TakeHold{1, 0, {nan, 0, 0}, 0.1f}, now_ns);
  else if (turn % 4 == 2)
    send(wire::TakeHold{1, 200, Vec3f::Zero(), -1e30f}, now_ns);
  else
    send(wire::SetTouch{1'000'000, TouchAudience::chosen, {~0ull}}, now_ns);
}

}  // namespace hairnet::load
