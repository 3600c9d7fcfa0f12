#include "client/viewer/characters/hair_colour.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

#include "client/room/appearance.hpp"

namespace hairnet::viewer {
namespace {

// The standard's two-part curve, so that bytes survive the way there and back.
float linear_from_srgb(std::uint32_t byte) {
  const float c = static_cast<float>(byte) / 255;
  return c <= 0.04045f ? c / 12.92f : std::pow((c + 0.055f) / 1.055f, 2.4f);
}

std::uint8_t byte_from_linear(float c) {
  const float srgb = c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
  return static_cast<std::uint8_t>(std::lround(255 * std::clamp(srgb, 0.0f, 1.0f)));
}

}  // namespace

Result<Vec3f> parse_hair_colour(const std::string& text) {
  std::string names;
  for (const room::NamedColour& each : room::kHairColours) {
    if (text == each.name) return linear_of(each.colour);
    names += std::string(each.name) + ", ";
  }
  std::uint32_t rgb = 0;
  const char* end = text.data() + text.size();
  if (text.size() == 7 && text[0] == '#') {
    const auto [parsed, error] = std::from_chars(text.data() + 1, end, rgb, 16);
    if (error == std::errc() && parsed == end)
      return Vec3f(linear_from_srgb(rgb >> 16), linear_from_srgb(rgb >> 8 & 0xff), linear_from_srgb(rgb & 0xff));
  }
  return Refusal("colour '" + text + "' is not one of " + names + "or #rrggbb");
}

// Skin and roughness are the default's: the command line knows only hair.
wire::Appearance appearance_of(const Vec3f& hair_colour) {
  wire::Appearance appearance = room::default_appearance(1);
  appearance.hair_root = appearance.hair_tip = {byte_from_linear(hair_colour.x()), byte_from_linear(hair_colour.y()),
                                                byte_from_linear(hair_colour.z())};
  return appearance;
}

Vec3f linear_of(const wire::Srgb& colour) {
  return {linear_from_srgb(colour.red), linear_from_srgb(colour.green), linear_from_srgb(colour.blue)};
}

Vec3f default_hair_colour(std::size_t n) {
  // Numbers of members count from 1. The colours repeat.
  return linear_of(room::default_appearance(static_cast<std::uint32_t>(n % room::kHairColours.size()) + 1).hair_root);
}

}  // namespace hairnet::viewer
