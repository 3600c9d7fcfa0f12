// Measures how well modes represent hair: the error of the first coefficients, the bytes of frames, coarse levels
// through their maps, and how much hair lies in the body.

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "core/levels/level_map.hpp"
#include "core/world/world.hpp"
#include "schema/codec/frame.hpp"
#include "schema/wire/basis_file.hpp"
#include "tests/fidelity/modes_subject.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"
#include "tests/support/corpus.hpp"

namespace {

using namespace hairnet;
using Json = nlohmann::ordered_json;

// The table has the error of each of these counts of coefficients.
constexpr std::array<std::size_t, 8> kCounts{8, 16, 32, 64, 96, 128, 192, 256};
// The cases are high by its nodes and by its modes, and low by its nodes and by its map: see Run::deep_percent.
constexpr std::size_t kDepthCases = 4;

struct Options {
  std::vector<std::string> grooms{std::begin(fidelity::kRealGrooms), std::end(fidelity::kRealGrooms)};
  std::vector<std::string> motions{std::begin(fidelity::kRealMotions), std::end(fidelity::kRealMotions)};
  ModeTraining training;
  double rate_hz = 30, duration_s = 8;
  double error_percent = 10;
  std::string json;
};

// One clip of one hairstyle.
struct Run {
  std::vector<Pose> poses;
  std::vector<std::vector<float>> coefficients;
  // The sum of the squares of the hair's displacements over frames. The next three are sums of squares of errors.
  double motion_m2 = 0;
  // The part of the hair that no coefficient shows.
  double outside_m2 = 0;
  // The error of each level as its lattice moves the hair.
  std::array<double, 4> moved{};
  // The error of each level through its map.
  std::array<double, 4> learnt{};
  // The order is high: nodes, modes; low: nodes, modes; then the same after the push.
  std::array<double, 2 * kDepthCases> deep_percent{};

  [[nodiscard]] double percent(double error_m2) const { return 100 * std::sqrt(error_m2 / motion_m2); }
  [[nodiscard]] double rms_mm() const { return 1e3 * std::sqrt(motion_m2 / static_cast<double>(poses.size())); }
  // The error when only the first `count` coefficients are sent: modes are orthogonal, so the squares of the others add
  // to the error.
  [[nodiscard]] double first_percent(std::size_t count) const {
    double error_m2 = outside_m2;
    for (const std::vector<float>& c : coefficients)
      for (std::size_t k = count; k < c.size(); ++k) error_m2 += std::pow(static_cast<double>(c[k]), 2);
    return percent(error_m2);
  }
};

Run run_clip(const fidelity::ModesSubject& subject, const fidelity::Clip& clip) {
  const Modes& modes = *subject.modes;
  WorldDef def;
  def.tick_s = 1 / clip.rate_hz;
  World world(def);
  std::array<CharacterId, 4> ids;
  // The four levels with a lattice: high, medium, low and ether.
  for (std::size_t i = 0; i < 4; ++i) ids[i] = world.add({subject.levels, static_cast<LevelIndex>(i), clip.poses[0]});
  fidelity::HairDepth depth(subject, kDepthCases);
  Run run;
  std::vector<float> c(modes.basis.mode_count());
  std::vector<Vec3f> nodes(modes.basis.node_count);
  const auto error_m2 = [&](std::span<const Vec3f> truth) {
    std::vector<Vec3f> error = nodes;
    for (std::size_t n = 0; n < error.size(); ++n) error[n] -= truth[n];
    return subject.mean_square_m2(error);
  };
  for (std::size_t tick = 1; tick < clip.poses.size(); ++tick) {
    for (const CharacterId id : ids) world.set_pose(id, clip.poses[tick]);
    world.step();
    if (tick <= clip.lead_in_ticks) continue;
    const std::span<const Vec3f> truth = world.lattice(ids[0]).displacement;
    // Queries of the mesh are slow, so only every third tick is measured for depth.
    const bool looks_inside = tick % 3 == 0;
    if (looks_inside) {
      depth.bend(clip.poses[tick]);
      depth.add(0, truth);
    }
    run.motion_m2 += subject.mean_square_m2({truth.begin(), truth.end()});
    for (std::size_t i = 0; i < 4; ++i) {
      const std::span<const Vec3f> own = world.lattice(ids[i]).displacement;
      if (i > 0) {
        subject.levels->map(static_cast<LevelIndex>(i), LevelIndex::high)->apply(own, nodes);
        run.moved[i] += error_m2(truth);
        // Level 2 is low (LevelIndex).
        if (i == 2 && looks_inside) depth.add(2, nodes);
      }
      modes.maps[i].coefficients_of(own, c);
      displacements_of(modes.basis, c, nodes);
      run.learnt[i] += error_m2(truth);
      if (i == 2 && looks_inside) depth.add(3, nodes);
      if (i > 0) continue;
      run.outside_m2 += error_m2(truth);
      run.coefficients.push_back(c);
      run.poses.push_back(*world.lattice(ids[0]).pose);
      if (looks_inside) depth.add(1, nodes);
    }
  }
  for (std::size_t i = 0; i < 2 * kDepthCases; ++i) run.deep_percent[i] = depth.percent(i);
  return run;
}

struct Sizes {
  // All are means over the frames of a clip.
  double error_percent = 0, count = 0, hair_bytes = 0, pose_bytes = 0;
};

// Encodes all frames of a clip with this tolerance, and decodes them again.
Sizes code(const Run& run, const codec::CoefficientCode& code, float tolerance_m) {
  Sizes sizes;
  double error_m2 = run.outside_m2;
  codec::EncodedFrame frame;
  codec::DecodedFrame got;
  for (std::size_t f = 0; f < run.poses.size(); ++f) {
    const codec::Detail detail = codec::detail_for(code, run.coefficients[f], tolerance_m);
    codec::encode_frame(run.poses[f], &code, run.coefficients[f], detail.step, frame);
    const std::span<const std::uint8_t> bytes = frame.prefix(detail.count);
    if (!codec::decode_frame(bytes, &code, got)) std::abort();
    for (std::size_t k = 0; k < got.coefficients.size(); ++k)
      error_m2 += std::pow(static_cast<double>(got.coefficients[k] - run.coefficients[f][k]), 2);
    sizes.count += static_cast<double>(detail.count);
    sizes.pose_bytes += frame.pose_bits / 8.0;
    sizes.hair_bytes += static_cast<double>(bytes.size()) - frame.pose_bits / 8.0;
  }
  const auto frames = static_cast<double>(run.poses.size());
  return {run.percent(error_m2), sizes.count / frames, sizes.hair_bytes / frames, sizes.pose_bytes / frames};
}

// Finds the coarsest frames within the wanted error, or the finest ones where none are.
Sizes code_within(const Run& run, const codec::CoefficientCode& coder, double error_percent) {
  // Bisects the tolerance between 0.1 mm and 10 cm by its logarithm; 12 rounds leave it known to 0.2 %.
  double low_m = 1e-4, high_m = 0.1;
  Sizes best = code(run, coder, static_cast<float>(low_m));
  if (best.error_percent > error_percent) return best;
  for (int round = 0; round < 12; ++round) {
    const double middle_m = std::sqrt(low_m * high_m);
    const Sizes sizes = code(run, coder, static_cast<float>(middle_m));
    (sizes.error_percent <= error_percent ? low_m : high_m) = middle_m;
    if (sizes.error_percent <= error_percent) best = sizes;
  }
  return best;
}

Json row_of(const std::string& groom, const std::string& motion, const Run& run, const Sizes& sizes) {
  Json row{{"groom", groom}, {"motion", motion}, {"rms_mm", run.rms_mm()}};
  for (const std::size_t count : kCounts) row["error_percent"][std::to_string(count)] = run.first_percent(count);
  row["coded"] = {{"error_percent", sizes.error_percent},
                  {"coefficients", sizes.count},
                  {"hair_bytes", sizes.hair_bytes},
                  {"pose_bytes", sizes.pose_bytes}};
  for (std::size_t i = 1; i < 4; ++i) {
    const std::string level(kLevelNames[i]);
    row["moved_percent"][level] = run.percent(run.moved[i]);
    row["learnt_percent"][level] = run.percent(run.learnt[i]);
  }
  row["deep_percent"] = run.deep_percent;
  return row;
}

void print_head(double error_percent) {
  std::printf(
      "%-18s %-13s %6s | error of the first n coefficients, %%   | within %4.1f %%: n, B hair, pose |"
      " medium, low, ether: moved     learnt              | deep %%: high modes low modes, pushed\n",
      "", "", "rms mm", error_percent);
}

void print(const Json& row) {
  std::printf("%-18s %-13s %6.1f |", row["groom"].get<std::string>().c_str(), row["motion"].get<std::string>().c_str(),
              row["rms_mm"].get<double>());
  for (const auto& error : row["error_percent"]) std::printf(" %5.1f", error.get<double>());
  const Json& coded = row["coded"];
  std::printf(" | %5.1f %5.1f %5.1f %5.1f         |", coded["error_percent"].get<double>(),
              coded["coefficients"].get<double>(), coded["hair_bytes"].get<double>(),
              coded["pose_bytes"].get<double>());
  for (const auto& error : row["moved_percent"]) std::printf(" %5.1f", error.get<double>());
  std::printf("  ");
  for (const auto& error : row["learnt_percent"]) std::printf(" %5.1f", error.get<double>());
  std::printf(" |");
  for (const auto& deep : row["deep_percent"]) std::printf(" %5.2f", deep.get<double>());
  std::printf("\n");
  std::fflush(stdout);
}

// The mean of every number of the rows.
Json mean_of(const Json& rows) {
  Json mean = rows.front().flatten();
  for (auto& [key, value] : mean.items()) {
    if (!value.is_number()) continue;
    double sum = 0;
    for (const Json& row : rows) sum += row.flatten()[key].get<double>();
    value = sum / static_cast<double>(rows.size());
  }
  mean = mean.unflatten();
  mean["groom"] = "mean";
  mean["motion"] = "";
  return mean;
}

int run(const Options& o) {
  Json rows = Json::array();
  for (const std::string& name : o.grooms) {
    const Result<Groom> groom = fidelity::load_groom(name, 2000);
    if (!groom) return fidelity::fail(groom.error());
    const fidelity::ModesSubject subject(*groom, o.training);
    const Basis& basis = subject.modes->basis;
    const codec::CoefficientCode coder(basis.deviation_m);
    const Level& finest = (*subject.levels)[LevelIndex::high];
    const std::size_t basis_bytes = wire::encode_basis(finest.geometry, basis, *finest.skin).size();
    std::printf("\n%s: %zu nodes, %zu modes of %zu kB in %.1f s; validation error of the first n, %%:", name.c_str(),
                basis.node_count, basis.mode_count(), basis_bytes / 1000, subject.modes_s);
    for (const std::size_t count : kCounts)
      if (count <= basis.mode_count()) std::printf(" %.1f", 100 * double{subject.modes->validation_error[count - 1]});
    std::printf("; of all %.1f; within 10 %%: %zu\n", 100 * double{subject.modes->validation_error.back()},
                subject.modes->count_within(0.1f));
    print_head(o.error_percent);
    for (const std::string& motion_name : o.motions) {
      const Result<Motion> motion = fidelity::load_motion(motion_name, groom->body);
      if (!motion) return fidelity::fail(motion.error());
      const Run clip = run_clip(subject, fidelity::make_clip(*motion, o.rate_hz, o.duration_s));
      rows.push_back(row_of(name, motion_name, clip, code_within(clip, coder, o.error_percent)));
      print(rows.back());
    }
  }
  std::printf("\n");
  print_head(o.error_percent);
  print(mean_of(rows));
  return fidelity::write_json(o.json, rows);
}

}  // namespace

void hairnet::fidelity::add_modes(CLI::App& program, std::function<int()>& chosen) {
  CLI::App& app = *program.add_subcommand("modes", "How well modes carry hair.");
  app.footer("Examples:\n  hairnet-fidelity modes\n  hairnet-fidelity modes --groom made:bob --motion made:dance\n");
  const auto kept = std::make_shared<Options>();
  Options& o = *kept;
  app.add_option("--groom", o.grooms, "hairstyles of the corpus")->capture_default_str();
  app.add_option("--motion", o.motions, "motions of the corpus")->capture_default_str();
  app.add_option("--rate", o.rate_hz, "ticks a second")->check(CLI::Range(10.0, 240.0))->capture_default_str();
  app.add_option("--duration", o.duration_s, "of each motion, at most, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--modes-error", o.training.error_max, "of all modes, on validation motions, as a share of the motion")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str();
  app.add_option("--error", o.error_percent, "of coded frames, % of the motion")
      ->check(CLI::Range(0.1, 100.0))
      ->capture_default_str();
  app.add_option("--json", o.json, "the rows as JSON");
  app.callback([kept, &chosen] { chosen = [kept] { return run(*kept); }; });
}
