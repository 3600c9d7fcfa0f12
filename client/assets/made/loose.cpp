#include "client/assets/made/loose.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"
#include "client/assets/made/recipe_growth.hpp"

namespace hairnet::made {
namespace {

// A lock of hair: the data that its strands share. Locks are grown like strands, a little longer, and serve as lines
// towards which their strands gather.
struct Lock {
  Root root;
  bool fringe = false;
  // The direction of the comb at the root.
  Vec3 comb = Vec3::Zero();
  Path path;
  Curl curl;
  // Scales the length of the lock's strands.
  double shortening = 1;
};

// One object makes one hairstyle. Its random numbers are drawn in the order of the strands, so any change of that order
// changes every style.
class Dresser {
 public:
  Dresser(const LooseRecipe& recipe, const StyleOptions& options, Groom& groom)
      // The second number is a stream of the seed that only this class uses.
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
  // The hairdresser's reference: a strand from the side of the crown has the requested length; the blunt part of other
  // strands is cut at the height of its tip. The reference strand is grown, but not added.
  void find_cut_height() {
    const Vec3 p = skin_along(Vec3(0.42, 0.88, -0.2).normalized());
    const Root root{p, bust_normal(p), std::atan2(p.x(), p.z()), 1.0};
    cut_height_m_ = grow(growth_of(recipe_, root, {.length_m = options_.length_m, .layer = 0.7})).back().y();
  }

  // The length before thinning and cutting.
  [[nodiscard]] double full_length_m(const Root& root, bool fringe) const {
    if (fringe) {
      return std::min(recipe_.fringe.length_m, options_.length_m);
    }
    // The nape and the sides get a share of the length, by the height of the root.
    return options_.length_m * mix(recipe_.side_length, 1, smootherstep(0.1, 0.75, root.height));
  }

  [[nodiscard]] Vec3 stray(double amount) {
    return amount * Vec3(random_.symmetric(), random_.symmetric(), random_.symmetric());
  }

  void make_locks(const std::vector<Root>& roots) {
    // Every beginning of the sequence of roots is evenly spread.
    const auto count = std::min<std::size_t>(roots.size(), static_cast<std::size_t>(recipe_.locks));
    for (std::size_t i = 0; i < count; ++i) {
      const Root& root = roots[i];
      Lock lock;
      lock.root = root;
      lock.fringe = in_fringe(recipe_, root);
      lock.comb = recipe_.comb(root.point, root);
      lock.curl = make_curl(options_.curl, random_);
      // Strands of a lock are thinned together, by up to 0.35 of the recipe's thinning; add_strand() thins each strand
      // once more. This makes the outline of tips uneven in locks and not hair by hair.
      lock.shortening = 1 - 0.35 * recipe_.thinning * random_.unit();
      // The lock is a tenth longer, so that strands which are a little longer still find the lock's line beside them.
      lock.path = grow(growth_of(recipe_, root,
                                 {.length_m = 1.1 * full_length_m(root, lock.fringe),
                                  .layer = random_.unit(),
                                  .stray = stray(0.6 * recipe_.flyaway),
                                  .fringe = lock.fringe}));
      locks_.push_back(std::move(lock));
    }
  }

  // The nearest lock in the same part of the hair, on the same side of the parting and of the shoulder. A strand that
  // gathered to a lock of the other side would cross the parting. A lock that is apart is still taken if no other
  // exists.
  [[nodiscard]] const Lock& lock_of(const Root& root, bool fringe) const {
    const Vec3 comb = recipe_.comb(root.point, root);
    const Lock* best = &locks_.front();
    // The search is over all locks, which are a few hundred.
    double best_distance = std::numeric_limits<double>::max();
    for (const Lock& lock : locks_) {
      const bool apart = lock.fringe != fringe || falls_to_chest(recipe_, lock.root) != falls_to_chest(recipe_, root) ||
                         lock.comb.dot(comb) < 0;
      const double distance = (lock.root.point - root.point).squaredNorm() + (apart ? 1 : 0);
      if (distance < best_distance) {
        best_distance = distance;
        best = &lock;
      }
    }
    return *best;
  }

  void add_strand(const Root& root) {
    const bool fringe = in_fringe(recipe_, root);
    const Lock& lock = lock_of(root, fringe);
    // The cube of the chance leaves most strands long and makes few much shorter.
    const double chance = random_.unit();
    const double thinned = lock.shortening * (1 - recipe_.thinning * chance * chance * chance);
    Path path = grow(growth_of(recipe_, root,
                               {.length_m = thinned * full_length_m(root, fringe),
                                .layer = random_.unit(),
                                .stray = stray(recipe_.flyaway),
                                .fringe = fringe}));
    // The order is gather, cut, curl: the cut measures heights of gathered hair, and curls must not decide where it is
    // cut.
    gather(path, lock, root);
    if (!fringe) {
      cut(path, root, thinned);
    }
    // Curls of one lock differ a little in size, and those of a fringe are much smaller.
    Curl curl = lock.curl;
    curl.phase += recipe_.curl_disorder * random_.symmetric();
    curl.radius_m *= random_.between(0.8, 1.15) * (fringe ? 0.4 : 1);
    add_path(groom_, curled(path, curl), finish_for(root, fringe));
  }

  // Pulls the path to its lock's path, more and more towards the tip; the distance between the roots shrinks with it.
  void gather(Path& path, const Lock& lock, const Root& root) {
    const ArcSampler along(lock.path);
    const Vec3 apart = root.point - lock.root.point;
    const double clumping = recipe_.clumping * random_.between(0.6, 1.0);
    double s = 0;
    Vec3 shift = Vec3::Zero();
    // The last point as it was grown: the pull must not change the arc length.
    Vec3 before = path.front();
    for (std::size_t i = 1; i < path.size(); ++i) {
      s += (path[i] - before).norm();
      before = path[i];
      // The pull is complete before the tip; `apart` keeps a fifth of the distance between the roots, so that a lock
      // has a thickness.
      const double pull = clumping * smootherstep(0.0, recipe_.gathered_at, s / std::max(along.length(), 1e-6));
      // Beyond the lock's end the strand continues beside it.
      if (s <= along.length()) {
        shift = pull * (along.at(s) + 0.2 * apart - path[i]);
      }
      // The clearance grows with the distance from the root, because the root itself lies on the skin.
      path[i] = push_out(path[i] + shift, std::min(0.5 * s, 0.002));
    }
  }

  // Cuts at the height of the reference strand, to the degree that the style is blunt, but leaves a short rest of hair.
  void cut(Path& path, const Root& root, double thinned) {
    const double tip_m = path.back().y();
    // Thinned strands are cut higher, and each strand up to 6 mm higher or lower, so the edge of blunt hair is no line.
    const double blunt_m = cut_height_m_ + 0.006 * random_.symmetric() + 0.5 * (1 - thinned) * options_.length_m;
    if (tip_m >= blunt_m || recipe_.blunt <= 0) {
      return;
    }
    // No cut is above the root.
    const double height_m = std::min(mix(tip_m, blunt_m, recipe_.blunt), root.point.y());
    // At least 2.5 cm of hair remain, or half of a short style, even where the whole strand lies below the cut.
    const double min_m = std::min(0.025, 0.5 * options_.length_m);
    double s = 0;
    for (std::size_t i = 1; i < path.size(); ++i) {
      s += (path[i] - path[i - 1]).norm();
      if (path[i].y() < height_m && s > min_m) {
        path.resize(i + 1);
        return;
      }
    }
  }

  // Groups are regions in which users set materials and root lengths. The limits are a share of the way from nape to
  // crown (Root::height), and degrees from the front.
  StrandFinish finish_for(const Root& root, bool fringe) {
    const char* group = fringe                           ? "fringe"
                        : root.height > 0.78             ? "top"
                        : degrees_from_front(root) > 115 ? "back"
                                                         : "sides";
    return {.points = curl_points(options_.curl, options_.length_m, recipe_.points),
            .group = group_index(groom_, group),
            .hair_count = kHairsInAll / static_cast<double>(options_.strand_count)};
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

}  // namespace hairnet::made
