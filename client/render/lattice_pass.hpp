#pragma once

#include <cstddef>
#include <map>
#include <memory>

#include "client/draw/character_records.hpp"
#include "client/render/program.hpp"
#include "client/render/vector_texture.hpp"

namespace hairnet::render {

// Writes the nodes of all lattices of a picture into one texture, which ffd.glsl reads. The GPU sums modes up: a basis
// lies there once for all characters, and a character costs the upload of its coefficients, in its record. Nodes of
// lattices without modes, and all that the processor sums up, are uploaded. The texture stays from picture to picture,
// so that the same records must fill it, and hair that sleeps costs nothing.
class LatticePass {
 public:
  static Result<LatticePass> build();

  // Records must be bound. Changes the bound framebuffer, viewport and vertex array, and binds the nodes.
  void run(const draw::CharacterRecords& records);
  // Says how the nodes are summed up, in the context in which the pass was built.
  [[nodiscard]] draw::NodeSum sum_by() const { return sum_by_; }
  // Counts the memory of the bases on the GPU.
  [[nodiscard]] std::size_t basis_bytes() const;
  // The framebuffer of the nodes, for reading back.
  [[nodiscard]] GLuint nodes() const { return target_.name(); }

 private:
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
  std::size_t rows_ = 0;
  std::map<const Basis*, Modes> modes_;
};

}  // namespace hairnet::render
