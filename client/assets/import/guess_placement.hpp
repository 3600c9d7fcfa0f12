#pragma once

#include <optional>
#include <span>
#include <string>
#include <vector>

#include "client/assets/import/placement.hpp"
#include "core/geometry/triangle_mesh.hpp"

namespace hairnet {

// Guesses the placement of files of strands from the strands themselves: roots lie on the upper back of a skull of
// usual size, and most hair hangs. Usual units (m, cm, mm, inch ...) are preferred. All programs use this function,
// with all files of one head. What is known stays. The error is one line with the flag that decides what the strands do
// not show; a face that they do not show is taken where it usually is, with a line in `doubts`. Strands are root first
// and without outliers: a tip-first file would show a head in the tips. At least 4 strands with a point are necessary,
// unless all is known.
Result<Placement> guess_placement(std::span<const StrandFile> files, const KnownPlacement& known = {},
                                  std::vector<std::string>* doubts = nullptr);

// The placements of strands and of the mesh under them. The mesh has that of guess_mesh_placement. The strands have the
// same file axes if their roots then lie near its surface, else the axes and unit that bring them nearest. None when
// nothing brings them within 3 cm. It tries all axes and the likely units with a sample of the roots.
struct PlacedTogether {
  Placement strands, body;
};
std::optional<PlacedTogether> guess_together(std::span<const StrandFile> files, const TriangleMesh& mesh,
                                             const KnownPlacement& of_strands = {}, const KnownPlacement& of_body = {});

// Guesses the placement of a mesh of a head, a bust or a person: up is +y or +z, along which it is longer; the unit
// comes from the head's size, the face from the chin in front of the neck. `origin` is the head joint: the known one,
// else that under its skull. The mesh needs 50 vertices. The guess assumes that the head is upright in the file.
Result<Placement> guess_mesh_placement(const TriangleMesh& mesh, const KnownPlacement& known = {});

// Returns text like "up +z, face +y, 0.0033 m a unit".
std::string to_string(const Placement& placement);

}  // namespace hairnet
