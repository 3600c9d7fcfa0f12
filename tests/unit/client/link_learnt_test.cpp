#include <gmock/gmock.h>

#include <cmath>
#include <map>

#include "core/random.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/learnt_file.hpp"
#include "tests/support/learnt.hpp"
#include "tests/unit/client/link_core_driver.hpp"
#include "tests/unit/client/small_basis.hpp"

namespace hairnet::link {
namespace {

constexpr std::uint32_t kMember = 40;
// Bounds the distance (distance_m()) of hair that is evaluated here from hair that the server evaluates. Networks that
// began at different times differ by at most 2.4 mm RMS after kLearntSettled_ticks, in nearly all clips
// (learnt_hair.hpp).
constexpr float kNear_m = 5e-3f;
// Bounds the distance while the jump from the hair that was shown to the hair of the server is spread over some frames.
constexpr float kSurprise_m = 0.2f;
constexpr std::uint64_t kSettled = kLearntSettled_ticks;

Pose moved_pose(std::uint64_t tick, std::uint32_t member = kMember) {
  const double t = static_cast<double>(tick) / 30 + member;
  const Quat turn(Eigen::AngleAxisd(0.6 * std::sin(5 * t), Vec3(0.2, 1, 0.1).normalized()));
  return rigid_pose({turn, {0.1 * std::sin(3 * t), 1.6, 0.1 * std::cos(2 * t)}});
}

// Returns random weights of moderate size: hair follows the head within a third of a second, and moves by some
// centimetres.
LearntHair hair_like() {
  LearntHair hair = support::random_learnt_hair(3);
  std::fill_n(hair.bias.begin(), hair.hidden_count, -1.0f);
  for (float& weight : hair.output_weights) weight *= 0.5f;
  return hair;
}

// Returns the Euclidean distance of two sets of coefficients. The rounding of 12 coefficients makes 0.1 mm of it, so
// tests allow 0.2 mm for hair that is shown as it was sent.
float distance_m(std::span<const float> a, std::span<const float> b) {
  EXPECT_EQ(a.size(), b.size());
  float squares = 0;
  for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) squares += std::pow(a[k] - b[k], 2.0f);
  return std::sqrt(squares);
}

// The hair of one character as a server steps it, from tick 0 on.
class ServedHair {
 public:
  ServedHair(const LearntHair& hair, std::uint32_t member)
      : hair_(&hair), member_(member), coefficients_(small_basis().basis.mode_count()) {}
  const std::vector<float>& at(std::uint64_t tick) {
    for (; tick_ < tick; ++tick_) {
      const Pose from = moved_pose(tick_, member_), to = moved_pose(tick_ + 1, member_);
      LearntMotion motion{
          .state = &state_, .from = &from, .to = &to, .begins = tick_ == 0, .coefficients = coefficients_};
      step_learnt(*hair_, {&motion, 1});
    }
    return coefficients_;
  }

 private:
  const LearntHair* hair_;
  std::uint32_t member_;
  std::vector<float> coefficients_;
  LearntState state_;
  std::uint64_t tick_ = 0;
};

class ReceivingLearnt : public testing::Test {
 protected:
  explicit ReceivingLearnt(LinkCoreOptions options = {}) : d(std::move(options)) {
    d.connect(welcome_to(5));
    announce();
  }
  void announce() {
    d.send(wire::MemberJoined{kMember, 9, 1, hash_of(2)});
    d.send(wire::GroomBasis{hash_of(2), wire::hash_groom(basis_)});
    send_file(basis_);
    d.send(wire::GroomLearnt{hash_of(2), wire::hash_groom(network_)});
  }
  // Asks for the file and sends it, so that the client takes it as if a frame had needed it.
  void send_file(const std::vector<std::uint8_t>& file) {
    d.core.request_groom(wire::hash_groom(file));
    d.take_all();
    d.send(wire::GroomData{wire::hash_groom(file), file.size(), 0, file});
  }
  // Shows a learnt frame, and gives the client the network for it. From the next frame on the client can evaluate.
  void fetch(std::uint64_t tick) {
    show(tick);
    send_file(network_);
  }
  struct Sent {
    LevelIndex level = LevelIndex::learnt;
    bool evaluated = false, discontinuous = false;
  };
  // Sends the frame of a member at a tick, and returns the coefficients that the client shows. An evaluated frame comes
  // without coefficients; one at another level than learnt has 0.03 m for each.
  std::vector<float> show(std::uint64_t tick, Sent sent) {
    send({kMember}, tick, sent);
    const std::optional<FrameBatch> batch = d.event<FrameBatch>();
    EXPECT_TRUE(batch && batch->frames.size() == 1);
    return batch ? batch->frames[0].coefficients : std::vector<float>();
  }
  std::vector<float> show(std::uint64_t tick) { return show(tick, Sent()); }
  std::vector<float> show_evaluated(std::uint64_t tick) { return show(tick, {.evaluated = true}); }
  void send(const std::vector<std::uint32_t>& members, std::uint64_t tick, Sent sent) {
    send(members, tick, sent, tick);
  }
  // Sends one batch. `at` is the tick of the poses and the hair, when another than that of the frames; the hair is then
  // 0.01 m for each coefficient.
  void send(const std::vector<std::uint32_t>& members, std::uint64_t tick, Sent sent, std::uint64_t at) {
    const codec::CoefficientCode code(small_basis().basis.deviation_m);
    wire::FrameBatch batch;
    batch.tick = tick;
    std::vector<std::vector<std::uint8_t>> contents;
    for (const std::uint32_t member : members) {
      std::vector<float> c = at == tick ? served(member, at) : std::vector<float>(12, 0.01f);
      if (sent.level != LevelIndex::learnt) std::ranges::fill(c, 0.03f);
      codec::EncodedFrame coded;
      codec::encode_frame(moved_pose(at, member), &code, c, 0, coded);
      const std::span<const std::uint8_t> content = coded.prefix(sent.evaluated ? 0 : c.size());
      contents.emplace_back(content.begin(), content.end());
    }
    for (std::size_t i = 0; i < members.size(); ++i)
      batch.frames.push_back({members[i], sent.level, sent.discontinuous, false, sent.evaluated, 1, contents[i]});
    d.send(batch);
  }
  const std::vector<float>& served(std::uint32_t member, std::uint64_t tick) {
    return served_.try_emplace(member, learnt_, member).first->second.at(tick);
  }
  // Counts the messages since the last call by which the client says that it has a network and evaluates it itself.
  // All other messages are dropped.
  std::size_t announced() {
    std::size_t count = 0;
    for (const wire::Message& message : d.take_all()) count += std::holds_alternative<wire::EvaluateLearnt>(message);
    return count;
  }

  const LearntHair learnt_ = hair_like();
  const std::vector<std::uint8_t> basis_ =
      wire::encode_basis(small_basis().geometry, small_basis().basis, small_basis().skin);
  const std::vector<std::uint8_t> network_ = wire::encode_learnt(learnt_);
  std::map<std::uint32_t, ServedHair> served_;
  LinkCoreDriver d;
};

// Once the server knows that the client evaluates the network, it leaves the coefficients out of the frames.
TEST_F(ReceivingLearnt, asks_for_the_network_with_the_first_learnt_frame_and_tells_once_that_it_evaluates) {
  show(10, {.level = LevelIndex::low});
  EXPECT_THAT(d.take_all(), testing::IsEmpty());
  show(11);
  EXPECT_EQ(d.expect<wire::GroomRequest>().hash, wire::hash_groom(network_));
  show(12);
  EXPECT_FALSE(d.take());
  d.send(wire::GroomData{wire::hash_groom(network_), network_.size(), 0, network_});
  EXPECT_FALSE(d.take());
  show(13);
  const auto announced = d.expect<wire::EvaluateLearnt>();
  EXPECT_EQ(announced.groom, hash_of(2));
  EXPECT_EQ(announced.learnt, wire::hash_groom(network_));
  show(14);
  EXPECT_FALSE(d.take());
}

TEST_F(ReceivingLearnt, shows_coefficients_as_they_come_while_they_come) {
  fetch(100);
  for (std::uint64_t tick = 101; tick < 120; ++tick)
    EXPECT_LT(distance_m(show(tick), served(kMember, tick)), 0.2e-3f) << tick;
  EXPECT_EQ(d.core.counters().frames_evaluated, 0u);
}

TEST_F(ReceivingLearnt, that_joins_late_evaluates_what_the_server_has) {
  fetch(100);
  std::vector<float> last = show(101);
  float fastest = 0, at_switch = 0;
  for (std::uint64_t tick = 102; tick < 300; ++tick) {
    const bool evaluated = tick >= 101 + kSettled;
    const std::vector<float> shown = show(tick, {.evaluated = evaluated});
    EXPECT_LT(distance_m(shown, served(kMember, tick)), kNear_m) << tick;
    float& most = tick == 101 + kSettled ? at_switch : fastest;
    most = std::max(most, distance_m(shown, last));
    last = shown;
  }
  // The hair must move by more between two ticks than it may be wrong. Without that, hair that stands still would pass.
  EXPECT_GT(fastest, kNear_m);
  // The change from coefficients to the network is no jump: it moves hair hardly more than a tick does.
  EXPECT_LT(at_switch, 1.2f * fastest);
  EXPECT_EQ(d.core.counters().frames_evaluated, 300 - 101 - kSettled);
}

TEST_F(ReceivingLearnt, evaluates_what_the_server_has_when_a_fifth_of_the_frames_is_lost) {
  // The seed is fixed so that the same frames are lost in each run.
  Random random(7);
  fetch(100);
  float square_sum = 0, most = 0;
  std::size_t count = 0;
  for (std::uint64_t tick = 101; tick < 700; ++tick) {
    if (random.unit() < 0.2) continue;
    const bool evaluated = tick >= 101 + kSettled;
    const std::vector<float> shown = show(tick, {.evaluated = evaluated});
    if (!evaluated) continue;
    const float error_m = distance_m(shown, served(kMember, tick));
    most = std::max(most, error_m);
    square_sum += error_m * error_m;
    ++count;
  }
  EXPECT_LT(std::sqrt(square_sum / static_cast<float>(count)), kNear_m);
  // The error is largest where several frames in a row are lost.
  EXPECT_LT(most, 3 * kNear_m);
}

TEST_F(ReceivingLearnt, goes_on_from_what_was_shown_after_a_gap_that_the_server_does_not_know_of) {
  fetch(100);
  for (std::uint64_t tick = 101; tick < 180; ++tick) show(tick, {.evaluated = tick >= 101 + kSettled});
  const std::vector<float> before = show_evaluated(180);
  EXPECT_EQ(announced(), 1u);
  // The 15 ticks from 180 to 195 are more than kLearntGapMax_ticks, 8: the network begins again, from the hair that was
  // shown.
  EXPECT_LT(distance_m(show_evaluated(195), before), 1e-6f);
  EXPECT_EQ(announced(), 1u) << "the server is told of the gap";
  for (std::uint64_t tick = 196; tick < 200; ++tick) show_evaluated(tick);
  for (std::uint64_t tick = 200; tick < 200 + kSettled; ++tick)
    // From here on the server answers with coefficients. The first frame may be far from what was shown.
    EXPECT_LT(distance_m(show(tick), served(kMember, tick)), tick < 201 ? 1 : kSurprise_m) << tick;
  for (std::uint64_t tick = 200 + kSettled; tick < 260 + kSettled; ++tick)
    EXPECT_LT(distance_m(show_evaluated(tick), served(kMember, tick)), kNear_m) << tick;
  EXPECT_EQ(announced(), 0u) << "once is enough";
}

TEST_F(ReceivingLearnt, tells_of_no_gap_that_a_network_does_not_notice) {
  fetch(100);
  for (std::uint64_t tick = 101; tick < 180; ++tick) show(tick, {.evaluated = tick >= 101 + kSettled});
  announced();
  for (std::uint64_t tick = 180; tick < 400; tick += kLearntGapMax_ticks) show_evaluated(tick);
  EXPECT_EQ(announced(), 0u);
}

TEST_F(ReceivingLearnt, tells_of_each_gap_and_again_when_nothing_changes) {
  fetch(100);
  for (std::uint64_t tick = 101; tick < 180; ++tick) show(tick, {.evaluated = tick >= 101 + kSettled});
  announced();
  for (std::uint64_t tick = 200; tick < 200 + kSettled; ++tick) show_evaluated(tick);
  EXPECT_EQ(announced(), 1u);
  show_evaluated(300);
  EXPECT_EQ(announced(), 1u);
  // A frame with coefficients is the answer of the server to the message.
  show(301);
  show_evaluated(330);
  EXPECT_EQ(announced(), 1u);
  // The same message is sent again at the earliest after kLearntSettled_ticks, 60: here at tick 390.
  show_evaluated(350);
  EXPECT_EQ(announced(), 0u) << "the same message is on its way";
  for (std::uint64_t tick = 351; tick < 400; ++tick) show_evaluated(tick);
  EXPECT_EQ(announced(), 1u);
}

TEST_F(ReceivingLearnt, goes_on_smoothly_to_another_level_and_ends_with_its_hair) {
  fetch(100);
  for (std::uint64_t tick = 101; tick < 199; ++tick) show(tick, {.evaluated = tick >= 101 + kSettled});
  std::vector<float> last = show_evaluated(199);
  const float speed = distance_m(last, show_evaluated(200));
  last = show(201, {.level = LevelIndex::low});
  EXPECT_LT(distance_m(last, served(kMember, 201)), kNear_m) << "as if the level had not ended";
  for (std::uint64_t tick = 202; tick < 260; ++tick) {
    const std::vector<float> shown = show(tick, {.level = LevelIndex::low});
    // A tick may take at most 0.3 of the remaining way to the sent hair, beside the speed that the hair had.
    EXPECT_LT(distance_m(shown, last), 0.3f * distance_m(last, std::vector<float>(12, 0.03f)) + speed) << tick;
    last = shown;
  }
  EXPECT_LT(distance_m(last, std::vector<float>(12, 0.03f)), 0.2e-3f);
}

TEST_F(ReceivingLearnt, shows_a_jump_as_it_is_and_continues_the_network) {
  fetch(100);
  for (std::uint64_t tick = 101; tick < 200; ++tick) show(tick, {.evaluated = tick >= 101 + kSettled});
  const std::vector<float> before = show_evaluated(200);
  // The World does not step hair that a teleport moves.
  EXPECT_LT(distance_m(show(201, {.evaluated = true, .discontinuous = true}), before), 0.2e-3f);
  const std::vector<float> coded = show(202, {.level = LevelIndex::low, .discontinuous = true});
  EXPECT_LT(distance_m(coded, std::vector<float>(12, 0.03f)), 0.2e-3f);
}

TEST_F(ReceivingLearnt, evaluates_members_side_by_side_as_each_by_itself) {
  // The 40 members fill more than two groups of kLearntWidth, 16, which a step evaluates side by side.
  std::vector<std::uint32_t> members;
  for (std::uint32_t member = kMember; member < kMember + 40; ++member) {
    d.send(wire::MemberJoined{member, 9, member, hash_of(2)});
    members.push_back(member);
  }
  fetch(100);
  // Sends the same frames, in batches of all members or of one member each, and returns what is shown. The second call
  // begins 70 ticks after the first, so every network begins again.
  const auto shown = [&](bool together) {
    std::map<std::pair<std::uint64_t, std::uint32_t>, std::vector<float>> coefficients;
    const std::uint64_t first = together ? 201 : 301;
    for (std::uint64_t tick = first; tick < first + 30; ++tick) {
      std::vector<std::vector<std::uint32_t>> batches(together ? 1 : members.size());
      // Every member misses every fifth tick.
      for (std::size_t m = 0; m < members.size(); ++m)
        if ((m + tick) % 5 != 0) batches[together ? 0 : m].push_back(members[m]);
      for (const auto& batch : batches)
        if (!batch.empty()) send(batch, tick, {.evaluated = tick > first + 10}, tick - first);
      for (const FrameBatch& batch : d.events<FrameBatch>())
        for (const Frame& frame : batch.frames) coefficients[{tick - first, frame.member}] = frame.coefficients;
    }
    return coefficients;
  };
  const auto together = shown(true), alone = shown(false);
  // The 40 members have 960 frames: four fifths of 30 ticks.
  EXPECT_GT(together.size(), 900u);
  EXPECT_EQ(together, alone);
}

// The client's word may have been lost with the connection, and the server would send coefficients forever.
TEST_F(ReceivingLearnt, tells_a_server_that_resumes_the_session_again) {
  fetch(100);
  show(101);
  EXPECT_EQ(announced(), 1u);
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.take_all();
  d.send(welcome_to(5, true));
  announce();
  d.take_all();
  show(110);
  EXPECT_EQ(announced(), 1u);
}

// A new session may be on a server that has learnt another network, so the client must ask for it again.
TEST_F(ReceivingLearnt, forgets_the_network_of_a_session_that_is_lost) {
  fetch(100);
  show(101);
  d.core.on_closed("the cable", d.now_ns);
  d.open();
  d.take_all();
  d.send(welcome_to(6));
  announce();
  d.take_all();
  show(110);
  EXPECT_EQ(d.expect<wire::GroomRequest>().hash, wire::hash_groom(network_));
}

TEST_F(ReceivingLearnt, keeps_the_last_coefficients_and_counts_when_it_cannot_evaluate) {
  const std::vector<float> coded = show(100);
  EXPECT_EQ(show_evaluated(101), coded);
  EXPECT_EQ(show_evaluated(102), coded);
  EXPECT_EQ(d.core.counters().frames_lacking_learnt, 2u);
  EXPECT_EQ(d.core.counters().frames_evaluated, 0u);
  EXPECT_LT(distance_m(show(103), served(kMember, 103)), 0.2e-3f);
}

// The hair must still be shown, by the coefficients that the server computes.
TEST_F(ReceivingLearnt, with_a_network_that_cannot_be_used_says_why_once_and_takes_coefficients) {
  std::vector<std::uint8_t> corrupted = network_;
  corrupted.resize(corrupted.size() / 2);
  d.send(wire::GroomLearnt{hash_of(2), wire::hash_groom(corrupted)});
  show(100);
  send_file(corrupted);
  const std::vector<wire::Error> errors = d.events<wire::Error>();
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].groom, hash_of(2));
  EXPECT_THAT(errors[0].detail, testing::HasSubstr("its learnt hair cannot be used"));
  d.pass(5000 * kMs);
  d.take_all();
  EXPECT_LT(distance_m(show(101), served(kMember, 101)), 0.2e-3f);
  EXPECT_FALSE(d.take());
}

TEST_F(ReceivingLearnt, does_not_bother_the_caller_when_the_server_refuses_to_leave_it_to_the_client) {
  fetch(100);
  show(101);
  d.take_all();
  d.send(wire::Error{wire::ErrorReason::groom_unavailable, 0, wire::hash_groom(network_), "no"});
  EXPECT_THAT(d.events<wire::Error>(), testing::IsEmpty());
  EXPECT_LT(distance_m(show(102), served(kMember, 102)), 0.2e-3f);
  EXPECT_EQ(announced(), 0u);
}

class ReceivingLearntAsAnnounced : public ReceivingLearnt {
 protected:
  ReceivingLearntAsAnnounced() : ReceivingLearnt(options()) {}
  static LinkCoreOptions options() {
    LinkCoreOptions options;
    options.evaluate_learnt = false;
    return options;
  }
};

TEST_F(ReceivingLearntAsAnnounced, neither_downloads_a_network_nor_says_that_it_evaluates) {
  for (std::uint64_t tick = 100; tick < 110; ++tick) EXPECT_LT(distance_m(show(tick), served(kMember, tick)), 0.2e-3f);
  EXPECT_FALSE(d.take());
}

}  // namespace
}  // namespace hairnet::link
