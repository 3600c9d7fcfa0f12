#include "tests/fidelity/motion_figures_measure.hpp"

#include <algorithm>
#include <cmath>

#include "client/assets/upright.hpp"
#include "core/ffd/strand_lengths.hpp"
#include "core/levels/build.hpp"
#include "core/world/world.hpp"
#include "tests/fidelity/depth_in_skin.hpp"
#include "tests/fidelity/strand_sample.hpp"

namespace hairnet::fidelity {
namespace {

// Depth and length are measured at ticks that are so far apart.
constexpr double kLookInterval_s = 0.1;
// After the motion the head gets upright within this time.
constexpr double kEaseUpright_s = 0.5;
// A jump of the head reaches the tips within this time. So the largest jump of the head in it is subtracted from a
// point's jump.
constexpr double kReachTips_s = 0.33;

// Keeps the largest value with its time.
void raise(Worst& worst, double value, double time_s) {
  if (value > worst.value) worst = {value, time_s};
}

// The probe_points of the design, moved rigidly with the head, and the recent change of their speed: the tips react to
// a head's motion some ticks later.
class RigidProbePoints {
 public:
  RigidProbePoints(std::size_t count, double tick_s)
      : before_(count, Vec3::Zero()),
        before_that_(before_),
        last_m_(static_cast<std::size_t>(std::ceil(kReachTips_s / tick_s)), std::vector<double>(count, 0.0)) {}

  void move(const StrandSample& strands, const RigidTransform& head) {
    std::vector<double>& now_m = last_m_[tick_++ % last_m_.size()];
    for (std::size_t i = 0; i < strands.probe_points.size(); ++i) {
      const Vec3 now = head.point(strands.points[strands.probe_points[i]].cast<double>());
      // This is the second difference of the place, which is the acceleration times the square of the tick.
      now_m[i] = (now - 2 * before_[i] + before_that_[i]).norm();
      before_that_[i] = before_[i];
      before_[i] = now;
    }
  }
  [[nodiscard]] double jump_m(std::size_t probe) const {
    double max_m = 0;
    for (const std::vector<double>& tick_m : last_m_) max_m = std::max(max_m, tick_m[probe]);
    return max_m;
  }

 private:
  std::vector<Vec3> before_, before_that_;
  std::vector<std::vector<double>> last_m_;
  std::size_t tick_ = 0;
};

// One character of the world, and its figures.
class Run {
 public:
  Run(CharacterId character, const Level& level, const StrandSample& strands, const BentBody& body,
      MotionFigures figures)
      : figures_(std::move(figures)),
        character_(character),
        strands_(strands),
        deformer_(level.geometry.lattice, strands.points, strands.blend, FfdKind::quadratic),
        drawn_lengths_(strands.points, strands.begin),
        deep_(body, at_spots(strands.points)),
        grid_(level.geometry.lattice.node_count()),
        stretched_(strands.points),
        points_(strands.points),
        points_before_(strands.points),
        before_(strands.probe_points.size(), Vec3::Zero()),
        before_that_(before_) {}

  [[nodiscard]] CharacterId character() const { return character_; }

  // Call it after every tick. Jumps count when `time_s` is not negative.
  void follow(const World& world, const RigidTransform& head, const RigidProbePoints& rigid, double time_s) {
    points_before_.swap(points_);
    const LatticeView view = world.lattice(character_);
    expand_displacements(view.model->geometry, view.displacement, grid_);
    deformer_.deform(grid_, stretched_);
    points_ = stretched_;
    drawn_lengths_.limit(points_);
    for (std::size_t i = 0; i < before_.size(); ++i) {
      const Vec3 now = head.point(points_[strands_.probe_points[i]].cast<double>());
      const double jump_m = (now - 2 * before_[i] + before_that_[i]).norm() - rigid.jump_m(i);
      before_that_[i] = before_[i];
      before_[i] = now;
      if (time_s < 0) continue;
      jumps_m_.push_back(std::max(0.0F, static_cast<float>(jump_m)));
      raise(figures_.jump_m, jump_m, time_s);
    }
  }

  // Measures depth and lengths at a tick.
  void look(const BentBody& body, double time_s) {
    const double share = deep_.share(body, at_spots(stretched_));
    figures_.deep_share += share;
    ++looks_;
    raise(figures_.deep, share, time_s);
    for (std::size_t s = 0; s < strands_.strand_count(); ++s) {
      const auto length_of = [&](const std::vector<Vec3f>& points) {
        return polyline_length({points.begin() + strands_.begin[s], points.begin() + strands_.begin[s + 1]}) /
               strands_.length_m[s];
      };
      const double length = length_of(stretched_);
      lengths_.push_back(static_cast<float>(length));
      drawn_.push_back(static_cast<float>(length_of(points_)));
      raise(figures_.length, length, time_s);
    }
  }

  void look_whether_it_hangs(const Quat& head) { figures_.hanging_rad = hanging_angle(strands_, points_, head); }

  void look_at_rest(const World& world, const BentBody& body, double tick_s) {
    RestFigures& rest = figures_.rest.emplace();
    std::vector<float> off_m;
    double square_sum = 0;
    for (std::size_t p = 0; p < points_.size(); ++p) {
      rest.speed_m_per_s =
          std::max(rest.speed_m_per_s, static_cast<double>((points_[p] - points_before_[p]).norm()) / tick_s);
      off_m.push_back((points_[p] - strands_.points[p]).norm());
      square_sum += static_cast<double>(off_m.back() * off_m.back());
    }
    rest.rms_m = std::sqrt(square_sum / static_cast<double>(points_.size()));
    rest.p99_m = percentile(off_m, 0.99);
    rest.deep_share = deep_.share(body, at_spots(stretched_));
    rest.inverted_share = inverted_share(*world.lattice(character_).model, strands_, grid_);
  }

  MotionFigures finish() {
    figures_.deep_share /= std::max(1, looks_);
    figures_.length_p50 = percentile(lengths_, 0.5);
    figures_.length_p99 = percentile(lengths_, 0.99);
    figures_.drawn_p99 = percentile(drawn_, 0.99);
    figures_.jump_p999_m = percentile(jumps_m_, 0.999);
    return std::move(figures_);
  }

 private:
  std::vector<Vec3f> at_spots(std::span<const Vec3f> points) const {
    std::vector<Vec3f> probe_points;
    for (const std::uint32_t p : strands_.probe_points) probe_points.push_back(points[p]);
    return probe_points;
  }

  MotionFigures figures_;
  CharacterId character_;
  const StrandSample& strands_;
  Deformer deformer_;
  StrandLengths drawn_lengths_;
  DeepPoints deep_;
  int looks_ = 0;
  // Points in head space: `stretched_` as FFD has them, `points_` as they are drawn, `points_before_` a tick earlier.
  std::vector<Vec3f> grid_, stretched_, points_, points_before_;
  // The places of the probe points at the last tick and at the one before it, world.
  std::vector<Vec3> before_, before_that_;
  std::vector<float> jumps_m_, lengths_, drawn_;
};

// The poses after the clip: upright within kEaseUpright_s, and then still for `rest_after_s`.
std::vector<Pose> poses_to_rest(const Pose& last, double rate_hz, double rest_after_s) {
  std::vector<Pose> poses;
  const auto count = static_cast<std::size_t>(std::ceil((kEaseUpright_s + rest_after_s) * rate_hz));
  for (std::size_t i = 1; i <= count; ++i)
    poses.push_back(rounded_to_wire(ease(last, upright(last), static_cast<double>(i) / rate_hz, kEaseUpright_s)));
  return poses;
}

}  // namespace

Subject make_subject(Groom groom, const std::vector<LevelIndex>& indices) {
  auto levels = std::make_shared<LevelSet>();
  for (const LevelIndex level : indices) {
    const auto i = static_cast<std::size_t>(level);
    levels->levels[i] = *build_level(groom, kLevelSpecs[i]);
  }
  return {std::move(groom), indices, std::move(levels)};
}

std::vector<MotionFigures> measure_motion_figures(const Subject& subject, const Clip& clip, bool hangs,
                                                  const MotionFigureOptions& options,
                                                  const std::function<void(double)>& progress) {
  const StrandSample strands = sample_strands(subject.groom, options.point_count);
  BentBody body(subject.groom);
  WorldDef def;
  def.tick_s = 1 / clip.rate_hz;
  RigidProbePoints rigid(strands.probe_points.size(), def.tick_s);
  World world(def);
  std::vector<Run> runs;
  for (const LevelIndex level : subject.indices)
    runs.emplace_back(world.add({subject.levels, level, clip.poses.front()}), (*subject.levels)[level], strands, body,
                      MotionFigures{.groom = subject.groom.name, .motion = clip.name, .level = level});

  const auto step_to = [&](const Pose& pose, double time_s) {
    for (const Run& run : runs) world.set_pose(run.character(), pose);
    world.step();
    rigid.move(strands, pose.head());
    for (Run& run : runs) run.follow(world, pose.head(), rigid, time_s);
  };
  const auto ticks_between = static_cast<std::size_t>(std::max(1.0, std::round(kLookInterval_s * clip.rate_hz)));
  world.set_environment(options.environment);
  for (std::size_t tick = 1; tick < clip.poses.size(); ++tick) {
    const double time_s = (static_cast<double>(tick) - static_cast<double>(clip.lead_in_ticks)) / clip.rate_hz;
    step_to(clip.poses[tick], time_s);
    if (time_s <= 0 || (tick - clip.lead_in_ticks) % ticks_between != 0) continue;
    body.bend(clip.poses[tick]);
    for (Run& run : runs) run.look(body, time_s);
    if (progress) progress(static_cast<double>(tick) / static_cast<double>(clip.tick_count()));
  }
  if (hangs)
    for (Run& run : runs) run.look_whether_it_hangs(clip.poses.back().head().rotation);

  if (options.rest_after_s > 0) {
    world.set_environment(kCalmEnvironment);
    for (const Pose& pose : poses_to_rest(clip.poses.back(), clip.rate_hz, options.rest_after_s)) step_to(pose, -1);
    body.bend({});
    for (Run& run : runs) run.look_at_rest(world, body, def.tick_s);
  }
  std::vector<MotionFigures> all;
  for (Run& run : runs) all.push_back(run.finish());
  return all;
}

}  // namespace hairnet::fidelity
