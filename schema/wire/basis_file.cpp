#include "schema/wire/basis_file.hpp"

#include "basis_generated.h"
#include "core/assert.hpp"
#include "schema/codec/golomb.hpp"
#include "schema/wire/geometry_table.hpp"
#include "schema/wire/packing.hpp"

namespace hairnet::wire {
namespace {

using flatbuffers::FlatBufferBuilder;

// Calls visit(index into Basis::modes) for each number, in the order in which the file's planes have them: mode by
// mode, x of all nodes, then y, then z.
void in_order_of_planes(const Basis& basis, const auto& visit) {
  for (std::size_t mode = 0; mode < basis.mode_count(); ++mode)
    for (std::size_t axis = 0; axis < 3; ++axis)
      for (std::size_t node = 0; node < basis.node_count; ++node) visit(3 * (mode * basis.node_count + node) + axis);
}

// The low bytes of all numbers, then the high bytes, each number less the one before.
std::vector<std::uint8_t> planes_of(const Basis& basis) {
  const std::size_t count = basis.modes.size();
  std::vector<std::uint8_t> planes(2 * count);
  std::size_t at = 0;
  std::int16_t before = 0;
  in_order_of_planes(basis, [&](std::size_t i) {
    // Neighbouring nodes move alike, so differences are small, and their upper bytes are mostly 0, which deflate packs
    // well. Differences wrap modulo 2^16 in both directions.
    const std::uint16_t z = codec::zigzag(static_cast<std::int16_t>(basis.modes[i] - before));
    before = basis.modes[i];
    planes[at] = static_cast<std::uint8_t>(z);
    planes[count + at++] = static_cast<std::uint8_t>(z >> 8);
  });
  return planes;
}

void read_planes(std::span<const std::uint8_t> planes, Basis& basis) {
  const std::size_t count = planes.size() / 2;
  basis.modes.resize(count);
  std::size_t at = 0;
  std::int16_t before = 0;
  in_order_of_planes(basis, [&](std::size_t i) {
    const auto z = static_cast<std::uint16_t>(planes[at] | planes[count + at] << 8);
    ++at;
    before = basis.modes[i] = static_cast<std::int16_t>(before + codec::unzigzag(z));
  });
}

// Calls visit(node, prediction) for each node in order. The prediction follows from the bytes of the nodes before,
// which must be there (BoneSkin in basis.fbs has the formula).
void in_order_of_grid(const std::array<int, 3>& dims, const std::vector<std::uint8_t>& bytes, const auto& visit) {
  const std::array<int, 3> stride{1, dims[0], dims[0] * dims[1]};
  int node = 0;
  for (int k = 0; k < dims[2]; ++k) {
    for (int j = 0; j < dims[1]; ++j) {
      for (int i = 0; i < dims[0]; ++i, ++node) {
        const auto back = [&](int x, int y, int z) {
          // Beyond the border the byte counts as 0, on both ends alike.
          if (i < x || j < y || k < z) return 0;
          return static_cast<int>(bytes[static_cast<std::size_t>(node - x - y * stride[1] - z * stride[2])]);
        };
        visit(static_cast<std::size_t>(node), back(1, 0, 0) + back(0, 1, 0) + back(0, 0, 1) - back(1, 1, 0) -
                                                  back(1, 0, 1) - back(0, 1, 1) + back(1, 1, 1));
      }
    }
  }
}

flatbuffers::Offset<fb::BoneSkin> write_bone_skin(FlatBufferBuilder& to, const SkinDistanceField& field) {
  std::vector<std::uint8_t> bytes, less;
  for (const float distance_m : field.distance) bytes.push_back(skin_byte(distance_m));
  in_order_of_grid(field.dims, bytes, [&](std::size_t node, int before) {
    less.push_back(static_cast<std::uint8_t>(bytes[node] - before));
  });
  const fb::Vec3 origin = to_flatbuffer(field.origin);
  const auto dims = [&](std::size_t axis) { return static_cast<std::uint32_t>(field.dims[axis]); };
  return fb::CreateBoneSkinDirect(to, static_cast<std::uint8_t>(field.bone), &origin, field.cell_m, dims(0), dims(1),
                                  dims(2), &less);
}

// Returns an empty string when the skin is valid, else one line.
std::string read_skin(const flatbuffers::Vector<flatbuffers::Offset<fb::BoneSkin>>& in, Skin& skin) {
  for (const fb::BoneSkin* part : in) {
    SkinDistanceField& field = skin.emplace_back();
    // The number of the bone may be any; validate() below refuses one that does not exist.
    field.bone = static_cast<Bone>(part->bone());
    field.origin = from_flatbuffer(*part->origin());
    field.cell_m = part->cell_m();
    std::uint64_t count = 1;
    const std::array<std::uint32_t, 3> dims{part->node_count_x(), part->node_count_y(), part->node_count_z()};
    for (std::size_t axis = 0; axis < 3; ++axis) {
      // Each axis and each product is compared before the next multiplication, so the product cannot wrap.
      if (dims[axis] > part->bytes()->size()) return "skin: counts disagree";
      field.dims[axis] = static_cast<int>(dims[axis]);
      count *= dims[axis];
      if (count > part->bytes()->size()) return "skin: counts disagree";
    }
    if (count != part->bytes()->size()) return "skin: counts disagree";
    std::vector<std::uint8_t> bytes(part->bytes()->begin(), part->bytes()->end());
    in_order_of_grid(field.dims, bytes, [&](std::size_t node, int before) {
      bytes[node] = static_cast<std::uint8_t>(bytes[node] + before);
      field.distance.push_back(distance_of_skin_byte(bytes[node]));
    });
  }
  return validate(skin);
}

}  // namespace

std::vector<std::uint8_t> encode_basis(const LevelGeometry& geometry, const Basis& basis, const Skin& skin) {
  HAIRNET_ASSERT(validate(basis).empty());
  HAIRNET_ASSERT(validate(skin).empty());
  HAIRNET_ASSERT(geometry.active_nodes.size() == basis.node_count);
  FlatBufferBuilder to(std::size_t{1} << 16);
  const fb::Vec3 origin = to_flatbuffer(geometry.lattice.origin), spacing = to_flatbuffer(geometry.lattice.spacing);
  const auto dims = [&](std::size_t axis) { return static_cast<std::uint32_t>(geometry.lattice.dims[axis]); };
  const std::vector<std::uint8_t> planes = planes_of(basis);
  std::vector<flatbuffers::Offset<fb::BoneSkin>> fields;
  for (const SkinDistanceField& field : skin) fields.push_back(write_bone_skin(to, field));
  const auto root =
      fb::CreateHairBasisDirect(to, &origin, &spacing, dims(0), dims(1), dims(2), &geometry.active_nodes,
                                &geometry.trimmed_nodes, &geometry.trimmed_begin, &geometry.trimmed_from,
                                &geometry.trimmed_weights, &basis.deviation_m, &basis.unit, &planes, &fields);
  return pack(finish(to, root, fb::HairBasisIdentifier()), kPackedBasis);
}

Result<HairBasis> decode_basis(std::span<const std::uint8_t> bytes) {
  const Result<std::vector<std::uint8_t>> table = unpack(bytes, kPackedBasis);
  if (!table) return Refusal(table.error());
  const AlignedBytes aligned(*table);
  const auto* root = verified_root<fb::HairBasis>(aligned.bytes(), fb::HairBasisIdentifier());
  if (!root) return Refusal("not whole: no valid table of a basis");
  HairBasis out;
  if (std::string error = read_geometry(*root, out.geometry); !error.empty()) return Refusal(std::move(error));
  Basis& basis = out.basis;
  basis.node_count = out.geometry.active_nodes.size();
  from_flatbuffer(*root->deviation_m(), basis.deviation_m);
  from_flatbuffer(*root->unit(), basis.unit);
  // The planes have two bytes for each axis of each node of each mode.
  if (root->mode_planes()->size() != 2 * 3 * basis.node_count * basis.mode_count())
    return Refusal("a basis whose modes have another number of nodes");
  read_planes(span_of(root->mode_planes()), basis);
  if (std::string error = validate(basis); !error.empty()) return Refusal(std::move(error));
  if (std::string error = read_skin(*root->skin(), out.skin); !error.empty()) return Refusal(std::move(error));
  return out;
}

}  // namespace hairnet::wire
