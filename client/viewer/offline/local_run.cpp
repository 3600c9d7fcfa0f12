#include "client/viewer/offline/local_run.hpp"

#include <cstdio>
#include <map>
#include <optional>
#include <utility>

#include "client/files/frame_trace.hpp"
#include "client/tools/command_line/progress_bar.hpp"
#include "client/tools/command_line/stop_signal.hpp"
#include "client/viewer/offline/scripted_touch.hpp"
#include "client/viewer/offline/window_recorder.hpp"
#include "client/viewer/sources/scene_list.hpp"
#include "core/levels/build.hpp"
#include "schema/channel/monotonic_clock.hpp"

namespace hairnet::viewer {
namespace {

// The time that a run takes, in one line.
class Cost {
 public:
  void take(std::span<const LocalTick> ticks) {
    for (const LocalTick& tick : ticks) {
      ++ticks_;
      steps_ += tick.report.stepped;
      ms_ += tick.step_ms;
    }
  }
  void print() const {
    std::printf("%llu ticks, %llu steps of characters, %.3f ms a tick\n", static_cast<unsigned long long>(ticks_),
                static_cast<unsigned long long>(steps_), ticks_ == 0 ? 0.0 : ms_ / static_cast<double>(ticks_));
  }

 private:
  std::uint64_t ticks_ = 0, steps_ = 0;
  double ms_ = 0;
};

std::vector<Moment> moments_of(const LocalWorld& world) {
  std::vector<Moment> moments;
  for (const ViewedCharacter& character : world.viewed_characters()) {
    moments.emplace_back(character.pose, character.lattice, character.geometry);
    moments.back().skin = character.skin;
  }
  return moments;
}

}  // namespace

// Builds the levels before the first tick, so that a run does not depend on how fast they are built.
LocalWorld local_world_of(const ViewOptions& options, const std::vector<CharacterSetup>& characters) {
  LocalWorld world(
      {options.tick_rate_hz, options.duration_s, Loop::plain, options.wind.value_or(Wind{}), channel::monotonic_ns});
  const SceneList scenes(characters);
  for (const LocalCharacter& character : scenes.given()) world.add(character);
  ProgressBar bar("hairnet-view");
  std::map<std::shared_ptr<const Groom>, std::shared_ptr<LevelSet>> sets;
  for (const CharacterSetup& setup : characters) {
    // Rigid hair and heads without hair need no level.
    if (setup.level == LevelIndex::rigid || setup.groom->points.empty()) continue;
    // Two characters with one groom may want different levels: both are in one set.
    std::shared_ptr<LevelSet>& set = sets[setup.groom];
    if (!set) set = std::make_shared<LevelSet>();
    // Nothing is learnt in this process.
    const LevelIndex level = setup.level == LevelIndex::learnt ? LevelIndex::low : setup.level;
    const auto index = static_cast<std::size_t>(level);
    // The level is built already for another character.
    if (!set->levels[index].rest.empty()) continue;
    BuildCallbacks callbacks;
    callbacks.progress = [&bar](double fraction, std::string_view stage) {
      bar.show(fraction, stage);
      // A stop signal during a build is noticed after it: builds take seconds.
      return true;
    };
    set->levels[index] = *build_level(*setup.groom, kLevelSpecs[index], callbacks);
  }
  for (const auto& [groom, set] : sets) world.give_levels(*groom, set);
  return world;
}

StreamResult run_locally(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                         const std::vector<double>& moment_times_s) {
  StreamResult result;
  std::optional<FrameTrace> trace;
  if (!options.trace.empty()) {
    Result<FrameTrace> made = FrameTrace::create(options.trace);
    if (!made) {
      result.ended = Refusal(made.error());
      return result;
    }
    trace.emplace(std::move(*made));
  }
  LocalWorld world = local_world_of(options, characters);
  // Bodies of a script are set before the first tick, which they must see.
  if (options.touch) touch_by_script(*options.touch, characters.front(), options.duration_s, world);
  if (trace) world.on_tick([&] { add_to_trace(world, *trace); });
  ProgressBar bar("hairnet-view");
  Cost cost;
  const double end_s = options.duration_s + options.settle_s;
  // Each round makes one tick, so that a signal is noticed, or stops at a wanted moment between two ticks.
  while (result.moments.size() < moment_times_s.size() || world.time_s() < end_s) {
    if (stop_requested()) {
      result.stopped = true;
      break;
    }
    // Moments ascend, so only the next one can be due.
    const bool wants_moment = result.moments.size() < moment_times_s.size();
    const double tick_end_s = world.tick_end_s();
    const bool at_moment = wants_moment && moment_times_s[result.moments.size()] <= tick_end_s;
    world.advance_to(at_moment ? moment_times_s[result.moments.size()] : tick_end_s);
    cost.take(world.ticks());
    if (at_moment) result.moments.push_back(moments_of(world));
    // The lead-in counts, too: the bar begins with it.
    bar.show((world.time_s() + MotionTimeline::kLeadIn_s) / (end_s + MotionTimeline::kLeadIn_s), "simulating");
  }
  // A run that a signal stops still has a whole trace until then.
  if (trace) result.ended = trace->finish();
  cost.print();
  return result;
}

}  // namespace hairnet::viewer
