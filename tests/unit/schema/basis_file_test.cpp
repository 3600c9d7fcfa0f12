#include "schema/wire/basis_file.hpp"

#include <gtest/gtest.h>

#include "core/random.hpp"
#include "schema/wire/packing.hpp"

namespace hairnet::wire {
namespace {

using Bytes = std::vector<std::uint8_t>;

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
  }
  LevelGeometry geometry_;
  Basis basis_;
};

TEST_F(BasisFile, comes_back_the_same) {
  const Bytes bytes = encode_basis(geometry_, basis_);
  const Result<HairBasis> got = decode_basis(bytes);
  ASSERT_TRUE(got) << got.error();
  EXPECT_EQ(got->basis.node_count, basis_.node_count);
  EXPECT_EQ(got->basis.modes, basis_.modes);
  EXPECT_EQ(got->basis.unit, basis_.unit);
  EXPECT_EQ(got->basis.deviation_m, basis_.deviation_m);
  EXPECT_EQ(got->geometry.lattice.dims, geometry_.lattice.dims);
  EXPECT_EQ(got->geometry.active_nodes, geometry_.active_nodes);
  EXPECT_EQ(got->geometry.trimmed_weights, geometry_.trimmed_weights);
  EXPECT_EQ(encode_basis(got->geometry, got->basis), bytes);
}

TEST_F(BasisFile, that_is_spoilt_is_refused_or_valid) {
  const Bytes bytes = encode_basis(geometry_, basis_);
  for (std::size_t size = 0; size < bytes.size(); size += 7) {
    EXPECT_FALSE(decode_basis(std::span(bytes).first(size))) << size;
  }
  const Bytes table = unpack(bytes, kPackedBasis).value();
  Random random(2);
  int accepted = 0;
  for (int round = 0; round < 5000; ++round) {
    Bytes spoilt = table;
    for (std::uint64_t n = 0; n <= random.next() % 4; ++n)
      spoilt[random.next() % spoilt.size()] = static_cast<std::uint8_t>(random.next());
    const Result<HairBasis> got = decode_basis(pack(spoilt, kPackedBasis));
    if (!got) continue;
    ++accepted;
    ASSERT_EQ(validate(got->basis), "");
    ASSERT_EQ(validate(got->geometry), "");
    ASSERT_EQ(got->geometry.active_nodes.size(), got->basis.node_count);
  }
  EXPECT_GT(accepted, 0);
}

TEST_F(BasisFile, of_other_counts_is_refused) {
  const auto error_of = [this](const auto& spoil) {
    HairBasis file{geometry_, basis_};
    spoil(file);
    const Bytes table = unpack(encode_basis(file.geometry, file.basis), kPackedBasis).value();
    const Result<HairBasis> got = decode_basis(pack(table, kPackedBasis));
    return got ? std::string() : got.error();
  };
  EXPECT_EQ(error_of([](HairBasis&) {}), "");
  EXPECT_NE(error_of([](HairBasis& file) { file.geometry.lattice.spacing.x() = 1e9f; }), "");
  EXPECT_NE(error_of([](HairBasis& file) { file.geometry.trimmed_nodes.pop_back(); }), "");
  EXPECT_FALSE(decode_basis(Bytes(100, 0)));
}

}  // namespace
}  // namespace hairnet::wire
