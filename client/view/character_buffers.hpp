#pragma once

#include "client/view/body_surface.hpp"
#include "client/view/fabric_mesh.hpp"
#include "client/view/gl_objects.hpp"
#include "client/view/strand_ribbons.hpp"

namespace hairnet::view {

// One character's geometry on the GPU. Filled anew for each character of each picture.
class CharacterBuffers {
 public:
  CharacterBuffers();
  void fill(const BodySurface& body, const FabricMesh& fabric, const StrandRibbons& ribbons);
  void draw_body() const;
  void draw_fabric() const;
  void draw_opaque_fabric() const;
  void draw_strand_lines() const;
  // Slab by slab from far to near; within a slab all strands, then their followers.
  void draw_ribbons(int copies) const;

 private:
  VertexArray body_array_, fabric_array_, line_array_, ribbon_array_;
  Buffer body_vertices_, body_indices_, fabric_vertices_, fabric_indices_;
  Buffer strand_vertices_, line_indices_, ribbon_indices_;
  GLsizei body_index_count_ = 0, fabric_index_count_ = 0, opaque_index_count_ = 0, line_index_count_ = 0;
  std::vector<std::uint32_t> slabs_;
};

}  // namespace hairnet::view
