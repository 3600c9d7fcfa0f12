#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <filesystem>

#include "client/assets/made_spec.hpp"
#include "client/tools/command_line/parse.hpp"
#include "tests/gallery/cost.hpp"
#include "tests/gallery/frames_sheet.hpp"
#include "tests/gallery/sheets.hpp"
#include "tests/support/corpus.hpp"

namespace {

using namespace hairnet;
using namespace hairnet::gallery;

struct Options {
  std::string out = "gallery";
  std::vector<std::string> sections{"hairstyles", "detail", "wind", "crowd"}, grooms;
  int size_px = 300;
};

// Draws one file for each hairstyle, and prints its path as soon as it is written.
Result<void> draw_hairstyles(const Options& options, render::Renderer& renderer) {
  for (std::size_t i = 0; i < options.grooms.size(); ++i) {
    const Result<Hairstyle> style = load_hairstyle(options.grooms[i]);
    if (!style) return Refusal(style.error());
    const Result<render::Image> sheet = hairstyle_sheet(renderer, *style, i, options.size_px);
    if (!sheet) return Refusal(sheet.error());
    std::string name = options.grooms[i];
    std::ranges::replace(name, ':', '_');
    const std::string path = options.out + "/" + name + ".png";
    if (const Result<void> written = write_picture(path, *sheet); !written) return written;
    std::printf("%s\n", path.c_str());
    std::fflush(stdout);
  }
  return {};
}

Result<void> draw_one(const Options& options, render::Renderer& renderer, const std::string& section) {
  const Result<Hairstyle> style = load_hairstyle(section == "wind" ? "made:long_straight" : "made:long_curly");
  if (!style) return Refusal(style.error());
  const Result<render::Image> sheet = section == "wind" ? wind_sheet(renderer, *style, options.size_px)
                                                        : detail_sheet(renderer, *style, options.size_px);
  if (!sheet) return Refusal(sheet.error());
  std::printf("%s/%s.png\n", options.out.c_str(), section.c_str());
  return write_picture(options.out + "/" + section + ".png", *sheet);
}

Result<void> draw_crowd(const Options& options, render::Renderer& renderer) {
  std::vector<Hairstyle> styles;
  for (const char* name : {"made:long_straight", "made:long_curly", "made:bob", "made:ponytail", "made:short"}) {
    Result<Hairstyle> style = load_hairstyle(name);
    if (!style) return Refusal(style.error());
    styles.push_back(std::move(*style));
  }
  render::StageStatistics statistics;
  // The arguments are 100 characters, and the width and height of the picture in pixels.
  const Result<render::Image> picture = crowd_picture(renderer, styles, 100, 1280, 720, statistics);
  if (!picture) return Refusal(picture.error());
  std::printf(
      "%s/crowd.png: 100 characters of 5 grooms, %zu draw calls, %zu strands, %zu vertices; "
      "GPU bytes: %zu of grooms, %zu a character, %zu of strands' points\n",
      options.out.c_str(), statistics.draw_calls, statistics.strands, statistics.vertices, statistics.groom_bytes,
      statistics.character_bytes, statistics.point_bytes);
  return write_picture(options.out + "/crowd.png", *picture);
}

Result<void> draw_frames(const Options& options, render::Renderer& renderer) {
  for (const char* name : {"made:long_curly", "made:bob", "made:ponytail"}) {
    const Result<Hairstyle> style = load_hairstyle(name);
    if (!style) return Refusal(style.error());
    std::printf("%s: learning its hair, most of a minute\n", name);
    std::fflush(stdout);
    const Result<render::Image> sheet = frames_sheet(renderer, *style, "made:dance", options.size_px);
    if (!sheet) return Refusal(sheet.error());
    const std::string path = options.out + "/frames_" + std::string(made_name(name)) + ".png";
    if (const Result<void> written = write_picture(path, *sheet); !written) return written;
    std::printf("%s\n", path.c_str());
  }
  return {};
}

// Prints figures and draws no file. The picture of print_draw_cost has 960 times 540 pixels.
Result<void> measure_cost() {
  for (const char* name : {"made:long_straight", "made:long_curly"}) {
    const Result<Hairstyle> style = load_hairstyle(name);
    if (!style) return Refusal(style.error());
    if (const Result<void> printed = print_lattice_cost(*style); !printed) return printed;
    if (const Result<void> printed = print_draw_cost(*style, 960, 540); !printed) return printed;
  }
  return {};
}

Result<void> run(Options& options) {
  if (options.grooms.empty()) {
    options.grooms = fidelity::made_grooms();
    if (fidelity::has_real_data()) {
      options.grooms.insert(options.grooms.end(), std::begin(fidelity::kRealGrooms), std::end(fidelity::kRealGrooms));
    } else {
      std::fprintf(stderr, "hairnet-gallery: no ../shared/data: real hairstyles are left out\n");
    }
  }
  std::error_code error;
  std::filesystem::create_directories(options.out, error);
  if (error) return Refusal(options.out + ": " + error.message());
  Result<std::unique_ptr<render::Renderer>> renderer = render::Renderer::create();
  if (!renderer) return Refusal(renderer.error());
  for (const std::string& section : options.sections) {
    const Result<void> drawn = section == "hairstyles" ? draw_hairstyles(options, **renderer)
                               : section == "crowd"    ? draw_crowd(options, **renderer)
                               : section == "cost"     ? measure_cost()
                               : section == "frames"   ? draw_frames(options, **renderer)
                                                       : draw_one(options, **renderer, section);
    if (!drawn) return drawn;
  }
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app(
      "Pictures of every hairstyle: still and in motion; from near to far; in wind; a crowd; "
      "frames",
      "hairnet-gallery");
  Options options;
  app.add_option("--out", options.out, "folder for the pictures")->capture_default_str();
  app.add_option("--section", options.sections, "hairstyles, detail, wind, crowd, cost, frames; several may be named")
      ->check(CLI::IsMember({"hairstyles", "detail", "wind", "crowd", "cost", "frames"}));
  app.add_option("--groom", options.grooms,
                 "of hairstyles: only these (made:NAME, yuksel, ponytail, harolongo, sintel)");
  app.add_option("--size", options.size_px, "width of a tile, px")->check(CLI::Range(32, 2000))->capture_default_str();
  app.footer(
      "Examples:\n  hairnet-gallery --out pictures\n  hairnet-gallery --section hairstyles --groom made:bob --size "
      "600");
  if (const auto exit_status = hairnet::parse_command_line(app, argc, argv)) return *exit_status;
  const Result<void> done = run(options);
  if (done) return 0;
  std::fprintf(stderr, "hairnet-gallery: %s\n", done.error().c_str());
  return 1;
}
