#include "client/tools/sim/options.hpp"

#include <CLI/CLI.hpp>
#include <array>
#include <cmath>
#include <string_view>
#include <vector>

#include "client/assets/export/strand_writer.hpp"
#include "client/assets/import/head_files.hpp"
#include "client/assets/import/placement.hpp"
#include "client/assets/load_motion.hpp"
#include "client/tools/command_line/hair_flags.hpp"
#include "client/tools/command_line/in_range.hpp"
#include "client/tools/command_line/parse.hpp"
#include "client/tools/command_line/wind_flags.hpp"

namespace hairnet::sim {
namespace {

constexpr std::string_view kFooter = R"(Examples:
  hairnet-sim --groom made:long_curly --motion made:nod --out nodes.npy
  hairnet-sim --groom made:bob --motion walk.bvh --rate 30 --out bob.abc
  hairnet-sim --groom sintel.groom --motion walk.bvh --level low --rate 60 --settle 4
  hairnet-sim --groom made:bob --motion made:run --solver converged --dump-model model.json --poses poses.npy
  hairnet-sim --replay server.rec --trace replayed
  hairnet-sim --replay server.rec --character 1 --out strands.abc
)";

// Only levels with a lattice: rigid hair needs no simulation, and learnt hair needs a server.
Result<LevelIndex> parse_lattice_level(const std::string& text) {
  for (std::size_t i = 0; i < kLevelSpecs.size(); ++i) {
    if (text == kLevelNames[i]) return static_cast<LevelIndex>(i);
  }
  return Refusal("'" + text + "' is not one of high, medium, low, ether");
}

Result<Solver> parse_solver(const std::string& text) {
  if (text == "default") return Solver::standard;
  if (text == "converged") return Solver::converged;
  return Refusal("'" + text + "' is not one of default, converged");
}

void add_motion_flags(CLI::App& app, SimulateOptions& o) {
  add_parsed(app, "--rest", o.bvh.rest,
             "BVH: the pose that is upright: zero, first (frame) or auto, whichever has the head above the hips (auto)",
             parse_rest_pose);
  add_parsed(app, "--up", o.bvh.up, "BVH: axis that points up (+y, or +z where the skeleton shows it)", parse_axis);
  add_parsed(app, "--face", o.bvh.face, "BVH: axis that the rest pose looks along (by left and right joints)",
             parse_axis);
  app.add_option("--unit", o.bvh.unit_m, "BVH: metres a file unit (metres, or what makes the skeleton a person)")
      ->check(in_range(1e-6, 1e3));
  // In the order of the bones.
  constexpr std::array<const char*, kBoneCount> kFlags{"--joint-head", "--joint-neck", "--joint-left-shoulder",
                                                       "--joint-right-shoulder", "--joint-upper-trunk"};
  for (std::size_t b = 0; b < kBoneCount; ++b)
    app.add_option(kFlags[b], o.bvh.joint_names[b], "BVH: the joint for this bone (found by its usual names)");
}

void add_simulation_flags(CLI::App& app, SimulateOptions& o) {
  app.add_option(
      "--groom", o.groom,
      "groom file, strand file (" + strand_extensions() + "), body for made hair (.glb, .gltf, .vrm), or made:STYLE");
  app.add_option("--motion", o.motion, "BVH file, or made:NAME (made:look_around; none with only --dump-model)");
  app.add_option("--strands", o.hairstyle.strand_count, "made grooms: how many strands (the style's own)");
  add_parsed(app, "--level", o.level, "high, medium, low or ether (high)", parse_lattice_level);
  app.add_option("--rate", o.rate_hz, "ticks a second (30)")->check(in_range(1.0, 1000.0));
  app.add_option("--substeps", o.substep_count, "steps a tick (as many as keep a step within 1/50 s)")
      ->check(CLI::Range(1, 1000));
  app.add_option("--iterations", o.iterations, "of conjugate gradient a step, default solver (the level's own)")
      ->check(CLI::Range(1, 100000));
  add_parsed(app, "--solver", o.solver,
             "default: what the server runs; converged: in double, each step's system solved to 1e-10", parse_solver);
  add_parsed(app, "--material", o.material, "of all hair, instead of the groom's own: soft, normal, stiff, gelled, wet",
             make_material);
  add_wind_flags(app, o.wind);
  app.add_option("--settle", o.settle_s, "seconds added after the clip, the head easing upright, then still")
      ->check(in_range(0.0, 3600.0));
  app.add_option("--out", o.out,
                 "strands in motion, world, m, a frame a tick: " + exported_motion_extensions() +
                     "; any other ending: node positions, ticks + 1 x nodes x 3, float32 .npy");
  app.add_option("--velocities", o.velocities, "node velocities, world, m/s: the same shape");
  app.add_option("--points", o.points, "deformed strand points, world, m: ticks + 1 x points x 3");
  app.add_option("--poses", o.poses, "bone poses: ticks + 1 x bones x 7 (x y z, quaternion x y z w)");
  app.add_option("--dump-model", o.dump_model, "the built model as JSON");
  add_motion_flags(app, o);
  add_hair_flags(app, "--hair-", o.hair);
}

// Checks relations between flags that CLI11 cannot express. Returns an empty string when they are right. It runs before
// defaults are filled in, so that it sees what was typed.
std::string check(const SimulateOptions& simulate, const ReplayOptions& replay) {
  // A format of strands without motion would hold the first frame alone.
  if (is_exported_file(simulate.out) && !is_exported_motion(simulate.out))
    return "--out " + simulate.out + ": such a file holds no motion: these do: " + exported_motion_extensions();
  if (!replay.recording.empty()) {
    if (!simulate.groom.empty() || !simulate.motion.empty())
      return "--replay takes its grooms and motions from the recording: leave out --groom and --motion";
    if (!replay.out.empty() && !replay.character) return "--replay with --out needs --character";
    return {};
  }
  if (!replay.trace.empty() || replay.character) return "--trace and --character go with --replay";
  if (simulate.groom.empty()) return "--groom is required (or --replay)";
  if (std::string error = validate(simulate.wind); !error.empty()) return error;
  const bool is_steady = simulate.wind.gust_ratio == 0 && simulate.wind.turbulence_rms_m_per_s == 0;
  if (!simulate.dump_model.empty() && !is_steady)
    return "--dump-model holds a steady wind: leave out --gust and --turbulence";
  return {};
}

// Names the default motion. A model is dumped without stepping anything; all else needs a motion.
void name_motion(SimulateOptions& o) {
  const bool only_dumps =
      !o.dump_model.empty() && o.out.empty() && o.velocities.empty() && o.points.empty() && o.poses.empty();
  if (o.motion.empty() && !only_dumps) o.motion = kDefaultMotion;
}

}  // namespace

std::variant<Options, int> parse_options(int argc, char** argv) {
  SimulateOptions simulate;
  ReplayOptions replay;
  std::uint64_t character = 0;

  CLI::App app("Hair simulated without a server: files in, files out.", "hairnet-sim");
  app.footer(std::string(kFooter));
  add_simulation_flags(app, simulate);
  app.add_option("--replay", replay.recording, "a server's recording: step it again and check every tick's hash");
  app.add_option("--trace", replay.trace, "with --replay: folder for every frame of every character");
  const auto* character_flag =
      app.add_option("--character", character,
                     "with --replay: whose strands or nodes --out holds; client's number, or session << 32 | number");
  const auto check_flags = [&] {
    if (character_flag->count() > 0) replay.character = character;
    // --out serves both kinds of run.
    replay.out = simulate.out;
    if (const std::string wrong = check(simulate, replay); !wrong.empty()) throw CLI::ValidationError(wrong);
  };
  if (const auto exit_status = parse_command_line(app, argc, argv, check_flags)) return *exit_status;
  name_motion(simulate);
  // The default depends on the rate: no step may be longer than 1/50 s.
  if (simulate.substep_count == 0) simulate.substep_count = substep_count_for(1 / simulate.rate_hz);
  if (!replay.recording.empty()) return Options(replay);
  return Options(simulate);
}

}  // namespace hairnet::sim
