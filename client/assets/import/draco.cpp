#include "client/assets/import/draco.hpp"

#include <draco/compression/decode.h>

#include <array>

namespace hairnet {

Result<TriangleMesh> decode_draco(std::span<const std::byte> bytes, std::size_t position_id) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  draco::Decoder decoder;
  auto decoded = decoder.DecodeMeshFromBuffer(&buffer);
  if (!decoded.ok()) return Refusal("its mesh is compressed by Draco, and damaged: export it again");
  const draco::Mesh& packed = *decoded.value();
  const draco::PointAttribute* const positions = packed.GetAttributeByUniqueId(static_cast<std::uint32_t>(position_id));
  // All indices come from the file, so positions and corners are checked below.
  if (!positions || positions->num_components() != 3) return Refusal("its compressed mesh has no positions");
  TriangleMesh mesh;
  for (draco::PointIndex p(0); p < packed.num_points(); ++p) {
    std::array<float, 3> x{};
    const draco::AttributeValueIndex value = positions->mapped_index(p);
    if (value.value() >= positions->size() || !positions->ConvertValue<float, 3>(value, x.data()))
      return Refusal("its compressed mesh has a vertex without a position");
    mesh.vertices.emplace_back(x[0], x[1], x[2]);
  }
  for (draco::FaceIndex f(0); f < packed.num_faces(); ++f) {
    std::array<std::uint32_t, 3>& triangle = mesh.triangles.emplace_back();
    for (std::size_t i = 0; i < 3; ++i) {
      triangle[i] = packed.face(f)[i].value();
      if (triangle[i] >= packed.num_points()) return Refusal("its compressed mesh has a triangle without a vertex");
    }
  }
  return mesh;
}

}  // namespace hairnet
