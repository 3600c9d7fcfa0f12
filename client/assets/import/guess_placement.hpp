#pragma once

#include <optional>
#include <span>
#include <string>

#include "client/assets/import/placement.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace hairnet::viewer {

// How files of strands lie, told from the strands themselves: roots sit on the upper back of a skull of usual size, and
// most hair hangs. Units that people use (m, cm, mm, inch ...) are preferred to others. One line when there are no
// roots to tell it by.
Result<Placement> guess_placement(std::span<const StrandFile> files);

// How strands and the mesh under them lie: the mesh as guess_mesh_placement has it, the strands as they do in the same
// file axes when their roots then lie near its surface, else in whichever axes and unit bring them nearest. None when
// nothing brings them within 3 cm.
struct PlacedTogether {
  Placement strands, body;
};
std::optional<PlacedTogether> guess_together(std::span<const StrandFile> files, const TriangleMesh& mesh);

// How a mesh of a head, a bust or a person lies by itself: +y or +z up, whichever is longer, the head's size for a
// unit, the chin before the neck. `origin` is the head joint.
Result<Placement> guess_mesh_placement(const TriangleMesh& mesh);

// "up +z, face +y, 0.0033 m a unit".
std::string to_string(const Placement& placement);

}  // namespace hairnet::viewer
