#pragma once

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include "core/ffd/deform.hpp"
#include "tests/support/case_name.hpp"
#include "tests/support/levels.hpp"

// Lattices, shapes of them and points of all sorts, for tests of the wide FFD.
namespace hairnet::deform_cases {

// Quadratic FFD is used for near hair, and linear FFD, which is cheaper, for far hair.
inline constexpr support::Named<FfdKind> kFfdKinds[] = {{"quadratic", FfdKind::quadratic}, {"linear", FfdKind::linear}};

// Makes a lattice whose first node is at (-10, -30, -15) cm; cells are 3, 5 and 4 cm long. The sizes differ, so that a
// test finds axes that are mixed up.
inline Lattice make_lattice(std::array<int, 3> dims) {
  return {Vec3f(-0.1f, -0.3f, -0.15f), Vec3f(0.03f, 0.05f, 0.04f), dims};
}

inline std::vector<Vec3f> random_displacements(const Lattice& lattice, float size_m, unsigned seed) {
  std::mt19937 random(seed);
  std::vector<Vec3f> displacements(lattice.node_count());
  for (Vec3f& d : displacements) d = support::random_vec(random, size_m);
  return displacements;
}

// Points with everything that a Deformer takes of them. Every fifth has a blend of 0 (it stays with the skull),
// every fifth a blend of 1 (it follows the lattice), and the others have a random one.
struct Points {
  std::vector<Vec3f> x;
  std::vector<float> blend;
  RestTangents rest;

  void add(const Vec3f& point, std::mt19937& random) {
    std::uniform_real_distribution<float> unit(0, 1);
    x.push_back(point);
    blend.push_back(x.size() % 5 == 0 ? 0.0f : x.size() % 5 == 1 ? 1.0f : unit(random));
    rest.direction.push_back(support::random_vec(random, 1).normalized());
    // The slope is drawn up to 100 per m. The blend of the usual root length, 2 cm, has a slope of up to 43 per m.
    rest.blend_slope.push_back(100 * unit(random));
  }
  [[nodiscard]] Deformer deformer(const Lattice& lattice, FfdKind kind) const {
    return {lattice, x, blend, rest, kind};
  }
};

// Makes points everywhere in the grid and in a crowd at its centre. Others lie on nodes and in the middle between
// nodes, just within and beyond the border, and up to one and a half times the grid's size outside.
inline Points make_points(const Lattice& lattice, unsigned seed) {
  std::mt19937 random(seed);
  Points points;
  const Vec3f size(lattice.spacing.cwiseProduct(Vec3f(static_cast<float>(lattice.dims[0] - 1),
                                                      static_cast<float>(lattice.dims[1] - 1),
                                                      static_cast<float>(lattice.dims[2] - 1))));
  const Vec3f centre = lattice.origin + 0.5f * size;
  const auto in_box = [&](float scale) {
    return Vec3f(centre + support::random_vec(random, 1).cwiseProduct(0.5f * scale * size));
  };
  for (int i = 0; i < 1000; ++i) points.add(in_box(1), random);
  for (int i = 0; i < 300; ++i) points.add(centre + support::random_vec(random, 0.01f), random);
  for (int i = 0; i < 400; ++i) points.add(in_box(1.3f), random);
  for (int i = 0; i < 200; ++i) points.add(in_box(4), random);
  for (std::uint32_t n = 0; n < lattice.node_count(); ++n) {
    points.add(lattice.node(n), random);
    points.add(lattice.node(n) + 0.5f * lattice.spacing, random);
    points.add(lattice.node(n) - 0.5f * lattice.spacing, random);
  }
  return points;
}

// Returns how much displacements grow at a point outside the grid, where they are extrapolated: the factors of the
// three axes multiply. It is 1 inside.
inline double reach(const Lattice& lattice, const Vec3f& x) {
  double factor = 1;
  for (int a = 0; a < 3; ++a) {
    const double g = static_cast<double>((x[a] - lattice.origin[a]) / lattice.spacing[a]);
    const double most = lattice.dims[static_cast<std::size_t>(a)] - 1.0;
    factor *= 1 + 2 * std::max({0.0, -g, g - most});
  }
  return factor;
}

}  // namespace hairnet::deform_cases
