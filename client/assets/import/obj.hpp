#pragma once

#include <string_view>

#include "client/assets/import/strands.hpp"
#include "core/geometry/triangle_mesh.hpp"
#include "core/result.hpp"

namespace hairnet {

// Wavefront OBJ: v and f (polygons become fans, indices may be negative); skips everything else. The error names the
// line. Vertices that no face uses remain.
Result<TriangleMesh> decode_obj(std::string_view text);

// Reads its lines (v and l) as strands. A line that begins where the previous one ended continues it, since some
// programs write one line for each edge. Returns no strands when there are no lines. Groups come from o and g lines.
// Points may be used by several strands, and are copied for each.
Result<ImportedStrands> decode_obj_strands(std::string_view text);

}  // namespace hairnet
