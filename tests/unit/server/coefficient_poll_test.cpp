#include <gmock/gmock.h>

#include <cmath>
#include <map>

#include "schema/codec/frame.hpp"
#include "schema/wire/basis_file.hpp"
#include "tests/support/learnt.hpp"
#include "tests/unit/server/poll_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::SizeIs;

// Reads frames of coefficients as a client does that has downloaded the basis. The modes are trained on eight motions
// of 2 s, to save time.
class CoefficientFrames : public PollTest {
 protected:
  CoefficientFrames() {
    build_ = [](const LevelBuildDef& def, const wire::GroomHash& hash, std::span<const std::uint8_t> file,
                const Groom& groom, const GoesOn& goes_on) {
      return build_with({.motion_count = 8, .duration_s = 2, .snapshot_s = 0.1}, def, hash, file, groom, goes_on);
    };
    start();
  }
  void ask(FakeClient& client, float error_m) {
    wire::Observe observe;
    observe.error_m = error_m;
    client.send(observe, now_ns_);
  }
  wire::HairBasis basis_for(FakeClient& client) {
    const auto announced = client.connection->all<wire::GroomBasis>();
    EXPECT_THAT(announced, SizeIs(1));
    if (announced.empty()) return {};
    EXPECT_EQ(announced[0].groom, hash_);
    client.send(wire::GroomRequest{announced[0].basis, 0}, now_ns_);
    run_ms(200);
    std::vector<std::uint8_t> file;
    for (const wire::GroomData& data : client.connection->all<wire::GroomData>()) {
      EXPECT_EQ(data.offset, file.size());
      file.insert(file.end(), data.bytes.begin(), data.bytes.end());
    }
    EXPECT_EQ(wire::hash_groom(file), announced[0].basis);
    Result<wire::HairBasis> basis = wire::decode_basis(file);
    EXPECT_TRUE(basis) << basis.error();
    return std::move(*basis);
  }
  struct Seen {
    wire::Frame frame;
    codec::DecodedFrame decoded;
    std::size_t bytes = 0;
  };
  // Returns all frames by their ticks; expects each to be readable.
  static std::map<std::uint64_t, Seen> frames(const FakeClient& client, const wire::HairBasis& basis) {
    const codec::CoefficientCode code(basis.basis.deviation_m);
    std::map<std::uint64_t, Seen> seen;
    for (const wire::FrameBatch& batch : client.connection->all<wire::FrameBatch>()) {
      for (const wire::Frame& frame : batch.frames) {
        Seen& one = seen[batch.tick];
        one.frame = frame;
        one.bytes = frame.content.size();
        EXPECT_TRUE(codec::decode_frame(frame.content, &code, one.decoded));
      }
    }
    return seen;
  }
  // Returns true when the level switches, and the hair then moves at most half as fast again as at other times:
  // coefficients of two levels differ, and without a fade hair would jump.
  static bool switches_smoothly(const std::map<std::uint64_t, Seen>& seen) {
    const Seen* last = nullptr;
    double fastest = 0, at_switch = 0;
    bool has_switched = false;
    for (const auto& [tick, one] : seen) {
      if (last && last->frame.level != LevelIndex::rigid) {
        double square = 0;
        for (std::size_t k = 0; k < one.decoded.coefficients.size(); ++k)
          square += std::pow(one.decoded.coefficients[k] - last->decoded.coefficients[k], 2);
        const bool switches = one.frame.level != last->frame.level;
        has_switched = has_switched || switches;
        double& most = switches ? at_switch : fastest;
        most = std::max(most, std::sqrt(square));
        EXPECT_FALSE(one.frame.discontinuous) << tick;
      }
      last = &one;
    }
    return has_switched && at_switch < 1.5 * fastest;
  }
};

TEST_F(CoefficientFrames, are_shorter_the_more_error_is_allowed) {
  const auto owner = join("", LevelIndex::high);
  FakeClient fine(*server_, now_ns_), coarse(*server_, now_ns_);
  for (FakeClient* client : {&fine, &coarse}) client->hello(now_ns_);
  // The errors are five octaves apart. They are RMS errors in m where a head fills the screen.
  ask(fine, 0.25e-3f);
  ask(coarse, 8e-3f);
  run_ms(1500, {owner.get()});
  const wire::HairBasis basis = basis_for(fine);
  run_ms(1000, {owner.get()});
  const auto mean_bytes = [&](const FakeClient& client) {
    double bytes = 0;
    const auto seen = frames(client, basis);
    for (const auto& [tick, one] : seen) bytes += static_cast<double>(one.bytes) / static_cast<double>(seen.size());
    return bytes;
  };
  // A frame has a pose, however coarse its hair is.
  EXPECT_GT(mean_bytes(coarse), 5);
  // The pose takes the same bytes in both, so the sum falls by less than the hair's part. A share of 0.6 shows that the
  // hair became much shorter.
  EXPECT_LT(mean_bytes(coarse), 0.6 * mean_bytes(fine));
}

TEST_F(CoefficientFrames, go_on_when_the_level_changes) {
  const auto owner = join("", LevelIndex::high);
  ask(*owner, 0.25e-3f);
  run_ms(1500, {owner.get()});
  const wire::HairBasis basis = basis_for(*owner);
  run_ms(500, {owner.get()});
  owner->send(wire::SetLevel{1, LevelIndex::low}, now_ns_);
  run_ms(1000, {owner.get()});
  EXPECT_TRUE(switches_smoothly(frames(*owner, basis)));
}

TEST_F(CoefficientFrames, are_refused_for_an_error_out_of_range) {
  const auto owner = join();
  ask(*owner, -1);
  ask(*owner, std::numeric_limits<float>::quiet_NaN());
  run_ms(50);
  EXPECT_EQ(owner->errors(), std::vector(2, wire::ErrorReason::observe_invalid));
}

// Tests a server that learns hair as soon as its levels have been built. The network is random and takes no time to
// learn; it covers air up to 15 m/s (random_learnt_hair).
class LearntFrames : public CoefficientFrames {
 protected:
  LearntFrames() {
    learn_ = [](const Groom&, const auto&, const BuildCallbacks&) -> Result<std::shared_ptr<const LearntHair>> {
      return std::make_shared<LearntHair>(support::random_learnt_hair(3));
    };
    config_.grooms.learning = Learning::always;
    start(config_);
  }
  static LevelIndex level(FakeClient& client) {
    const auto batches = client.connection->all<wire::FrameBatch>();
    return batches.empty() || batches.back().frames.empty() ? LevelIndex::rigid : batches.back().frames[0].level;
  }
  Config config_;
};

TEST_F(LearntFrames, take_the_place_of_lower_levels_as_soon_as_they_are_learnt) {
  const auto low = join("", LevelIndex::low), high = join("other", LevelIndex::high);
  run_ms(2000, {low.get(), high.get()});
  EXPECT_EQ(metrics_.groom.grooms_learnt.value(), 1u);
  EXPECT_EQ(level(*low), LevelIndex::learnt);
  EXPECT_EQ(level(*high), LevelIndex::high);
}

TEST_F(LearntFrames, are_not_made_where_the_server_shall_not_learn) {
  // Without a clock no tick is measured, so time is never short.
  config_.grooms.learning = Learning::when_short;
  start(config_);
  const auto low = join("", LevelIndex::low);
  run_ms(2000, {low.get()});
  EXPECT_EQ(metrics_.groom.grooms_learnt.value(), 0u);
  EXPECT_EQ(level(*low), LevelIndex::low);
}

TEST_F(LearntFrames, give_way_to_the_low_level_in_strong_wind_and_with_another_material) {
  const auto owner = join("", LevelIndex::learnt);
  run_ms(2000, {owner.get()});
  EXPECT_EQ(level(*owner), LevelIndex::learnt);
  wire::SetWind wind;
  wind.wind.mean_m_per_s = {2, 0, 0};
  owner->send(wind, now_ns_);
  run_ms(1000, {owner.get()});
  EXPECT_EQ(level(*owner), LevelIndex::learnt);
  // Gusts of half the mean reach 18 m/s, which is more than the network covers.
  wind.wind.mean_m_per_s = {12, 0, 0};
  wind.wind.gust_ratio = 0.5;
  owner->send(wind, now_ns_);
  run_ms(1000, {owner.get()});
  EXPECT_EQ(level(*owner), LevelIndex::low);
  owner->send(wire::SetWind{}, now_ns_);
  run_ms(1000, {owner.get()});
  EXPECT_EQ(level(*owner), LevelIndex::learnt);
  owner->send(wire::SetMaterial{1, {.density = 2}}, now_ns_);
  run_ms(1000, {owner.get()});
  EXPECT_EQ(level(*owner), LevelIndex::low);
}

TEST_F(LearntFrames, give_way_to_the_low_level_in_motions_that_were_not_trained) {
  learn_ = [](const Groom&, const auto&, const BuildCallbacks&) -> Result<std::shared_ptr<const LearntHair>> {
    auto hair = std::make_shared<LearntHair>(support::random_learnt_hair(3));
    // The network covers nearly no motion of the head.
    hair->most.fill(0.01f);
    return hair;
  };
  start(config_);
  const auto owner = join("", LevelIndex::low);
  run_ms(2500, {owner.get()});
  EXPECT_EQ(level(*owner), LevelIndex::low);
  // The head rests. After a motion that was not trained, a character stays off the learnt level for 2 s (kUncovered_s
  // in level_chooser.cpp).
  run_ms(2500);
  EXPECT_EQ(level(*owner), LevelIndex::learnt);
}

TEST_F(LearntFrames, give_way_to_the_low_level_in_wind_that_the_network_knows_nothing_of) {
  learn_ = [](const Groom&, const auto&, const BuildCallbacks&) -> Result<std::shared_ptr<const LearntHair>> {
    auto hair = std::make_shared<LearntHair>(support::random_learnt_hair(3));
    // This network was learnt without wind.
    hair->wind = {};
    return hair;
  };
  start(config_);
  const auto owner = join("", LevelIndex::low);
  run_ms(2000, {owner.get()});
  EXPECT_EQ(level(*owner), LevelIndex::learnt);
  wire::SetWind wind;
  wind.wind.mean_m_per_s = {0.1, 0, 0};
  owner->send(wind, now_ns_);
  run_ms(1000, {owner.get()});
  EXPECT_EQ(level(*owner), LevelIndex::low);
}

TEST_F(LearntFrames, go_on_smoothly_from_and_to_a_lattice) {
  const auto owner = join("", LevelIndex::learnt);
  ask(*owner, 0.25e-3f);
  run_ms(1500, {owner.get()});
  const wire::HairBasis basis = basis_for(*owner);
  for (const LevelIndex to : {LevelIndex::high, LevelIndex::low}) {
    owner->connection->received.clear();
    run_ms(500, {owner.get()});
    owner->send(wire::SetLevel{1, to}, now_ns_);
    run_ms(1000, {owner.get()});
    EXPECT_TRUE(switches_smoothly(frames(*owner, basis)));
  }
}

TEST_F(LearntFrames, of_a_groom_that_cannot_be_learnt_are_those_of_the_low_level) {
  learn_ = [](const Groom&, const auto&, const BuildCallbacks&) -> Result<std::shared_ptr<const LearntHair>> {
    return Refusal("it errs too much");
  };
  start(config_);
  const auto owner = join("", LevelIndex::learnt);
  run_ms(1500, {owner.get()});
  EXPECT_EQ(metrics_.groom.grooms_learnt_refused.value(), 1u);
  EXPECT_EQ(level(*owner), LevelIndex::low);
}

}  // namespace
}  // namespace hairnet::server
