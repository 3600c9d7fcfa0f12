// Measures how well the play-out shows hair whose frames come late or never: the error from the hair as it was
// simulated at the shown time, and how much the shown hair changes its speed from one picture to the next.

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <random>
#include <string>
#include <vector>

#include "client/link/playout.hpp"
#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "core/world/world.hpp"
#include "schema/codec/frame.hpp"
#include "tests/fidelity/sections.hpp"
#include "tests/fidelity/write_json.hpp"
#include "tests/support/corpus.hpp"

namespace {

using namespace hairnet;
using Json = nlohmann::ordered_json;

constexpr int kPictureRate_hz = 120;
constexpr int kFrameRate_hz = 30;
constexpr std::int64_t kPicture_ns = 1'000'000'000 / kPictureRate_hz;
// The network takes 20 ms, and up to Options::jitter_ms more for each frame.
constexpr std::int64_t kLatency_ns = 20'000'000;
// Figures are means over so many seeds, each of which loses other frames.
constexpr unsigned kSeeds = 8;

struct Options {
  std::vector<std::string> grooms{std::begin(fidelity::kRealGrooms), std::end(fidelity::kRealGrooms)};
  std::vector<std::string> motions{std::begin(fidelity::kRealMotions), std::end(fidelity::kRealMotions)};
  std::vector<double> losses_percent{0, 5, 20, 40};
  double duration_s = 8, error_mm = 1, jitter_ms = 5;
  std::string json;
};

// A clip as it was simulated, one row a picture.
struct Run {
  std::vector<std::vector<float>> coefficients;
  std::vector<Pose> poses;
  std::size_t lead_in = 0;
  double motion_m2 = 0;
};

Run run_clip(const std::shared_ptr<const LevelSet>& levels, const Modes& modes, const fidelity::Clip& clip) {
  WorldDef def;
  def.tick_s = 1.0 / kPictureRate_hz;
  World world(def);
  const CharacterId id = world.add({levels, LevelIndex::high, clip.poses[0]});
  Run run;
  run.lead_in = clip.lead_in_ticks;
  for (std::size_t tick = 1; tick < clip.poses.size(); ++tick) {
    world.set_pose(id, clip.poses[tick]);
    world.step();
    std::vector<float> c(modes.basis.mode_count());
    modes.map(LevelIndex::high).coefficients_of(world.lattice(id).displacement, c);
    run.poses.push_back(*world.lattice(id).pose);
    run.coefficients.push_back(std::move(c));
  }
  return run;
}

struct Figures {
  // The errors in percent of the motion.
  double error_percent = 0;
  // The change of speed from picture to picture beyond the true one, in percent of the RMS speed.
  double jolt_percent = 0;
  // The largest jolt in one picture.
  double worst_jolt_mm = 0;
  double delay_ms = 0;

  // Adds the figures of one of kSeeds seeds. The sums become means over the seeds, and the worst jolt of all stays.
  Figures& operator+=(const Figures& other) {
    error_percent += other.error_percent / kSeeds;
    jolt_percent += other.jolt_percent / kSeeds;
    worst_jolt_mm = std::max(worst_jolt_mm, other.worst_jolt_mm);
    delay_ms += other.delay_ms / kSeeds;
    return *this;
  }
};

double square(const std::vector<float>& a, const std::vector<float>& b) {
  double sum = 0;
  for (std::size_t k = 0; k < a.size(); ++k) sum += std::pow(static_cast<double>(a[k] - b[k]), 2);
  return sum;
}

// The coefficients of the hair as it was simulated at `time_ns`, counted from the clip's begin.
std::vector<float> true_at(const Run& run, std::int64_t time_ns) {
  // Between two pictures the truth is interpolated linearly.
  const double at = std::clamp(static_cast<double>(time_ns) / static_cast<double>(kPicture_ns), 0.0,
                               static_cast<double>(run.coefficients.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(at), run.coefficients.size() - 2);
  const auto s = static_cast<float>(at - static_cast<double>(i));
  std::vector<float> c = run.coefficients[i];
  for (std::size_t k = 0; k < c.size(); ++k) c[k] += s * (run.coefficients[i + 1][k] - c[k]);
  return c;
}

// Sends a clip's frames over a network that loses some of them and delays each, plays them out as a client does, and
// compares each picture with the truth at the time that it shows.
Figures play(const Run& run, const std::shared_ptr<const link::KnownBasis>& basis, const Options& o,
             double loss_percent, unsigned seed) {
  std::mt19937_64 random(seed);
  link::Playout playout;
  codec::EncodedFrame coded;
  codec::DecodedFrame got;
  struct Coming {
    link::Frame frame;
    std::int64_t sample_ns, arrival_ns;
  };
  std::vector<Coming> coming;
  for (std::size_t i = 0; i < run.poses.size(); i += kPictureRate_hz / kFrameRate_hz) {
    const bool is_lost = std::uniform_real_distribution(0.0, 100.0)(random) < loss_percent;
    const double jitter_ms = std::uniform_real_distribution(0.0, 1.0)(random) * o.jitter_ms;
    if (is_lost) continue;
    const codec::Detail detail =
        codec::detail_for(basis->code, run.coefficients[i], static_cast<float>(1e-3 * o.error_mm));
    codec::encode_frame(run.poses[i], &basis->code, run.coefficients[i], detail.step, coded);
    if (!codec::decode_frame(coded.prefix(detail.count), &basis->code, got)) std::abort();
    link::Frame frame;
    frame.level = LevelIndex::high;
    frame.step_s = 1.0f / kFrameRate_hz;
    frame.pose = got.pose;
    frame.coefficients = got.coefficients;
    frame.basis = basis;
    const auto time_ns = static_cast<std::int64_t>(i) * kPicture_ns;
    coming.push_back({frame, time_ns, time_ns + kLatency_ns + static_cast<std::int64_t>(1e6 * jitter_ms)});
  }
  // Jitter lets frames overtake each other.
  std::sort(coming.begin(), coming.end(), [](const Coming& a, const Coming& b) { return a.arrival_ns < b.arrival_ns; });
  std::size_t next = 0;
  double error_m2 = 0, motion_m2 = 0, jolt_m2 = 0, speed_m2 = 0, delay_ns = 0;
  Figures figures;
  std::vector<std::vector<float>> shown, truth;
  for (std::size_t i = 0; i < run.poses.size(); ++i) {
    const std::int64_t now_ns = static_cast<std::int64_t>(i) * kPicture_ns;
    for (; next < coming.size() && coming[next].arrival_ns <= now_ns; ++next)
      playout.push(coming[next].frame, coming[next].sample_ns, coming[next].arrival_ns);
    const link::Playout::Sample sample = playout.sample(now_ns);
    if (!sample.valid || i < run.lead_in) continue;
    delay_ns += static_cast<double>(now_ns - sample.time_ns);
    std::vector<float> c(run.coefficients[0].size());
    std::copy(sample.coefficients.begin(), sample.coefficients.end(), c.begin());
    shown.push_back(std::move(c));
    truth.push_back(true_at(run, sample.time_ns));
    error_m2 += square(shown.back(), truth.back());
    motion_m2 += square(truth.back(), std::vector<float>(truth.back().size()));
    // A change of speed needs three pictures.
    if (shown.size() < 3) continue;
    const std::size_t n = shown.size() - 1;
    // `bend` is the change of speed of the shown hair, less that of the true hair at the same times.
    std::vector<float> bend(shown[n].size());
    for (std::size_t k = 0; k < bend.size(); ++k) {
      const float of_shown = shown[n][k] - 2 * shown[n - 1][k] + shown[n - 2][k];
      bend[k] = of_shown - (truth[n][k] - 2 * truth[n - 1][k] + truth[n - 2][k]);
    }
    const double jolt = square(bend, std::vector<float>(bend.size()));
    jolt_m2 += jolt;
    figures.worst_jolt_mm = std::max(figures.worst_jolt_mm, 1e3 * std::sqrt(jolt));
    speed_m2 += square(truth[n], truth[n - 1]);
  }
  figures.error_percent = 100 * std::sqrt(error_m2 / motion_m2);
  figures.jolt_percent = 100 * std::sqrt(jolt_m2 / speed_m2);
  figures.delay_ms = 1e-6 * delay_ns / static_cast<double>(shown.size());
  return figures;
}

int run(const Options& o) {
  Json rows = Json::array();
  std::printf("%-18s %-13s", "", "");
  for (const double loss : o.losses_percent) std::printf(" | %3.0f %% lost: error jolt worst delay", loss);
  std::printf("\n");
  std::vector<std::array<double, 4>> sums(o.losses_percent.size());
  for (const std::string& name : o.grooms) {
    const Result<Groom> groom = fidelity::load_groom(name, 2000);
    if (!groom) return fidelity::fail(groom.error());
    const std::shared_ptr<const LevelSet> levels = build_levels(*groom);
    const std::shared_ptr<const Modes> modes = make_modes(*groom, levels, {}, {});
    wire::HairBasis hair;
    hair.geometry = (*levels)[LevelIndex::high].geometry;
    hair.basis = modes->basis;
    const auto basis = std::make_shared<const link::KnownBasis>(std::move(hair));
    for (const std::string& motion_name : o.motions) {
      const Result<Motion> motion = fidelity::load_motion(motion_name, groom->body);
      if (!motion) return fidelity::fail(motion.error());
      const Run clip = run_clip(levels, *modes, fidelity::make_clip(*motion, kPictureRate_hz, o.duration_s));
      Json row{{"groom", name}, {"motion", motion_name}};
      std::printf("%-18s %-13s", name.c_str(), motion_name.c_str());
      for (std::size_t i = 0; i < o.losses_percent.size(); ++i) {
        Figures f;
        for (unsigned seed = 1; seed <= kSeeds; ++seed) f += play(clip, basis, o, o.losses_percent[i], seed);
        row["lost"][std::to_string(o.losses_percent[i])] = {{"error_percent", f.error_percent},
                                                            {"jolt_percent", f.jolt_percent},
                                                            {"worst_jolt_mm", f.worst_jolt_mm},
                                                            {"delay_ms", f.delay_ms}};
        std::printf(" |            %5.2f %5.2f %5.1f %5.0f", f.error_percent, f.jolt_percent, f.worst_jolt_mm,
                    f.delay_ms);
        sums[i][0] += f.error_percent, sums[i][1] += f.jolt_percent, sums[i][2] += f.worst_jolt_mm,
            sums[i][3] += f.delay_ms;
      }
      std::printf("\n");
      std::fflush(stdout);
      rows.push_back(std::move(row));
    }
  }
  std::printf("%-18s %-13s", "mean", "");
  for (const auto& sum : sums) {
    std::printf(" |           ");
    for (const double figure : sum) std::printf(" %5.2f", figure / static_cast<double>(rows.size()));
  }
  std::printf("\n");
  return fidelity::write_json(o.json, rows);
}

}  // namespace

void hairnet::fidelity::add_playout(CLI::App& program, std::function<int()>& chosen) {
  CLI::App& app =
      *program.add_subcommand("playout", "How well the play-out shows hair whose frames come late or never.");
  app.footer(
      "Examples:\n  hairnet-fidelity playout\n  hairnet-fidelity playout --groom made:bob --motion made:dance\n");
  const auto kept = std::make_shared<Options>();
  Options& o = *kept;
  app.add_option("--groom", o.grooms, "hairstyles of the corpus")->capture_default_str();
  app.add_option("--motion", o.motions, "motions of the corpus")->capture_default_str();
  app.add_option("--lost", o.losses_percent, "shares of the frames that are lost, %")
      ->check(CLI::Range(0.0, 95.0))
      ->capture_default_str();
  app.add_option("--error", o.error_mm, "of coded frames, RMS, mm")
      ->check(CLI::Range(0.1, 100.0))
      ->capture_default_str();
  app.add_option("--jitter", o.jitter_ms, "of arrivals, ms")->check(CLI::Range(0.0, 500.0))->capture_default_str();
  app.add_option("--duration", o.duration_s, "of each motion, at most, s")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--json", o.json, "the rows as JSON");
  app.callback([kept, &chosen] { chosen = [kept] { return run(*kept); }; });
}
