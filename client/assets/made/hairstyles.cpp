#include <algorithm>
#include <array>
#include <cmath>

#include "client/assets/made/cards_and_clumps.hpp"
#include "client/assets/made/loose.hpp"
#include "client/assets/made/made.hpp"
#include "client/assets/made/plait.hpp"
#include "client/assets/made/ponytail.hpp"
#include "client/assets/made/veil.hpp"
#include "core/groom/root_lengths.hpp"

namespace hairnet {
namespace {

using made::comb_from_parting;
using made::comb_from_whorl;
using made::LooseRecipe;
using made::Root;
using made::StyleOptions;

// Each function below is a style: the default recipe with what differs; recipe.hpp describes the fields of a recipe.
// Only the eye can judge a style: draw it from the front, the side, behind and above before you commit it.
void dress_long_straight(const StyleOptions& options, Groom& groom) {
  LooseRecipe recipe;
  // The numbers of comb_from_parting() are the parting's x, its front and its back end, m. The second term combs the
  // hair back, out of the face.
  recipe.comb = [](const Vec3& p, const Root& root) {
    return Vec3(comb_from_parting(p, root, 0.0, 0.10, -0.035) + Vec3(0, 0, -0.30));
  };
  made::dress_loose(recipe, options, groom);
}

void dress_long_curly(const StyleOptions& options, Groom& groom) {
  LooseRecipe recipe;
  recipe.comb = [](const Vec3& p, const Root& root) {
    return Vec3(comb_from_parting(p, root, 0.012, 0.10, -0.035) + Vec3(0, 0, -0.2));
  };
  recipe.lift_m = 0.034;
  recipe.lift_rise_m = 0.075;
  recipe.rise = 0.9;
  recipe.bend_m = 0.028;
  recipe.blunt = 0.35;
  recipe.thinning = 0.3;
  // Strong clumping and little disorder make ringlets: strands of a lock curl in phase.
  recipe.clumping = 0.85;
  recipe.locks = 230;
  recipe.gathered_at = 0.5;
  recipe.curl_disorder = 0.4;
  recipe.flyaway = 0.09;
  made::dress_loose(recipe, options, groom);
}

void dress_wavy(const StyleOptions& options, Groom& groom) {
  LooseRecipe recipe;
  recipe.comb = [](const Vec3& p, const Root& root) {
    return Vec3(comb_from_parting(p, root, 0.022, 0.10, -0.035) + Vec3(0, 0, -0.25));
  };
  recipe.lift_m = 0.025;
  recipe.lift_rise_m = 0.07;
  recipe.rise = 0.7;
  recipe.blunt = 0.6;
  recipe.thinning = 0.22;
  recipe.clumping = 0.7;
  recipe.gathered_at = 0.7;
  recipe.curl_disorder = 0.5;
  recipe.flyaway = 0.07;
  made::dress_loose(recipe, options, groom);
}

void dress_bob(const StyleOptions& options, Groom& groom) {
  LooseRecipe recipe;
  recipe.comb = [](const Vec3& p, const Root&) { return comb_from_whorl(p, 0.0, 0.005); };
  recipe.lift_m = 0.026;
  recipe.blunt = 1;
  recipe.thinning = 0.05;
  recipe.rise = 0.3;
  recipe.tuck = 0.9;
  recipe.clumping = 0.3;
  recipe.flyaway = 0.03;
  recipe.fringe = {.half_angle_deg = 54, .depth_m = 0.13, .wedge = 0.3, .length_m = 0.19};
  // The bob ends above the shoulders, so no hair is led behind them.
  recipe.front_deg = 180;
  made::dress_loose(recipe, options, groom);
}

void dress_side_part(const StyleOptions& options, Groom& groom) {
  LooseRecipe recipe;
  recipe.comb = [](const Vec3& p, const Root& root) {
    return Vec3(comb_from_parting(p, root, 0.032, 0.10, -0.035) + Vec3(0, 0, -0.25));
  };
  recipe.lift_m = 0.023;
  recipe.lift_rise_m = 0.065;
  recipe.blunt = 0.85;
  recipe.tuck = 0.4;
  recipe.fringe = {.half_angle_deg = 30, .depth_m = 0.035, .tip_height_m = 0.058, .sweep = -0.9, .length_m = 0.15};
  made::dress_loose(recipe, options, groom);
  // With gel the fringe leaves the skull later than other hair, and never completely. A pair is a multiple of the root
  // length, and the blend delta there (RootBlend).
  const auto fringe = made::group_index(groom, "fringe");
  groom.root_blends.resize(groom.group_names.size());
  groom.root_blends[fringe].points = {{1, 0.08f}, {2.5f, 0.4f}, {5, 0.75f}};
  // Beside the parting, hair rises before it falls: within 6 cm of this place the root length grows from 2 cm to 4 cm.
  RootLengths lengths;
  lengths.regions = {{Vec3f(0.032f, 0.165f, 0.04f), 0.06f, 0.04f}};
  lengths.spread = 0.3f;
  lengths.seed = static_cast<std::uint32_t>(options.seed);
  set_root_lengths(lengths, kEveryGroup, groom);
}

void dress_veiled(const StyleOptions& options, Groom& groom) {
  dress_long_straight(options, groom);
  // The veil is longer than the hair, and long enough to hang from a short one.
  made::add_veil(std::max(0.12, 1.3 * options.length_m), groom);
}

void dress_locks(const StyleOptions& options, Groom& groom) {
  dress_wavy(options, groom);
  // The copies have no mechanics, so the style costs the server only its few strands.
  made::turn_into_clumps(6, 0.0045, groom);
  RootLengths lengths;
  lengths.spread = 0.3f;
  lengths.seed = static_cast<std::uint32_t>(options.seed);
  set_root_lengths(lengths, kEveryGroup, groom);
}

void dress_cards(const StyleOptions& options, Groom& groom) {
  // Cards need flat hair, so they are made of the straight style.
  dress_long_straight(options, groom);
  // The width follows the distance between roots, which falls with the square root of their number, so that cards
  // overlap alike in each style: 1000 of them are 19 mm wide.
  made::turn_into_cards(std::clamp(0.6 / std::sqrt(static_cast<double>(options.strand_count)), 0.004, 0.03), groom);
}

void dress_short(const StyleOptions& options, Groom& groom) {
  LooseRecipe recipe;
  recipe.comb = [](const Vec3& p, const Root&) {
    // Hair leads away from the whorl at the crown; in front, it turns to the side.
    Vec3 away = comb_from_whorl(p, 0.012, -0.035);
    away.x() -= 0.5 * std::max(0.0, p.z() / 0.08);
    return away;
  };
  // The comb holds over the whole length, because short hair never hangs free.
  recipe.comb_reach_m = 0.5;
  recipe.fall = 0.25;
  recipe.rise = 1.1;
  recipe.bend_m = 0.03;
  recipe.lift_m = 0.020;
  recipe.lift_rise_m = 0.02;
  recipe.blunt = 0;
  recipe.thinning = 0.4;
  recipe.side_length = 0.4;
  recipe.clumping = 0.45;
  recipe.locks = 420;
  recipe.points = 12;
  recipe.flyaway = 0.12;
  made::dress_loose(recipe, options, groom);
}

// The length (m), the curl (0 to 1) and the number of strands hold where the options leave them open.
struct Style {
  MadeName name;
  double length_m, curl;
  std::size_t strand_count;
  void (*dress)(const StyleOptions&, Groom&);
};
constexpr std::array<Style, 11> kStyles{{
    {{"long_straight", "long and sleek, parted in the middle"}, 0.52, 0, 10'000, dress_long_straight},
    {{"long_curly", "long, full, in loose ringlets"}, 0.46, 0.6, 8'000, dress_long_curly},
    {{"wavy", "shoulder-length waves, parted a little to the left"}, 0.40, 0.25, 10'000, dress_wavy},
    {{"bob", "chin-length, blunt, tips turned in, with a straight fringe"}, 0.25, 0, 10'000, dress_bob},
    {{"side_part", "collar-length, parted on the left, with a swept stiff fringe"}, 0.33, 0, 10'000, dress_side_part},
    {{"ponytail", "pulled back to a band with a bow behind the crown, the tail free"},
     0.44,
     0.18,
     10'000,
     made::dress_ponytail},
    {{"short", "short and textured, longer on top"}, 0.055, 0, 14'000, dress_short},
    {{"plait", "pulled back and plaited from the nape, knotted all along, a cord at its end"},
     0.42,
     0,
     6'000,
     made::dress_plait},
    {{"veiled", "long and sleek under a veil that is pinned across the crown"}, 0.52, 0, 10'000, dress_veiled},
    {{"locks", "waves of few strands, each drawn as a lock that follows it"}, 0.40, 0.25, 1'600, dress_locks},
    {{"strips", "long and sleek, in ribbons of textured hair"}, 0.52, 0, 1'000, dress_cards},
}};
// The names in the order of the table, computed when the program is compiled.
constexpr auto kStyleNames = [] {
  std::array<MadeName, kStyles.size()> names;
  for (std::size_t i = 0; i < names.size(); ++i) {
    names[i] = kStyles[i].name;
  }
  return names;
}();

// NaN fails these comparisons and is refused.
std::string check(const HairstyleOptions& options) {
  if (options.length_m != 0 && !(options.length_m >= 0.01 && options.length_m <= 1.2)) {
    return "length of a hairstyle must be 0.01 to 1.2 m";
  }
  if (!(options.curl <= 1)) {
    return "curl of a hairstyle must be 0 to 1";
  }
  if (options.strand_count != 0 && (options.strand_count < 10 || options.strand_count > 100'000)) {
    return "strand count of a hairstyle must be 10 to 100000";
  }
  return {};
}

}  // namespace

std::span<const MadeName> hairstyle_names() {
  return kStyleNames;
}

Result<Groom> make_hairstyle(std::string_view name, const HairstyleOptions& options) {
  if (std::string wrong = check(options); !wrong.empty()) {
    return Refusal(std::move(wrong));
  }
  for (const Style& style : kStyles) {
    if (style.name.name != name) {
      continue;
    }
    Groom groom;
    groom.name = name;
    groom.body = make_bust();
    style.dress({.length_m = options.length_m > 0 ? options.length_m : style.length_m,
                 .curl = options.curl >= 0 ? options.curl : style.curl,
                 .strand_count = options.strand_count > 0 ? options.strand_count : style.strand_count,
                 .seed = options.seed},
                groom);
    return groom;
  }
  std::string known;
  for (const Style& style : kStyles) {
    known += (known.empty() ? "" : ", ") + std::string(style.name.name);
  }
  // The name comes from a user and may be long, so only its beginning is shown.
  return Refusal("no hairstyle is called '" + std::string(name.substr(0, 64)) + "'; there are " + known);
}

}  // namespace hairnet
