// Writes cases for a module for WebAssembly, and what the native functions give for them.
#include <hwy/targets.h>

#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>

#include "client/assets/made/made.hpp"
#include "client/files/write_file.hpp"
#include "core/levels/build.hpp"
#include "schema/codec/frame.hpp"
#include "schema/wire/basis_file.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_file.hpp"
#include "schema/wire/level_file.hpp"
#include "tests/support/learnt.hpp"
#include "tests/support/random_messages.hpp"
#include "tests/unit/client/small_basis.hpp"
#include "tests/wasm/header_session.hpp"
#include "tests/wasm/same_bits.hpp"
#include "tests/wasm/session.hpp"

namespace hairnet::same_bits {
namespace {

// The server runs 30 ticks a second, and its clock is 7000 s ahead of the client's, so that a mix-up of the clocks
// shows.
constexpr std::int64_t kTick_ns = 33'333'333;
constexpr std::int64_t kServerAhead_ns = 7'000'000'000'000;
// The numbers of members as the server gives them: the client's own, one with hair from the server, and one with learnt
// hair.
constexpr std::uint32_t kOwnMember = 31, kOther = 40, kLearntMember = 41;

Pose moved_pose(std::uint64_t tick, std::uint32_t member) {
  const double t = static_cast<double>(tick) / 30 + member;
  const Quat turn(Eigen::AngleAxisd(0.6 * std::sin(5 * t), Vec3(0.2, 1, 0.1).normalized()));
  return rigid_pose({turn, {0.1 * std::sin(3 * t), 1.6, 0.1 * std::cos(2 * t)}});
}

// Plays the server of a SessionClient, and stores each step: the client's answers to them decide what the server sends
// next.
class Recorder {
 public:
  explicit Recorder(const Bytes& groom) : groom_(groom), basis_(link::small_basis()), code_(basis_.basis.deviation_m) {
    file(groom_);
    basis_hash_ = file(wire::encode_basis(basis_.geometry, basis_.basis, basis_.skin));
    learnt_hash_ = file(wire::encode_learnt(support::random_learnt_hair(3)));
  }

  // Five seconds with poses at every second tick. At tick 70 the connection breaks, and the client comes back. One
  // frame in eleven is missing, so that play-out must bridge gaps.
  std::vector<Step> record() {
    step(StepKind::add, groom_);
    for (std::uint64_t tick = 1; tick < 150; ++tick) {
      now_ns_ += kTick_ns;
      if (tick % 2 == 0 && is_added_) step(StepKind::pose, written(moved_pose(tick, kOwnMember)));
      if (tick == 70) {
        step(StepKind::lose, {});
        is_welcomed_ = is_added_ = false;
      }
      if (is_welcomed_ && tick % 11 != 3) send_frames(tick);
      step(StepKind::pass, {});
    }
    return std::move(steps_);
  }

 private:
  wire::GroomHash file(Bytes bytes) {
    const wire::GroomHash hash = wire::hash_groom(bytes);
    files_[hash] = std::move(bytes);
    return hash;
  }

  void step(StepKind kind, Bytes bytes) {
    steps_.push_back({kind, now_ns_, std::move(bytes)});
    now_ns_ += 1'000'000;
    for (const Bytes& packet : client_.take(steps_.back())) answer(packet);
  }
  void send(wire::Message message) {
    step(StepKind::packet, wire::encode_packet({kServerAhead_ns + now_ns_, std::move(message)}));
  }

  void answer(const Bytes& packet) {
    const wire::DecodedPacket decoded = wire::decode_packet(packet);
    HAIRNET_ASSERT(decoded.error == wire::DecodeError::none);
    const wire::Message& message = decoded.envelope.message;
    if (std::holds_alternative<wire::Hello>(message)) welcome();
    if (const auto* offer = std::get_if<wire::GroomOffer>(&message)) send(wire::GroomNeed{offer->hash, 0});
    if (const auto* add = std::get_if<wire::AddCharacter>(&message)) {
      send(wire::GroomBasis{add->groom, basis_hash_});
      send(wire::CharacterAdded{add->character, add->groom, LevelIndex::low, kOwnMember});
      is_added_ = true;
    }
    if (const auto* request = std::get_if<wire::GroomRequest>(&message)) {
      const Bytes& wanted = files_.at(request->hash);
      const std::size_t half = request->offset + (wanted.size() - request->offset) / 2;
      for (const auto& [begin, end] : {std::pair(request->offset, half), std::pair(half, wanted.size())})
        send(wire::GroomData{request->hash, wanted.size(), begin,
                             Bytes(wanted.begin() + static_cast<std::ptrdiff_t>(begin),
                                   wanted.begin() + static_cast<std::ptrdiff_t>(end))});
    }
  }

  void welcome() {
    wire::Welcome welcome;
    welcome.session = ++session_;
    welcome.room = "hall";
    send(welcome);
    is_welcomed_ = true;
    const wire::GroomHash groom = wire::hash_groom(groom_);
    for (const std::uint32_t member : {kOther, kLearntMember}) {
      send(wire::GroomBasis{groom, basis_hash_});
      // The 9 is the session of the other members' client, which also sets the wind below.
      send(wire::MemberJoined{member, 9, member, groom, "member " + std::to_string(member)});
    }
    send(wire::GroomLearnt{groom, learnt_hash_});
    Wind wind;
    wind.mean_m_per_s = Vec3(1, 0, 2);
    send(wire::RoomWind{wind, 9});
  }

  void send_frames(std::uint64_t tick) {
    wire::FrameBatch batch;
    batch.tick = tick;
    // Frames show poses that were captured 20 ms earlier.
    batch.sample_time_ns = kServerAhead_ns + now_ns_ - 20'000'000;
    std::vector<Bytes> contents;
    std::vector<std::uint32_t> members;
    if (is_added_) members.push_back(kOwnMember);
    members.insert(members.end(), {kOther, kLearntMember});
    for (const std::uint32_t member : members) {
      std::vector<float> c;
      for (std::size_t k = 0; k < code_.mode_count(); ++k)
        c.push_back(0.05f / static_cast<float>(k + 1) *
                    std::sin(0.3f * static_cast<float>(tick + member) + static_cast<float>(k)));
      codec::EncodedFrame coded;
      codec::encode_frame(moved_pose(tick, member), &code_, c, 0, coded);
      // From tick 61 on the client computes the learnt member's hair itself, but for each ninth frame, which has
      // coefficients.
      const bool is_evaluated = member == kLearntMember && tick > 60 && tick % 9 != 0;
      // A frame has its first 4 to 12 coefficients, or none where the client computes the hair.
      const auto content = coded.prefix(is_evaluated ? 0 : 4 + tick % 9);
      contents.emplace_back(content.begin(), content.end());
      wire::Frame& frame = batch.frames.emplace_back();
      frame.member = member;
      frame.level = member == kLearntMember ? LevelIndex::learnt : LevelIndex::low;
      frame.discontinuous = member == kOther && tick == 50;
      frame.evaluated = is_evaluated;
    }
    for (std::size_t i = 0; i < contents.size(); ++i) batch.frames[i].content = contents[i];
    send(batch);
  }

  Bytes groom_;
  wire::HairBasis basis_;
  codec::CoefficientCode code_;
  wire::GroomHash basis_hash_{}, learnt_hash_{};
  std::map<wire::GroomHash, Bytes> files_;
  SessionClient client_;
  std::vector<Step> steps_;
  std::int64_t now_ns_ = 1'000'000'000;
  std::uint64_t session_ = 4;
  bool is_welcomed_ = false, is_added_ = false;
};

// Three members join, leave the line and come back.
Bytes session_case() {
  const Groom bob = make_hairstyle("bob", {.strand_count = 300}).value();
  return written(Recorder(wire::encode_groom(bob)).record());
}

Bytes all_cases(const Bytes& session) {
  Writer to;
  const Groom plait = make_hairstyle("plait", {.strand_count = 200}).value();
  put_case(to, "groom", "plait", wire::encode_groom(plait));
  for (const std::uint64_t seed : {3u, 4u, 5u})
    put_case(to, "groom", "random " + std::to_string(seed), wire::encode_groom(wire::RandomMessages(seed).groom(20)));
  const wire::HairBasis basis = link::small_basis();
  put_case(to, "basis", "waves", wire::encode_basis(basis.geometry, basis.basis, basis.skin));
  put_case(to, "learnt", "random", wire::encode_learnt(support::random_learnt_hair(5)));
  const Groom bob = make_hairstyle("bob", {.strand_count = 300}).value();
  const Bytes file = wire::encode_groom(bob);
  put_case(to, "session", "three members", session);
  put_case(to, "groom", "bob", file);
  put_case(to, "levels", "bob", wire::encode_levels(wire::hash_groom(file), *build_levels(bob)));
  return to.bytes();
}

bool write(const std::filesystem::path& path, std::span<const std::byte> bytes) {
  const auto written = write_file(path.string(), bytes);
  if (!written) std::fprintf(stderr, "hairnet-wasm-cases: %s: %s\n", path.c_str(), written.error().c_str());
  return written.has_value();
}

int write_all(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  // A module has no fused multiply-add: neither has SSE4.
  hwy::SetSupportedTargetsForTest(HWY_SSE4);
  const Bytes session = session_case(), cases = all_cases(session);
  const std::string expected = results_of(cases), by_header = header_results(session);
  return write(folder / "cases", std::as_bytes(std::span(cases))) &&
                 write(folder / "expected", std::as_bytes(std::span(expected))) &&
                 write(folder / "session", std::as_bytes(std::span(session))) &&
                 write(folder / "header_expected", std::as_bytes(std::span(by_header)))
             ? 0
             : 1;
}

}  // namespace
}  // namespace hairnet::same_bits

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: hairnet-wasm-cases FOLDER\n");
    return 2;
  }
  return hairnet::same_bits::write_all(argv[1]);
}
