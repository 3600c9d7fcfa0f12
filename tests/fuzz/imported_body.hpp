#pragma once

#include <string>

#include "core/geometry/triangle_mesh.hpp"
#include "core/groom/groom.hpp"
#include "core/result.hpp"
#include "tests/fuzz/target.hpp"

namespace hairnet::fuzz {

// A body of a file from anywhere is refused with one line, or a finite mesh whose triangles have vertices.
inline int require_mesh(const Result<TriangleMesh>& mesh) {
  if (!mesh) {
    require(!mesh.error().empty(), "a refusal has a line");
    require(mesh.error().find('\n') == std::string::npos, "a refusal is one line: " + mesh.error());
    return 0;
  }
  require(!mesh->triangles.empty(), "a body has triangles");
  for (const Vec3f& x : mesh->vertices) require(x.allFinite(), "vertices are finite");
  for (const auto& triangle : mesh->triangles) {
    for (const std::uint32_t v : triangle) require(v < mesh->vertices.size(), "a triangle has vertices");
  }
  return 0;
}

template <class Body>
Result<TriangleMesh> mesh_of(Result<Body> body) {
  if (!body) return Refusal(body.error());
  return std::move(body->mesh);
}

}  // namespace hairnet::fuzz
