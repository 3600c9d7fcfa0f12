#include "client/tools/sim/simulate.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <span>
#include <utility>
#include <vector>

#include "client/assets/load_groom.hpp"
#include "client/assets/load_motion.hpp"
#include "client/files/write_file.hpp"
#include "client/tools/command_line/progress_bar.hpp"
#include "client/tools/sim/clip.hpp"
#include "client/tools/sim/model_json.hpp"
#include "client/tools/sim/stepper.hpp"
#include "client/tools/sim/trajectory_files.hpp"
#include "core/levels/build.hpp"

namespace hairnet::sim {
namespace {

using Clock = std::chrono::steady_clock;

// How far nodes are from their design.
struct Displaced {
  double sum_squares_m2 = 0, max_m = 0;
  std::size_t count = 0;

  void add(std::span<const Vec3f> displacement) {
    for (const Vec3f& d : displacement) {
      sum_squares_m2 += double{d.squaredNorm()};
      max_m = std::max(max_m, double{d.norm()});
    }
    count += displacement.size();
  }
  [[nodiscard]] double rms_mm() const {
    return count == 0 ? 0 : 1e3 * std::sqrt(sum_squares_m2 / static_cast<double>(count));
  }
};

// What a run measured.
struct Run {
  Displaced motion, end;
  // The rows whose step was a teleport.
  std::vector<std::size_t> resets;
  // Lattices that were not finite and returned to rest.
  std::size_t lattices_reset = 0;
  // The wall time of all steps, s.
  double step_s = 0;
};

Result<Groom> load_valid_groom(const SimulateOptions& o) {
  Result<Groom> groom = load_groom(o.groom, o.hairstyle, o.hair);
  // The material is set before levels are built: it is a part of them.
  if (groom && o.material) set_material(*o.material, *groom);
  if (!groom) return Refusal(groom.error());
  if (groom->points.empty()) return Refusal(o.groom + ": has no strand points, so there is nothing to simulate");
  return groom;
}

// Builds only the requested level: the others are left empty, which saves most of the time.
std::shared_ptr<const LevelSet> build_one(const SimulateOptions& o, const Groom& groom, ProgressBar& bar) {
  BuildCallbacks callbacks;
  callbacks.progress = [&bar](double fraction, std::string_view stage) {
    bar.show(fraction, stage);
    return true;
  };
  const auto index = static_cast<std::size_t>(o.level);
  auto levels = std::make_shared<LevelSet>();
  levels->levels[index] = *build_level(groom, kLevelSpecs[index], callbacks);
  return levels;
}

Run run_clip(const SimulateOptions& o, const Clip& clip, const StepperDef& def, TrajectoryFiles& files,
             ProgressBar& bar) {
  Run run;
  const std::unique_ptr<Stepper> stepper = make_stepper(o.solver, def);
  // The velocity of a row is that of its last substep.
  const double substep_s = def.tick_s / def.substep_count;
  // Row 0 is the state before the first step.
  files.add_row(clip.poses[0], clip.poses[0], substep_s, stepper->state());
  for (std::size_t row = 1; row <= clip.tick_count(); ++row) {
    const Pose& to = clip.poses[row];
    // Only steps are timed, not the writing of files.
    const Clock::time_point started = Clock::now();
    const StepReport report = stepper->step(to, clip.teleports[row]);
    run.step_s += std::chrono::duration<double>(Clock::now() - started).count();

    const bool has_teleported = report.teleports > 0;
    if (has_teleported) run.resets.push_back(row);
    run.lattices_reset += report.lattices_reset;
    // The last substep begins at this share of the tick.
    const double last_substep = (def.substep_count - 1.0) / def.substep_count;
    // After a teleport nothing has moved: both poses are the new one.
    files.add_row(has_teleported ? to : interpolate(clip.poses[row - 1], to, last_substep), to, substep_s,
                  stepper->state());
    // Settling would hide how far the motion moves the hair.
    if (row <= clip.motion_tick_count) run.motion.add(stepper->state().displacement);
    bar.show(static_cast<double>(row) / static_cast<double>(clip.tick_count()), "stepping");
  }
  run.end.add(stepper->state().displacement);
  return run;
}

void print_summary(const SimulateOptions& o, const Clip& clip, const Level& level, const Run& run) {
  std::printf(
      "%zu ticks, %zu nodes (%zu active), %zu springs, %zu attachments, RMS displacement %.3f mm (max %.1f mm), "
      "%.4f ms a tick\n",
      clip.tick_count(), level.geometry.lattice.node_count(), level.rest.size(), level.springs.count(),
      level.attachments.count(), run.motion.rms_mm(), 1e3 * run.motion.max_m,
      clip.tick_count() == 0 ? 0.0 : 1e3 * run.step_s / static_cast<double>(clip.tick_count()));
  if (o.settle_s > 0)
    std::printf("after settling %g s: max %.4f mm, RMS %.4f mm from the design\n", o.settle_s, 1e3 * run.end.max_m,
                run.end.rms_mm());
  if (run.lattices_reset > 0)
    std::printf("the lattice was not finite %zu times and returned to rest\n", run.lattices_reset);
}

Result<void> write_model(const SimulateOptions& o, const Level& level, std::vector<std::size_t> resets) {
  if (o.dump_model.empty()) return {};
  const std::string json = encode_model_json(
      {&level, o.rate_hz, o.substep_count, Environment{}.gravity, o.wind.mean_m_per_s, std::move(resets)});
  const Result<void> written = write_file(o.dump_model, std::as_bytes(std::span(json)));
  if (!written) return Refusal(o.dump_model + ": " + written.error());
  return {};
}

}  // namespace

Result<void> simulate(const SimulateOptions& o) {
  // Files that cannot be written are refused before minutes of simulation.
  if (const Result<void> possible = check_can_write({o.out, o.velocities, o.points, o.poses, o.dump_model}); !possible)
    return possible;
  const Result<Groom> groom = load_valid_groom(o);
  if (!groom) return Refusal(groom.error());
  StepperDef def;
  def.level = o.level;
  def.tick_s = 1 / o.rate_hz;
  def.substep_count = o.substep_count;
  def.iterations = o.iterations;
  def.environment.wind = WindField(o.wind);

  Run run;
  // Without a motion the model alone is wanted.
  if (o.motion.empty()) {
    ProgressBar bar("hairnet-sim");
    def.levels = build_one(o, *groom, bar);
  } else {
    const Result<Motion> motion = load_motion(o.motion, o.bvh, &groom->body);
    if (!motion) return Refusal(o.motion + ": " + motion.error());
    const Clip clip = make_clip(*motion, o.rate_hz, o.settle_s);
    def.start = clip.poses[0];
    // The bar is cleared before the summary is printed.
    {
      ProgressBar bar("hairnet-sim");
      def.levels = build_one(o, *groom, bar);
      Result<TrajectoryFiles> files = TrajectoryFiles::create(o, *groom, (*def.levels)[o.level], clip.poses.size());
      if (!files) return Refusal(files.error());
      run = run_clip(o, clip, def, *files, bar);
      if (const Result<void> finished = files->finish(); !finished) return finished;
    }
    print_summary(o, clip, (*def.levels)[o.level], run);
  }
  // The model comes last, since its resets are known only after the run.
  return write_model(o, (*def.levels)[o.level], run.resets);
}

}  // namespace hairnet::sim
