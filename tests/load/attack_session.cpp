#include "tests/load/attack_session.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <utility>

namespace hairnet::load {
namespace {

// A session that the server has ended connects again after this time. Those that attack by connecting do so at once.
constexpr std::int64_t kSessionRedial_ns = 250'000'000;
// The attacker sends nothing while more bytes than this wait: a server that does not read has defended itself.
constexpr std::size_t kSessionUnsentBytesMax = 1u << 20;
constexpr std::uint32_t kPosesPerPacket = 1024;
// The attacker asks for this many nearest members and for one more, in turn, so that each request changes something.
constexpr std::uint32_t kObservedCount = 64;
// A session that reads slowly takes its bytes in ten portions a second.
constexpr double kReads_hz = 10;

}  // namespace

AttackSession::AttackSession(const AttackContext& context, std::uint32_t host, SessionAttack attack)
    : Attacker(context, host, attack.stay == SessionAttack::Stay::stays ? kSessionRedial_ns : 0),
      attack_(std::move(attack)),
      poses_(attack_.pose_hz),
      observes_(attack_.observe_hz),
      winds_(attack_.wind_hz),
      churn_(attack_.churn_hz),
      appearances_(attack_.appearance_hz),
      bad_appearances_(attack_.bad_appearance_hz),
      reads_(attack_.read_bytes_per_s > 0 ? kReads_hz : 0),
      random_(host) {}

void AttackSession::begin(std::int64_t now_ns) {
  welcomed_ = false;
  wire::Hello hello;
  hello.client_name = "hairnet-load attacker";
  hello.room = attack_.room;
  hello.role = attack_.role;
  hello.session = session_;
  hello.secret = secret_;
  hello.signs_of_life = attack_.promises_signs_of_life;
  send(std::move(hello), now_ns);
}

void AttackSession::hear(const wire::Message& message, std::int64_t now_ns) {
  const auto* added = std::get_if<wire::CharacterAdded>(&message);
  const bool may_leave = added && added->character + 1 == end_ && attack_.stay == SessionAttack::Stay::resumes;
  if (const auto* welcome = std::get_if<wire::Welcome>(&message)) {
    welcomed_ = true;
    count(welcome->resumed ? "resumes" : "sessions");
    if (attack_.stay == SessionAttack::Stay::leaves) {
      send(wire::Goodbye{wire::GoodbyeReason::client_leaves, {}}, now_ns);
      return close(now_ns);
    }
    if (welcome->resumed) return close(now_ns);
    session_ = attack_.stay == SessionAttack::Stay::resumes ? welcome->session : 0;
    secret_ = welcome->secret;
    first_ = end_ = 1;
    while (end_ <= attack_.characters) add_character(now_ns);
  } else if (may_leave) {
    close(now_ns);
  }
}

void AttackSession::add_character(std::int64_t now_ns) {
  send(wire::AddCharacter{end_++, context_->groom, LevelIndex::high}, now_ns);
}

void AttackSession::proceed(std::int64_t now_ns) {
  if (!welcomed_) return;
  if (reads_.take(now_ns)) connection().limit_reading(attack_.read_bytes_per_s / static_cast<std::size_t>(kReads_hz));
  if (connection().unsent_bytes() > kSessionUnsentBytesMax) return;
  while (const auto captured_ns = poses_.take(now_ns)) send_poses(*captured_ns, now_ns);
  while (observes_.take(now_ns)) {
    wire::Observe observe;
    observe.mode = wire::ObserveMode::nearest;
    observe.count = kObservedCount + turn_++ % 2;
    send(std::move(observe), now_ns);
  }
  while (winds_.take(now_ns)) {
    wire::SetWind wind;
    wind.wind.mean_m_per_s = Vec3(1 + (attack_.wind_varies ? 0.01 * (turn_++ % 100) : 0), 0, 0);
    wind.wind.turbulence_rms_m_per_s = 1;
    send(std::move(wind), now_ns);
  }
  while (churn_.take(now_ns)) {
    if (turn_++ % 2 == 0)
      add_character(now_ns);
    else
      send(wire::RemoveCharacter{first_++}, now_ns);
  }
  while (connection().unsent_bytes() < kSessionUnsentBytesMax && appearances_.take(now_ns)) set_appearance(now_ns);
  while (bad_appearances_.take(now_ns)) send_bad_appearance(now_ns);
}

void AttackSession::set_appearance(std::int64_t now_ns) {
  wire::SetAppearance set;
  set.character = first_ + turn_++ % attack_.characters;
  set.tag = random_tag(wire::kTagBytesMax);
  set.appearance.emplace();
  set.appearance->roughness = static_cast<std::uint8_t>(random_.next());
  count("appearances");
  send(std::move(set), now_ns);
}

void AttackSession::send_bad_appearance(std::int64_t now_ns) {
  // A damaged packet ends the session, so most packets are well-formed and only not allowed.
  constexpr std::uint32_t kDamagedEvery = 256;
  count("bad_appearances");
  const std::uint32_t turn = turn_++;
  if (turn % kDamagedEvery == kDamagedEvery - 1) {
    std::vector<std::uint8_t> packet =
        wire::encode_packet({now_ns, wire::SetAppearance{first_, random_tag(wire::kTagBytesMax), wire::Appearance{}}});
    // The first four bytes are the packet's size. They stay, so that the server finds the next packet.
    for (std::size_t i = 4; i < packet.size(); ++i) packet[i] ^= static_cast<std::uint8_t>(random_.next());
    return connection().send(packet);
  }
  std::string too_long = random_tag(wire::kTagBytesMax + 1 + turn % 4096);
  if (turn % 3 == 0)
    send(wire::AddCharacter{end_, context_->groom, LevelIndex::high, {}, std::move(too_long), {}}, now_ns);
  else if (turn % 3 == 1)
    send(wire::SetAppearance{first_, std::move(too_long), wire::Appearance{}}, now_ns);
  else
    send(wire::SetAppearance{end_ + turn, random_tag(wire::kTagBytesMax), wire::Appearance{}}, now_ns);
}

std::string AttackSession::random_tag(std::size_t bytes) {
  std::string tag;
  while (tag.size() < bytes) {
    const auto eight = std::bit_cast<std::array<char, 8>>(random_.next());
    tag.append(eight.data(), eight.size());
  }
  tag.resize(bytes);
  return tag;
}

// Sends a pose of every character. The heads stand in rows of 32 and turn by up to 0.5 rad from side to side, about
// once a second. A riding character goes round a circle for 3 s and stands still for 1 s, in turn.
void AttackSession::send_poses(std::int64_t captured_ns, std::int64_t now_ns) {
  ++turn_;
  const double angle = attack_.moves ? 0.5 * std::sin(static_cast<double>(captured_ns) * 6e-9) : 0;
  wire::PoseSample sample;
  sample.sequence = turn_;
  sample.capture_time_ns = captured_ns;
  RigidTransform head;
  head.rotation = Quat(std::cos(angle / 2), 0, std::sin(angle / 2), 0);
  // A riding head moves along a circle for three of every four seconds and stands in the fourth, so that it starts and
  // stops again and again.
  constexpr double kRideRadius_m = 50;
  const double t = static_cast<double>(captured_ns) * 1e-9,
               ridden_s = 3 * std::floor(t / 4) + std::min(3.0, std::fmod(t, 4.0));
  const double turn = attack_.ride_m_per_s / kRideRadius_m * ridden_s;
  const Vec3 ride = attack_.ride_m_per_s > 0 ? Vec3(kRideRadius_m * std::cos(turn), 0, kRideRadius_m * std::sin(turn))
                                             : Vec3(Vec3::Zero());
  for (std::uint32_t begin = first_; begin < end_;) {
    wire::PoseBatch batch;
    for (; begin < end_ && batch.poses.size() < kPosesPerPacket; ++begin) {
      sample.character = begin;
      head.position = ride + Vec3(begin % 32, 0, begin / 32);
      sample.pose = rigid_pose(head);
      batch.poses.push_back(sample);
    }
    count("poses", batch.poses.size());
    send(std::move(batch), now_ns);
  }
}

}  // namespace hairnet::load
