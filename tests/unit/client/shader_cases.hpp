#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <string>
#include <vector>

#include "core/ffd/lattice.hpp"
#include "core/random.hpp"
#include "tests/fidelity/corpus.hpp"

// Lattices and hairstyles for tests of what shaders do to points.
namespace hairnet::view {

struct Layer {
  LevelGeometry geometry;
  std::vector<Vec3f> displacements;
  float weight = 1;
};

// Every node at random: far rougher than hair ever moves.
inline Layer rough_layer(const Lattice& lattice, std::uint64_t seed) {
  Layer layer;
  layer.geometry.lattice = lattice;
  Random random(seed);
  for (std::size_t n = 0; n < lattice.node_count(); ++n)
    layer.displacements.push_back(0.05f *
                                  Vec3(random.symmetric(), random.symmetric(), random.symmetric()).cast<float>());
  return layer;
}

inline std::vector<std::string> all_grooms() {
  std::vector<std::string> names = fidelity::made_grooms();
  names.insert(names.end(), std::begin(fidelity::kRealGrooms), std::end(fidelity::kRealGrooms));
  return names;
}

inline bool can_load(const std::string& groom) {
  return groom.starts_with("made:") || fidelity::has_real_data();
}

inline std::string test_name(const testing::TestParamInfo<std::string>& groom) {
  std::string name = groom.param;
  std::ranges::replace_if(
      name, [](unsigned char c) { return std::isalnum(c) == 0; }, '_');
  return name;
}

}  // namespace hairnet::view
