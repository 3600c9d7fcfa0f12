#pragma once

#include <gtest/gtest.h>

#include <optional>
#include <string>
#include <vector>

#include "client/draw/character_records.hpp"
#include "client/render/egl_context.hpp"
#include "client/render/lattice_pass.hpp"
#include "client/render/vector_texture.hpp"
#include "core/ffd/lattice.hpp"
#include "core/ffd/skin_push.hpp"
#include "core/levels/make_skin.hpp"
#include "core/random.hpp"
#include "tests/support/corpus.hpp"

// Shares lattices, hairstyles and a graphics context between the tests that compare shaders with core.
namespace hairnet::render {
using namespace draw;

struct Nodes {
  LevelGeometry geometry;
  std::vector<Vec3f> displacements;
};

// Moves every node at random by up to 5 cm on each axis. Neighbours then differ far more than in the motion of hair, so
// that a wrong weight shows.
inline Nodes rough_nodes(const Lattice& lattice, std::uint64_t seed) {
  Nodes nodes;
  nodes.geometry.lattice = lattice;
  Random random(seed);
  for (std::size_t n = 0; n < lattice.node_count(); ++n)
    nodes.displacements.push_back(0.05f *
                                  Vec3(random.symmetric(), random.symmetric(), random.symmetric()).cast<float>());
  return nodes;
}

// A graphics context, and the textures from which shaders read characters.
class ShaderTest : public testing::Test {
 protected:
  void SetUp() override {
    Result<EglContext> context = EglContext::create();
    if (!context) GTEST_SKIP() << "NOT TESTED: " << context.error();
    context_.emplace(std::move(*context));
    records_.emplace(kRecordsUnit, CharacterRecords::kRecordTexels);
    Result<LatticePass> lattices = LatticePass::build();
    ASSERT_TRUE(lattices) << lattices.error();
    lattices_.emplace(std::move(*lattices));
    set_up_drawing();
  }
  void TearDown() override {
    tear_down_drawing();
    lattices_.reset();
    records_.reset();
  }
  virtual void set_up_drawing() = 0;
  virtual void tear_down_drawing() = 0;

  // Fills the records of two characters; the second has the nodes and the pose. Displacements are in head space, so
  // without a skin the poses do not matter. `nodes` null: at rest. `first` and `second`: the rows of their points.
  void fill_records(const Nodes* nodes, float quadratic, const CharacterRecords::PointRows& first = {},
                    const CharacterRecords::PointRows& second = {}) {
    std::array<ShownCharacter, 2> characters;
    ShownCharacter& character = characters[1];
    if (nodes != nullptr) character.lattice = {&nodes->geometry, nodes->displacements};
    character.pose = pose_;
    DrawDetail detail;
    detail.quadratic = quadratic;
    CharacterRecords records;
    records.begin(characters);
    records.add(0, Vec3::Zero(), {}, 1, first);
    records.add(1, Vec3::Zero(), detail, 4e-4f, second);
    records_->fill(records.records());
    lattices_->run(records);
  }

  std::optional<EglContext> context_;
  std::optional<VectorTexture> records_;
  std::optional<LatticePass> lattices_;
  Pose pose_ = rigid_pose({Quat(Eigen::AngleAxisd(0.7, Vec3(1, 2, 3).normalized())), Vec3(3, 1, -2)});
};

// Returns a pose in which neck, shoulders and trunk have moved against the head, each in another way.
inline Pose bent(Pose pose) {
  for (std::size_t b = 1; b < kBoneCount; ++b) {
    const auto by = static_cast<double>(b);
    pose.bones[b] =
        pose.bones[b] * RigidTransform{Quat(Eigen::AngleAxisd(0.12 * by, Vec3(1, by - 2, 0.5).normalized())),
                                       Vec3(0.01, 0.004 * by, 0.02)};
  }
  return pose;
}

// Tests may draw with a software renderer. So many strands have all features of a made hairstyle, and are drawn fast
// enough.
inline constexpr std::size_t kMadeStrands = 600;

inline std::vector<std::string> all_grooms() {
  std::vector<std::string> names = fidelity::made_grooms();
  names.insert(names.end(), std::begin(fidelity::kRealGrooms), std::end(fidelity::kRealGrooms));
  return names;
}

inline bool can_load(const std::string& groom) {
  return groom.starts_with("made:") || fidelity::has_real_data();
}

}  // namespace hairnet::render
