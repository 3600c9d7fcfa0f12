#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace hairnet {

// A mesh that Draco has compressed. `position` is the number of the attribute that holds its positions. Only positions
// and triangles are taken. Errors name no file. This function is not in WebAssembly modules or servers, which do not
// link Draco.
Result<TriangleMesh> decode_draco(std::span<const std::byte> bytes, std::size_t position);

}  // namespace hairnet
