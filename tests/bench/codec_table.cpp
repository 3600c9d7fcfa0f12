#include "tests/bench/codec_table.hpp"

#include <array>
#include <cstdio>
#include <string>
#include <string_view>

#include "tests/bench/codec_bench.hpp"

namespace hairnet::bench {
namespace {

constexpr std::array kRates_hz{25.0, 30.0};

struct Row {
  std::string level;
  double rate_hz = 0;
  const LevelGeometry* geometry = nullptr;
  const std::vector<CodecClip>* clips = nullptr;
};

void add_row(const Row& row, const CodecCase& what, int repetitions, Report& report) {
  const CodecResult got = measure_codec(*row.geometry, *row.clips, what, repetitions);
  const std::string name(wire::kErrorClassNames[static_cast<std::size_t>(what.error_class)]);
  const std::string label =
      row.level + " " + name + ", order " + std::to_string(what.order) + ", stride " + std::to_string(what.stride);
  if (!got.right) report.fail("codec, " + label + ": a frame did not come back");
  if (got.frames == 0) return;
  std::printf("  %2.0f Hz %-36s %8.3f %8.0f %8.1f", row.rate_hz, label.c_str(), got.share_of_raw, got.bytes_a_frame,
              got.bone_bytes_a_frame);
  if (repetitions > 0) std::printf(" %10.0f %10.0f", got.encode_ns, got.decode_ns);
  std::printf("\n");
  std::fflush(stdout);
  Json json{{"section", "codec"},
            {"level", row.level},
            {"rate_hz", row.rate_hz},
            {"variant", name},
            {"order", what.order},
            {"stride", what.stride},
            {"share_of_raw", got.share_of_raw},
            {"bytes_a_frame", got.bytes_a_frame},
            {"bone_bytes_a_frame", got.bone_bytes_a_frame}};
  if (repetitions > 0) {
    json["encode_ns"] = got.encode_ns;
    json["decode_ns"] = got.decode_ns;
  }
  report.add(std::move(json));
}

}  // namespace

void measure_codec_table(const Subject& subject, const Options& options, Report& report) {
  std::printf("\nFrames, against 6 bytes a node (16-bit raw); bytes with bones\n");
  std::printf("  %-42s %8s %8s %8s %10s %10s\n", "", "share", "bytes", "bones", "encode ns", "decode ns");
  for (const LevelIndex index : {LevelIndex::high, LevelIndex::low}) {
    const auto i = static_cast<std::size_t>(index);
    const LevelGeometry geometry = build_level(subject.groom, kLevelSpecs[i])->geometry;
    for (const double rate_hz : kRates_hz) {
      const std::vector<CodecClip> clips = step_clips(subject, index, rate_hz, options.duration_s);
      const Row row{std::string(kLevelNames[i]), rate_hz, &geometry, &clips};
      const double prototype = share_of_prototype(clips, codec::ErrorClass::half_mm);
      std::printf("  %2.0f Hz %-36s %8.3f\n", rate_hz, (row.level + " normal, a prototype, order 3").c_str(),
                  prototype);
      report.add({{"section", "codec"},
                  {"level", row.level},
                  {"rate_hz", rate_hz},
                  {"variant", "prototype"},
                  {"share_of_raw", prototype}});
      for (std::size_t order = 0; order <= codec::kHistoryMax; ++order)
        add_row(row, {codec::ErrorClass::half_mm, order, 1}, options.repetitions, report);
      for (const std::size_t stride : {2, 4}) {
        for (std::size_t order = 1; order <= codec::kHistoryMax; ++order)
          add_row(row, {codec::ErrorClass::half_mm, order, stride}, 0, report);
      }
      // Whether a frame that is long past is worth keeping.
      for (const std::size_t stride : {3, 8}) add_row(row, {codec::ErrorClass::half_mm, 1, stride}, 0, report);
      for (const codec::ErrorClass error_class : {codec::ErrorClass::quarter_mm, codec::ErrorClass::one_mm}) {
        for (const std::size_t order : {std::size_t{0}, codec::kHistoryMax})
          add_row(row, {error_class, order, 1}, 0, report);
      }
    }
  }
}

}  // namespace hairnet::bench
