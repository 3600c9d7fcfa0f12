#include <gmock/gmock.h>

#include <cmath>
#include <map>

#include "client/link/link_core.hpp"
#include "core/random.hpp"
#include "schema/wire/learnt_file.hpp"
#include "tests/support/learnt.hpp"
#include "tests/unit/server/poll_fixture.hpp"

// The whole server without a socket: learnt hair that clients evaluate themselves.
namespace hairnet::server {
namespace {

using testing::Each;
using testing::IsEmpty;
using testing::Not;
using testing::SizeIs;

// The largest RMS distance over the hair between a client and the server. Trained networks that began at different
// times differ by 2.4 mm at most in nearly all clips after two seconds (kLearntSettled_ticks in learnt_hair.hpp);
// coding adds its error.
constexpr float kNear_m = 5e-3f;

// Makes a network whose hair follows the head within a third of a second and moves by some centimetres. It covers wind
// up to 0.4 m/s.
std::shared_ptr<const LearntHair> hair_like() {
  auto hair = std::make_shared<LearntHair>(support::random_learnt_hair(3));
  std::fill_n(hair->bias.begin(), hair->hidden_count, -1.0f);
  for (float& weight : hair->output_weights) weight *= 0.5f;
  hair->wind.max_m_per_s = 0.4f;
  return hair;
}

// A client as programs have it, with the protocol core of client/link. It observes and adds no character.
class LinkedClient {
 public:
  LinkedClient(Server& server, std::int64_t now_ns) : core_(options()), pipe_(std::make_shared<Pipe>()) {
    core_.start();
    core_.on_opening(now_ns);
    core_.on_open(now_ns);
    sink_ = server.open(pipe_, now_ns);
  }
  void poll(std::int64_t now_ns) {
    for (const std::vector<std::uint8_t>& packet : std::exchange(pipe_->packets, {})) core_.on_packet(packet, now_ns);
    core_.poll(now_ns);
    for (std::vector<std::uint8_t> packet; !(packet = core_.take_packet(now_ns)).empty();)
      sink_->on_packet(packet, now_ns);
    for (link::Event& event : core_.take_events()) {
      if (const auto* batch = std::get_if<link::FrameBatch>(&event))
        for (const link::Frame& frame : batch->frames) shown[batch->tick] = frame.coefficients;
    }
  }
  [[nodiscard]] link::LinkCounters counters() const { return core_.counters(); }

  // The coefficients that were shown of one member, by tick.
  std::map<std::uint64_t, std::vector<float>> shown;

 private:
  struct Pipe final : Connection {
    void mark_joined() override {}
    void send(std::vector<std::uint8_t> packet) override { packets.push_back(std::move(packet)); }
    [[nodiscard]] bool writable() const override { return true; }
    void close(std::string_view) override {}
    [[nodiscard]] std::string_view peer() const override { return "nowhere"; }
    std::vector<std::vector<std::uint8_t>> packets;
  };
  static link::LinkCoreOptions options() {
    link::LinkCoreOptions options;
    options.role = wire::Role::observer;
    return options;
  }
  link::LinkCore core_;
  std::shared_ptr<Pipe> pipe_;
  PacketSink* sink_ = nullptr;
};

// Lets the server learn hair at once: `hair_` takes the place of what training would give. Frames of learnt hair are 30
// a second.
class EvaluatedFrames : public PollTest {
 protected:
  EvaluatedFrames() {
    learn_ = [this](const Groom&, const auto&, const BuildCallbacks&) -> Result<std::shared_ptr<const LearntHair>> {
      return hair_;
    };
    Config config;
    config.grooms.learning = Learning::always;
    start(config);
    owner_ = join("", LevelIndex::learnt);
    run(1500);
  }
  void run(int count_ms, const std::vector<LinkedClient*>& clients = {}) {
    for (int i = 0; i < count_ms; i += 15) {
      run_ms(15, {owner_.get()});
      for (LinkedClient* client : clients) client->poll(now_ns_);
    }
  }
  // Returns the hash of the network that was announced to a client; expects one announcement.
  wire::GroomHash announced(const FakeClient& client) {
    const auto all = client.connection->all<wire::GroomLearnt>();
    EXPECT_THAT(all, SizeIs(1));
    if (all.empty()) return {};
    EXPECT_EQ(all[0].groom, hash_);
    return all[0].learnt;
  }
  // Returns for each frame whether the client has to evaluate the hair itself, as the frame has no coefficients.
  static std::vector<bool> evaluated(const FakeClient& client) {
    std::vector<bool> evaluated;
    for (const wire::FrameBatch& batch : client.connection->all<wire::FrameBatch>())
      for (const wire::Frame& frame : batch.frames) evaluated.push_back(frame.evaluated);
    return evaluated;
  }

  static double mean_bytes(const FakeClient& client) {
    double bytes = 0, count = 0;
    for (const wire::FrameBatch& batch : client.connection->all<wire::FrameBatch>()) {
      for (const wire::Frame& frame : batch.frames) {
        bytes += static_cast<double>(frame.content.size());
        ++count;
      }
    }
    return bytes / count;
  }

  const std::shared_ptr<const LearntHair> hair_ = hair_like();
  std::unique_ptr<FakeClient> owner_;
};

TEST_F(EvaluatedFrames, are_of_a_network_that_clients_download) {
  const wire::GroomHash file = announced(*owner_);
  owner_->send(wire::GroomRequest{file, 0}, now_ns_);
  run(100);
  std::vector<std::uint8_t> bytes;
  for (const wire::GroomData& data : owner_->connection->all<wire::GroomData>())
    bytes.insert(bytes.end(), data.bytes.begin(), data.bytes.end());
  EXPECT_EQ(wire::hash_groom(bytes), file);
  const Result<LearntHair> decoded = wire::decode_learnt(bytes);
  ASSERT_TRUE(decoded) << decoded.error();
  EXPECT_EQ(decoded->output_weights, hair_->output_weights);
}

// A client's network needs 60 ticks (kLearntSettled_ticks) until its state hardly depends on when it began. For this
// time the server still sends coefficients.
TEST_F(EvaluatedFrames, come_two_seconds_after_the_client_says_so_and_are_smaller) {
  wire::Observe observe;
  observe.error_m = 0.25e-3f;
  owner_->send(observe, now_ns_);
  owner_->connection->received.clear();
  run(2500);
  EXPECT_THAT(evaluated(*owner_), Each(false));
  // The announcement was cleared away above.
  owner_->send(wire::EvaluateLearnt{hash_, wire::hash_groom(wire::encode_learnt(*hair_))}, now_ns_);
  owner_->connection->received.clear();
  run(1950);
  EXPECT_THAT(evaluated(*owner_), Each(false));
  const double coded = mean_bytes(*owner_);
  run(200);
  owner_->connection->received.clear();
  run(500);
  EXPECT_THAT(evaluated(*owner_), Each(true));
  // A frame without coefficients still has a pose.
  EXPECT_GT(mean_bytes(*owner_), 15);
  EXPECT_LT(mean_bytes(*owner_) + 3, coded);
  EXPECT_GT(metrics_.tick.frames_evaluated_by_clients.value(), 10u);
}

// A client that has lost frames says again that it evaluates hair: its network must settle again, for which it gets
// coefficients.
TEST_F(EvaluatedFrames, have_coefficients_for_two_seconds_when_the_client_says_so_again) {
  const wire::GroomHash file = announced(*owner_);
  owner_->send(wire::EvaluateLearnt{hash_, file}, now_ns_);
  run(2500);
  ASSERT_TRUE(evaluated(*owner_).back());
  owner_->send(wire::EvaluateLearnt{hash_, file}, now_ns_);
  run(100);
  owner_->connection->received.clear();
  run(1800);
  EXPECT_THAT(evaluated(*owner_), testing::AllOf(SizeIs(testing::Gt(40u)), Each(false)));
  run(300);
  owner_->connection->received.clear();
  run(500);
  EXPECT_THAT(evaluated(*owner_), Each(true));
}

TEST_F(EvaluatedFrames, do_not_come_for_hair_that_the_server_does_not_know) {
  const wire::GroomHash file = announced(*owner_);
  const FakeClient::SeenFrame before = owner_->frames(1).back();
  owner_->send(wire::EvaluateLearnt{hash_, {1, 2, 3}}, now_ns_);
  owner_->send(wire::EvaluateLearnt{{4}, file}, now_ns_);
  run(2500);
  EXPECT_EQ(owner_->errors(), std::vector(2, wire::ErrorReason::groom_unavailable));
  const auto error = owner_->connection->all<wire::Error>().at(0);
  EXPECT_EQ(error.groom, (wire::GroomHash{1, 2, 3}));
  EXPECT_NE(error.detail, "");
  EXPECT_EQ(metrics_.tick.evaluations_refused.value(), 2u);
  EXPECT_THAT(evaluated(*owner_), Each(false));
}

TEST_F(EvaluatedFrames, are_not_announced_to_a_client_that_does_not_know_them) {
  FakeClient old(*server_, now_ns_);
  wire::Hello hello;
  // An older client knows messages up to GroomBasis, number 28; GroomLearnt is 29.
  hello.message_max = 28;
  old.send(hello, now_ns_);
  run(500);
  EXPECT_THAT(old.connection->all<wire::FrameBatch>(), Not(IsEmpty()));
  EXPECT_THAT(old.connection->all<wire::GroomLearnt>(), IsEmpty());
}

TEST_F(EvaluatedFrames, are_announced_and_asked_for_again_when_the_session_resumes) {
  owner_->send(wire::EvaluateLearnt{hash_, announced(*owner_)}, now_ns_);
  run(2500);
  EXPECT_TRUE(evaluated(*owner_).back());
  const auto welcome = owner_->connection->all<wire::Welcome>().at(0);
  owner_->break_connection(now_ns_);
  owner_ = std::make_unique<FakeClient>(*server_, now_ns_);
  owner_->resume(welcome, now_ns_);
  run(2500);
  EXPECT_THAT(evaluated(*owner_), Each(false));
  owner_->send(wire::EvaluateLearnt{hash_, announced(*owner_)}, now_ns_);
  run(2500);
  EXPECT_TRUE(evaluated(*owner_).back());
}

TEST_F(EvaluatedFrames, show_the_same_hair_to_clients_that_joined_at_different_times) {
  LinkedClient early(*server_, now_ns_);
  run(4000, {&early});
  LinkedClient late(*server_, now_ns_);
  run(3000, {&early, &late});
  // The second client has been there for 3 s, so its network has settled.
  const std::uint64_t settled = early.shown.rbegin()->first;
  run(4000, {&early, &late});
  // The first client evaluates from the third second on, for some 9 s; the second one for some 5 s of its 7 s.
  EXPECT_GT(early.counters().frames_evaluated, 200u);
  EXPECT_GT(late.counters().frames_evaluated, 120u);
  EXPECT_EQ(late.counters().frames_lacking_learnt, 0u);
  // The owner gets coefficients all the time.
  float hair_m = 0;
  std::size_t compared = 0;
  for (const FakeClient::SeenFrame& frame : owner_->frames(1)) {
    if (frame.tick <= settled || !early.shown.contains(frame.tick) || !late.shown.contains(frame.tick)) continue;
    ++compared;
    const auto distance_m = [](const std::vector<float>& a, const std::vector<float>& b) {
      float squares = 0;
      for (std::size_t k = 0; k < std::min(a.size(), b.size()); ++k) squares += std::pow(a[k] - b[k], 2.0f);
      return std::sqrt(squares);
    };
    hair_m = std::max(hair_m, distance_m(frame.coefficients, std::vector<float>(frame.coefficients.size())));
    EXPECT_LT(distance_m(early.shown[frame.tick], late.shown[frame.tick]), kNear_m) << frame.tick;
    EXPECT_LT(distance_m(early.shown[frame.tick], frame.coefficients), kNear_m) << frame.tick;
  }
  EXPECT_GT(compared, 100u);
  // The hair must have moved by more than the tolerance.
  EXPECT_GT(hair_m, 2 * kNear_m);
}

TEST_F(EvaluatedFrames, have_coefficients_in_wind_and_clients_show_that_hair) {
  LinkedClient client(*server_, now_ns_);
  run(4000, {&client});
  wire::SetWind wind;
  // The network covers this wind, but clients do not download its weights of the wind, so the server sends
  // coefficients.
  wind.wind.mean_m_per_s = {0.3f, 0, 0};
  owner_->send(wind, now_ns_);
  run(1500, {&client});
  const std::uint64_t before = client.counters().frames_evaluated, windy = client.shown.rbegin()->first;
  run(1000, {&client});
  EXPECT_EQ(client.counters().frames_evaluated, before);
  owner_->send(wire::SetWind{}, now_ns_);
  run(4000, {&client});
  EXPECT_GT(client.counters().frames_evaluated, before + 30);
  std::size_t compared = 0;
  for (const FakeClient::SeenFrame& frame : owner_->frames(1)) {
    if (frame.tick <= windy || !client.shown.contains(frame.tick)) continue;
    ++compared;
    const std::vector<float>& shown = client.shown[frame.tick];
    float squares = 0;
    for (std::size_t k = 0; k < std::min(shown.size(), frame.coefficients.size()); ++k)
      squares += std::pow(shown[k] - frame.coefficients[k], 2.0f);
    EXPECT_LT(std::sqrt(squares), kNear_m) << frame.tick;
  }
  EXPECT_GT(compared, 100u);
}

TEST_F(EvaluatedFrames, have_coefficients_in_still_air_that_is_carried_along) {
  LinkedClient client(*server_, now_ns_);
  run(4000, {&client});
  EXPECT_GT(client.counters().frames_evaluated, 0u);
  wire::SetWind still;
  still.wind.carried = true;
  owner_->send(still, now_ns_);
  run(1500, {&client});
  const std::uint64_t before = client.counters().frames_evaluated;
  run(1000, {&client});
  EXPECT_EQ(client.counters().frames_evaluated, before) << "clients know only air that stands in the room";
}

TEST_F(EvaluatedFrames, go_on_smoothly_when_the_level_changes) {
  LinkedClient client(*server_, now_ns_);
  run(5000, {&client});
  EXPECT_GT(client.counters().frames_evaluated, 30u);
  const std::uint64_t before = client.shown.rbegin()->first;
  owner_->send(wire::SetLevel{1, LevelIndex::low}, now_ns_);
  // This wind is stronger than the network covers.
  wire::SetWind wind;
  wind.wind.mean_m_per_s = {0.5f, 0, 0};
  owner_->send(wind, now_ns_);
  run(1000, {&client});
  float fastest = 0, at_switch = 0;
  const std::vector<float>* last = nullptr;
  for (const auto& [tick, shown] : client.shown) {
    if (last && last->size() == shown.size()) {
      float squares = 0;
      for (std::size_t k = 0; k < shown.size(); ++k) squares += std::pow(shown[k] - (*last)[k], 2.0f);
      float& most = tick > before && tick <= before + 3 ? at_switch : fastest;
      most = std::max(most, std::sqrt(squares));
    }
    last = &shown;
  }
  // Without a fade, the hair would jump from the network's solution to the lattice's in the ticks after the switch.
  EXPECT_LT(at_switch, 1.5f * fastest);
}

}  // namespace
}  // namespace hairnet::server
