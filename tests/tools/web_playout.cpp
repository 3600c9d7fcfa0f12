#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <vector>

#include "client/link/playout.hpp"
#include "client/link/switch_blend.hpp"
#include "core/ffd/deform.hpp"
#include "tests/tools/web_hair.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_random.hpp"

namespace hairnet {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::int64_t kMs = 1'000'000;
constexpr std::int64_t kTick_ns = 33'333'333;

constexpr float kReach_m = 0.25f;  // of lattices; some points lie beyond

// High and medium are two grids. A server and its connection to a client, as a play-out sees them; the scene is written
// with its results.
class Scene {
 public:
  explicit Scene(std::uint64_t seed) : random_(seed) {
    for (const std::array<int, 3>& dims : {std::array{5, 4, 6}, std::array{3, 3, 4}}) {
      auto geometry = std::make_shared<LevelGeometry>(random_.geometry(dims));
      geometry->lattice.origin = Vec3f::Constant(-kReach_m);
      for (int a = 0; a < 3; ++a)
        geometry->lattice.spacing[a] = 2 * kReach_m / static_cast<float>(dims[static_cast<std::size_t>(a)] - 1);
      levels_.push_back(std::move(geometry));
    }
    points_ = random_.vectors(40, 1.2f * kReach_m);
  }

  bool velocities = true;
  LevelIndex level = LevelIndex::high;

  // The frame of a tick; it arrives later by `late_ms`, and 20 ms that every frame takes.
  void push(int tick, int late_ms, bool discontinuous = false, bool asleep = false) {
    const double t = 1e-9 * static_cast<double>(tick * kTick_ns);
    link::Frame frame;
    frame.level = level;
    frame.error_class = static_cast<codec::ErrorClass>(tick % 3);
    frame.discontinuous = discontinuous;
    frame.asleep = asleep;
    frame.step_s = 1.0f / 30;
    const Quat turn(Eigen::AngleAxisd(0.8 * std::sin(2 * t), Vec3(0.2, 1, 0.1).normalized()));
    frame.pose = rounded_to_wire(rigid_pose({turn, Vec3(0.3 * std::sin(t), 1.6, 0.2 * t)}));
    if (level != LevelIndex::rigid) {
      frame.geometry = levels_[static_cast<std::size_t>(level)];
      const std::size_t count = 3 * frame.geometry->active_nodes.size();
      for (std::size_t i = 0; i < count; ++i) {
        const double phase = 3 * t + 0.7 * static_cast<double>(i);
        frame.displacements.push_back(static_cast<std::int16_t>(60 * std::sin(phase)));
        if (velocities) frame.velocities.push_back(static_cast<std::int16_t>(9 * std::cos(phase)));
      }
    }
    const std::int64_t sample_ns = tick * kTick_ns, arrival_ns = sample_ns + (20 + late_ms) * kMs;
    playout_.push(frame, sample_ns, arrival_ns);
    steps_.push_back({{"push",
                       {{"level", static_cast<unsigned>(frame.level)},
                        {"errorClass", static_cast<unsigned>(frame.error_class)},
                        {"discontinuous", frame.discontinuous},
                        {"asleep", frame.asleep},
                        {"stepS", frame.step_s},
                        {"pose", to_json(frame.pose)},
                        {"displacements", frame.displacements},
                        {"velocities", frame.velocities}}},
                      {"sampleTimeNs", sample_ns},
                      {"arrivalTimeNs", arrival_ns}});
  }

  void freeze() {
    playout_.freeze();
    steps_.push_back({{"freeze", true}});
  }

  void sample(std::int64_t render_ns) {
    const link::Playout::Sample sample = playout_.sample(render_ns);
    std::vector<Vec3f> points = points_;
    if (!sample.displacement.empty()) {
      std::vector<Vec3f> grid(sample.geometry->lattice.node_count());
      expand_displacements(*sample.geometry, sample.displacement, grid);
      Deformer(sample.geometry->lattice, points_, {}, FfdKind::quadratic).deform(grid, points);
    }
    if (sample.valid) blend_.apply(sample.level, sample.time_ns, false, points);
    steps_.push_back({{"sample", render_ns},
                      {"valid", sample.valid},
                      {"timeNs", sample.time_ns},
                      {"delayNs", playout_.delay_ns()},
                      {"level", static_cast<unsigned>(sample.level)},
                      {"pose", to_json(sample.pose)},
                      {"displacement", flat(sample.displacement)},
                      {"blended", flat(points)},
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
    Json levels = Json::array();
    for (const auto& geometry : levels_) levels.push_back(to_json(*geometry));
    return {{"name", name}, {"levels", levels}, {"points", flat(points_)}, {"steps", steps_}};
  }

 private:
  WebRandom random_;
  std::vector<std::shared_ptr<const LevelGeometry>> levels_;
  std::vector<Vec3f> points_;
  link::Playout playout_;
  link::SwitchBlend blend_;
  std::int64_t shown_ns_ = 0;
  Json steps_ = Json::array();
};

Json steady(bool velocities) {
  Scene scene(11);
  scene.velocities = velocities;
  scene.run(0, 25, 12);
  return scene.finish(velocities ? "hair with velocities" : "hair without velocities");
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

Json switches() {
  Scene scene(15);
  const auto then = [&](LevelIndex level, int from, int to) {
    scene.level = level;
    scene.push(from, 1, true);
    scene.run(from + 1, to, 3);
  };
  then(LevelIndex::high, 0, 8);
  then(LevelIndex::medium, 8, 14);  // another switch before this one has faded
  then(LevelIndex::high, 14, 35);
  then(LevelIndex::rigid, 35, 50);
  then(LevelIndex::medium, 50, 70);
  return scene.finish("switches of level");
}

}  // namespace

Json playout_cases() {
  return {steady(true), steady(false), gap(), frozen(), disorder(), switches()};
}

}  // namespace hairnet
