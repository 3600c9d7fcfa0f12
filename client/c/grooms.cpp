#include <cmath>

#include "client/assets/import/placement.hpp"
#include "client/assets/made/made.hpp"
#include "client/c/handles.hpp"

// Grooms: their files, making them, and reading them. hairnet.h says what each function promises.
namespace hairnet::c {
namespace {

// Bounds the memory of a wrong call. The largest made hairstyle takes 938 kB (schema/wire/README.md).
constexpr std::size_t kGroomFileBytesMax = std::size_t{64} << 20;
// hairnet.h promises these limits.
constexpr std::uint32_t kStrandPointsMin = 2, kStrandPointsMax = 256;

Result<ImportedStrands> strands_of(const float* points, const std::uint32_t* counts, std::size_t strand_count) {
  const GroomLimits limits;
  if (strand_count == 0 || strand_count > limits.strand_count_max)
    return Refusal(std::to_string(strand_count) + " strands; there may be 1 to " +
                   std::to_string(limits.strand_count_max));
  ImportedStrands strands;
  for (std::size_t s = 0; s < strand_count; ++s) {
    // The count is checked before it is added, so the sum of all strands fits 32 bits.
    if (counts[s] < kStrandPointsMin || counts[s] > kStrandPointsMax)
      return Refusal("strand " + std::to_string(s) + " has " + std::to_string(counts[s]) + " points, not 2 to 256");
    strands.strand_begin.push_back(strands.strand_begin.back() + counts[s]);
  }
  if (strands.strand_begin.back() > limits.point_count_max)
    return Refusal("more than " + std::to_string(limits.point_count_max) + " points");
  strands.points.resize(strands.strand_begin.back());
  for (std::size_t p = 0; p < strands.points.size(); ++p) {
    strands.points[p] = Vec3f(points[3 * p], points[3 * p + 1], points[3 * p + 2]);
    if (!strands.points[p].allFinite() || strands.points[p].cwiseAbs().maxCoeff() > limits.coordinate_max_m)
      return Refusal("point " + std::to_string(p) + " is not within 10 m of the head");
  }
  return strands;
}

}  // namespace

hairnet_error keep(Result<Groom>&& groom, hairnet_error code, hairnet_groom** out, char* error,
                   std::size_t error_size) {
  if (!groom) return refuse(code, groom.error(), error, error_size);
  if (const std::string invalid = validate(*groom); !invalid.empty()) return refuse(code, invalid, error, error_size);
  // A room names the groom by the hash of its file, so a groom that was made gets a file as well.
  auto file = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(*groom));
  const wire::GroomHash hash = wire::hash_groom(*file);
  *out = new hairnet_groom{std::make_shared<const Groom>(std::move(*groom)), std::move(file), hash};
  return HAIRNET_OK;
}

}  // namespace hairnet::c

using namespace hairnet;

hairnet_error hairnet_groom_load(const void* bytes, size_t size, hairnet_groom** groom, char* error,
                                 size_t error_size) {
  return c::guarded(
      [&] {
        if (size > c::kGroomFileBytesMax)
          return c::refuse(HAIRNET_MALFORMED, "a groom file has at most 64 MiB", error, error_size);
        const auto* begin = static_cast<const std::uint8_t*>(bytes);
        auto file = std::make_shared<const std::vector<std::uint8_t>>(begin, begin + size);
        Result<Groom> decoded = wire::decode_groom(*file);
        if (!decoded) return c::refuse(HAIRNET_MALFORMED, decoded.error(), error, error_size);
        // The hash is that of the bytes as they came, and not of the groom encoded again: servers and other clients
        // know the file by it.
        const wire::GroomHash hash = wire::hash_groom(*file);
        *groom = new hairnet_groom{std::make_shared<const Groom>(std::move(*decoded)), std::move(file), hash};
        return hairnet_error{HAIRNET_OK};
      },
      error, error_size);
}

hairnet_error hairnet_groom_from_strands(const char* name, const float* points, const uint32_t* counts,
                                         size_t strand_count, float radius_m, float hairs, hairnet_groom** groom,
                                         char* error, size_t error_size) {
  return c::guarded(
      [&] {
        // 0 means the default of either; negated comparisons also refuse what is not a number.
        if (!(radius_m >= 0 && radius_m <= 0.01f) || !(hairs >= 0 && hairs <= 100'000))
          return c::refuse(HAIRNET_INVALID, "a radius is at most 0.01 m, and a strand at most 100 000 hairs", error,
                           error_size);
        Result<ImportedStrands> strands = c::strands_of(points, counts, strand_count);
        if (!strands) return c::refuse(HAIRNET_INVALID, strands.error(), error, error_size);
        GroomDef def;
        def.name = name == nullptr ? "strands" : name;
        def.files.push_back({std::move(*strands), "hair"});
        def.placement.origin = Vec3::Zero();
        // Hair needs a body to be rooted in and to lie on. The caller gives none, so a made bust takes its place.
        def.body = make_bust().mesh;
        if (hairs > 0) def.hairs_in_all = double{hairs} * static_cast<double>(strand_count);
        Result<ImportedGroom> made = assemble_groom(def);
        if (!made) return c::refuse(HAIRNET_INVALID, made.error(), error, error_size);
        if (radius_m > 0) {
          for (StrandProperties& strand : made->groom.strands) strand.radius_m = radius_m;
        }
        return c::keep(std::move(made->groom), HAIRNET_INVALID, groom, error, error_size);
      },
      error, error_size);
}

hairnet_error hairnet_groom_make(const char* hairstyle, uint32_t strands, hairnet_groom** groom, char* error,
                                 size_t error_size) {
  return c::guarded(
      [&] {
        HairstyleOptions options;
        options.strand_count = strands;
        return c::keep(make_hairstyle(hairstyle, options), HAIRNET_INVALID, groom, error, error_size);
      },
      error, error_size);
}

hairnet_error hairnet_groom_file(const hairnet_groom* groom, void* buffer, size_t* size) {
  const std::size_t capacity = std::exchange(*size, groom->file->size());
  if (capacity < *size) return HAIRNET_TOO_SMALL;
  std::memcpy(buffer, groom->file->data(), *size);
  return HAIRNET_OK;
}

const char* hairnet_groom_name(const hairnet_groom* groom) {
  return groom->groom->name.c_str();
}

void hairnet_groom_hash(const hairnet_groom* groom, uint8_t hash[HAIRNET_HASH_BYTES]) {
  std::memcpy(hash, groom->hash.data(), groom->hash.size());
}

size_t hairnet_groom_point_count(const hairnet_groom* groom) {
  return groom->groom->points.size();
}

size_t hairnet_groom_strand_count(const hairnet_groom* groom) {
  return groom->groom->strand_count();
}

const uint32_t* hairnet_groom_strand_begin(const hairnet_groom* groom) {
  return groom->groom->strand_begin.data();
}

const float* hairnet_groom_points(const hairnet_groom* groom) {
  static_assert(sizeof(Vec3f) == 3 * sizeof(float));
  return groom->groom->points.empty() ? nullptr : groom->groom->points.front().data();
}

void hairnet_groom_body(const hairnet_groom* groom, hairnet_body* body) {
  const Body& of = groom->groom->body;
  *body = {};
  body->vertex_count = of.mesh.vertices.size();
  body->triangle_count = of.mesh.triangles.size();
  if (body->vertex_count > 0) {
    body->vertices = of.mesh.vertices.front().data();
    body->bone_weights = of.bone_weights.front().data();
  }
  if (body->triangle_count > 0) body->triangles = of.mesh.triangles.front().data();
}

void hairnet_groom_free(hairnet_groom* groom) {
  delete groom;
}
