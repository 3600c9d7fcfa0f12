#include "tests/gallery/simulate.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/levels/build.hpp"
#include "core/world/world.hpp"
#include "tests/support/corpus.hpp"

namespace hairnet::gallery {
namespace {

constexpr double kRate_hz = 60;

Moment moment_of(const LatticeView& lattice) {
  Moment moment;
  moment.pose = *lattice.pose;
  if (lattice.model == nullptr) return moment;
  moment.geometry = &lattice.model->geometry;
  moment.grid_displacements.resize(moment.geometry->lattice.node_count());
  expand_displacements(*moment.geometry, lattice.displacement, moment.grid_displacements);
  return moment;
}

}  // namespace

Result<Hairstyle> load_hairstyle(const std::string& name) {
  Result<Groom> groom = fidelity::load_groom(name);
  if (!groom) return Refusal(groom.error());
  Hairstyle style{name, std::make_shared<Groom>(std::move(*groom)), nullptr};
  style.levels = build_levels(*style.groom);
  return style;
}

Result<std::vector<Moment>> simulate_motion(const Hairstyle& style, const std::string& motion, LevelIndex level,
                                            const std::vector<double>& times_s, const Environment& environment) {
  const Result<Motion> loaded = fidelity::load_motion(motion, style.groom->body);
  if (!loaded) return Refusal(loaded.error());
  const double last_s = times_s.empty() ? 0 : times_s.back();
  // A clip begins with a lead-in at rest, so times before 0 show the hair at rest.
  const fidelity::Clip clip = fidelity::make_clip(*loaded, kRate_hz, last_s + 1 / kRate_hz);
  WorldDef def;
  def.tick_s = 1 / kRate_hz;
  def.environment = environment;
  World world(def);
  const CharacterId id = world.add({.levels = style.levels, .level = level, .pose = clip.poses.front()});
  std::vector<Moment> moments;
  for (std::size_t tick = 0; moments.size() < times_s.size(); ++tick) {
    const double time_s = (static_cast<double>(tick) - static_cast<double>(clip.lead_in_ticks)) / kRate_hz;
    // Sums of times round, so a time that is a tick's may be a little later than the tick.
    while (moments.size() < times_s.size() && times_s[moments.size()] <= time_s + 1e-9)
      moments.push_back(moment_of(world.lattice(id)));
    world.set_pose(id, clip.poses[std::min(tick + 1, clip.poses.size() - 1)]);
    static_cast<void>(world.step());
  }
  return moments;
}

draw::ShownCharacter shown(std::size_t groom, const Moment& moment) {
  draw::ShownCharacter character;
  character.groom = groom;
  character.pose = moment.pose;
  character.lattice = {moment.geometry, moment.grid_displacements};
  return character;
}

Vec3f hair_colour(std::size_t number) {
  // Brown, light brown, black, red, hazel and grey.
  static const std::array<Vec3f, 6> kColours{Vec3f(0.16f, 0.07f, 0.03f),  Vec3f(0.45f, 0.27f, 0.12f),
                                             Vec3f(0.03f, 0.022f, 0.02f), Vec3f(0.30f, 0.08f, 0.025f),
                                             Vec3f(0.24f, 0.13f, 0.06f),  Vec3f(0.35f, 0.33f, 0.32f)};
  return kColours[number % kColours.size()];
}

}  // namespace hairnet::gallery
