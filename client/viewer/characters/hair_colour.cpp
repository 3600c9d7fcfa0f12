#include "client/viewer/characters/hair_colour.hpp"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <string_view>

namespace hairnet::viewer {
namespace {

struct NamedColour {
  std::string_view name;
  std::array<float, 3> linear;
};
// In the order in which characters get them: neighbours have different colours.
constexpr std::array<NamedColour, 8> kColours{{{"brown", {0.14f, 0.065f, 0.03f}},
                                               {"blonde", {0.52f, 0.36f, 0.17f}},
                                               {"black", {0.022f, 0.017f, 0.014f}},
                                               {"red", {0.34f, 0.10f, 0.03f}},
                                               {"dark_blonde", {0.30f, 0.19f, 0.09f}},
                                               {"dark_brown", {0.06f, 0.03f, 0.016f}},
                                               {"auburn", {0.20f, 0.055f, 0.025f}},
                                               {"grey", {0.42f, 0.42f, 0.43f}}}};

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
  for (const NamedColour& colour : kColours) {
    if (text == colour.name) return Vec3f(colour.linear.data());
    names += std::string(colour.name) + ", ";
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

wire::Appearance appearance_of(const Vec3f& hair_colour) {
  constexpr wire::Srgb kSkin{0xe1, 0xbf, 0xad};
  constexpr std::uint8_t kRoughness = 77;
  const wire::Srgb hair{byte_from_linear(hair_colour.x()), byte_from_linear(hair_colour.y()),
                        byte_from_linear(hair_colour.z())};
  return {hair, hair, kSkin, kRoughness};
}

Vec3f linear_of(const wire::Srgb& colour) {
  return {linear_from_srgb(colour.red), linear_from_srgb(colour.green), linear_from_srgb(colour.blue)};
}

Vec3f default_hair_colour(std::size_t n) {
  return Vec3f(kColours[n % kColours.size()].linear.data());
}

}  // namespace hairnet::viewer
