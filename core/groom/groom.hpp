#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/assert.hpp"
#include "core/groom/body.hpp"
#include "core/groom/fabric.hpp"
#include "core/groom/material.hpp"
#include "core/groom/root_blend.hpp"

namespace hairnet {

// The properties of one strand.
struct StrandProperties {
  // The radius of one real hair, for drawing.
  float radius_m = 4e-5f;
  // How many real hairs this strand represents. The number multiplies stiffness, mass and drag.
  float hair_count = 10;
  // The root length lambda_0 of eq. 7; zero means no root blend.
  float root_length_m = 0.02f;
  // The group of the strand, an index into Groom::group_names.
  std::uint16_t group = 0;
  // Whether the first point is on the skull.
  bool rooted = true;
};

// A lock of hair drawn as one ribbon of textured hair. It has the mechanics of a strand along its middle.
struct HairCard {
  // The points of both edges in pairs: left, right, left, right and so on, from the root.
  PointRange points;
  // The properties of the strand along the card's middle. Its radius_m is unused.
  StrandProperties properties;
};

// A strand that is drawn as a clump of hair: copies follow the strand at fixed offsets. The copies have no mechanics;
// hair_count is the number of real hairs that the strand and its copies represent together.
struct Clump {
  std::uint32_t strand = 0;
  std::uint16_t copy_count = 6;
  // The radius of the clump a little beyond the root; tip_radius_m is the one at the tip.
  float radius_m = 0.004f;
  float tip_radius_m = 0.002f;
};

// The immutable hairstyle: strands in head space (metres) as they lie on the upright head, other things in the hair
// (threads, cloth, knots), and the body below.
struct Groom {
  std::string name;
  // Strand by strand, root first; then those of the threads, of the cards and of the cloths. All code for points (the
  // lattice's box, the FFD, framing a picture) includes them in this way.
  std::vector<Vec3f> points;
  // Strand s has points [strand_begin[s], strand_begin[s + 1]).
  std::vector<std::uint32_t> strand_begin{0};
  std::vector<StrandProperties> strands;
  // There is at least one name once anything has a group.
  std::vector<std::string> group_names;
  MaterialSet materials;
  // One entry for each group, or none at all, which means eq. 7 everywhere.
  std::vector<RootBlend> root_blends;
  std::vector<Clump> clumps;
  std::vector<Thread> threads;
  std::vector<HairCard> cards;
  std::vector<Cloth> cloths;
  std::vector<Knot> knots;
  Body body;

  [[nodiscard]] std::size_t strand_count() const { return strands.size(); }
  [[nodiscard]] std::span<const Vec3f> strand_points(std::size_t s) const {
    HAIRNET_VALIDATE(s + 1 < strand_begin.size());
    return {points.data() + strand_begin[s], points.data() + strand_begin[s + 1]};
  }
  [[nodiscard]] std::span<const Vec3f> points_of(const PointRange& range) const {
    HAIRNET_VALIDATE(range.begin <= range.end && range.end <= points.size());
    return {points.data() + range.begin, points.data() + range.end};
  }

  // Each function sets the point range of the part that it adds. Asserts the order: strands, threads, cards, cloths.
  void add_strand(std::span<const Vec3f> strand, const StrandProperties& properties) {
    HAIRNET_ASSERT(threads.empty() && cards.empty() && cloths.empty());
    append(strand);
    strand_begin.push_back(static_cast<std::uint32_t>(points.size()));
    strands.push_back(properties);
  }
  void add_thread(std::span<const Vec3f> polyline, Thread thread) {
    HAIRNET_ASSERT(cards.empty() && cloths.empty());
    thread.points = append(polyline);
    threads.push_back(thread);
  }
  void add_card(std::span<const Vec3f> edges, const StrandProperties& properties) {
    HAIRNET_ASSERT(cloths.empty());
    const PointRange range = append(edges);
    cards.push_back({range, properties});
  }
  // The cloth's triangles count from the first of `vertices`.
  void add_cloth(std::span<const Vec3f> vertices, Cloth cloth);

 private:
  PointRange append(std::span<const Vec3f> more) {
    const auto begin = static_cast<std::uint32_t>(points.size());
    points.insert(points.end(), more.begin(), more.end());
    return {begin, static_cast<std::uint32_t>(points.size())};
  }
};

// Sets the material of all hair, or of one group, and the root length lambda_0 of its rooted strands.
void set_material(const Material& material, Groom& groom);
void set_group_material(std::uint16_t group, const Material& material, Groom& groom);
// The line along a card's middle, one point for each pair.
void middle_of(const Groom& groom, const HairCard& card, std::vector<Vec3f>& line);

// The largest groom that `validate` accepts. The limits bound the time and memory that a stranger's upload can take.
struct GroomLimits {
  std::size_t strand_count_max = 200'000;
  std::size_t point_count_max = 8'000'000;
  std::size_t vertex_count_max = 1'000'000;
  std::size_t group_count_max = 256;
  // The most copies in one clump.
  std::size_t copy_count_max = 64;
  // The most of each kind: threads, cards, cloths and knots.
  std::size_t fabric_count_max = 4096;
  // The greatest size of any coordinate.
  float coordinate_max_m = 10;
};

// Returns an empty string when the groom is valid: consistent offsets, finite and bounded numbers, valid groups,
// weights and triangles. Otherwise one line says what is wrong and where. Empty and single-point strands are valid.
std::string validate(const Groom& groom, const GroomLimits& limits = {});

}  // namespace hairnet
