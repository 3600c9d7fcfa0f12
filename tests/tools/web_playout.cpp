#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "client/link/playout.hpp"
#include "schema/wire/basis_file.hpp"
#include "tests/tools/hex.hpp"
#include "tests/tools/web_hair.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_modes.hpp"
#include "tests/tools/web_random.hpp"

namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kTick_ns = 33'333'333;

constexpr int kNone = -1;

// A server and its connection to a client, as a play-out sees them; the scene is written with its results.
class Scene {
 public:
  explicit Scene(std::uint64_t seed) : random_(seed) {
    for (const std::size_t mode_count : {7, 4})
      bases_.push_back(std::make_shared<const link::KnownBasis>(make_basis(random_, {3, 4, 3}, mode_count)));
  }

  int basis = 0;                    // that frames have, or kNone
  std::int64_t clock_error_ns = 0;  // of the client's estimate: frames seem to be that much older

  // The frame of a tick; it arrives later by `late_ms`, and 20 ms that every frame takes. Some have fewer coefficients
  // than others.
  void push(int tick, int late_ms, bool discontinuous = false, bool asleep = false, bool repeated = false) {
    const double t = 1e-9 * static_cast<double>(tick * kTick_ns);
    link::Frame frame;
    frame.level = static_cast<LevelIndex>(tick / 4 % 4);
    frame.discontinuous = discontinuous;
    frame.asleep = asleep;
    frame.repeated = repeated;
    frame.step_s = 1.0f / 30;
    const Quat turn(Eigen::AngleAxisd(0.8 * std::sin(2 * t), Vec3(0.2, 1, 0.1).normalized()));
    frame.pose = rounded_to_wire(rigid_pose({turn, Vec3(0.3 * std::sin(t), 1.6, 0.2 * t)}));
    if (basis != kNone) {
      frame.basis = bases_[static_cast<std::size_t>(basis)];
      const std::size_t count = frame.basis->code.mode_count() - static_cast<std::size_t>(tick % 3);
      for (std::size_t k = 0; k < count; ++k) {
        const double phase = 3 * t + 0.7 * static_cast<double>(k);
        frame.coefficients.push_back(static_cast<float>(0.01 * std::sin(phase)));
      }
    }
    const std::int64_t sample_ns = tick * kTick_ns - clock_error_ns;
    const std::int64_t arrival_ns = tick * kTick_ns + (20 + late_ms) * kMs;
    playout_.push(frame, sample_ns, arrival_ns);
    steps_.push_back({{"push",
                       {{"level", static_cast<unsigned>(frame.level)},
                        {"discontinuous", frame.discontinuous},
                        {"asleep", frame.asleep},
                        {"repeated", frame.repeated},
                        {"stepS", frame.step_s},
                        {"pose", to_json(frame.pose)},
                        {"coefficients", frame.coefficients},
                        {"basis", basis}}},
                      {"sampleTimeNs", sample_ns},
                      {"arrivalTimeNs", arrival_ns}});
  }

  void freeze() {
    playout_.freeze();
    steps_.push_back({{"freeze", true}});
  }

  void sample(std::int64_t render_ns) {
    const link::Playout::Sample sample = playout_.sample(render_ns);
    steps_.push_back({{"sample", render_ns},
                      {"valid", sample.valid},
                      {"timeNs", sample.time_ns},
                      {"delayNs", playout_.delay_ns()},
                      {"level", static_cast<unsigned>(sample.level)},
                      {"pose", to_json(sample.pose)},
                      {"displacement", flat(sample.displacement)},
                      {"droppedCount", playout_.dropped_count()}});
  }

  // Ticks [from, to) arrive with jitter, and pictures are shown at 72 Hz between.
  void run(int from, int to, std::size_t jitter_ms) {
    for (int tick = from; tick < to; ++tick) {
      push(tick, static_cast<int>(random_.below(jitter_ms + 1)));
      show_until((tick + 1) * kTick_ns + 20 * kMs);
    }
  }
  void show_until(std::int64_t end_ns) {
    for (; shown_ns_ < end_ns; shown_ns_ += 13'888'889) sample(shown_ns_);
  }

  Json finish(const char* name) {
    Json files = Json::array();
    for (const auto& each : bases_) files.push_back(hex(wire::encode_basis(each->hair.geometry, each->hair.basis, {})));
    return {{"name", name}, {"bases", files}, {"steps", steps_}};
  }

 private:
  WebRandom random_;
  std::vector<std::shared_ptr<const link::KnownBasis>> bases_;
  link::Playout playout_;
  std::int64_t shown_ns_ = 0;
  Json steps_ = Json::array();
};

Json steady() {
  Scene scene(11);
  scene.run(0, 25, 12);
  return scene.finish("moving hair");
}

Json gap() {
  Scene scene(12);
  scene.run(0, 10, 4);
  scene.show_until(50 * kTick_ns);  // frozen, eased to rest
  scene.run(50, 60, 4);
  return scene.finish("a gap");
}

Json frozen() {
  Scene scene(13);
  scene.run(0, 8, 4);
  scene.show_until(12 * kTick_ns);
  scene.freeze();
  scene.show_until(40 * kTick_ns);
  scene.run(40, 44, 4);
  scene.push(44, 2, false, true);
  scene.show_until(90 * kTick_ns);  // asleep
  return scene.finish("held and asleep");
}

Json lossy() {
  Scene scene(16);
  for (int tick = 0; tick < 60; ++tick) {
    if (tick % 5 != 3 && tick % 7 != 4) scene.push(tick, tick * 5 % 13);
    scene.show_until((tick + 1) * kTick_ns + 20 * kMs);
  }
  return scene.finish("lost frames");
}

Json asleep_before_its_basis() {
  Scene scene(17);
  scene.basis = kNone;
  scene.run(1, 6, 3);
  scene.push(7, 0, false, true);
  scene.show_until(14 * kTick_ns);
  scene.basis = 0;
  scene.push(7, 300, false, true, true);
  scene.show_until(30 * kTick_ns);
  return scene.finish("a sleeping frame that comes again with its basis");
}

Json disorder() {
  Scene scene(14);
  scene.run(0, 6, 4);
  scene.push(8, 0);
  scene.push(7, 40);
  scene.push(7, 45);  // twice
  scene.push(2, 90);  // long gone
  scene.show_until(10 * kTick_ns);
  scene.push(10, 0, true);  // a teleport
  scene.run(11, 20, 30);
  return scene.finish("out of order, twice, late, a teleport");
}

Json changes() {
  Scene scene(15);
  const auto then = [&](int basis, int from, int to) {
    scene.basis = basis;
    scene.run(from, to, 3);
  };
  then(kNone, 0, 8);
  then(0, 8, 14);
  then(1, 14, 35);
  then(kNone, 35, 50);
  then(1, 50, 60);
  return scene.finish("hair at rest, and with other bases");
}

Json corrected_clock() {
  Scene scene(18);
  scene.run(0, 12, 4);
  scene.clock_error_ns = kTick_ns - kMs / 10;  // two frames seem to be of the same moment
  scene.run(12, 30, 4);
  return scene.finish("a clock that is corrected");
}

}  // namespace

Json playout_cases() {
  return {steady(), gap(), frozen(), lossy(), asleep_before_its_basis(), disorder(), changes(), corrected_clock()};
}

}  // namespace hairnet
