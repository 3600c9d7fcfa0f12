// Compares the nodes of lattices that the GPU makes with those of core.
#include <gmock/gmock.h>

#include <cmath>
#include <limits>

#include "client/assets/made/made.hpp"
#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "tests/unit/client/shader_cases.hpp"

namespace hairnet::render {
using namespace draw;

namespace {

// This is far below what is seen; both sums round in float, in another order.
constexpr float kNode_m = 1e-5f;

// Builds a hairstyle with its levels and a basis of as many modes as there may be.
struct Hair {
  explicit Hair(const char* style) {
    HairstyleOptions options;
    options.strand_count = 200;
    groom = *make_hairstyle(style, options);
    levels = build_levels(groom);
    modes = make_modes(groom, levels, {}, {}, {.duration_s = 2, .error_max = 0});
    basis = {modes, &modes->basis};
  }
  [[nodiscard]] const LevelGeometry& geometry() const { return (*levels)[LevelIndex::high].geometry; }

  Groom groom;
  std::shared_ptr<const LevelSet> levels;
  std::shared_ptr<const Modes> modes;
  std::shared_ptr<const Basis> basis;
};

class LatticePassTest : public ShaderTest {
 protected:
  static void SetUpTestSuite() { hair_ = new Hair("long_curly"); }
  static void TearDownTestSuite() { delete hair_; }
  void set_up_drawing() override {}
  void tear_down_drawing() override {}

  // Returns random coefficients of up to twice their usual deviation, as in lively motion.
  static std::vector<float> coefficients(std::size_t count, std::uint64_t seed) {
    Random random(seed);
    std::vector<float> out;
    for (std::size_t k = 0; k < count; ++k)
      out.push_back(2 * hair_->basis->deviation_m[k] * static_cast<float>(random.symmetric()));
    return out;
  }
  static MovedLattice moved(std::span<const float> by) { return {&hair_->geometry(), {}, hair_->basis, by}; }

  // Returns the nodes of all characters as the GPU has made them. Reads them at the rows that the records say, and adds
  // the records from the last one to the first, so that their order differs from that of the rows.
  std::vector<std::vector<Vec3f>> nodes_from_gpu(std::span<const MovedLattice> lattices) {
    std::vector<ShownCharacter> characters(lattices.size());
    for (std::size_t i = 0; i < lattices.size(); ++i) characters[i].lattice = lattices[i];
    picture_.begin(characters, sum_);
    for (std::size_t i = lattices.size(); i-- > 0;) picture_.add(i, Vec3::Zero(), {}, 1, {});
    records_->fill(picture_.records());
    lattices_->run(picture_);
    std::vector<std::vector<Vec3f>> nodes;
    glBindFramebuffer(GL_FRAMEBUFFER, lattices_->nodes());
    for (std::size_t i = 0; i < lattices.size(); ++i) {
      const Eigen::Vector4f* texels =
          picture_.records().data() + (lattices.size() - 1 - i) * CharacterRecords::kRecordTexels;
      std::vector<Vec3f>& read = nodes.emplace_back();
      if (texels[4].z() == 0) continue;
      // Texel 17 of a record says where the nodes begin, counted in texels.
      const std::size_t rows = node_rows(*lattices[i].geometry);
      // The texture holds the bits of floats as integers, so reading them as integers changes nothing.
      std::vector<std::array<float, 4>> bits(rows * kLatticeRow);
      glReadPixels(0, static_cast<GLint>(texels[17].w()) / static_cast<GLint>(kLatticeRow), kLatticeRow,
                   static_cast<GLsizei>(rows), GL_RGBA_INTEGER, GL_UNSIGNED_INT, bits.data());
      for (std::size_t n = 0; n < lattices[i].geometry->lattice.node_count(); ++n)
        read.emplace_back(bits[n][0], bits[n][1], bits[n][2]);
    }
    EXPECT_EQ(glGetError(), static_cast<GLenum>(GL_NO_ERROR));
    return nodes;
  }
  // Returns the largest distance between a node of the GPU and that of core.
  float furthest(std::span<const MovedLattice> lattices) {
    const auto nodes = nodes_from_gpu(lattices);
    float most = 0;
    for (std::size_t i = 0; i < lattices.size(); ++i) {
      std::vector<Vec3f> scratch;
      const std::span<const Vec3f> wanted = nodes_of(lattices[i], scratch);
      if (nodes[i].size() != wanted.size()) return std::numeric_limits<float>::infinity();
      for (std::size_t n = 0; n < wanted.size(); ++n) most = std::max(most, (nodes[i][n] - wanted[n]).norm());
    }
    return most;
  }

  // Returns how many lattices of the last image were computed or uploaded. Texel 4 says whether a lattice moves hair,
  // and texel 16 is negative where nodes remain from the image before.
  [[nodiscard]] std::size_t new_count() const {
    std::size_t count = 0;
    for (std::size_t i = 0; i < picture_.count(); ++i) {
      const Eigen::Vector4f* texels = picture_.records().data() + i * CharacterRecords::kRecordTexels;
      if (texels[4].z() == 1 && texels[16].w() >= 0) ++count;
    }
    return count;
  }

  static inline Hair* hair_ = nullptr;
  CharacterRecords picture_;
  NodeSum sum_ = NodeSum::gpu;
};

TEST_F(LatticePassTest, nodes_from_coefficients_are_those_of_core) {
  const auto all = coefficients(hair_->basis->mode_count(), 1), few = coefficients(5, 2), none = coefficients(0, 3);
  std::vector<float> zeros = coefficients(40, 4);
  for (std::size_t k = 17; k < zeros.size(); ++k) zeros[k] = 0;
  ASSERT_FALSE(hair_->geometry().trimmed_nodes.empty());
  const std::array lattices{moved(all), moved(few), moved(none), moved(zeros)};
  const float apart = furthest(lattices);
  EXPECT_LT(apart, kNode_m);
  RecordProperty("furthest_nm", static_cast<int>(std::ceil(1e9f * apart)));
  std::vector<Vec3f> scratch;
  float most = 0;
  for (const Vec3f& u : nodes_of(lattices[0], scratch)) most = std::max(most, u.norm());
  // The nodes must move by more than 5 cm, or equal nodes would say little.
  EXPECT_GT(most, 0.05f);
}

// A program may sum up modes on either side, and hair must look the same.
TEST_F(LatticePassTest, gpu_and_processor_give_the_same_nodes) {
  const auto all = coefficients(hair_->basis->mode_count(), 1), few = coefficients(5, 2);
  const std::array lattices{moved(all), moved(few)};
  const auto by_gpu = nodes_from_gpu(lattices);
  EXPECT_TRUE(picture_.uploaded_nodes().empty());
  picture_ = {};
  sum_ = NodeSum::processor;
  const auto by_processor = nodes_from_gpu(lattices);
  EXPECT_EQ(picture_.uploaded_nodes().size(), 2 * kLatticeRow);
  for (std::size_t i = 0; i < lattices.size(); ++i) {
    ASSERT_EQ(by_gpu[i].size(), by_processor[i].size());
    for (std::size_t n = 0; n < by_gpu[i].size(); ++n)
      ASSERT_LT((by_gpu[i][n] - by_processor[i][n]).norm(), kNode_m) << n;
  }
}

TEST_F(LatticePassTest, hair_that_sleeps_is_not_summed_up_again) {
  const Nodes other = rough_nodes({Vec3f::Zero(), Vec3f::Constant(0.05f), {13, 12, 11}}, 7);
  const MovedLattice uploaded{&other.geometry, other.displacements};
  for (const NodeSum sum : {NodeSum::gpu, NodeSum::processor}) {
    picture_ = {};
    sum_ = sum;
    auto first = coefficients(20, 1), second = coefficients(9, 2);
    std::vector<MovedLattice> lattices{moved(first), moved(second), moved(first)};
    EXPECT_LT(furthest(lattices), kNode_m);
    EXPECT_EQ(new_count(), 3u);
    EXPECT_LT(furthest(lattices), kNode_m);
    EXPECT_EQ(new_count(), 0u);
    // The same coefficients again need no sum. A lattice with other coefficients needs one.
    second[8] *= -1;
    EXPECT_LT(furthest(lattices), kNode_m);
    EXPECT_EQ(new_count(), 1u);
    // For a lattice that comes, the texture grows and loses all nodes. When it goes again, only the rows of the two
    // after it move.
    lattices.insert(lattices.begin() + 1, uploaded);
    EXPECT_LT(furthest(lattices), kNode_m);
    EXPECT_EQ(new_count(), 4u);
    lattices.erase(lattices.begin() + 1);
    EXPECT_LT(furthest(lattices), kNode_m);
    EXPECT_EQ(new_count(), 2u);
    lattices[2] = moved(second);
    EXPECT_LT(furthest(lattices), kNode_m);
    EXPECT_EQ(new_count(), 1u);
  }
}

TEST_F(LatticePassTest, basis_at_the_address_of_one_that_is_gone_is_another) {
  const auto c = coefficients(5, 1);
  Basis place = *hair_->basis;
  for (int round = 0; round < 2; ++round) {
    for (std::int16_t& integer : place.modes) integer = static_cast<std::int16_t>(-integer);
    // Both rounds have another basis at the same address. A comparison of addresses would take the second for the
    // first.
    const std::shared_ptr<const Basis> basis(&place, [](const Basis*) {});
    const std::array lattices{MovedLattice{&hair_->geometry(), {}, basis, c}};
    EXPECT_LT(furthest(lattices), kNode_m);
    EXPECT_EQ(new_count(), 1u);
    std::array<ShownCharacter, 1> unseen;
    unseen[0].lattice.geometry = &hair_->geometry();
    picture_.begin(unseen);
  }
}

TEST(NodeSum, software_renderers_leave_it_to_the_processor) {
  for (const char* software :
       {"llvmpipe (LLVM 15.0.6, 256 bits)", "softpipe", "Google SwiftShader", "Apple Software Renderer",
        "ANGLE (Google, Vulkan 1.3.0 (SwiftShader Device (Subzero) (0x0000C0DE)), SwiftShader driver)",
        "ANGLE (Microsoft, Microsoft Basic Render Driver Direct3D11 vs_5_0 ps_5_0, D3D11)"})
    EXPECT_EQ(node_sum_for(software), NodeSum::processor) << software;
  for (const char* gpu : {"NVIDIA H200/PCIe/SSE2", "ANGLE (Apple, ANGLE Metal Renderer: Apple M2, Unspecified Version)",
                          "Mesa Intel(R) UHD Graphics 620 (KBL GT2)", "Adreno (TM) 740", ""})
    EXPECT_EQ(node_sum_for(gpu), NodeSum::gpu) << gpu;
}

// Characters with two bases and characters whose nodes are uploaded come mixed. The memory of a basis that nobody
// uses must be freed.
TEST_F(LatticePassTest, bases_and_uploaded_nodes_share_a_picture) {
  Basis reversed = *hair_->basis;
  for (std::int16_t& integer : reversed.modes) integer = static_cast<std::int16_t>(-integer);
  auto other = std::make_shared<const Basis>(std::move(reversed));
  const Nodes large = rough_nodes({Vec3f::Zero(), Vec3f::Constant(0.05f), {13, 12, 11}}, 7);
  const auto c = coefficients(20, 1);
  const MovedLattice uploaded{&large.geometry, large.displacements};
  std::vector<MovedLattice> lattices{moved(c), uploaded, {&hair_->geometry(), {}, other, c}, uploaded, moved(c)};
  EXPECT_LT(furthest(lattices), kNode_m);
  EXPECT_EQ(lattices_->basis_bytes(), 2 * 16 * kLatticeRow * mode_rows(hair_->geometry(), *other));
  other.reset();
  lattices.erase(lattices.begin() + 2);
  EXPECT_LT(furthest(lattices), kNode_m);
  EXPECT_EQ(lattices_->basis_bytes(), 16 * kLatticeRow * mode_rows(hair_->geometry(), *hair_->basis));
}

TEST_F(LatticePassTest, coefficients_that_are_none_of_hair_move_nothing) {
  const auto valid = coefficients(3, 1);
  for (const float wrong : {std::numeric_limits<float>::quiet_NaN(), std::numeric_limits<float>::infinity(), 1e30f}) {
    const std::vector<float> c{0.1f, wrong};
    const std::array lattices{moved(c), moved(valid)};
    const auto nodes = nodes_from_gpu(lattices);
    EXPECT_TRUE(nodes[0].empty());
    // The high level has 10 x 10 x 10 nodes.
    EXPECT_EQ(nodes[1].size(), 1000u);
  }
}

TEST_F(LatticePassTest, basis_that_no_texture_has_room_for_is_summed_up_before) {
  const auto c = coefficients(30, 1);
  std::array<ShownCharacter, 1> characters;
  characters[0].lattice = moved(c);
  picture_.begin(characters, NodeSum::gpu, mode_rows(hair_->geometry(), *hair_->basis) - 1);
  picture_.add(0, Vec3::Zero(), {}, 1, {});
  std::vector<Vec3f> scratch;
  const std::span<const Vec3f> nodes = nodes_of(characters[0].lattice, scratch);
  ASSERT_EQ(picture_.uploaded_nodes().size(), kLatticeRow);
  for (std::size_t n = 0; n < nodes.size(); ++n) EXPECT_EQ(picture_.uploaded_nodes()[n].head<3>(), nodes[n]);
}

}  // namespace
}  // namespace hairnet::render
