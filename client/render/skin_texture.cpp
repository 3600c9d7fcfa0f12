#include "client/render/skin_texture.hpp"

#include <vector>

namespace hairnet::render {
namespace {

// The shader has the same width of a row.
constexpr std::size_t kSkinRow = 1024;

}  // namespace

SkinTexture::SkinTexture() {
  // A cell of size 0 tells the shader that the bone has no grid.
  place_.fill(Eigen::Vector4f::Zero());
  dims_.fill(Eigen::Vector4f::Zero());
}

void SkinTexture::fill(const SkinPush& skin) {
  // A bone of the old skin may have no grid in the new one. Its dims stay, which the shader does not read without a
  // cell.
  place_.fill(Eigen::Vector4f::Zero());
  for (const SkinGrid& grid : skin.grids()) {
    const auto bone = static_cast<std::size_t>(grid.bone);
    place_[bone] = {grid.origin.x(), grid.origin.y(), grid.origin.z(), grid.cell_m};
    dims_[bone] = {static_cast<float>(grid.dims[0]), static_cast<float>(grid.dims[1]), static_cast<float>(grid.dims[2]),
                   static_cast<float>(grid.first)};
  }
  thickness_m_ = skin.thickness_m();
  std::vector<SkinNode> nodes(skin.nodes().begin(), skin.nodes().end());
  // Whole rows are uploaded; at least one, since a texture has a size.
  nodes.resize((nodes.size() / kSkinRow + 1) * kSkinRow);
  glActiveTexture(GL_TEXTURE0 + kSkinNodesUnit);
  glBindTexture(GL_TEXTURE_2D, nodes_.name());
  glTexImage2D(GL_TEXTURE_2D, 0, GL_RGBA8, static_cast<GLsizei>(kSkinRow),
               static_cast<GLsizei>(nodes.size() / kSkinRow), 0, GL_RGBA, GL_UNSIGNED_BYTE, nodes.data());
  for (const GLenum filter : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    // The shader interpolates distances and ways by itself, since neighbours in a row are not neighbours in space.
    glTexParameteri(GL_TEXTURE_2D, filter, GL_NEAREST);
  bytes_ = nodes.size() * sizeof(SkinNode);
}

void SkinTexture::use(const Program& program) const {
  glActiveTexture(GL_TEXTURE0 + kSkinNodesUnit);
  glBindTexture(GL_TEXTURE_2D, nodes_.name());
  program.set("skin_place", std::span<const Eigen::Vector4f>(place_));
  program.set("skin_dims", std::span<const Eigen::Vector4f>(dims_));
  program.set("skin_thickness", thickness_m_);
}

}  // namespace hairnet::render
