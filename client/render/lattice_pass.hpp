#pragma once

#include <cstddef>
#include <map>
#include <memory>

#include "client/draw/character_records.hpp"
#include "client/render/shader_program.hpp"
#include "client/render/vector_texture.hpp"

namespace hairnet::render {

// Writes the nodes of all lattices of a picture into one texture, which ffd.glsl reads. It is a pass of its own because
// each point of hair reads up to 27 nodes, and many points read the same node. The GPU sums modes up: it has each basis
// once for all characters, and a character costs only the upload of its coefficients, in its record. Nodes of lattices
// without modes, and nodes that the processor sums up, are uploaded. The texture stays from picture to picture, so
// sleeping hair costs nothing. For that, each picture must come from the same CharacterRecords.
class LatticePass {
 public:
  static Result<LatticePass> build();

  // Makes the nodes that are new in these records. Records must be bound. Changes the viewport, vertex array and
  // program, and binds the nodes; the framebuffer that was bound is bound again.
  void run(const draw::CharacterRecords& records);
  // Whether the GPU or the processor sums up the nodes. The name of the renderer in whose context the pass was built
  // decides.
  [[nodiscard]] draw::NodeSum sum_by() const { return sum_by_; }
  // The memory of the bases on the GPU, bytes: those of characters in the last picture, and others that still have an
  // owner.
  [[nodiscard]] std::size_t basis_bytes() const;
  // The framebuffer of the nodes, for reading back.
  [[nodiscard]] GLuint nodes() const { return target_.name(); }

 private:
  // The texture of a basis. The weak pointer shows when no one has the basis any more, and the texture is then freed.
  struct Modes {
    std::weak_ptr<const Basis> basis;
    Texture texture;
    std::size_t bytes = 0;
  };
  LatticePass(Program sum, Program copy, draw::NodeSum sum_by)
      : sum_(std::move(sum)), copy_(std::move(copy)), sum_by_(sum_by) {}
  void reserve(std::size_t rows);
  void bind_modes(const draw::CharacterRecords::Source& source);

  Program sum_, copy_;
  draw::NodeSum sum_by_;
  VectorTexture uploaded_{kUploadedNodesUnit, draw::kLatticeRow};
  Texture nodes_;
  Framebuffer target_;
  VertexArray nothing_;
  // The rows of the texture of nodes.
  std::size_t rows_ = 0;
  // The textures by the address of their basis.
  std::map<const Basis*, Modes> modes_;
};

}  // namespace hairnet::render
