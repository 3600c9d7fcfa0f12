#include "core/made/loose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "core/made/bust_shape.hpp"
#include "core/made/smooth.hpp"

namespace hairnet::made {
namespace {

// What the strands of a lock share.
struct Lock {
  Root root;
  Path path;
  Curl curl;
  double length_factor = 1;
};

class Dresser {
 public:
  Dresser(const LooseRecipe& recipe, const StyleOptions& options, Groom& groom)
      : recipe_(recipe), options_(options), groom_(groom), random_(options.seed, 21) {}

  void dress() {
    const std::vector<Root> roots = scatter_roots(options_.strand_count, options_.seed);
    find_cut_height();
    make_locks(roots);
    for (const Root& root : roots) {
      add_strand(root);
    }
  }

 private:
  [[nodiscard]] bool in_fringe(const Root& root) const {
    const double degrees = std::abs(root.azimuth) * 180 / std::numbers::pi;
    const Fringe& fringe = recipe_.fringe;
    if (degrees > fringe.half_angle_deg) {
      return false;
    }
    // A wedge: deepest in the middle, nothing at its ends.
    const double depth = fringe.depth_m * (1 - 0.6 * degrees / fringe.half_angle_deg);
    return root.point.z() > 0.0 && above_hairline(root.point) < depth;
  }

  // The hairdresser's reference: a strand from the side of the crown has the length asked for, and where it ends, the
  // blunt part of the others is cut.
  void find_cut_height() {
    const Vec3 p = skin_along(Vec3(0.42, 0.88, -0.2).normalized());
    const Root root{p, bust_normal(p), std::atan2(p.x(), p.z()), 1.0};
    cut_height_m_ = grow(growth_for(root, options_.length_m, 0.7, Vec3::Zero(), false)).back().y();
  }

  Growth growth_for(const Root& root, double length_m, double layer, const Vec3& stray, bool fringe) const {
    const LooseRecipe& r = recipe_;
    Growth growth;
    growth.start = root.point;
    growth.length_m = length_m;
    growth.step_m = std::clamp(length_m / 24, 0.0015, 0.005);
    growth.bend_m = r.bend_m;
    growth.spares_face = !fringe;
    growth.wish = [&r, root, length_m, stray, fringe](const Vec3& at, double s) {
      return fringe ? fringe_wish(r, at, stray) : wish(r, root, length_m, at, s, stray);
    };
    const Vec3 comb = growth.wish(root.point, 0);
    const Vec3 flat = (comb - comb.dot(root.normal) * root.normal).normalized();
    growth.direction = r.rise * root.normal + flat + stray;
    const double on_head = r.lift_m * mix(0.15, 1, smooth_step(-0.1, 0.95, root.height)) * mix(0.35, 1, layer);
    const double on_body = 0.003 + 0.55 * r.lift_m * layer;
    growth.clearance = [&r, on_head, on_body](const Vec3& at, double s) {
      const double rising = 1 - std::exp(-s / r.lift_rise_m);
      return std::min(0.8 * s, rising * mix(on_body, on_head, smooth_step(-0.10, -0.01, at.y())));
    };
    if (fringe) {
      growth.done = [tip = r.fringe.tip_height_m + 0.004 * stray.x() / std::max(r.flyaway, 1e-6)](
                        const Vec3& at, double) { return at.y() < tip && at.z() > 0.06; };
    }
    return growth;
  }

  static Vec3 fringe_wish(const LooseRecipe& r, const Vec3& at, const Vec3& stray) {
    const Vec3 normal = bust_normal(at);
    const Vec3 ahead(r.fringe.sweep, 0, 0.8);
    return ahead - ahead.dot(normal) * normal + Vec3(0, -0.9, 0) + stray;
  }

  static Vec3 wish(const LooseRecipe& r, const Root& root, double length_m, const Vec3& at, double s,
                   const Vec3& stray) {
    const double held = std::exp(-s * s / (r.comb_reach_m * r.comb_reach_m));
    Vec3 sum(0, -mix(1, r.fall, held), 0);
    if (held > 0.01) {
      const Vec3 normal = bust_normal(at);
      const Vec3 comb = r.comb(at, root);
      sum += held * (comb - comb.dot(normal) * normal);
    }
    sum += parted_by_shoulders(r, root, at);
    if (r.tuck > 0) {
      const double tip = smooth_step(length_m - 0.075, length_m, s);
      sum += r.tuck * tip * (Vec3(0, at.y(), -0.02) - at).normalized();
    }
    return sum + stray * (1 - 0.5 * held);
  }

  // Hair goes to the chest or to the back before it meets a shoulder, and keeps together.
  static Vec3 parted_by_shoulders(const LooseRecipe& r, const Root& root, const Vec3& at) {
    const double beside = 1 - smooth_step(-0.13, 0.03, at.y());
    if (beside <= 0) {
      return Vec3::Zero();
    }
    const double degrees = std::abs(root.azimuth) * 180 / std::numbers::pi;
    const bool to_chest = degrees < r.front_deg;
    const double ahead =
        to_chest ? std::clamp(14 * (0.035 - at.z()), 0.0, 0.7) : std::clamp(14 * (-0.070 - at.z()), -0.7, 0.0);
    const double outside = std::clamp(10 * (std::abs(at.x()) - 0.085), 0.0, 0.5);
    return beside * Vec3(at.x() > 0 ? -outside : outside, 0, ahead);
  }

  // How long the strand would be, before thinning.
  [[nodiscard]] double length_of(const Root& root) const {
    const double even = options_.length_m * mix(recipe_.side_length, 1, smooth_step(0.1, 0.75, root.height));
    return even;
  }

  void make_locks(const std::vector<Root>& roots) {
    // The sequence of roots is even in each of its beginnings.
    const auto count = std::min<std::size_t>(roots.size(), static_cast<std::size_t>(recipe_.clumps));
    for (std::size_t i = 0; i < count; ++i) {
      Lock lock;
      lock.root = roots[i];
      lock.curl = make_curl(options_.curl, random_);
      lock.length_factor = 1 - 0.35 * recipe_.thinning * random_.unit();
      const Vec3 stray = 0.6 * recipe_.flyaway * Vec3(random_.symmetric(), random_.symmetric(), random_.symmetric());
      lock.path = grow(growth_for(lock.root, 1.1 * length_of(lock.root), random_.unit(), stray, in_fringe(lock.root)));
      locks_.push_back(std::move(lock));
    }
  }

  // The nearest lock on the same side of the head and in the same part of the hair.
  [[nodiscard]] const Lock* lock_of(const Root& root) const {
    const bool fringe = in_fringe(root);
    const Lock* best = nullptr;
    double best_distance = std::numeric_limits<double>::max();
    const Vec3 lead = recipe_.comb(root.point, root);
    for (const Lock& lock : locks_) {
      if (in_fringe(lock.root) != fringe || recipe_.comb(lock.root.point, lock.root).dot(lead) < 0) {
        continue;
      }
      const double distance = (lock.root.point - root.point).squaredNorm();
      if (distance < best_distance) {
        best_distance = distance, best = &lock;
      }
    }
    return best;
  }

  void add_strand(const Root& root) {
    const bool fringe = in_fringe(root);
    const Lock* lock = lock_of(root);
    const double shared = lock ? lock->length_factor : 1;
    const double shorter = random_.unit();
    const double thin = shared * (1 - recipe_.thinning * shorter * shorter * shorter);
    const Vec3 stray = recipe_.flyaway * Vec3(random_.symmetric(), random_.symmetric(), random_.symmetric());
    const double length_m = fringe ? std::min(recipe_.fringe.length_m, options_.length_m) : length_of(root);
    Path path = grow(growth_for(root, length_m * thin, random_.unit(), stray, fringe));
    if (lock) {
      gather(path, lock->path, root, lock->root);
    }
    if (!fringe) {
      cut(path, root, random_.symmetric(), thin);
    }
    Curl curl = lock ? lock->curl : make_curl(options_.curl, random_);
    curl.phase += 0.9 * random_.symmetric();
    curl.radius_m *= random_.between(0.75, 1.15) * (fringe ? 0.4 : 1);
    path = curled(path, curl);
    add_path(groom_, path, finish_for(root, fringe));
  }

  // Pulls the path to its lock's, more and more towards the tip; what lay between the roots shrinks with it.
  void gather(Path& path, const Path& lock, const Root& root, const Root& lock_root) const {
    const ArcSampler along(lock);
    const Vec3 apart = root.point - lock_root.point;
    const double scatter = random_copy(root);
    double s = 0;
    Vec3 shift = Vec3::Zero();
    Vec3 before = path.front();  // as grown: the arc length must not feel the pull
    for (std::size_t i = 1; i < path.size(); ++i) {
      s += (path[i] - before).norm();
      before = path[i];
      const double t = smooth_step(0.0, 0.9, s / std::max(along.length(), 1e-6));
      const double pull = recipe_.clumping * t * scatter;
      // Beyond the lock's end the strand goes on beside it.
      if (s <= along.length()) {
        shift = pull * (along.at(s) + 0.25 * apart - path[i]);
      }
      path[i] = push_out(path[i] + shift, 0.002);
    }
  }

  // A few strands stay out of their lock.
  static double random_copy(const Root& root) {
    const double x = std::abs(std::sin(root.point.x() * 12345.6 + root.point.z() * 6543.2));
    return mix(0.6, 1.0, x);
  }

  // Cuts at the height of the reference strand, as far as the style is blunt, but leaves a stump of hair.
  void cut(Path& path, const Root& root, double jitter, double thin) const {
    if (recipe_.blunt <= 0) {
      return;
    }
    const double tip_cut = cut_height_m_ + 0.006 * jitter + 0.5 * (1 - thin) * options_.length_m;
    const double tip_free = path.back().y();
    if (tip_free >= tip_cut) {
      return;
    }
    const double height = mix(tip_free, tip_cut, recipe_.blunt);
    const double least = std::min(0.025, 0.5 * options_.length_m);
    double s = 0;
    for (std::size_t i = 1; i < path.size(); ++i) {
      s += (path[i] - path[i - 1]).norm();
      if (path[i].y() < height && path[i].y() < root.point.y() && s > least) {
        path.resize(i + 1);
        return;
      }
    }
  }

  StrandFinish finish_for(const Root& root, bool fringe) {
    const double degrees = std::abs(root.azimuth) * 180 / std::numbers::pi;
    const char* group = fringe ? "fringe" : root.height > 0.78 ? "top" : degrees > 115 ? "back" : "sides";
    StrandFinish finish;
    finish.points = curl_points(options_.curl, options_.length_m, recipe_.points);
    finish.group = group_index(groom_, group);
    finish.hair_count = kHairsInAll / static_cast<double>(options_.strand_count);
    return finish;
  }

  const LooseRecipe& recipe_;
  const StyleOptions& options_;
  Groom& groom_;
  Random random_;
  double cut_height_m_ = 0;
  std::vector<Lock> locks_;
};

}  // namespace

void dress_loose(const LooseRecipe& recipe, const StyleOptions& options, Groom& groom) {
  Dresser(recipe, options, groom).dress();
}

Vec3 comb_from_parting(const Vec3& p, const Root& root, double x, double front_z, double back_z) {
  Vec3 away(p.x() - x, 0, p.z() - std::clamp(p.z(), back_z, front_z));
  // On the parting itself the root decides which way.
  const double side = root.point.x() < x ? -1 : 1;
  if (p.z() > back_z) {
    away.x() = side * std::max(side * away.x(), 0.012);
  }
  return away.normalized();
}

}  // namespace hairnet::made
