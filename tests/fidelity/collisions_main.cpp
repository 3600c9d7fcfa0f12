#include <cstdio>
#include <span>

#include "client/tools/files/write_file.hpp"
#include "client/tools/progress/progress_bar.hpp"
#include "tests/fidelity/collisions_measure.hpp"
#include "tests/fidelity/collisions_options.hpp"
#include "tests/fidelity/collisions_table.hpp"

namespace hairnet::fidelity {
namespace {

constexpr double kRate_hz = 30;

Result<std::vector<Depths>> measure(const CollisionsOptions& options) {
  ProgressBar bar("hairnet-fidelity-collisions");
  std::vector<Depths> all;
  const auto count = static_cast<double>(options.grooms.size() * options.motions.size());
  double done = 0;
  for (const std::string& groom_name : options.grooms) {
    bar.show(done / count, "building " + groom_name);
    auto groom = load_groom(groom_name);
    if (!groom) return Refusal(groom.error());
    groom->name = groom_name;
    const Subject subject = make_subject(std::move(*groom), options.levels);
    for (const std::string& motion_name : options.motions) {
      const auto motion = load_motion(motion_name, subject.groom.body);
      if (!motion) return Refusal(motion.error());
      const Clip clip = make_clip(*motion, kRate_hz, options.duration_s);
      const std::string stage = groom_name + ", " + motion_name;
      bar.show(done / count, stage);
      for (Depths& run : measure_depths(subject, clip, [&](double part) { bar.show((done + part) / count, stage); }))
        all.push_back(std::move(run));
      done += 1;
    }
  }
  return all;
}

int run(const CollisionsOptions& options) {
  const auto all = measure(options);
  if (!all) {
    std::fprintf(stderr, "hairnet-fidelity-collisions: %s\n", all.error().c_str());
    return 1;
  }
  std::fputs(depth_tables(*all).c_str(), stdout);
  if (options.json.empty()) return 0;
  const std::string json = depths_json(*all);
  const auto written = write_file(options.json, std::as_bytes(std::span(json)));
  if (written) return 0;
  std::fprintf(stderr, "hairnet-fidelity-collisions: %s: %s\n", options.json.c_str(), written.error().c_str());
  return 1;
}

}  // namespace
}  // namespace hairnet::fidelity

int main(int argc, char** argv) {
  const auto parsed = hairnet::fidelity::parse_collisions_options(argc, argv);
  if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
  return hairnet::fidelity::run(std::get<hairnet::fidelity::CollisionsOptions>(parsed));
}
