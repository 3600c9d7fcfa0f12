#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "core/groom/groom.hpp"

// Small grooms put together by hand, with the unusual strands that real ones have. Lengths are in metres, in head
// space.
namespace hairnet::support {

// Adds a strand, and the groups up to its own where the groom lacks them.
inline void add(Groom& groom, const std::vector<Vec3f>& strand, StrandProperties properties = {}) {
  if (groom.group_names.size() <= properties.group) groom.group_names.resize(properties.group + 1u, "group");
  groom.add_strand(strand, properties);
}

// Makes a straight strand of this length from `root` along `direction`, in `segment_count` equal segments.
inline std::vector<Vec3f> straight(const Vec3f& root, const Vec3f& direction, float length_m, int segment_count) {
  std::vector<Vec3f> strand;
  for (int i = 0; i <= segment_count; ++i) {
    strand.push_back(root +
                     direction.normalized() * (length_m * static_cast<float>(i) / static_cast<float>(segment_count)));
  }
  return strand;
}

// Makes a helix about a vertical axis that runs down `length_m` in `turns` turns. With a length of 0 it is a ring.
inline std::vector<Vec3f> curl(const Vec3f& root, float radius_m, float length_m, int turns, int segment_count) {
  std::vector<Vec3f> strand;
  for (int i = 0; i <= segment_count; ++i) {
    const float s = static_cast<float>(i) / static_cast<float>(segment_count);
    const float angle = 2 * std::numbers::pi_v<float> * static_cast<float>(turns) * s;
    strand.push_back(root + Vec3f(radius_m * std::cos(angle), -length_m * s, radius_m * std::sin(angle)));
  }
  return strand;
}

// Makes a random walk of `segment_count` steps of about 2 cm that tends downwards.
inline std::vector<Vec3f> wander(std::mt19937& random, int segment_count) {
  std::uniform_real_distribution<float> range(-1, 1);
  const auto vec = [&] {
    const float x = range(random), y = range(random), z = range(random);
    return Vec3f(x, y, z);
  };
  std::vector<Vec3f> strand{0.1f * vec()};
  for (int i = 0; i < segment_count; ++i) strand.push_back(strand.back() + 0.02f * (vec() - Vec3f(0, 0.7f, 0)));
  return strand;
}

// Makes one strand that runs from end to end of its box `turns` times. Each run crosses all planes of the lattice and
// makes a spring at each, so its levels are costly to build.
inline Groom make_zigzag(int turns) {
  Groom groom;
  std::mt19937 random(1);
  std::uniform_real_distribution<float> place(-0.1f, 0.1f);
  std::vector<Vec3f> strand;
  for (int i = 0; i <= turns; ++i) {
    const float y = place(random), z = place(random);
    strand.emplace_back(i % 2 ? 0.15f : -0.15f, y, z);
  }
  add(groom, strand);
  return groom;
}

// Makes strands with 16 points that grow on the upper part of a head of 9 cm radius and hang 25 cm. They are in two
// groups.
inline Groom make_head_of_hair(int strand_count, unsigned seed = 1) {
  Groom groom;
  std::mt19937 random(seed);
  std::uniform_real_distribution<float> range(0, 1);
  for (int s = 0; s < strand_count; ++s) {
    const float azimuth = 2 * std::numbers::pi_v<float> * range(random), height = 0.2f + 0.8f * range(random);
    const float ring = std::sqrt(1 - height * height);
    const Vec3f out(ring * std::cos(azimuth), height, ring * std::sin(azimuth));
    std::vector<Vec3f> strand;
    for (int i = 0; i <= 15; ++i) {
      const float s01 = static_cast<float>(i) / 15;
      strand.push_back(0.09f * out + 0.04f * std::sqrt(s01) * out - Vec3f(0, 0.25f * s01 * s01, 0));
    }
    add(groom, strand, {.hair_count = 20, .group = static_cast<std::uint16_t>(s % 2)});
  }
  return groom;
}

// Makes a groom with every unusual kind of strand that a valid groom may hold, beside 40 ordinary strands.
inline Groom make_odd_groom() {
  Groom groom = make_head_of_hair(40);
  // This strand has no point.
  add(groom, {});
  // This strand is a single point.
  add(groom, {{0.01f, 0.02f, 0.03f}});
  // All points of this strand lie in one place.
  add(groom, std::vector<Vec3f>(5, Vec3f(0.02f, 0.05f, 0)));
  // This strand has a length of 0.1 um, below kLengthMin, 10 um.
  add(groom, {{0, 0.09f, 0}, {1e-7f, 0.09f, 0}});
  // This is a tight curl of eight turns.
  add(groom, curl({0.1f, 0.05f, 0}, 0.03f, 0.2f, 8, 200));
  // This is a closed ring, whose root and tip are one point.
  add(groom, curl({0, 0.1f, 0.1f}, 0.02f, 0, 1, 32));
  // This strand starts in mid-air.
  add(groom, straight({0, 0.08f, -0.1f}, {0, 0, -1}, 0.15f, 2), {.rooted = false});
  // This strand stands up and is one long segment.
  add(groom, straight({-0.08f, 0, 0}, {0, 1, 0}, 0.2f, 1));
  // This strand lies within one cell of the lattice.
  add(groom, straight({0.05f, 0, 0}, {1, 1, 1}, 0.004f, 3));
  // This strand turns back on itself.
  add(groom, {{0, 0.1f, 0}, {0, -0.1f, 0}, {0, 0.1f, 0}, {0, -0.1f, 0}});
  return groom;
}

// Returns the metres of real hair: the sum over all strands of hair count times arc length.
inline double hair_length(const Groom& groom) {
  double sum = 0;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    const auto points = groom.strand_points(s);
    for (std::size_t i = 1; i < points.size(); ++i) {
      sum += static_cast<double>(groom.strands[s].hair_count) * (points[i] - points[i - 1]).cast<double>().norm();
    }
  }
  return sum;
}

// Adds a closed ellipsoid whose vertices all move with one bone.
inline void add_ellipsoid(Body& body, const Vec3f& centre, const Vec3f& radii, Bone bone) {
  constexpr int kRings = 24, kSectors = 36;
  const auto first = static_cast<std::uint32_t>(body.mesh.vertices.size());
  for (int r = 0; r <= kRings; ++r) {
    const float theta = std::numbers::pi_v<float> * static_cast<float>(r) / kRings;
    for (int s = 0; s < kSectors; ++s) {
      const float phi = 2 * std::numbers::pi_v<float> * static_cast<float>(s) / kSectors;
      const Vec3f unit(std::sin(theta) * std::cos(phi), std::cos(theta), -std::sin(theta) * std::sin(phi));
      body.mesh.vertices.push_back(centre + radii.cwiseProduct(unit));
      body.bone_weights.push_back({});
      body.bone_weights.back()[static_cast<std::size_t>(bone)] = 1;
    }
  }
  const auto at = [&](int r, int s) { return first + static_cast<std::uint32_t>(r * kSectors + s % kSectors); };
  for (int r = 0; r < kRings; ++r) {
    for (int s = 0; s < kSectors; ++s) {
      body.mesh.triangles.push_back({at(r, s), at(r + 1, s), at(r + 1, s + 1)});
      body.mesh.triangles.push_back({at(r, s), at(r + 1, s + 1), at(r, s + 1)});
    }
  }
}

// Makes a body of overlapping ellipsoids about the size of an adult: head, neck, shoulders and trunk.
inline Body make_plain_body() {
  Body body;
  add_ellipsoid(body, {0, 0.05f, 0.02f}, {0.075f, 0.11f, 0.095f}, Bone::head);
  add_ellipsoid(body, {0, -0.1f, -0.01f}, {0.055f, 0.09f, 0.055f}, Bone::neck);
  add_ellipsoid(body, {0.12f, -0.2f, -0.02f}, {0.1f, 0.05f, 0.06f}, Bone::left_shoulder);
  add_ellipsoid(body, {-0.12f, -0.2f, -0.02f}, {0.1f, 0.05f, 0.06f}, Bone::right_shoulder);
  add_ellipsoid(body, {0, -0.32f, -0.02f}, {0.16f, 0.16f, 0.1f}, Bone::upper_trunk);
  return body;
}

}  // namespace hairnet::support
