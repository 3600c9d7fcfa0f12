#include "schema/wire/level_file.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "core/assert.hpp"
#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "levels_generated.h"
#include "schema/bytes/content_hash.hpp"
#include "schema/wire/flatbuffer_convert.hpp"
#include "schema/wire/learnt_hair_table.hpp"

namespace hairnet::wire {
namespace {

// Raise this version when the payload's layout or meaning changes. Caches then build their levels again.
constexpr std::uint32_t kLayoutVersion = 5;
constexpr std::array<char, 8> kMagic{'H', 'N', 'L', 'E', 'V', 'E', 'L', 'S'};

// The header without its checksum. All fields lie at their natural alignment, so the struct has the file's layout.
struct Header {
  std::array<char, 8> magic = kMagic;
  std::uint32_t layout_version = kLayoutVersion;
  std::uint32_t build_version = kBuildVersion;
  // Levels that were built to other specs are other levels, though every byte of theirs is valid.
  std::array<std::array<std::uint32_t, 6>, kLevelSpecs.size()> specs = flat_specs();
  GroomHash groom{};
  std::uint64_t payload_bytes = 0;

  static std::array<std::array<std::uint32_t, 6>, kLevelSpecs.size()> flat_specs() {
    std::array<std::array<std::uint32_t, 6>, kLevelSpecs.size()> flat;
    for (std::size_t i = 0; i < flat.size(); ++i) {
      const LevelSpec& spec = kLevelSpecs[i];
      for (std::size_t axis = 0; axis < 3; ++axis) flat[i][axis] = static_cast<std::uint32_t>(spec.dims[axis]);
      flat[i][3] = static_cast<std::uint32_t>(spec.spring_count);
      flat[i][4] = static_cast<std::uint32_t>(spec.attachment_count);
      flat[i][5] = static_cast<std::uint32_t>(spec.contact_count);
    }
    return flat;
  }
};
// Padding would have undefined bytes, and the checksum covers every byte.
static_assert(std::is_trivially_copyable_v<Header> && std::has_unique_object_representations_v<Header>);

using Checksum = bytes::ContentHash;
constexpr std::size_t kChecksumAt = sizeof(Header);
static_assert(kChecksumAt + sizeof(Checksum) == kLevelFileHeaderBytes);
static_assert(kLevelFileHeaderBytes % 8 == 0, "the payload keeps the buffer's alignment");

Checksum checksum_of(std::span<const std::uint8_t> file) {
  HAIRNET_ASSERT(file.size() >= kLevelFileHeaderBytes);
  bytes::ContentHasher hasher;
  // The checksum covers the header too: a changed hash of the groom would give one groom the levels of another.
  hasher.add(file.first(kChecksumAt));
  hasher.add(file.subspan(kLevelFileHeaderBytes));
  return hasher.hash();
}

using flatbuffers::FlatBufferBuilder;
using flatbuffers::Offset;

// Copies vectors of vectors as one block of floats.
template <class T>
Offset<flatbuffers::Vector<float>> write_floats(FlatBufferBuilder& to, const std::vector<T>& from) {
  static_assert(sizeof(T) % sizeof(float) == 0);
  return to.CreateVector(reinterpret_cast<const float*>(from.data()), from.size() * (sizeof(T) / sizeof(float)));
}

Offset<fb::Stiffeners> write(FlatBufferBuilder& to, const Stiffeners& list) {
  const auto rest = write_floats(to, list.rest);
  const auto begin = to.CreateVector(list.begin);
  const auto nodes = to.CreateVector(list.nodes);
  return fb::CreateStiffeners(to, begin, nodes, to.CreateVector(list.weights), to.CreateVector(list.stiffness),
                              to.CreateVector(list.damping), rest);
}

Offset<fb::SkinDistanceField> write(FlatBufferBuilder& to, const SkinDistanceField& field) {
  const fb::Vec3 origin = to_flatbuffer(field.origin);
  const auto nodes = [&](std::size_t axis) { return static_cast<std::uint32_t>(field.dims[axis]); };
  return fb::CreateSkinDistanceField(to, static_cast<std::uint8_t>(field.bone), &origin, field.cell_m, nodes(0),
                                     nodes(1), nodes(2), to.CreateVector(field.distance));
}

Offset<fb::BuiltLevel> write(FlatBufferBuilder& to, const Level& level) {
  const LevelGeometry& g = level.geometry;
  HAIRNET_ASSERT(g.lattice.dims[0] > 0 && g.lattice.dims[1] > 0 && g.lattice.dims[2] > 0);
  const fb::Vec3 origin = to_flatbuffer(g.lattice.origin), spacing = to_flatbuffer(g.lattice.spacing);
  const auto dims = [&](std::size_t axis) { return static_cast<std::uint32_t>(g.lattice.dims[axis]); };
  const ContactPoints& c = level.contacts;
  const auto active_nodes = to.CreateVector(g.active_nodes), trimmed_nodes = to.CreateVector(g.trimmed_nodes);
  const auto trimmed_begin = to.CreateVector(g.trimmed_begin), trimmed_from = to.CreateVector(g.trimmed_from);
  const auto trimmed_weights = to.CreateVector(g.trimmed_weights);
  const auto rest = write_floats(to, level.rest), drag = write_floats(to, level.drag);
  const auto mass = to.CreateVector(level.mass), ether_stiffness = to.CreateVector(level.ether_stiffness),
             ether_damping = to.CreateVector(level.ether_damping);
  const auto springs = write(to, level.springs), attachments = write(to, level.attachments);
  const auto contact_begin = to.CreateVector(c.begin);
  const auto contact_nodes = to.CreateVector(c.nodes);
  const auto contact_weights = to.CreateVector(c.weights), contact_rest = write_floats(to, c.rest),
             contact_potential = to.CreateVector(c.potential), contact_limit = to.CreateVector(c.limit);
  return fb::CreateBuiltLevel(to, &origin, &spacing, dims(0), dims(1), dims(2), active_nodes, trimmed_nodes,
                              trimmed_begin, trimmed_from, trimmed_weights, level.displacement_max_m, rest, mass,
                              ether_stiffness, ether_damping, drag, springs, attachments, contact_begin, contact_nodes,
                              contact_weights, contact_rest, contact_potential, contact_limit);
}

Offset<fb::BuiltModes> write(FlatBufferBuilder& to, const Modes& modes) {
  const auto deviation = to.CreateVector(modes.basis.deviation_m), unit = to.CreateVector(modes.basis.unit);
  const auto shapes = to.CreateVector(modes.basis.modes);
  std::vector<Offset<fb::ModeMap>> maps;
  for (const ModeMap& map : modes.maps) {
    maps.push_back(
        fb::CreateModeMap(to, to.CreateVector(map.matrix().data(), static_cast<std::size_t>(map.matrix().size()))));
  }
  const auto mode_maps = to.CreateVector(maps);
  return fb::CreateBuiltModes(to, deviation, unit, shapes, mode_maps, to.CreateVector(modes.validation_error));
}

// Like from_flatbuffer, but false where the last element is not whole.
template <class To, class From>
bool read(const flatbuffers::Vector<From>& from, std::vector<To>& to) {
  if (from.size() % (sizeof(To) / sizeof(From)) != 0) return false;
  from_flatbuffer(from, to);
  return true;
}

bool read(const fb::Stiffeners& in, Stiffeners& out) {
  return read(*in.begin(), out.begin) && !out.begin.empty() && read(*in.nodes(), out.nodes) &&
         read(*in.weights(), out.weights) && read(*in.stiffness(), out.stiffness) && read(*in.damping(), out.damping) &&
         read(*in.rest(), out.rest);
}

bool read_contacts(const fb::BuiltLevel& in, ContactPoints& out) {
  return read(*in.contact_begin(), out.begin) && read(*in.contact_nodes(), out.nodes) &&
         read(*in.contact_weights(), out.weights) && read(*in.contact_rest(), out.rest) &&
         read(*in.contact_potential(), out.potential) && read(*in.contact_limit(), out.limit);
}

// Copies the field with its counts as they are; validate() judges them later.
SkinDistanceField read(const fb::SkinDistanceField& in) {
  SkinDistanceField field{static_cast<Bone>(in.bone()), from_flatbuffer(*in.origin()), in.cell_m(), {}, {}};
  const auto nodes = [](std::uint32_t count) {
    return static_cast<int>(std::min<std::uint32_t>(count, std::numeric_limits<int>::max()));
  };
  field.dims = {nodes(in.node_count_x()), nodes(in.node_count_y()), nodes(in.node_count_z())};
  from_flatbuffer(*in.distance(), field.distance);
  return field;
}

// Returns false where counts disagree with each other or with the spec. Numbers are judged later, by validate().
bool read(const fb::BuiltLevel& in, const LevelSpec& spec, Level& out) {
  LevelGeometry& g = out.geometry;
  const std::array<std::uint32_t, 3> dims{in.node_count_x(), in.node_count_y(), in.node_count_z()};
  for (std::size_t axis = 0; axis < 3; ++axis) {
    // The header has the same specs, but is not proof of what the payload has.
    if (dims[axis] != static_cast<std::uint32_t>(spec.dims[axis])) return false;
  }
  g.lattice = {from_flatbuffer(*in.origin()), from_flatbuffer(*in.spacing()), spec.dims};
  out.displacement_max_m = in.displacement_max_m();
  return read(*in.active_nodes(), g.active_nodes) && read(*in.trimmed_nodes(), g.trimmed_nodes) &&
         read(*in.trimmed_begin(), g.trimmed_begin) && !g.trimmed_begin.empty() &&
         read(*in.trimmed_from(), g.trimmed_from) && read(*in.trimmed_weights(), g.trimmed_weights) &&
         read(*in.rest(), out.rest) && read(*in.mass(), out.mass) && read(*in.ether_stiffness(), out.ether_stiffness) &&
         read(*in.ether_damping(), out.ether_damping) && read(*in.drag(), out.drag) &&
         read(*in.springs(), out.springs) && out.springs.count() <= spec.spring_count &&
         read(*in.attachments(), out.attachments) && out.attachments.count() <= spec.attachment_count &&
         read_contacts(in, out.contacts);
}

// Returns an empty string, or the error.
std::string read(const fb::BuiltModes& in, const LevelSet& set, Modes& out) {
  Basis& basis = out.basis;
  // Modes move the active nodes of the finest level, which has been read and validated before.
  basis.node_count = set.levels[0].rest.size();
  from_flatbuffer(*in.deviation_m(), basis.deviation_m);
  from_flatbuffer(*in.unit(), basis.unit);
  from_flatbuffer(*in.modes(), basis.modes);
  if (std::string error = validate(basis); !error.empty()) return error;
  from_flatbuffer(*in.validation_error(), out.validation_error);
  const auto is_error = [](float error) { return std::isfinite(error) && error >= 0; };
  if (out.validation_error.size() != basis.mode_count() || !std::ranges::all_of(out.validation_error, is_error))
    return "modes without an error for each";
  if (in.maps()->size() != out.maps.size()) return "modes without a map for each level";
  for (std::size_t i = 0; i < out.maps.size(); ++i) {
    // Each level has a map of its own, from its displacements to the coefficients that all levels share.
    const flatbuffers::Vector<float>& from = *in.maps()->Get(static_cast<flatbuffers::uoffset_t>(i))->matrix();
    if (from.size() != 3 * basis.mode_count() * set.levels[i].rest.size())
      return "a map of another size than its level";
    ModeMap::Matrix matrix(static_cast<Eigen::Index>(basis.mode_count()),
                           static_cast<Eigen::Index>(3 * set.levels[i].rest.size()));
    std::ranges::copy(from, matrix.data());
    // The limit keeps coefficients finite for any displacements.
    constexpr float kMax = 1e6f;
    if (!matrix.allFinite() || matrix.cwiseAbs().maxCoeff() > kMax) return "a map that is not finite";
    out.maps[i] = ModeMap(std::move(matrix));
  }
  return {};
}

// Returns an empty string, or the error.
std::string read(std::span<const std::uint8_t> payload, LevelSet& set) {
  // The header is a multiple of 8 bytes, so a file that lies aligned in memory is not copied.
  const AlignedBytes aligned(payload);
  const auto* root = verified_root<fb::BuiltLevels>(aligned.bytes(), fb::BuiltLevelsIdentifier());
  if (!root || root->levels()->size() != set.levels.size()) return "not a whole and valid buffer of levels";
  auto skin = std::make_shared<Skin>();
  for (const fb::SkinDistanceField* field : *root->skin()) skin->push_back(read(*field));
  for (std::size_t i = 0; i < set.levels.size(); ++i) {
    const std::string name(kLevelNames[i]);
    // The skin is one for all levels: it is that of the body, and depends on no lattice.
    set.levels[i].skin = skin;
    if (!read(*root->levels()->Get(static_cast<flatbuffers::uoffset_t>(i)), kLevelSpecs[i], set.levels[i]))
      return "level " + name + ": counts disagree";
    if (std::string error = validate(set.levels[i]); !error.empty()) return error.insert(0, "level " + name + ": ");
  }
  if (root->learnt()) {
    auto learnt = std::make_shared<LearntHair>();
    if (std::string error = read_learnt(*root->learnt(), root->learnt_wind(), *learnt); !error.empty()) return error;
    set.learnt = std::move(learnt);
  }
  if (!root->modes()) return {};
  auto modes = std::make_shared<Modes>();
  std::string error = read(*root->modes(), set, *modes);
  set.modes = std::move(modes);
  return error;
}

// Checks the header before the payload's checksum is checked.
LevelFileError error_of(const Header& header, const GroomHash& groom) {
  const Header own;
  if (header.magic != own.magic) return LevelFileError::not_a_level_file;
  if (header.layout_version != own.layout_version || header.build_version != own.build_version ||
      header.specs != own.specs)
    return LevelFileError::other_version;
  return header.groom == groom ? LevelFileError::none : LevelFileError::other_groom;
}

}  // namespace

std::vector<std::uint8_t> encode_levels(const GroomHash& groom, const LevelSet& set) {
  FlatBufferBuilder to;
  std::vector<Offset<fb::BuiltLevel>> levels;
  for (const Level& level : set.levels) levels.push_back(write(to, level));
  std::vector<Offset<fb::SkinDistanceField>> skin;
  HAIRNET_ASSERT(set.levels.front().skin);
  for (const SkinDistanceField& field : *set.levels.front().skin) skin.push_back(write(to, field));
  const auto modes = set.modes ? write(to, *set.modes) : 0;
  const auto learnt = set.learnt ? write_learnt(to, *set.learnt) : 0;
  const auto wind = set.learnt ? write_wind(to, set.learnt->wind) : 0;
  const auto payload =
      finish(to, fb::CreateBuiltLevels(to, to.CreateVector(levels), to.CreateVector(skin), modes, learnt, wind),
             fb::BuiltLevelsIdentifier());
  std::vector<std::uint8_t> bytes(kLevelFileHeaderBytes + payload.size());
  Header header;
  // The payload's length and the checksum are set at the end, when the bytes are there.
  header.groom = groom;
  std::memcpy(bytes.data(), &header, sizeof(header));
  std::ranges::copy(payload, bytes.begin() + kLevelFileHeaderBytes);
  set_level_file_checksum(bytes);
  return bytes;
}

DecodedLevels decode_levels(std::span<const std::uint8_t> bytes, const GroomHash& groom) {
  if (bytes.size() < kLevelFileHeaderBytes) return {LevelFileError::damaged, "no whole header", nullptr};
  Header header;
  std::memcpy(&header, bytes.data(), sizeof(header));
  // The header is judged before the checksum: a file of another version is reported as that, and not as damaged.
  switch (const LevelFileError error = error_of(header, groom); error) {
    case LevelFileError::not_a_level_file:
      return {error, "not a file of levels", nullptr};
    case LevelFileError::other_version:
      return {error, "built by another version, or to other specs", nullptr};
    case LevelFileError::other_groom:
      return {error, "levels of another groom", nullptr};
    case LevelFileError::none:
    case LevelFileError::damaged:
    case LevelFileError::invalid:
      break;
  }
  const auto payload = bytes.subspan(kLevelFileHeaderBytes);
  if (header.payload_bytes != payload.size())
    return {LevelFileError::damaged,
            std::to_string(payload.size()) + " bytes of levels, not " + std::to_string(header.payload_bytes), nullptr};
  const Checksum checksum = checksum_of(bytes);
  if (!std::ranges::equal(checksum, bytes.subspan(kChecksumAt, checksum.size())))
    return {LevelFileError::damaged, "the checksum is another one", nullptr};
  // Only now the payload is known to be what was written. It may still be invalid, where the build itself was wrong.
  auto set = std::make_shared<LevelSet>();
  if (std::string error = read(payload, *set); !error.empty())
    return {LevelFileError::invalid, std::move(error), nullptr};
  return {LevelFileError::none, {}, std::move(set)};
}

std::string level_file_name(const GroomHash& groom) {
  std::string name;
  for (const std::uint8_t byte : groom)
    for (const int digit : {byte >> 4, byte & 15}) name += "0123456789abcdef"[digit];
  return name + kLevelFileSuffix;
}

void set_level_file_checksum(std::span<std::uint8_t> bytes) {
  HAIRNET_ASSERT(bytes.size() >= kLevelFileHeaderBytes);
  const std::uint64_t payload_bytes = bytes.size() - kLevelFileHeaderBytes;
  std::memcpy(bytes.data() + offsetof(Header, payload_bytes), &payload_bytes, sizeof(payload_bytes));
  const Checksum checksum = checksum_of(bytes);
  std::ranges::copy(checksum, bytes.begin() + kChecksumAt);
}

}  // namespace hairnet::wire
