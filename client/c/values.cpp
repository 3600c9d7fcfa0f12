// The values of hairnet.h as those of the library, and what errors are called.
#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>

#include "client/c/handles.hpp"
#include "core/version.hpp"

namespace hairnet::c {
namespace {

constexpr std::size_t kNumbersPerBone = 7;
static_assert(HAIRNET_POSE_NUMBERS == kNumbersPerBone * kBoneCount);
static_assert(HAIRNET_HASH_BYTES == std::tuple_size_v<wire::GroomHash>);
// The last value of each enum is compared: a value that is inserted before it would shift all that follow.
static_assert(HAIRNET_RIGID == static_cast<int>(LevelIndex::rigid));
static_assert(HAIRNET_UNLOCK == static_cast<int>(wire::ModerateAction::unlock));

// The colour is 0xRRGGBB, as in a page's styles.
wire::Srgb srgb_of(std::uint32_t colour) {
  return {static_cast<std::uint8_t>(colour >> 16), static_cast<std::uint8_t>(colour >> 8),
          static_cast<std::uint8_t>(colour)};
}

std::uint32_t number_of(const wire::Srgb& colour) {
  return std::uint32_t{colour.red} << 16 | std::uint32_t{colour.green} << 8 | colour.blue;
}

}  // namespace

Pose pose_of(const double* numbers) {
  Pose pose;
  for (RigidTransform& bone : pose.bones) {
    // A bone is x y z w of its rotation, then x y z of its position.
    bone = place_of(numbers, numbers + 4);
    numbers += kNumbersPerBone;
  }
  return pose;
}

void write_pose(const Pose& pose, double* numbers) {
  for (const RigidTransform& bone : pose.bones) {
    write_place(bone, numbers, numbers + 4);
    numbers += kNumbersPerBone;
  }
}

wire::Appearance appearance_of(const hairnet_appearance& appearance) {
  return {srgb_of(appearance.hair_root), srgb_of(appearance.hair_tip), srgb_of(appearance.skin),
          static_cast<std::uint8_t>(std::lround(255 * appearance.roughness))};
}

hairnet_appearance appearance_of(const wire::Appearance& appearance) {
  return {number_of(appearance.hair_root), number_of(appearance.hair_tip), number_of(appearance.skin),
          static_cast<float>(appearance.roughness) / 255};
}

Result<std::optional<wire::Appearance>> checked(const hairnet_appearance* appearance) {
  // Null means that the receiver chooses, and is not an error.
  if (appearance == nullptr) return std::nullopt;
  for (const std::uint32_t colour : {appearance->hair_root, appearance->hair_tip, appearance->skin}) {
    if (colour > 0xffffff) return Refusal("appearance: a colour is beyond 0xffffff");
  }
  // The negation also refuses what is not a number.
  if (!(appearance->roughness >= 0 && appearance->roughness <= 1))
    return Refusal("appearance: roughness is not in 0 to 1");
  return appearance_of(*appearance);
}

// The two mistakes look the same from here, so the line names both.
Refusal of_another_size(const char* macro) {
  return Refusal("options: fill them by " + std::string(macro) +
                 "; this library is older than its header, or size is not set");
}

Result<room::CharacterOptions> character_options_of(const hairnet_character_options* given) {
  const Result<hairnet_character_options> full =
      full_options<hairnet_character_options>(given, HAIRNET_CHARACTER_OPTIONS, "HAIRNET_CHARACTER_OPTIONS");
  if (!full) return Refusal(full.error());
  const hairnet_character_options& options = *full;
  if (static_cast<unsigned>(options.level) > HAIRNET_RIGID) return Refusal("options: there is no such level");
  const Result<std::optional<wire::Appearance>> appearance = checked(options.appearance);
  if (!appearance) return Refusal(appearance.error());
  std::string tag = tag_of(options.tag, options.tag_size);
  if (std::string error = wire::validate_tag(tag); !error.empty()) return Refusal(std::move(error));
  return room::CharacterOptions{static_cast<LevelIndex>(options.level), std::move(tag), *appearance};
}

MaterialScale scale_of(const hairnet_material& material) {
  return {material.stiffness,     material.damping,  material.density,
          material.ether_damping, material.air_drag, material.gel_per_s2};
}

Wind wind_of(const hairnet_wind& wind) {
  Wind out;
  out.mean_m_per_s = Vec3(wind.mean_m_per_s[0], wind.mean_m_per_s[1], wind.mean_m_per_s[2]);
  out.gust_ratio = wind.gust_ratio;
  out.gust_period_s = wind.gust_period_s;
  out.turbulence_rms_m_per_s = wind.turbulence_rms_m_per_s;
  out.turbulence_scale_m = wind.turbulence_scale_m;
  out.seed = wind.seed;
  out.carried = wind.carried != 0;
  return out;
}

hairnet_wind wind_of(const Wind& wind) {
  return {{wind.mean_m_per_s[0], wind.mean_m_per_s[1], wind.mean_m_per_s[2]},
          wind.gust_ratio,
          wind.gust_period_s,
          wind.turbulence_rms_m_per_s,
          wind.turbulence_scale_m,
          wind.seed,
          wind.carried};
}

RigidTransform place_of(const double rotation[4], const double position[3]) {
  return {Quat(rotation[3], rotation[0], rotation[1], rotation[2]), Vec3(position[0], position[1], position[2])};
}

void write_place(const RigidTransform& place, double* rotation, double* position) {
  std::ranges::copy(place.rotation.coeffs(), rotation);  // x y z w
  std::ranges::copy(place.position, position);
}

Result<TouchBody> body_of(const hairnet_touch_body& given) {
  if (given.number > std::numeric_limits<std::uint8_t>::max())
    return tl::unexpected("number " + std::to_string(given.number) + " is more than 255");
  TouchBody body;
  body.key = {given.toucher, static_cast<std::uint8_t>(given.number)};
  body.place = place_of(given.rotation, given.position);
  const Vec3 half_size_m = Eigen::Map<const Vec3f>(given.half_size_m).cast<double>();
  const double radius_m = double{given.radius_m};
  switch (given.shape) {
    case HAIRNET_SPHERE:
      body.shape = sphere(radius_m);
      break;
    case HAIRNET_CAPSULE:
      body.shape = capsule(half_size_m.y(), radius_m);
      break;
    case HAIRNET_BOX:
      body.shape = box(half_size_m);
      break;
    case HAIRNET_PLANE: {
      // A plane becomes a large box below it, which moves its place as well.
      const PlacedShape below = half_space(body.place);
      body.shape = below.shape;
      body.place = below.place;
      break;
    }
    // An enum of C may hold any integer.
    default:
      return tl::unexpected("there is no shape " + std::to_string(given.shape));
  }
  body.shape.is_inside_out = given.is_inside_out != 0;
  body.has_jumped = given.has_jumped != 0;
  return body;
}

// Props come back as boxes, spheres and capsules: a plane has become a box when it was set.
hairnet_touch_body body_of(const wire::Prop& prop) {
  hairnet_touch_body body{};
  const Vec3& half_m = prop.shape.half_size_m;
  // A room has one kind of shape, a box with a radius: a sphere has no half size, a capsule one along y alone.
  const bool is_thin = half_m.x() == 0 && half_m.z() == 0;
  body.number = prop.number;
  body.shape = !is_thin ? HAIRNET_BOX : half_m.y() == 0 ? HAIRNET_SPHERE : HAIRNET_CAPSULE;
  body.is_inside_out = prop.shape.is_inside_out;
  body.has_jumped = prop.has_jumped;
  Eigen::Map<Vec3f>(body.half_size_m) = half_m.cast<float>();
  body.radius_m = static_cast<float>(prop.shape.radius_m);
  write_place(prop.place, body.rotation, body.position);
  return body;
}

}  // namespace hairnet::c

const char* hairnet_version(void) {
  return hairnet::kVersion;
}

// The number is made from the text, so that there is one place to change.
uint32_t hairnet_version_number(void) {
  const std::string_view text = hairnet::kVersion;
  std::uint32_t number = 0, part = 0;
  for (const char *at = text.data(), *end = at + text.size(); at < end; ++at) {
    at = std::from_chars(at, end, part).ptr;
    // Each part of the version gets two decimal digits: 0.1.0 gives 100.
    number = 100 * number + part;
  }
  return number;
}

const char* hairnet_error_text(hairnet_error error) {
  switch (error) {
    case HAIRNET_OK:
      return "no error";
    case HAIRNET_INVALID:
      return "an argument is out of its range";
    case HAIRNET_MALFORMED:
      return "the bytes are no such file";
    case HAIRNET_UNREACHABLE:
      return "no server answers there";
    case HAIRNET_REFUSED:
      return "the server refuses";
    case HAIRNET_NOT_THERE:
      return "there is none, or not yet";
    case HAIRNET_TOO_SMALL:
      return "the buffer is too small";
    case HAIRNET_OUT_OF_MEMORY:
      return "out of memory";
    default:
      return "unknown error";
  }
}
