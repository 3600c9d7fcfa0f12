#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace hairnet {

// A mesh that Google's Draco has compressed, as glTF files have it. Positions are those of the attribute with the
// unique id `position_id`, which the glTF file states. Only positions and triangles are taken. Errors name no file.
// This function is not in WebAssembly modules or servers, which do not link Draco.
Result<TriangleMesh> decode_draco(std::span<const std::byte> bytes, std::size_t position_id);

}  // namespace hairnet
