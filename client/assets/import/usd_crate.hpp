#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

#include "core/result.hpp"

namespace hairnet::usda {

inline constexpr std::string_view kCrateMagic = "PXR-USDC";

// What is read of a scene.
enum class Content : std::uint8_t { curves, bodies };

// The text form of what a binary USD file, a crate of version 0.4 to 0.10, says of curves or of bodies: its prims,
// their types, transforms, visibility and variants, and the attributes of curves, or of meshes and skeletons.
// Everything else is left out. References are named. The whole text exists at once: at most 64 MB and 16 bytes for each
// byte of the file. So text and binary share one parser, and a binary file needs no reader of its own for curves.
Result<std::string> text_of_crate(std::span<const std::byte> bytes, Content content = Content::curves);

}  // namespace hairnet::usda
