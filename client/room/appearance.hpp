#pragma once

#include <array>
#include <cstdint>
#include <string_view>

#include "schema/wire/messages.hpp"

namespace hairnet::room {

struct NamedColour {
  std::string_view name;
  wire::Srgb colour;
};
// Natural colours of hair, in the order in which characters get them: neighbours have different ones.
inline constexpr std::array<NamedColour, 8> kHairColours{{{"brown", {0x69, 0x48, 0x30}},
                                                          {"blonde", {0xbf, 0xa2, 0x73}},
                                                          {"black", {0x29, 0x23, 0x1f}},
                                                          {"red", {0x9e, 0x59, 0x30}},
                                                          {"dark_blonde", {0x95, 0x79, 0x55}},
                                                          {"dark_brown", {0x45, 0x30, 0x22}},
                                                          {"auburn", {0x7c, 0x42, 0x2c}},
                                                          {"grey", {0xad, 0xad, 0xaf}}}};

// What a character without an appearance is drawn like, by its number (from 1): the same everywhere.
inline wire::Appearance default_appearance(std::uint32_t number) {
  const wire::Srgb hair = kHairColours[(number + kHairColours.size() - 1) % kHairColours.size()].colour;
  // The root and the tip have one colour, the skin is light, and the roughness is 77 of 255, about 0.3.
  return {hair, hair, {0xe1, 0xbf, 0xad}, 77};
}

}  // namespace hairnet::room
