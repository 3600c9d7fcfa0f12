#include <CLI/CLI.hpp>
#include <cstdio>
#include <span>

#include "client/assets/print_warnings.hpp"
#include "client/files/read_file.hpp"
#include "client/files/write_file.hpp"
#include "client/tools/command_line/parse.hpp"
#include "tests/support/bvh_text.hpp"
#include "tests/support/deepmimic_clip.hpp"

namespace {

using namespace hairnet;

constexpr const char* kFooter = R"(Example:
  hairnet-deepmimic-to-bvh deepmimic_humanoid3d_dance_a.txt dance_a.bvh
The BVH is in metres, y up, and faces +x, as its left and right joints tell an import.
)";

int fail(const std::string& file, const std::string& reason) {
  std::fprintf(stderr, "hairnet-deepmimic-to-bvh: %s: %s\n", file.c_str(), reason.c_str());
  return 1;
}

int convert(const std::string& in, const std::string& out, double rate_hz) {
  const auto bytes = read_file(in);
  if (!bytes) return fail(in, bytes.error());
  const Result<DeepMimicClip> clip = decode_deepmimic_clip(as_text(*bytes), rate_hz);
  if (!clip) return fail(in, clip.error());
  print_warnings(in, clip->warnings);
  const std::string text = bvh_text(*clip);
  const Result<void> written = write_file(out, std::as_bytes(std::span(text)));
  return written ? 0 : fail(out, written.error());
}

int run(int argc, char** argv) {
  CLI::App app("Converts a motion clip of DeepMimic's humanoid to BVH.", "hairnet-deepmimic-to-bvh");
  app.footer(kFooter);
  std::string in, out;
  double rate_hz = 60;
  app.add_option("in", in, "clip: JSON with 44 numbers a frame")->required();
  app.add_option("out", out, "BVH file to write")->required();
  app.add_option("--rate", rate_hz, "frames a second (60)")->check(CLI::Range(1.0, 1000.0));
  if (const auto exit_status = parse_command_line(app, argc, argv)) return *exit_status;
  return convert(in, out, rate_hz);
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "hairnet-deepmimic-to-bvh: out of memory\n");
    return 1;
  }
}
