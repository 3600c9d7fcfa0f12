#include "client/viewer/characters/character_spec.hpp"

#include <charconv>
#include <cmath>

#include "client/assets/import/placement.hpp"
#include "client/viewer/characters/hair_colour.hpp"
#include "core/groom/groom.hpp"
#include "schema/wire/text.hpp"

namespace hairnet::viewer {
namespace {

std::string in_quotes(std::string_view text) {
  return std::string("'").append(text).append("'");
}

template <class T>
Result<void> store(const Result<T>& value, T& target) {
  if (!value) return Refusal(value.error());
  target = *value;
  return {};
}

template <class T>
Result<void> store_optional(const Result<T>& value, std::optional<T>& target) {
  if (!value) return Refusal(value.error());
  target = *value;
  return {};
}

// The names are those of core's levels, which all programs share.
Result<LevelIndex> parse_level(const std::string& text) {
  for (std::size_t i = 0; i < kLevelCount; ++i) {
    if (text == kLevelNames[i]) return static_cast<LevelIndex>(i);
  }
  return Refusal("level " + in_quotes(text) + " is not one of high, medium, low, ether, learnt, rigid");
}

Result<std::size_t> parse_strand_count(const std::string& text) {
  const Result<double> number = parse_finite_number(text);
  constexpr std::size_t kMost = GroomLimits{}.strand_count_max;
  if (!number || *number < 1 || *number > static_cast<double>(kMost) || *number != std::floor(*number))
    return Refusal("strands " + in_quotes(text) + " is not a whole number in 1 ... " + std::to_string(kMost));
  return static_cast<std::size_t>(*number);
}

Result<double> parse_unit(const std::string& text) {
  const Result<double> number = parse_finite_number(text);
  if (!number || !(*number > 0)) return Refusal("unit " + in_quotes(text) + " is not a number above 0");
  return number;
}

Result<std::string> parse_name(const std::string& text) {
  // Tags on the wire may hold any bytes; a person's name should be readable for all.
  if (std::string error = wire::validate_tag(text); !error.empty())
    return Refusal("name is longer than " + std::to_string(wire::kTagBytesMax) + " bytes");
  if (!wire::is_text(text)) return Refusal("name is not UTF-8 text free of control characters");
  return text;
}

Result<void> set(CharacterOptions& o, const std::string& key, const std::string& value) {
  // An empty value is mostly a slip, so it does not mean the default.
  if (value.empty()) return Refusal(key + " has no value");
  if (key == "groom") return store<std::string>(value, o.groom);
  if (key == "motion") return store<std::string>(value, o.motion);
  if (key == "level") return store(parse_level(value), o.level);
  if (key == "strands") return store(parse_strand_count(value), o.hairstyle.strand_count);
  if (key == "up") return store_optional(parse_axis(value), o.bvh.up);
  if (key == "face") return store_optional(parse_axis(value), o.bvh.face);
  if (key == "unit") return store_optional(parse_unit(value), o.bvh.unit_m);
  if (key == "rest") return store(parse_rest_pose(value), o.bvh.rest);
  if (key == "at") return store_optional(parse_place(value), o.place);
  if (key == "material") return store_optional(make_material(value), o.material);
  if (key == "name") return store(parse_name(value), o.name);
  if (key == "colour") return store_optional(parse_hair_colour(value), o.colour);
  return Refusal(in_quotes(key) +
                 " is not one of groom, motion, level, material, at, name, colour, strands, rest, up, face, unit");
}

}  // namespace

Result<double> parse_finite_number(std::string_view text) {
  double number = 0;
  const char* end = text.data() + text.size();
  // The whole text must be used: "6s" is no number.
  const auto [parsed, error] = std::from_chars(text.data(), end, number);
  if (error != std::errc() || parsed != end || !std::isfinite(number))
    return Refusal(in_quotes(text) + " is not a number");
  return number;
}

Result<CharacterOptions> parse_character(const std::string& spec) {
  CharacterOptions options;
  // The end is included: an empty last part is refused as no key=value.
  for (std::size_t begin = 0; begin <= spec.size();) {
    const std::size_t end = std::min(spec.find(',', begin), spec.size());
    const std::string part = spec.substr(begin, end - begin);
    const std::size_t equals = part.find('=');
    if (equals == std::string::npos) return Refusal(in_quotes(part) + " is not key=value");
    if (const Result<void> done = set(options, part.substr(0, equals), part.substr(equals + 1)); !done)
      return Refusal(done.error());
    begin = end + 1;
  }
  if (options.groom.empty()) return Refusal("groom= is missing");
  return options;
}

}  // namespace hairnet::viewer
