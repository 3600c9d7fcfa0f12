#include <gmock/gmock.h>

#include <cmath>
#include <map>

#include "core/ffd/deform.hpp"
#include "schema/codec/coefficient_frame.hpp"
#include "schema/wire/basis_file.hpp"
#include "tests/unit/server/poll_fixture.hpp"

namespace hairnet::server {
namespace {

using testing::SizeIs;

// Frames of coefficients, as one client reads them that has asked for the basis.
class CoefficientFrames : public PollTest {
 protected:
  CoefficientFrames() {
    build_ = [](const LevelBuildDef& def, const wire::GroomHash& hash, std::span<const std::uint8_t> file,
                const Groom& groom, const GoesOn& goes_on) {
      LevelBuildDef some = def;
      if (some.training) some.training = ModeTraining{.motion_count = 8, .duration_s = 2, .snapshot_s = 0.1};
      return build_levels_here(some, hash, file, groom, goes_on);
    };
    Config config;
    config.modes = true;
    start(config);
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
  // By tick.
  static std::map<std::uint64_t, Seen> frames(const FakeClient& client, const wire::HairBasis& basis) {
    const codec::CoefficientCode code(basis.basis.deviation_m);
    std::map<std::uint64_t, Seen> seen;
    for (const wire::FrameBatch& batch : client.connection->all<wire::FrameBatch>()) {
      for (const wire::Frame& frame : batch.frames) {
        if (!frame.coefficients) continue;
        Seen& one = seen[batch.tick];
        one.frame = frame;
        one.bytes = frame.content.size();
        EXPECT_TRUE(codec::decode_frame(frame.content, &code, one.decoded));
      }
    }
    return seen;
  }
};

TEST_F(CoefficientFrames, show_the_hair_that_frames_of_nodes_show) {
  const auto owner = join("", LevelIndex::high);
  FakeClient fine(*server_, now_ns_);
  fine.hello(now_ns_);
  ask(fine, 0.25e-3f);
  run_ms(1500, {owner.get()});
  const wire::HairBasis basis = basis_for(fine);
  run_ms(1500, {owner.get()});

  const std::vector<FakeClient::SeenFrame> nodes = owner->frames(1);
  const std::map<std::uint64_t, Seen> seen = frames(fine, basis);
  const Groom groom = small_groom();
  const Deformer deformer(groom, basis.geometry.lattice, FfdKind::quadratic);
  const auto points_of = [&](const std::vector<Vec3f>& active) {
    std::vector<Vec3f> grid(basis.geometry.lattice.node_count()), points(groom.points.size());
    expand_displacements(basis.geometry, active, grid);
    deformer.deform(grid, points);
    return points;
  };
  double motion = 0, error = 0;
  std::size_t compared = 0;
  for (const FakeClient::SeenFrame& truth : nodes) {
    const auto found = seen.find(truth.tick);
    if (found == seen.end() || truth.level != LevelIndex::high) continue;
    std::vector<Vec3f> shown(basis.basis.node_count), sent;
    displacements_of(basis.basis, found->second.decoded.coefficients, shown);
    codec::dequantise_nodes(truth.displacements, codec::ErrorClass::half_mm, sent);
    ASSERT_EQ(sent.size(), shown.size());
    const std::vector<Vec3f> shown_points = points_of(shown), sent_points = points_of(sent);
    for (std::size_t p = 0; p < groom.points.size(); ++p) {
      motion += static_cast<double>((sent_points[p] - groom.points[p]).squaredNorm());
      error += static_cast<double>((shown_points[p] - sent_points[p]).squaredNorm());
    }
    EXPECT_LT((found->second.decoded.pose.head().position - truth.pose.head().position).norm(), 2e-4);
    ++compared;
  }
  EXPECT_GT(compared, 20u);
  EXPECT_LT(std::sqrt(error / motion), 0.2);
}

TEST_F(CoefficientFrames, are_shorter_the_more_error_is_allowed) {
  const auto owner = join("", LevelIndex::high);
  FakeClient fine(*server_, now_ns_), coarse(*server_, now_ns_);
  for (FakeClient* client : {&fine, &coarse}) client->hello(now_ns_);
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
  EXPECT_GT(mean_bytes(coarse), 5);
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
  const auto seen = frames(*owner, basis);
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
  EXPECT_TRUE(has_switched);
  EXPECT_LT(at_switch, 1.5 * fastest);
}

TEST_F(CoefficientFrames, give_way_to_frames_of_nodes_and_come_back) {
  const auto owner = join("", LevelIndex::low);
  ask(*owner, 1e-3f);
  run_ms(1500, {owner.get()});
  const wire::HairBasis basis = basis_for(*owner);
  ask(*owner, 0);
  run_ms(500, {owner.get()});
  ask(*owner, 1e-3f);
  run_ms(500, {owner.get()});
  bool has_nodes_after_coefficients = false, has_coefficients = false;
  unsigned first_order = 9;
  for (const wire::FrameBatch& batch : owner->connection->all<wire::FrameBatch>()) {
    for (const wire::Frame& frame : batch.frames) {
      if (!frame.coefficients && has_coefficients && !has_nodes_after_coefficients) {
        has_nodes_after_coefficients = true;
        first_order = frame.order;
      }
      has_coefficients = has_coefficients || frame.coefficients;
    }
  }
  EXPECT_TRUE(has_nodes_after_coefficients);
  EXPECT_EQ(first_order, 0u);  // it has no nodes to refer to
  EXPECT_GT(frames(*owner, basis).rbegin()->first, 60u);
}

TEST_F(CoefficientFrames, do_not_come_without_modes) {
  start({});
  const auto owner = join("", LevelIndex::low);
  ask(*owner, 1e-3f);
  run_ms(1500, {owner.get()});
  EXPECT_THAT(owner->connection->all<wire::GroomBasis>(), SizeIs(0));
  EXPECT_FALSE(owner->frames(1).empty());
}

TEST_F(CoefficientFrames, are_refused_for_an_error_out_of_range) {
  const auto owner = join();
  ask(*owner, -1);
  ask(*owner, std::numeric_limits<float>::quiet_NaN());
  run_ms(50);
  EXPECT_EQ(owner->errors(), std::vector(2, wire::ErrorReason::observe_invalid));
}

}  // namespace
}  // namespace hairnet::server
