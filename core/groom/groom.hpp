#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "core/groom/body.hpp"
#include "core/groom/material.hpp"

namespace hairnet {

struct StrandProperties {
  float radius_m = 4e-5f;       // of one real hair, for drawing
  float hair_count = 10;        // real hairs this strand stands for: multiplies stiffness, mass and drag
  float root_length_m = 0.02f;  // lambda_0 of eq. 7; 0 = no root blend
  std::uint16_t group = 0;      // index into Groom::group_names
  bool rooted = true;           // its first point is on the skull
};

// The immutable hairstyle: strands in head space (metres) as they lie on the upright head, and the body under them.
struct Groom {
  std::string name;
  std::vector<Vec3f> points;                   // strand by strand, root first
  std::vector<std::uint32_t> strand_begin{0};  // strand s has points [strand_begin[s], strand_begin[s + 1])
  std::vector<StrandProperties> strands;
  std::vector<std::string> group_names;  // at least one once there are strands
  MaterialSet materials;
  Body body;

  [[nodiscard]] std::size_t strand_count() const { return strands.size(); }
  [[nodiscard]] std::span<const Vec3f> strand_points(std::size_t s) const {
    return {points.data() + strand_begin[s], points.data() + strand_begin[s + 1]};
  }
  void add_strand(std::span<const Vec3f> strand, const StrandProperties& properties) {
    points.insert(points.end(), strand.begin(), strand.end());
    strand_begin.push_back(static_cast<std::uint32_t>(points.size()));
    strands.push_back(properties);
  }
};

// All hair is of this material from now on, or all of one group; lambda_0 of rooted strands is set by it.
void set_material(const Material& material, Groom& groom);
void set_group_material(std::uint16_t group, const Material& material, Groom& groom);

struct GroomLimits {
  std::size_t strand_count_max = 200'000;
  std::size_t point_count_max = 8'000'000;
  std::size_t vertex_count_max = 1'000'000;
  std::size_t group_count_max = 256;
  float coordinate_max_m = 10;  // every coordinate's absolute value
};

// Empty when the groom is sound: consistent offsets, finite and bounded numbers, valid groups, weights and triangles.
// Otherwise one line that says what is wrong and where. Empty and single-point strands are sound.
std::string validate(const Groom& groom, const GroomLimits& limits = {});

}  // namespace hairnet
