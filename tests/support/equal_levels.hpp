#pragma once

#include <gtest/gtest.h>

#include "core/levels/level_map.hpp"

// Compare levels bit for bit and field by field, so that the failure names the field that differs.
namespace hairnet::support {

inline void expect_equal(const Stiffeners& a, const Stiffeners& b) {
  EXPECT_EQ(a.begin, b.begin);
  EXPECT_EQ(a.nodes, b.nodes);
  EXPECT_EQ(a.weights, b.weights);
  EXPECT_EQ(a.stiffness, b.stiffness);
  EXPECT_EQ(a.damping, b.damping);
  EXPECT_EQ(a.rest, b.rest);
}

inline void expect_equal(const Level& a, const Level& b) {
  EXPECT_EQ(a.geometry.lattice.origin, b.geometry.lattice.origin);
  EXPECT_EQ(a.geometry.lattice.spacing, b.geometry.lattice.spacing);
  EXPECT_EQ(a.geometry.lattice.dims, b.geometry.lattice.dims);
  EXPECT_EQ(a.geometry.active_nodes, b.geometry.active_nodes);
  EXPECT_EQ(a.geometry.trimmed_nodes, b.geometry.trimmed_nodes);
  EXPECT_EQ(a.geometry.trimmed_begin, b.geometry.trimmed_begin);
  EXPECT_EQ(a.geometry.trimmed_from, b.geometry.trimmed_from);
  EXPECT_EQ(a.geometry.trimmed_weights, b.geometry.trimmed_weights);
  EXPECT_EQ(a.displacement_max_m, b.displacement_max_m);
  EXPECT_EQ(a.rest, b.rest);
  EXPECT_EQ(a.mass, b.mass);
  EXPECT_EQ(a.ether_stiffness, b.ether_stiffness);
  EXPECT_EQ(a.ether_damping, b.ether_damping);
  EXPECT_EQ(a.drag, b.drag);
  expect_equal(a.springs, b.springs);
  expect_equal(a.attachments, b.attachments);
  ASSERT_EQ(a.skin->size(), b.skin->size());
  for (std::size_t f = 0; f < a.skin->size(); ++f) {
    const SkinDistanceField &of_a = (*a.skin)[f], &of_b = (*b.skin)[f];
    EXPECT_EQ(of_a.bone, of_b.bone);
    EXPECT_EQ(of_a.origin, of_b.origin);
    EXPECT_EQ(of_a.cell_m, of_b.cell_m);
    EXPECT_EQ(of_a.dims, of_b.dims);
    EXPECT_EQ(of_a.distance, of_b.distance);
  }
  EXPECT_EQ(a.contacts.begin, b.contacts.begin);
  EXPECT_EQ(a.contacts.nodes, b.contacts.nodes);
  EXPECT_EQ(a.contacts.weights, b.contacts.weights);
  EXPECT_EQ(a.contacts.rest, b.contacts.rest);
  EXPECT_EQ(a.contacts.potential, b.contacts.potential);
  EXPECT_EQ(a.contacts.limit, b.contacts.limit);
}

// Compares the maps between levels too, by what they make of the nodes of each level.
inline void expect_equal(const LevelSet& a, const LevelSet& b) {
  for (std::size_t from = 0; from < a.levels.size(); ++from) {
    SCOPED_TRACE(kLevelNames[from]);
    expect_equal(a.levels[from], b.levels[from]);
    for (std::size_t to = 0; to < a.levels.size(); ++to) {
      if (from == to) continue;
      // The rest positions stand in for displacements, since a map takes any vectors.
      std::vector<Vec3f> of_a(a.levels[to].rest.size()), of_b(of_a.size());
      a.maps[from][to]->apply(a.levels[from].rest, of_a);
      b.maps[from][to]->apply(a.levels[from].rest, of_b);
      EXPECT_EQ(of_a, of_b);
    }
  }
}

}  // namespace hairnet::support
