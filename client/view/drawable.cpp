#include "client/view/drawable.hpp"

#include <cmath>

namespace hairnet::view {
namespace {

std::string strand_fault(const DrawnCharacter& character) {
  const auto& begin = character.strand_begin;
  if (begin.empty()) {
    return character.strand_points.empty() ? "" : "strand points without strand offsets";
  }
  for (std::size_t s = 0; s + 1 < begin.size(); ++s) {
    if (begin[s] > begin[s + 1]) return "offset of strand " + std::to_string(s) + " is after its end";
  }
  if (begin.back() > character.strand_points.size()) {
    return "strands end at point " + std::to_string(begin.back()) + " of " +
           std::to_string(character.strand_points.size());
  }
  return "";
}

std::string triangle_fault(const DrawnCharacter& character) {
  if (character.triangles == nullptr) return "";
  const std::size_t count = character.body_vertices.size();
  for (std::size_t t = 0; t < character.triangles->size(); ++t) {
    for (const std::uint32_t corner : (*character.triangles)[t]) {
      if (corner >= count) {
        return "triangle " + std::to_string(t) + " names vertex " + std::to_string(corner) + " of " +
               std::to_string(count);
      }
    }
  }
  return "";
}

std::string surface_fault(const DrawnSurface& surface) {
  if (surface.kind == DrawnSurface::Kind::strip && surface.points.size() % 2 != 0) return "a point without its partner";
  for (const auto& triangle : surface.triangles) {
    for (const std::uint32_t corner : triangle) {
      if (corner < surface.first_index || corner - surface.first_index >= surface.points.size())
        return "a triangle names point " + std::to_string(corner) + ", which is not there";
    }
  }
  if (!(surface.opacity >= 0.0f && surface.opacity <= 1.0f)) return "opacity is not in 0 … 1";
  if (!(surface.radius_m > 0.0f && surface.radius_m <= 1.0f)) return "radius is not in 0 … 1 m";
  return "";
}

bool colour_is_sound(const Vec3f& c) {
  return c.allFinite() && c.minCoeff() >= 0.0f && c.maxCoeff() <= 1.0f;
}

}  // namespace

std::string validate(const DrawnCharacter& character) {
  if (std::string fault = strand_fault(character); !fault.empty()) return fault;
  if (std::string fault = triangle_fault(character); !fault.empty()) return fault;
  for (std::size_t i = 0; i < character.surfaces.size(); ++i) {
    std::string fault = surface_fault(character.surfaces[i]);
    if (fault.empty() && !colour_is_sound(character.surfaces[i].colour)) fault = "colour is not in 0 … 1";
    if (!fault.empty()) return "surface " + std::to_string(i) + ": " + fault;
  }
  if (!colour_is_sound(character.hair_colour)) return "hair colour is not in 0 … 1";
  if (!colour_is_sound(character.skin_colour)) return "skin colour is not in 0 … 1";
  if (!(character.strand_width_m > 0.0f && character.strand_width_m <= 1.0f)) return "strand width is not in 0 … 1 m";
  return "";
}

}  // namespace hairnet::view
