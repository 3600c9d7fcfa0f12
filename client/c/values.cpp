// The values of hairnet.h as those of the library, and what errors are called.
#include <algorithm>
#include <charconv>
#include <cmath>

#include "client/c/handles.hpp"
#include "core/version.hpp"

namespace hairnet::c {
namespace {

constexpr std::size_t kNumbersPerBone = 7;
static_assert(HAIRNET_POSE_NUMBERS == kNumbersPerBone * kBoneCount);
static_assert(HAIRNET_HASH_BYTES == std::tuple_size_v<wire::GroomHash>);
static_assert(HAIRNET_RIGID == static_cast<int>(LevelIndex::rigid));
static_assert(HAIRNET_UNLOCK == static_cast<int>(wire::ModerateAction::unlock));

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
    bone.rotation = Quat(numbers[3], numbers[0], numbers[1], numbers[2]);
    bone.position = Vec3(numbers[4], numbers[5], numbers[6]);
    numbers += kNumbersPerBone;
  }
  return pose;
}

void write_pose(const Pose& pose, double* numbers) {
  for (const RigidTransform& bone : pose.bones) {
    std::ranges::copy(bone.rotation.coeffs(), numbers);  // x y z w
    std::ranges::copy(bone.position, numbers + 4);
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
  if (appearance == nullptr) return std::nullopt;
  for (const std::uint32_t colour : {appearance->hair_root, appearance->hair_tip, appearance->skin}) {
    if (colour > 0xffffff) return Refusal("appearance: a colour is beyond 0xffffff");
  }
  if (!(appearance->roughness >= 0 && appearance->roughness <= 1))
    return Refusal("appearance: roughness is not in 0 to 1");
  return appearance_of(*appearance);
}

Result<room::CharacterOptions> character_options_of(const hairnet_character_options* given) {
  hairnet_character_options options = HAIRNET_CHARACTER_OPTIONS;
  if (given != nullptr) {
    if (given->size < offsetof(hairnet_character_options, level) || given->size > sizeof options)
      return Refusal(
          "options: fill them by HAIRNET_CHARACTER_OPTIONS; this library is older than its header, or size is not set");
    std::memcpy(&options, given, given->size);
  }
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

}  // namespace hairnet::c

const char* hairnet_version(void) {
  return hairnet::kVersion;
}

uint32_t hairnet_version_number(void) {
  const std::string_view text = hairnet::kVersion;
  std::uint32_t number = 0, part = 0;
  for (const char *at = text.data(), *end = at + text.size(); at < end; ++at) {
    at = std::from_chars(at, end, part).ptr;
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
