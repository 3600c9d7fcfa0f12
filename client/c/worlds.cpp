#include <algorithm>
#include <atomic>
#include <cmath>
#include <limits>
#if !defined(__wasm__)
#include <thread>
#endif

#include "client/c/handles.hpp"
#include "client/local/played_world.hpp"
#include "core/levels/build.hpp"
#include "schema/wire/level_file.hpp"

using namespace hairnet;

#if defined(__wasm__)
// The host of the WebAssembly module provides this function. The module has one thread, so during a build nothing but
// this call could report the progress.
__attribute__((import_module("hairnet"), import_name("on_progress"))) void hairnet_on_progress(double fraction);
#endif

namespace {

// Whether a world accepts the pose: in the range of the protocol, and by is_valid(), which measures a rotation's length
// more strictly.
bool is_pose(const Pose& pose) {
  return wire::validate_pose(pose) == wire::PoseRefusal::none && is_valid(pose);
}

}  // namespace

// A build runs on a thread of its own. In WebAssembly, which has one thread, hairnet_build_finish() runs it.
struct hairnet_build {
  std::shared_ptr<const Groom> groom;
  wire::GroomHash hash{};
  // The build's thread writes it, and any thread of the caller reads it.
  std::atomic<double> progress{0};
  std::atomic<bool> is_cancelled{false};
  std::shared_ptr<const LevelSet> levels;
#if !defined(__wasm__)
  std::thread thread;  // last: it uses the above
#endif

  void run() {
    BuildCallbacks callbacks;
    callbacks.progress = [this](double fraction, std::string_view) {
      progress = fraction;
#if defined(__wasm__)
      hairnet_on_progress(fraction);
#endif
      return !is_cancelled;
    };
// Modules of WebAssembly are compiled without exceptions, and end where memory is lacking.
#if defined(__cpp_exceptions)
    try {
      levels = build_levels(*groom, callbacks);
    } catch (const std::exception&) {
      return;  // out of memory: there are no levels
    }
#else
    levels = build_levels(*groom, callbacks);
#endif
    progress = 1;
  }
  // After this the build has ended, whatever its outcome.
  void wait() {
#if !defined(__wasm__)
    if (thread.joinable()) thread.join();
#else
    // A module has one thread, so the build runs here, when its result is asked for.
    if (!levels) run();
#endif
  }
};

struct hairnet_world {
  // A character goes from `before` to `pose` during an advance, since ticks lie anywhere between the caller's calls.
  struct Character {
    std::shared_ptr<room::Member> member;
    Pose before, pose;
    bool is_placed = false;
    // The next tick jumps to the pose.
    bool teleport = false;
  };
  // A hand or a prop, which goes from `before` to `body.place` in the same way.
  struct Body {
    TouchBody body;
    RigidTransform before;
  };
  explicit hairnet_world(double tick_rate_hz) : world(def(tick_rate_hz)) {
    world.touch_by([this](double, double to_s) { return bodies_at(to_s); });
  }
  static local::PlayedWorld::Def def(double tick_rate_hz) {
    local::PlayedWorld::Def def;
    def.tick_rate_hz = tick_rate_hz;
    return def;
  }
  Character* find(std::uint32_t own) {
    const auto found = characters.find(own);
    return found == characters.end() ? nullptr : found->second.get();
  }
  // PlayedWorld passes two equal times for the pose to show, and a tick's two ends for the pose to step.
  local::TickPose pose_at(Character& character, double from_s, double to_s) const {
    if (from_s == to_s) return {character.pose};
    if (std::exchange(character.teleport, false)) return {character.before = character.pose, true};
    return {interpolate(character.before, character.pose, into(to_s))};
  }
  // The share of the advance that has passed at this time, 0 ... 1.
  [[nodiscard]] double into(double time_s) const {
    const double span_s = now_s - before_s;
    return span_s > 0 ? std::clamp((time_s - before_s) / span_s, 0.0, 1.0) : 1;
  }
  // The map is ordered by key, as the World wants its bodies.
  std::vector<TouchBody> bodies_at(double time_s) {
    std::vector<TouchBody> there;
    for (auto& [key, moving] : bodies) {
      there.push_back(moving.body);
      there.back().place = interpolate(moving.before, moving.body.place, into(time_s));
      // The jump belongs to the first tick of the advance. In later ticks the body moves on from there.
      moving.body.has_jumped = false;
    }
    return there;
  }
  // Moves the world on by this many seconds, and shows the result.
  void advance(double seconds) {
    before_s = std::exchange(now_s, now_s + seconds);
    // The shown time is one tick behind: the poses of this advance then cover every tick that the World steps.
    world.advance_to(now_s - 1 / world.tick_rate_hz());
    for (const auto& [own, character] : characters) character->before = character->pose;
    for (auto& [key, moving] : bodies) moving.before = moving.body.place;
    show();
  }
  void show() {
    scene.shown.clear();
    for (const auto& [own, character] : characters) {
      const local::PlayedWorld::Shown now = world.shown(own);
      room::Member& member = *character->member;
      if (character->is_placed) member.pose = now.pose;
      member.sample.level = now.level;
      member.skin = now.model ? now.model->skin : nullptr;
      scene.shown.push_back({character->member, now.lattice, now.geometry});
    }
    c::forget_unused(scene);
  }

  // It plays one tick behind, so that all poses that a tick asks for are known.
  local::PlayedWorld world;
  // The last advance went from before_s to now_s.
  double before_s = 0, now_s = 0;
  // The characters by their own number, which PlayedWorld::add() gives. Callbacks of the world refer to them, so they
  // must not move.
  std::map<std::uint32_t, std::unique_ptr<Character>> characters;
  std::map<TouchKey, Body> bodies;
  hairnet_scene scene;
};

hairnet_error hairnet_build_begin(const hairnet_groom* groom, hairnet_build** build) {
  return c::guarded([&] {
    // A groom without points has nothing to simulate, and no box for a lattice.
    if (groom->groom->points.empty()) return hairnet_error{HAIRNET_INVALID};
    auto made = std::make_unique<hairnet_build>();
    made->groom = groom->groom;
    made->hash = groom->hash;
#if !defined(__wasm__)
    made->thread = std::thread([&build = *made] { build.run(); });
#endif
    *build = made.release();
    return hairnet_error{HAIRNET_OK};
  });
}

double hairnet_build_progress(const hairnet_build* build) {
  return build->progress;
}

hairnet_error hairnet_build_finish(hairnet_build* build, hairnet_levels** levels) {
  return c::guarded([&] {
    build->wait();
    if (!build->levels) return hairnet_error{HAIRNET_OUT_OF_MEMORY};
    *levels = new hairnet_levels{build->hash, build->levels};
    return hairnet_error{HAIRNET_OK};
  });
}

void hairnet_build_free(hairnet_build* build) {
  if (build == nullptr) return;
  // The build sees this at its next report of progress, and ends there.
  build->is_cancelled = true;
#if !defined(__wasm__)
  build->wait();
#endif
  delete build;
}

hairnet_error hairnet_levels_file(const hairnet_levels* levels, void* buffer, size_t* size) {
  return c::guarded([&] {
    const std::vector<std::uint8_t> file = wire::encode_levels(levels->groom, *levels->levels);
    // The size is written in any case, so that a caller learns how large its buffer must be.
    const std::size_t capacity = std::exchange(*size, file.size());
    if (capacity < *size) return hairnet_error{HAIRNET_TOO_SMALL};
    std::memcpy(buffer, file.data(), *size);
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_levels_load(const hairnet_groom* groom, const void* bytes, size_t size, hairnet_levels** levels,
                                  char* error, size_t error_size) {
  return c::guarded(
      [&] {
        wire::DecodedLevels decoded = wire::decode_levels({static_cast<const std::uint8_t*>(bytes), size}, groom->hash);
        if (groom->groom->points.empty())
          return c::refuse(HAIRNET_MALFORMED, "a groom without points has no levels", error, error_size);
        if (decoded.error != wire::LevelFileError::none)
          return c::refuse(HAIRNET_MALFORMED, decoded.detail, error, error_size);
        // The maps between levels are no part of the file, since they follow from the groom and the levels.
        make_level_maps(*groom->groom, *decoded.levels);
        *levels = new hairnet_levels{groom->hash, std::move(decoded.levels)};
        return hairnet_error{HAIRNET_OK};
      },
      error, error_size);
}

void hairnet_levels_free(hairnet_levels* levels) {
  delete levels;
}

hairnet_error hairnet_world_make(double tick_rate_hz, hairnet_world** world) {
  return c::guarded([&] {
    if (!(tick_rate_hz >= local::PlayedWorld::kTickRateMin_hz && tick_rate_hz <= local::PlayedWorld::kTickRateMax_hz))
      return hairnet_error{HAIRNET_INVALID};
    *world = new hairnet_world(tick_rate_hz);
    return hairnet_error{HAIRNET_OK};
  });
}

void hairnet_world_free(hairnet_world* world) {
  delete world;
}

hairnet_error hairnet_world_add(hairnet_world* world, const hairnet_groom* groom, const hairnet_levels* levels,
                                const hairnet_character_options* options, const double pose[HAIRNET_POSE_NUMBERS],
                                uint32_t* own, char* error, size_t error_size) {
  const auto add = [&] {
    const auto refuse = [&](std::string_view line) { return c::refuse(HAIRNET_INVALID, line, error, error_size); };
    const Result<room::CharacterOptions> wanted = c::character_options_of(options);
    if (!wanted) return refuse(wanted.error());
    // A local world rounds poses as a server does, so that both step the same poses.
    const Pose start = pose != nullptr ? rounded_to_wire(c::pose_of(pose)) : Pose{};
    // Levels of another groom would move these strands by a lattice that does not surround them.
    if (levels != nullptr && levels->groom != groom->hash) return refuse("the levels are of another groom");
    if (!is_pose(start)) return refuse("the pose is not finite, not made of rotations, or too far away");
    auto character = std::make_unique<hairnet_world::Character>();
    character->before = character->pose = start;
    // Without a pose the character is simulated, but not shown.
    character->is_placed = pose != nullptr;
    character->member = std::make_shared<room::Member>();
    room::Member& member = *character->member;
    member.groom = groom->groom;
    member.groom_file = groom->file;
    member.groom_hash = groom->hash;
    member.tag = wanted->tag;
    member.appearance = wanted->appearance;
    // The callback keeps the character's address, so characters live on the heap, where they do not move.
    const std::uint32_t number = world->world.add(
        [world, at = character.get()](double from_s, double to_s) { return world->pose_at(*at, from_s, to_s); });
    if (number == 0) return refuse("the world has as many characters as it can have");
    member.number = member.own = member.owners_character = number;
    world->characters[number] = std::move(character);
    world->world.set_level(number, wanted->level);
    if (levels != nullptr) world->world.give_levels(number, levels->levels);
    // The scene has the new character at once, before the next advance.
    world->show();
    if (own != nullptr) *own = number;
    return hairnet_error{HAIRNET_OK};
  };
  return c::guarded(add, error, error_size);
}

hairnet_error hairnet_world_set_levels(hairnet_world* world, uint32_t own, const hairnet_levels* levels) {
  return c::guarded([&] {
    const hairnet_world::Character* character = world->find(own);
    if (character == nullptr) return hairnet_error{HAIRNET_NOT_THERE};
    if (levels->groom != character->member->groom_hash) return hairnet_error{HAIRNET_INVALID};
    world->world.give_levels(own, levels->levels);
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_world_remove(hairnet_world* world, uint32_t own) {
  return c::guarded([&] {
    if (world->find(own) == nullptr) return hairnet_error{HAIRNET_NOT_THERE};
    // The world goes first, as its callback refers to the character.
    world->world.remove(own);
    world->characters.erase(own);
    world->show();
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_world_push_pose(hairnet_world* world, uint32_t own, const double pose[HAIRNET_POSE_NUMBERS],
                                      int32_t teleport) {
  hairnet_world::Character* character = world->find(own);
  if (character == nullptr) return HAIRNET_NOT_THERE;
  const Pose next = rounded_to_wire(c::pose_of(pose));
  if (!is_pose(next)) return HAIRNET_INVALID;
  character->pose = next;
  // Several poses may come before the next tick: a jump among them must not get lost. The first pose of a character
  // without a place is a jump, too.
  character->teleport = character->teleport || teleport != 0 || !character->is_placed;
  character->is_placed = true;
  return HAIRNET_OK;
}

hairnet_error hairnet_world_set_level(hairnet_world* world, uint32_t own, hairnet_level level) {
  if (static_cast<unsigned>(level) > HAIRNET_RIGID) return HAIRNET_INVALID;
  if (world->find(own) == nullptr) return HAIRNET_NOT_THERE;
  return c::guarded([&] {
    world->world.set_level(own, static_cast<LevelIndex>(level));
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_world_set_material(hairnet_world* world, uint32_t own, const hairnet_material* material,
                                         char* error, size_t error_size) {
  return c::guarded(
      [&] {
        if (world->find(own) == nullptr) return c::no_such_character(error, error_size);
        const MaterialScale scale = c::scale_of(*material);
        if (const std::string invalid = validate(scale); !invalid.empty())
          return c::refuse(HAIRNET_INVALID, invalid, error, error_size);
        world->world.set_material(own, scale);
        return hairnet_error{HAIRNET_OK};
      },
      error, error_size);
}

hairnet_error hairnet_world_set_appearance(hairnet_world* world, uint32_t own, const char* tag, size_t tag_size,
                                           const hairnet_appearance* appearance, char* error, size_t error_size) {
  return c::guarded(
      [&] {
        hairnet_world::Character* character = world->find(own);
        if (character == nullptr) return c::no_such_character(error, error_size);
        const Result<std::optional<wire::Appearance>> wanted = c::checked(appearance);
        if (!wanted) return c::refuse(HAIRNET_INVALID, wanted.error(), error, error_size);
        std::string name = c::tag_of(tag, tag_size);
        if (const std::string invalid = wire::validate_tag(name); !invalid.empty())
          return c::refuse(HAIRNET_INVALID, invalid, error, error_size);
        character->member->tag = std::move(name);
        character->member->appearance = *wanted;
        return hairnet_error{HAIRNET_OK};
      },
      error, error_size);
}

hairnet_error hairnet_world_set_wind(hairnet_world* world, const hairnet_wind* wind, char* error, size_t error_size) {
  return c::guarded(
      [&] {
        const Wind wanted = c::wind_of(*wind);
        if (const std::string invalid = validate(wanted); !invalid.empty())
          return c::refuse(HAIRNET_INVALID, invalid, error, error_size);
        world->world.set_wind(wanted);
        return hairnet_error{HAIRNET_OK};
      },
      error, error_size);
}

namespace {

// The most bodies in a world: every tick compares bodies with heads.
constexpr std::size_t kBodiesMax = 1024;

}  // namespace

hairnet_error hairnet_world_set_bodies(hairnet_world* world, const hairnet_touch_body* bodies, size_t count,
                                       char* error, size_t error_size) {
  const auto set = [&] {
    const auto refuse = [&](const std::string& line) { return c::refuse(HAIRNET_INVALID, line, error, error_size); };
    if (count > kBodiesMax) return refuse("more than " + std::to_string(kBodiesMax) + " bodies");
    std::map<TouchKey, hairnet_world::Body> now;
    for (size_t i = 0; i < count; ++i) {
      Result<TouchBody> body = c::body_of(bodies[i]);
      const std::string name = "body " + std::to_string(i) + ": ";
      if (!body) return refuse(name + body.error());
      if (const std::string invalid = validate(*body); !invalid.empty()) return refuse(name + invalid);
      body->place.rotation.normalize();
      const auto before = world->bodies.find(body->key);
      const bool is_new = before == world->bodies.end() || body->has_jumped;
      body->has_jumped = is_new;
      // A body that was there before moves on from its last place; its speed drags hair along. A new one appears where
      // it is.
      const RigidTransform from = is_new ? body->place : before->second.before;
      if (!now.try_emplace(body->key, hairnet_world::Body{*body, from}).second)
        return refuse(name + "another one has its toucher and number");
    }
    world->bodies = std::move(now);
    return hairnet_error{HAIRNET_OK};
  };
  return c::guarded(set, error, error_size);
}

hairnet_error hairnet_world_grab(hairnet_world* world, uint32_t own, uint32_t toucher, uint32_t number,
                                 const double place[3], double radius_m, uint32_t* held) {
  Grab grab;
  grab.place = {place[0], place[1], place[2]};
  grab.radius_m = radius_m;
  if (!grab.place.allFinite() || !(radius_m > 0 && radius_m <= kGrabRadiusMax_m)) return HAIRNET_INVALID;
  // No body can have a number above 255, so such a hand is not there.
  if (number > std::numeric_limits<std::uint8_t>::max() || world->find(own) == nullptr) return HAIRNET_NOT_THERE;
  grab.hand = {toucher, static_cast<std::uint8_t>(number)};
  if (!world->bodies.contains(grab.hand)) return HAIRNET_NOT_THERE;
  return c::guarded([&] {
    const std::uint32_t count = world->world.grab(own, grab);
    if (held != nullptr) *held = count;
    return hairnet_error{HAIRNET_OK};
  });
}

hairnet_error hairnet_world_let_go(hairnet_world* world, uint32_t own, uint32_t toucher, uint32_t number,
                                   hairnet_release release) {
  if (static_cast<unsigned>(release) > HAIRNET_UNPIN) return HAIRNET_INVALID;
  if (number > std::numeric_limits<std::uint8_t>::max() || world->find(own) == nullptr) return HAIRNET_NOT_THERE;
  world->world.let_go(own, {toucher, static_cast<std::uint8_t>(number)}, static_cast<Release>(release));
  return HAIRNET_OK;
}

hairnet_error hairnet_world_advance(hairnet_world* world, double seconds) {
  // A longer time counts as 0.1 s, so a machine that is too slow shows slow motion. Catching up would make each advance
  // longer than the one before.
  constexpr double kMost_s = 0.1;
  if (!(seconds >= 0) || !std::isfinite(seconds)) return HAIRNET_INVALID;
  return c::guarded([&] {
    world->advance(std::min(seconds, kMost_s));
    return hairnet_error{HAIRNET_OK};
  });
}

const hairnet_scene* hairnet_world_scene(const hairnet_world* world) {
  return &world->scene;
}
