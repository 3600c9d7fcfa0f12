#include "schema/wire/basis_file.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <limits>

#include "core/random.hpp"
#include "schema/wire/packing.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

// Makes a basis of 20 random modes on a lattice of 3 x 3 x 4 nodes, of which every third is trimmed, with the skin of
// two bones.
class BasisFile : public testing::Test {
 protected:
  BasisFile() {
    geometry_.lattice.dims = {3, 3, 4};
    const auto count = static_cast<std::uint32_t>(geometry_.lattice.node_count());
    for (std::uint32_t node = 0; node < count; ++node) {
      (node % 3 == 0 ? geometry_.trimmed_nodes : geometry_.active_nodes).push_back(node);
    }
    geometry_.trimmed_begin.push_back(0);
    for (std::uint32_t t = 0; t < geometry_.trimmed_nodes.size(); ++t) {
      geometry_.trimmed_from.push_back(t);
      geometry_.trimmed_weights.push_back(0.5f);
      geometry_.trimmed_begin.push_back(t + 1);
    }
    Random random(1);
    basis_.node_count = geometry_.active_nodes.size();
    for (int mode = 0; mode < 20; ++mode) {
      basis_.deviation_m.push_back(0.1f / static_cast<float>(1 + mode));
      basis_.unit.push_back(1e-4f * static_cast<float>(1 + mode));
      for (std::size_t i = 0; i < 3 * basis_.node_count; ++i)
        basis_.modes.push_back(static_cast<std::int16_t>(32767 * random.symmetric()));
    }
    skin_ = {field(Bone::neck, {4, 3, 2}), field(Bone::head, {3, 5, 7})};
  }
  // Makes distances that a byte represents exactly, so that they come back unchanged.
  static SkinDistanceField field(Bone bone, const std::array<int, 3>& dims) {
    SkinDistanceField field{bone, Vec3f(-0.1f, 0.2f, 0.05f), 0.008f, dims, {}};
    for (int node = 0; node < dims[0] * dims[1] * dims[2]; ++node)
      field.distance.push_back(distance_of_skin_byte(static_cast<std::uint8_t>(37 * node * node)));
    return field;
  }
  [[nodiscard]] Bytes encoded() const { return encode_basis(geometry_, basis_, skin_); }

  LevelGeometry geometry_;
  Basis basis_;
  Skin skin_;
};

TEST_F(BasisFile, comes_back_the_same) {
  const Bytes bytes = encoded();
  const Result<HairBasis> got = decode_basis(bytes);
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->basis.node_count, basis_.node_count);
  EXPECT_EQ(got->basis.modes, basis_.modes);
  EXPECT_EQ(got->basis.unit, basis_.unit);
  EXPECT_EQ(got->basis.deviation_m, basis_.deviation_m);
  EXPECT_EQ(got->geometry.lattice.dims, geometry_.lattice.dims);
  EXPECT_EQ(got->geometry.active_nodes, geometry_.active_nodes);
  EXPECT_EQ(got->geometry.trimmed_weights, geometry_.trimmed_weights);
  ASSERT_EQ(got->skin.size(), skin_.size());
  for (std::size_t f = 0; f < skin_.size(); ++f) {
    EXPECT_EQ(got->skin[f].bone, skin_[f].bone);
    EXPECT_EQ(got->skin[f].origin, skin_[f].origin);
    EXPECT_EQ(got->skin[f].cell_m, skin_[f].cell_m);
    EXPECT_EQ(got->skin[f].dims, skin_[f].dims);
    EXPECT_EQ(got->skin[f].distance, skin_[f].distance);
  }
  EXPECT_EQ(encode_basis(got->geometry, got->basis, got->skin), bytes);
}

TEST_F(BasisFile, rounds_distances_to_a_byte_near_the_skin_and_ends_them_far_from_it) {
  for (std::size_t node = 0; node < skin_[0].distance.size(); ++node)
    skin_[0].distance[node] = 0.01f * static_cast<float>(node) - 0.1f;
  const Result<HairBasis> got = decode_basis(encoded());
  ASSERT_TRUE(got) << got.error();
  const float farthest_m = distance_of_skin_byte(255);
  // Byte 255 means 15.75 mm outside of the skin (skin_distance_field.hpp).
  EXPECT_GT(farthest_m, 0.015f);
  for (std::size_t node = 0; node < skin_[0].distance.size(); ++node)
    EXPECT_NEAR(got->skin[0].distance[node], std::clamp(skin_[0].distance[node], kSkinDeepest_m, farthest_m),
                0.5001f * kSkinStep_m);
}

TEST_F(BasisFile, has_no_skin_where_the_groom_has_no_body) {
  skin_.clear();
  const Result<HairBasis> got = decode_basis(encoded());
  ASSERT_TRUE(got) << got.error();
  EXPECT_TRUE(got->skin.empty());
}

TEST_F(BasisFile, that_is_corrupted_is_refused_or_valid) {
  const Bytes bytes = encoded();
  // Every seventh truncation is tried, as each one unpacks the file.
  for (std::size_t size = 0; size < bytes.size(); size += 7) {
    EXPECT_FALSE(decode_basis(std::span(bytes).first(size))) << size;
  }
  const Bytes table = unpack(bytes, kPackedBasis).value();
  Random random(2);
  int accepted = 0;
  for (int round = 0; round < 5000; ++round) {
    Bytes corrupted = table;
    for (std::uint64_t n = 0; n <= random.next() % 4; ++n)
      corrupted[random.next() % corrupted.size()] = static_cast<std::uint8_t>(random.next());
    const Result<HairBasis> got = decode_basis(pack(corrupted, kPackedBasis));
    if (!got) continue;
    ++accepted;
    ASSERT_EQ(validate(got->basis), "");
    ASSERT_EQ(validate(got->geometry), "");
    ASSERT_EQ(validate(got->skin), "");
    ASSERT_EQ(got->geometry.active_nodes.size(), got->basis.node_count);
  }
  EXPECT_GT(accepted, 0);
}

TEST_F(BasisFile, of_other_counts_is_refused) {
  const auto error_of = [this](const auto& corrupt) {
    HairBasis file{geometry_, basis_, skin_};
    corrupt(file);
    const Result<HairBasis> got = decode_basis(encode_basis(file.geometry, file.basis, file.skin));
    return got ? std::string() : got.error();
  };
  EXPECT_EQ(error_of([](HairBasis&) {}), "");
  constexpr float kInfinity = std::numeric_limits<float>::infinity();
  const auto corrupted = [&](auto&& corrupt) {
    return error_of([&](HairBasis& file) { corrupt(file.geometry); }) != "";
  };
  // A viewer allocates by these counts and indexes with these numbers, so each must be refused.
  EXPECT_TRUE(corrupted([](LevelGeometry& g) { g.lattice.dims[0] = -1; }));
  EXPECT_TRUE(corrupted([](LevelGeometry& g) { g.lattice.dims[2] = 1 << 30; }));
  EXPECT_TRUE(corrupted([](LevelGeometry& g) { g.lattice.dims = {0, 0, 0}; }));
  EXPECT_TRUE(corrupted([=](LevelGeometry& g) { g.lattice.origin.x() = kInfinity; }));
  EXPECT_TRUE(corrupted([](LevelGeometry& g) { g.lattice.origin.x() = 2 * kLatticeCoordinateMax_m; }));
  EXPECT_TRUE(corrupted([](LevelGeometry& g) { g.lattice.spacing.z() = 0; }));
  EXPECT_TRUE(corrupted([](LevelGeometry& g) { g.trimmed_from[0] = 1u << 31; }));
  EXPECT_TRUE(corrupted([=](LevelGeometry& g) { g.trimmed_weights[0] = kInfinity; }));
  EXPECT_TRUE(corrupted([](LevelGeometry& g) { g.trimmed_begin.clear(); }));
  EXPECT_TRUE(corrupted([](LevelGeometry& g) { g.trimmed_begin.back() += 1; }));
  EXPECT_NE(error_of([](HairBasis& file) { file.geometry.lattice.spacing.x() = 1e9f; }), "");
  EXPECT_NE(error_of([](HairBasis& file) { file.geometry.trimmed_nodes.pop_back(); }), "");
  EXPECT_FALSE(decode_basis(Bytes(100, 0)));
}

TEST_F(BasisFile, of_a_wrong_skin_is_refused) {
  const Bytes table = unpack(encoded(), kPackedBasis).value();
  // Replaces the first number with the bytes of `before` in the file by `after`, and returns the decoder's error.
  const auto error_of = [&](const auto& before, const auto& after) {
    static_assert(sizeof before == sizeof after);
    Bytes corrupted = table;
    const auto* from = reinterpret_cast<const std::uint8_t*>(&before);
    const auto at = std::search(corrupted.begin(), corrupted.end(), from, from + sizeof before);
    EXPECT_NE(at, corrupted.end());
    std::memcpy(&*at, &after, sizeof after);
    const Result<HairBasis> got = decode_basis(pack(corrupted, kPackedBasis));
    return got ? std::string() : got.error();
  };
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  EXPECT_EQ(error_of(skin_[0].origin, Vec3f(0, 0, 0)), "");
  EXPECT_EQ(error_of(skin_[0].origin, Vec3f(0, kNaN, 0)), "skin: an origin is not finite");
  EXPECT_EQ(error_of(skin_[0].cell_m, kNaN), "skin: a cell without size");
  EXPECT_EQ(error_of(skin_[0].cell_m, -0.008f), "skin: a cell without size");
  // The head's field has 3 x 5 x 7 = 105 distances.
  EXPECT_EQ(error_of(std::uint32_t{105}, std::uint32_t{104}), "skin: counts disagree");
}

}  // namespace
}  // namespace hairnet::wire
