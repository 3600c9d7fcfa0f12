#include "tests/bench/codec_table.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "core/world/world.hpp"
#include "schema/codec/frame.hpp"
#include "tests/bench/stopwatch.hpp"
#include "tests/support/corpus.hpp"

namespace hairnet::bench {
namespace {

constexpr double kFrames_hz = 30;
// The allowed errors of hair (RMS over the hair). The first is the finest that a server uses (server/tick/publish.cpp);
// 1 mm is the default of wire::Observe::error_m.
constexpr std::array kTolerances_m{0.25e-3f, 1e-3f, 4e-3f, 16e-3f};

// A character's hair at one tick.
struct Moment {
  Pose pose;
  // The displacements of the level's active nodes, m.
  std::vector<Vec3f> displacement;
  std::vector<float> coefficients;
};

// Steps one character through each motion, and returns its hair after each tick but those of the lead-in.
std::vector<Moment> moments_of(const Subject& subject, const std::shared_ptr<const LevelSet>& levels,
                               const Modes& modes, LevelIndex level, double duration_s) {
  std::vector<Moment> moments;
  for (const Motion& motion : subject.motions) {
    const fidelity::Clip clip = fidelity::make_clip(motion, kFrames_hz, duration_s);
    WorldDef def;
    def.tick_s = 1 / kFrames_hz;
    World world(def);
    const CharacterId id = world.add({levels, level, clip.poses.front()});
    for (std::size_t t = 1; t < clip.poses.size(); ++t) {
      world.set_pose(id, clip.poses[t]);
      world.step();
      if (t <= clip.lead_in_ticks) continue;
      const LatticeView lattice = world.lattice(id);
      Moment& moment =
          moments.emplace_back(Moment{*lattice.pose, {lattice.displacement.begin(), lattice.displacement.end()}, {}});
      moment.coefficients.resize(modes.basis.mode_count());
      modes.map(level).coefficients_of(moment.displacement, moment.coefficients);
    }
  }
  return moments;
}

// Returns the shortest time of `body`, divided by the number of things that it handles.
double ns_each(const char* name, std::size_t count, int repetitions, const std::function<void()>& body) {
  std::vector<TimedRun> runs;
  runs.push_back({name, [] {}, body});
  measure(runs, repetitions);
  return 1e9 * runs[0].seconds_min / static_cast<double>(count);
}

void add_row(const std::string& level, const std::vector<Moment>& moments, const codec::CoefficientCode& code,
             float tolerance_m, int repetitions, Report& report) {
  std::vector<std::vector<std::uint8_t>> frames(moments.size());
  codec::EncodedFrame coded;
  const auto encode = [&] {
    for (std::size_t m = 0; m < moments.size(); ++m) {
      const std::span<const float> all = moments[m].coefficients;
      const codec::Detail detail = codec::detail_for(code, all, tolerance_m);
      codec::encode_frame(moments[m].pose, &code, all.first(detail.count), detail.step, coded);
      frames[m].assign(coded.bytes.begin(), coded.bytes.end());
    }
  };
  encode();
  codec::DecodedFrame decoded;
  double bytes = 0, pose_bytes = 0;
  for (std::size_t m = 0; m < moments.size(); ++m) {
    codec::encode_frame(moments[m].pose, &code, {}, 0, coded);
    pose_bytes += static_cast<double>(coded.bytes.size());
    bytes += static_cast<double>(frames[m].size());
    if (!codec::decode_frame(frames[m], &code, decoded)) report.fail("codec, " + level + ": a frame did not come back");
  }
  const auto count = static_cast<double>(moments.size());
  const double encode_ns = ns_each("encode", moments.size(), repetitions, encode);
  const double decode_ns = ns_each("decode", moments.size(), repetitions, [&] {
    for (const auto& frame : frames) static_cast<void>(codec::decode_frame(frame, &code, decoded));
  });
  std::printf("  %-8s %10.2f %8.0f %8.0f %10.0f %10.0f\n", level.c_str(), 1e3 * static_cast<double>(tolerance_m),
              bytes / count, pose_bytes / count, encode_ns, decode_ns);
  report.add({{"section", "codec"},
              {"level", level},
              {"tolerance_m", tolerance_m},
              {"bytes_a_frame", bytes / count},
              {"pose_bytes_a_frame", pose_bytes / count},
              {"encode_ns", encode_ns},
              {"decode_ns", decode_ns}});
}

}  // namespace

void measure_codec_table(const Subject& subject, const Options& options, Report& report) {
  const std::shared_ptr<const LevelSet> levels = build_levels(subject.groom);
  const std::shared_ptr<const Modes> modes = make_modes(subject.groom, levels);
  const codec::CoefficientCode code(modes->basis.deviation_m);
  std::printf("\nFrames of %zu modes at %.0f Hz; bytes with the pose\n", modes->basis.mode_count(), kFrames_hz);
  for (const LevelIndex index : {LevelIndex::high, LevelIndex::low, LevelIndex::ether}) {
    const std::string level(kLevelNames[static_cast<std::size_t>(index)]);
    std::vector<Moment> moments = moments_of(subject, levels, *modes, index, options.duration_s);
    if (moments.empty()) continue;
    const double map_ns = ns_each("map", moments.size(), options.repetitions, [&] {
      for (Moment& moment : moments) modes->map(index).coefficients_of(moment.displacement, moment.coefficients);
    });
    std::vector<std::span<const Vec3f>> in;
    std::vector<std::span<float>> out;
    for (Moment& moment : moments) {
      in.emplace_back(moment.displacement);
      out.emplace_back(moment.coefficients);
    }
    const double crowd_map_ns = ns_each("map", moments.size(), options.repetitions, [&] {
      for (std::size_t m = 0; m < moments.size(); m += kModeMapWidth) {
        const std::size_t count = std::min(kModeMapWidth, moments.size() - m);
        modes->map(index).coefficients_of(std::span(in).subspan(m, count), std::span(out).subspan(m, count));
      }
    });
    std::printf("  %-8s %.0f ns from the level to coefficients; %.0f ns for %zu characters at once\n", level.c_str(),
                map_ns, crowd_map_ns, kModeMapWidth);
    std::printf("  %-8s %10s %8s %8s %10s %10s\n", "", "error, mm", "bytes", "pose", "encode ns", "decode ns");
    report.add({{"section", "codec"}, {"level", level}, {"map_ns", map_ns}, {"crowd_map_ns", crowd_map_ns}});
    for (const float tolerance_m : kTolerances_m)
      add_row(level, moments, code, tolerance_m, options.repetitions, report);
  }
}

}  // namespace hairnet::bench
