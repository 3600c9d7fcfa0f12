// Compares what hairnet.h writes for a GPU with what client/draw writes.
#include <gmock/gmock.h>

#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "client/c/handles.hpp"
#include "client/draw/character_records.hpp"
#include "client/draw/light_rig.hpp"
#include "client/hairnet.h"
#include "tests/unit/client/small_basis.hpp"

namespace hairnet {
namespace {

using draw::CharacterRecords;
using draw::DensityGrid;

constexpr std::size_t kRowsMax = 2048;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
// Texel 16 of a record holds the lattice (kLatticeTexel in character_records.cpp).
constexpr std::size_t kLattice = 16, kRecordFloats = 4 * CharacterRecords::kRecordTexels;

Pose pose_of(const double* numbers) {
  Pose pose;
  for (RigidTransform& bone : pose.bones) {
    bone = {Quat(numbers[3], numbers[0], numbers[1], numbers[2]), Vec3(numbers[4], numbers[5], numbers[6])};
    numbers += 7;
  }
  return pose;
}

class HairnetHPicture : public testing::Test {
 protected:
  HairnetHPicture() : hair_(link::small_basis()), basis_(std::make_shared<const Basis>(hair_.basis)) {
    for (std::size_t i = 0; i < own_nodes_.size(); ++i) own_nodes_[i] = 0.1f * std::sin(static_cast<float>(i));
    EXPECT_EQ(hairnet_picture_make(&picture_), HAIRNET_OK);
  }
  ~HairnetHPicture() override { hairnet_picture_free(picture_); }

  // Adds a shown character whose hair is a sum of modes, and returns its index.
  std::uint32_t show(std::span<const float> coefficients) {
    scene_.shown.push_back({nullptr, {&hair_.geometry, {}, basis_, coefficients}, nullptr});
    return static_cast<std::uint32_t>(scene_.shown.size() - 1);
  }
  // Returns a character to draw, with hair at rest. Colours and boxes have other numbers on each axis or end, so that
  // a mixed up one shows.
  hairnet_drawn at_rest(std::uint32_t record) {
    hairnet_drawn one{};
    for (std::size_t bone = 0; bone < kBoneCount; ++bone) {
      double* numbers = one.pose + 7 * bone;
      numbers[1] = std::sin(0.4);
      numbers[3] = std::cos(0.4);
      numbers[4] = 0.5 * record;
      numbers[5] = 1.6 - 0.1 * static_cast<double>(bone);
    }
    one.record = record;
    one.scale = 1;
    one.roughness = 0.25f;
    one.strand_count = 5000;
    one.strand_width_m = 4e-4f;
    one.detail = {0.5f, 1.5f, 1e-3f, 0.75f};
    one.first_row = 7 * record;
    one.row_count = 3;
    for (int axis = 0; axis < 3; ++axis) {
      one.hair[axis] = 0.1f * static_cast<float>(axis + 1);
      one.hair_tip[axis] = 0.2f * static_cast<float>(axis + 1);
      one.skin[axis] = 0.3f * static_cast<float>(axis + 1);
      one.box[axis] = -0.2f;
      one.box[3 + axis] = 0.3f;
      one.root_box[axis] = -0.1f;
      one.root_box[3 + axis] = 0.1f;
    }
    one.ball_radius_m = 0.45f;
    return one;
  }
  hairnet_drawn moving(std::uint32_t record, std::uint32_t index) {
    hairnet_drawn one = at_rest(record);
    one.scene = &scene_;
    one.index = index;
    return one;
  }
  // Returns a character whose hair is moved by a lattice of 3 x 4 x 5 nodes that the caller owns.
  hairnet_drawn with_nodes(std::uint32_t record) {
    hairnet_drawn one = at_rest(record);
    one.nodes = own_nodes_.data();
    one.lattice = {{-0.5f, -0.5f, -0.5f}, {0.5f, 0.25f, 0.125f}, {3, 4, 5}, 0, 0};
    return one;
  }
  hairnet_error write(const std::vector<hairnet_drawn>& drawn, hairnet_node_sum sum = HAIRNET_SUM_BY_GPU,
                      std::size_t rows_max = kRowsMax) {
    return hairnet_picture_write(picture_, drawn.data(), drawn.size(), sum, rows_max, &data_);
  }
  [[nodiscard]] const float* texel(std::size_t record, std::size_t n) const {
    return data_.records + kRecordFloats * record + 4 * n;
  }
  // The third number of texel 4 is 1 where a lattice moves the hair (character_records.cpp).
  [[nodiscard]] bool moves(std::size_t record) const { return texel(record, 4)[2] == 1; }
  // The index in `sources` of what gives the record its nodes; -1 means that the nodes are in the texture already.
  [[nodiscard]] float source_of(std::size_t record) const { return texel(record, kLattice)[3]; }

  wire::HairBasis hair_;
  std::shared_ptr<const Basis> basis_;
  hairnet_scene scene_;
  std::array<float, 180> own_nodes_{};
  std::array<float, 12> coefficients_{0.05f, -0.02f, 0.01f};
  hairnet_picture* picture_ = nullptr;
  hairnet_picture_data data_{};
};

TEST_F(HairnetHPicture, records_are_those_of_client_draw) {
  std::vector<hairnet_drawn> drawn{moving(2, show(coefficients_)), at_rest(0), with_nodes(1)};
  drawn[0].scale = -1.5f;
  drawn[0].has_light = drawn[2].has_light = 1;
  drawn[1].hides_body = 1;
  ASSERT_EQ(write(drawn), HAIRNET_OK);

  const LevelGeometry own{
      {Vec3f(drawn[2].lattice.origin), Vec3f(drawn[2].lattice.spacing), {3, 4, 5}}, {}, {}, {}, {}, {}};
  std::vector<Vec3f> nodes;
  for (std::size_t i = 0; i < own_nodes_.size(); i += 3) nodes.emplace_back(own_nodes_.data() + i);
  std::array<draw::ShownCharacter, 3> characters;
  for (std::size_t i = 0; i < 3; ++i) {
    characters[i].pose = pose_of(drawn[i].pose);
    characters[i].hair_colour = Vec3f(drawn[i].hair);
    characters[i].hair_tip_colour = Vec3f(drawn[i].hair_tip);
    characters[i].skin_colour = Vec3f(drawn[i].skin);
    characters[i].roughness = drawn[i].roughness;
  }
  characters[0].lattice = scene_.shown[0].lattice;
  characters[0].scale = -1.5f;
  characters[1].body_shown = false;
  characters[2].lattice = {&own, nodes};
  const draw::DrawDetail detail{0.5f, 1.5f, 1e-3f, 0.75f};
  const draw::RestingStrands strands{
      {Vec3f::Constant(-0.2f), Vec3f::Constant(0.3f)}, {Vec3f::Constant(-0.1f), Vec3f::Constant(0.1f)}, 4e-4f, 5000};
  CharacterRecords records;
  records.begin(characters);
  std::size_t grids = 0;
  for (const std::size_t i : {1, 2, 0}) {
    std::optional<DensityGrid> density;
    if (drawn[i].has_light != 0) density = draw::density_of(strands, detail, characters[i].lattice, grids++);
    records.add(i, Vec3::Zero(), detail, 4e-4f, {drawn[i].first_row, drawn[i].row_count},
                density ? &*density : nullptr);
  }
  ASSERT_EQ(data_.record_count, 3u);
  EXPECT_EQ(std::span(data_.records, 3 * kRecordFloats).size_bytes(),
            std::as_bytes(std::span(records.records())).size());
  EXPECT_EQ(std::memcmp(data_.records, records.records().data(), 3 * kRecordFloats * sizeof(float)), 0);
  ASSERT_EQ(data_.nodes_rows, 1u);
  EXPECT_EQ(std::memcmp(data_.nodes, records.uploaded_nodes().data(), 4 * HAIRNET_NODE_TEXELS * sizeof(float)), 0);
  EXPECT_EQ(data_.node_rows, records.node_rows());
  EXPECT_EQ(data_.light_grids, 2u);
  // A negative scale counts as 1.5 for the width of strands. The fourth number of texel 4 is the scale minus 1.
  EXPECT_EQ(texel(2, 4)[3], -2.5f);
  EXPECT_FLOAT_EQ(texel(2, 2)[3], 1.5f * texel(0, 2)[3]);

  ASSERT_EQ(data_.source_count, 2u);
  EXPECT_EQ(data_.sources[0].basis, 0u);
  EXPECT_EQ(data_.sources[0].first, 1u);
  EXPECT_EQ(data_.sources[0].end, 2u);
  EXPECT_EQ(data_.sources[1].scene, &scene_);
  EXPECT_EQ(data_.sources[1].index, 0u);
  EXPECT_EQ(data_.sources[1].first, 2u);
  std::size_t modes = 0;
  ASSERT_EQ(hairnet_shown_modes(data_.sources[1].scene, data_.sources[1].index, nullptr, &modes), HAIRNET_OK);
  EXPECT_EQ(modes, 4u * HAIRNET_NODE_TEXELS * 12);
}

// Where graphics are computed in software, the processor sums up the modes itself.
TEST_F(HairnetHPicture, processor_sums_up_what_the_gpu_does_not) {
  const std::vector<hairnet_drawn> drawn{moving(0, show(coefficients_))};
  ASSERT_EQ(write(drawn, HAIRNET_SUM_BY_PROCESSOR), HAIRNET_OK);
  ASSERT_EQ(data_.source_count, 1u);
  EXPECT_EQ(source_of(0), 0);
  std::array<float, link::kSmallBasisCoordinates> nodes;
  ASSERT_EQ(hairnet_shown_nodes(&scene_, 0, nodes.data(), link::kSmallBasisNodes), HAIRNET_OK);
  for (std::size_t n = 0; n < link::kSmallBasisNodes; ++n) {
    for (std::size_t axis = 0; axis < 3; ++axis) EXPECT_EQ(data_.nodes[4 * n + axis], nodes[3 * n + axis]);
  }
  EXPECT_EQ(hairnet_node_sum_for("llvmpipe (LLVM 15.0.6, 256 bits)"), HAIRNET_SUM_BY_PROCESSOR);
  EXPECT_EQ(hairnet_node_sum_for("NVIDIA H200/PCIe/SSE2"), HAIRNET_SUM_BY_GPU);
}

TEST_F(HairnetHPicture, nodes_of_sleeping_hair_stay_also_where_it_is_not_drawn) {
  std::array<float, 12> other{0.03f};
  std::vector<hairnet_drawn> drawn{moving(0, show(coefficients_)), moving(1, show(other))};
  const auto sources = [&] {
    EXPECT_EQ(write(drawn), HAIRNET_OK);
    return std::array{source_of(0), source_of(data_.record_count - 1)};
  };
  EXPECT_THAT(sources(), testing::ElementsAre(1, 1));
  const std::uint32_t basis = data_.sources[1].basis;
  EXPECT_THAT(sources(), testing::ElementsAre(-1, -1));
  EXPECT_EQ(data_.source_count, 2u) << "its basis stays, too";
  EXPECT_EQ(data_.sources[1].first, data_.sources[1].end);
  drawn[0].record = HAIRNET_NOT_DRAWN;
  drawn[1].record = 0;
  EXPECT_THAT(sources(), testing::ElementsAre(-1, -1));
  drawn[0].record = 1;
  EXPECT_THAT(sources(), testing::ElementsAre(-1, -1));
  coefficients_[0] *= 2;
  EXPECT_THAT(sources(), testing::ElementsAre(-1, 1));
  EXPECT_EQ(data_.sources[1].basis, basis);
  hairnet_picture_forget(picture_);
  EXPECT_THAT(sources(), testing::ElementsAre(1, 1));
  // What is refused changes nothing.
  drawn[0].hair[1] = kNaN;
  EXPECT_EQ(write(drawn), HAIRNET_INVALID);
  drawn[0].hair[1] = 0;
  EXPECT_THAT(sources(), testing::ElementsAre(-1, -1));
  // Without lattices the texture shrinks, and loses what it had.
  std::vector<hairnet_drawn> many(40, moving(0, 0));
  for (std::uint32_t i = 0; i < many.size(); ++i) many[i].record = i;
  ASSERT_EQ(write(many), HAIRNET_OK);
  EXPECT_EQ(data_.node_rows, 40u);
  EXPECT_THAT(sources(), testing::ElementsAre(1, 1));
  EXPECT_EQ(data_.node_rows, 2u);
}

TEST_F(HairnetHPicture, lattices_that_are_none_move_nothing) {
  std::array<float, 12> broken{0.1f, kNaN}, huge{1e30f};
  std::vector<hairnet_drawn> drawn{moving(0, show(broken)), moving(1, show(huge))};
  for (std::uint32_t record = 2; record < 8; ++record) drawn.push_back(with_nodes(record));
  std::array<float, 180> infinite = own_nodes_;
  infinite[7] = std::numeric_limits<float>::infinity();
  drawn[2].nodes = infinite.data();
  // A lattice has 2 to 64 nodes on each axis (pictures.cpp).
  drawn[3].lattice.counts[1] = 1;
  drawn[4].lattice.counts[2] = 65;
  drawn[5].lattice.spacing[0] = 0;
  drawn[6].lattice.origin[2] = kNaN;
  drawn.push_back(moving(8, show(coefficients_)));
  ASSERT_EQ(write(drawn), HAIRNET_OK);
  for (std::size_t record = 0; record < 7; ++record) EXPECT_FALSE(moves(record)) << record;
  EXPECT_TRUE(moves(7));
  EXPECT_TRUE(moves(8));
  // The rows end before the last one.
  ASSERT_EQ(write({with_nodes(0), with_nodes(1), with_nodes(2)}, HAIRNET_SUM_BY_GPU, 3), HAIRNET_OK);
  EXPECT_TRUE(moves(2));
  hairnet_drawn tall = with_nodes(0);
  const std::vector<float> many(3 * 16 * 16 * 16);
  tall.nodes = many.data();
  std::ranges::fill(tall.lattice.counts, 16u);
  ASSERT_EQ(write({tall, with_nodes(1)}, HAIRNET_SUM_BY_GPU, 4), HAIRNET_OK);
  EXPECT_TRUE(moves(0));
  EXPECT_FALSE(moves(1));
}

TEST_F(HairnetHPicture, sixteen_characters_have_light_of_their_own) {
  std::vector<hairnet_drawn> drawn;
  for (std::uint32_t record = 0; record < 20; ++record) {
    drawn.push_back(at_rest(record));
    drawn.back().has_light = 1;
  }
  drawn[3].detail.quadratic = 0;
  drawn[4].strand_count = 0;
  ASSERT_EQ(write(drawn), HAIRNET_OK);
  EXPECT_EQ(data_.light_grids, DensityGrid::kDensityGridsMax);
  // Texel 20 has the number of the light grid, counted from 1; 0 means that the character has none. Records 3 and 4
  // need none, so the sixteenth grid is that of record 17.
  EXPECT_EQ(texel(2, 20)[3], 3);
  EXPECT_EQ(texel(3, 20)[3], 0);
  EXPECT_EQ(texel(17, 20)[3], 16);
  EXPECT_EQ(texel(18, 20)[3], 0);
}

// A program in C has no checks of its own. A wrong record would write beyond the buffer, and a NaN would spoil an
// image.
TEST_F(HairnetHPicture, wrong_arguments_are_refused) {
  const std::vector<hairnet_drawn> valid{at_rest(0), at_rest(1)};
  const auto refused = [&](const auto& corrupt) {
    std::vector<hairnet_drawn> drawn = valid;
    corrupt(drawn[1]);
    return write(drawn);
  };
  EXPECT_EQ(write(valid), HAIRNET_OK);
  EXPECT_EQ(refused([](hairnet_drawn& one) { one.record = 0; }), HAIRNET_INVALID);
  EXPECT_EQ(refused([](hairnet_drawn& one) { one.record = 2; }), HAIRNET_INVALID);
  EXPECT_EQ(refused([](hairnet_drawn& one) { one.pose[34] = std::nan(""); }), HAIRNET_INVALID);
  EXPECT_EQ(refused([](hairnet_drawn& one) { one.scale = kNaN; }), HAIRNET_INVALID);
  EXPECT_EQ(refused([](hairnet_drawn& one) { one.roughness = kNaN; }), HAIRNET_INVALID);
  EXPECT_EQ(refused([](hairnet_drawn& one) { one.detail.strand_share = kNaN; }), HAIRNET_INVALID);
  EXPECT_EQ(refused([](hairnet_drawn& one) { one.has_light = 1, one.box[4] = kNaN; }), HAIRNET_INVALID);
  EXPECT_EQ(refused([&](hairnet_drawn& one) { one.scene = &scene_; }), HAIRNET_NOT_THERE);
  EXPECT_EQ(refused([](hairnet_drawn& one) { one.record = HAIRNET_NOT_DRAWN, one.scale = kNaN; }), HAIRNET_OK);
  EXPECT_EQ(write(valid, HAIRNET_SUM_BY_GPU, 1), HAIRNET_INVALID);
  EXPECT_EQ(write({}), HAIRNET_OK);
  EXPECT_EQ(data_.record_count, 0u);
}

// A head behind the camera may have a size of NaN on the screen, and must still get a finite detail.
TEST_F(HairnetHPicture, details_are_those_of_client_draw_also_for_sizes_that_are_no_numbers) {
  std::vector<hairnet_drawn> drawn(4, at_rest(0));
  drawn[0].head_px = 700;
  drawn[1].head_px = 95;
  drawn[2].head_px = kNaN;
  drawn[3].head_px = std::numeric_limits<float>::infinity();
  for (const float quality : {1.0f, 0.5f, kNaN, 0.0f, -1.0f}) {
    hairnet_choose_details(drawn.data(), drawn.size(), quality);
    for (const hairnet_drawn& one : drawn) {
      const auto& [share, follow_hairs, tolerance_m, quadratic] = one.detail;
      for (const float each : {share, follow_hairs, tolerance_m, quadratic})
        EXPECT_TRUE(std::isfinite(each)) << quality;
      EXPECT_GT(share, 0);
      EXPECT_LE(share, 1);
    }
    if (!(quality > 0)) continue;
    const draw::DrawDetail wanted = draw::detail_for(95, quality, 5000);
    EXPECT_EQ(drawn[1].detail.strand_share, wanted.strand_share);
    EXPECT_EQ(drawn[1].detail.follow_hair_count, wanted.follow_hair_count);
    EXPECT_EQ(drawn[1].detail.tolerance_m, wanted.tolerance_m);
    EXPECT_EQ(drawn[1].detail.quadratic, wanted.quadratic);
  }
}

TEST_F(HairnetHPicture, motions_are_those_of_characters_with_an_id_since_the_last_call) {
  std::vector<hairnet_drawn> drawn{moving(0, show(coefficients_)), at_rest(1), with_nodes(2)};
  drawn[0].id = 5;
  drawn[2].id = std::uint64_t{1} << 40;
  drawn[2].head_px = 100;
  drawn[2].scale = 2;
  hairnet_motions announced{};
  ASSERT_EQ(hairnet_picture_motions(picture_, drawn.data(), drawn.size(), &announced), HAIRNET_OK);
  EXPECT_EQ(announced.count, 0u);
  drawn[2].pose[4] += 0.25;
  drawn[2].scale = -2;
  drawn[2].nodes = nullptr;
  ASSERT_EQ(hairnet_picture_motions(picture_, drawn.data(), drawn.size(), &announced), HAIRNET_OK);
  ASSERT_EQ(announced.count, 2u);
  const hairnet_motion& largest = announced.motions[0];
  EXPECT_EQ(largest.ball_radius_m, 0.45f);
  EXPECT_DOUBLE_EQ(largest.now[12] - largest.before[12], 0.25);
  EXPECT_DOUBLE_EQ(largest.before[13], 1.6);
  EXPECT_DOUBLE_EQ(largest.before[0], 2 * std::cos(0.8));
  EXPECT_DOUBLE_EQ(largest.before[8], 2 * std::sin(0.8));
  EXPECT_DOUBLE_EQ(largest.now[0], -2 * std::cos(0.8));
  EXPECT_EQ(largest.now[15], 1);
  // The hair of the largest character has come to rest, so it was where the nodes had moved it, up to 0.1 m away. The
  // hair of the other one has not moved.
  const auto swing = [&](std::size_t slice) {
    float most = 0;
    for (std::size_t i = 4 * 512 * slice; i < 4 * 512 * (slice + 1); ++i)
      most = std::max(most, std::abs(float{Eigen::half(Eigen::half_impl::raw_uint16_to_half(announced.swing[i]))}));
    return most;
  };
  EXPECT_GT(swing(0), 0.01f);
  EXPECT_LT(swing(0), 0.11f);
  EXPECT_EQ(swing(1), 0);
  drawn[0].index = 7;
  EXPECT_EQ(hairnet_picture_motions(picture_, drawn.data(), drawn.size(), &announced), HAIRNET_NOT_THERE);
  drawn[0].pose[0] = std::nan("");
  EXPECT_EQ(hairnet_picture_motions(picture_, drawn.data(), drawn.size(), &announced), HAIRNET_INVALID);
}

TEST(HairnetHLights, are_those_of_the_studio) {
  for (const Vec3& towards : {Vec3(0, 0, 2), Vec3(1, 0.5, 0.3), Vec3(-0.2, -3, 0.4), Vec3(0, 1, 0), Vec3(0, 0, 0)}) {
    hairnet_lights lights;
    hairnet_studio_lights(towards.data(), &lights);
    const draw::LightRig rig = draw::studio_lights(draw::Camera{towards, Vec3::Zero(), Vec3::UnitY(), 30});
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_EQ(Vec3f(lights.towards[i]), rig.towards[i]);
      EXPECT_NEAR(rig.towards[i].norm(), 1, 1e-6f);
      EXPECT_EQ(Vec3f(lights.colours[i]), rig.colours[i]);
    }
    EXPECT_EQ(Vec3f(lights.ambient_above), rig.ambient_above);
    EXPECT_EQ(Vec3f(lights.ambient_below), rig.ambient_below);
  }
}

}  // namespace
}  // namespace hairnet
