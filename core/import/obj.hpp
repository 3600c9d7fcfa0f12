#pragma once

#include <string_view>

#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace hairnet {

// Wavefront OBJ: v and f (polygons are fanned, indices may be negative); everything else is skipped.
Result<TriangleMesh> decode_obj(std::string_view text);

}  // namespace hairnet
