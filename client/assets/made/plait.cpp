#include "client/assets/made/plait.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"
#include "client/assets/made/tied.hpp"

namespace hairnet::made {
namespace {

constexpr int kLocks = 3;
// A lock returns to its side after this length of plait, m. A shorter period makes a finer plait, for which strands
// need more points.
constexpr double kPeriod = 0.075;
constexpr double kTurn = 2 * std::numbers::pi;

// The tie is a ring of 12 mm radius at the nape, whose middle is 16 mm off the skin.
Tie nape_tie() {
  const Vec3 skin = skin_along(Vec3(0, -0.30, -1).normalized());
  return {skin + 0.016 * bust_normal(skin), Vec3(0, -0.45, -0.89).normalized(), 0.012};
}

// The path of the plait: out of the tie and down over neck and back.
Path make_core(const Tie& tie, double length_m) {
  Growth growth;
  growth.start = tie.centre;
  growth.direction = tie.axis;
  growth.length_m = length_m;
  growth.bend_m = 0.03;
  growth.spares_face = false;
  // The term of x pulls the plait to the middle of the back.
  growth.preferred_direction = [&](const GrowthPoint& at) {
    return Vec3(Vec3(-6 * at.p.x(), -1, 0) + tie.axis * std::exp(-at.s / 0.02));
  };
  // The plait is thick, so its middle must stay farther from the skin than loose hair.
  growth.clearance = [](const Vec3&, double s) { return mix(0.012, 0.026, smootherstep(0, 0.08, s)); };
  return grow(growth);
}

class Plait {
 public:
  Plait(const Tie& tie, double length_m) : core_(make_core(tie, length_m)), along_(core_), length_m_(along_.length()) {}

  // Returns the length of plait above the cord. The end below the cord is 7.5 cm, or three tenths of a short plait.
  [[nodiscard]] double tied_at() const { return std::max(length_m_ - 0.075, 0.7 * length_m_); }
  // Returns the thickness of the plait at `s` metres, relative to its maximum: it is full from 4 cm behind the tie to
  // 10 cm, and falls to 0.55 at the cord.
  [[nodiscard]] double fullness(double s) const {
    return mix(0.75, 1, smootherstep(0, 0.04, s)) * mix(1, 0.55, smootherstep(0.1, tied_at(), s));
  }

  // The middle of a lock `s` metres down, and the sideways and backward directions of the plait there. Each lock
  // swings from side to side and, twice as often, over and under the others.
  struct Place {
    Vec3 middle, side, back;
  };
  // The sine of the double phase makes a lock pass in front on its way to one side and behind on its way back: three
  // locks a third of a period apart then cross over and under each other.
  [[nodiscard]] Place lock(int lock, double s) const {
    const Place core = place(s);
    // The locks come together at both ends, in the tie and under the cord. Where the plait is full, a lock swings 12.5
    // mm to each side, and 7.2 mm to the front and the back.
    const double held = smootherstep(0, 0.03, s) * (1 - 0.75 * smootherstep(tied_at() - 0.03, tied_at(), s));
    const double phase = kTurn * (s / kPeriod + static_cast<double>(lock) / kLocks);
    const double wide = 0.0125 * fullness(s) * held, deep = 0.0072 * fullness(s) * held;
    return {core.middle + wide * std::sin(phase) * core.side + deep * std::sin(2 * phase) * core.back, core.side,
            core.back};
  }
  // The frame is made from X instead of being carried along, which holds as long as the plait never runs sideways.
  [[nodiscard]] Place place(double s) const {
    const Vec3 down = (along_.at(s + 0.004) - along_.at(std::max(s - 0.004, 0.0))).normalized();
    const Vec3 side = (Vec3::UnitX() - down.x() * down).normalized();
    return {along_.at(s), side, side.cross(down)};
  }
  [[nodiscard]] double length() const { return length_m_; }

 private:
  Path core_;
  ArcSampler along_;
  double length_m_;
};

// One hair's path down a lock, from the tie to its tip; beyond the cord the tips spread a little.
void append_plaited(const Plait& plait, int lock, double length_m, Random& random, Path& path) {
  // The root of a uniform number spreads hairs evenly over the round section.
  const double angle = kTurn * random.unit(), ring = std::sqrt(random.unit());
  // A hair turns slowly within its lock, so it comes to its surface now and then.
  const double turn = 0.6 * random.symmetric();
  for (double s = 0.004; s < length_m; s += 0.004) {
    const Plait::Place at = plait.lock(lock, s);
    const double tuft = smootherstep(plait.tied_at() - 0.004, plait.tied_at() + 0.03, s);
    const double in_lock =
        0.0088 * plait.fullness(s) * mix(1, 0.75, smootherstep(plait.tied_at() - 0.03, plait.tied_at(), s));
    const double radius = ring * (in_lock + 0.003 * tuft) * smootherstep(-0.01, 0.02, s);
    const double round = angle + turn * s / kPeriod;
    path.push_back(at.middle + radius * (std::cos(round) * at.side + std::sin(round) * at.back));
  }
}

// The point of each strand nearest to `middle`, if it is within the radius. Knots tie points and not places, so each
// strand gives its nearest.
std::vector<std::uint32_t> points_at(const Groom& groom, const Vec3& middle, double radius_m) {
  std::vector<std::uint32_t> found;
  for (std::size_t s = 0; s < groom.strand_count(); ++s) {
    std::uint32_t best = groom.strand_begin[s];
    for (std::uint32_t i = best + 1; i < groom.strand_begin[s + 1]; ++i) {
      const auto distance2 = [&](std::uint32_t p) { return (groom.points[p].cast<double>() - middle).squaredNorm(); };
      if (distance2(i) < distance2(best)) best = i;
    }
    if ((groom.points[best].cast<double>() - middle).norm() < radius_m) found.push_back(best);
  }
  return found;
}

// Winds a cord round the plait's end; both ends of the cord hang. Returns some points of the windings, which are to be
// tied; the hanging ends stay free. The cord's points are 11 of the first end, 16 for each wind, and 11 of the other
// end.
std::vector<std::uint32_t> add_cord(const Plait& plait, Groom& groom) {
  constexpr int kWinds = 6;
  constexpr double kRadius = 0.0016, kHanging = 0.07;
  const double radius = 0.0092 * plait.fullness(plait.tied_at());
  std::vector<Vec3f> line;
  // The cord lies outside of the skin even where the plait rests on the back.
  const auto add = [&](const Vec3& p) { line.push_back(push_out(p, 0.002).cast<float>()); };
  const auto hang = [&](double sign, double s) {
    const Plait::Place at = plait.place(plait.tied_at());
    const Vec3 from = at.middle + (radius + 0.002 + 0.010 * (1 - std::exp(-s / 0.01))) * at.back;
    return Vec3(from + sign * (0.004 + 0.25 * s) * at.side - Vec3(0, s, 0));
  };
  for (int i = 0; i <= 10; ++i) add(hang(-1, kHanging * (10 - i) / 10));
  for (int i = 0; i <= 16 * kWinds; ++i) {
    const double wind = i / 16.0;
    const Plait::Place at = plait.place(plait.tied_at() + (wind - 0.5 * kWinds) * 2 * kRadius);
    const double angle = kTurn * (wind + 0.25);
    add(at.middle + radius * (std::cos(angle) * at.side + std::sin(angle) * at.back));
  }
  for (int i = 0; i <= 10; ++i) add(hang(1, 0.85 * kHanging * i / 10));
  Thread cord;
  cord.group = group_index(groom, "cord");
  cord.radius_m = static_cast<float>(kRadius);
  cord.colour = Vec3f(0.55f, 0.36f, 0.08f);
  cord.linear_density_kg_per_m = 2e-3f;
  groom.add_thread(line, cord);
  std::vector<std::uint32_t> wound;
  // Point 11 is the first of the windings. Every third point is enough to hold the cord.
  for (std::uint32_t i = 11; i < 11 + 16 * kWinds; i += 3) wound.push_back(groom.threads.back().points.begin + i);
  return wound;
}

}  // namespace

void dress_plait(const StyleOptions& options, Groom& groom) {
  const Tie tie = nape_tie();
  const Plait plait(tie, options.length_m);
  Random random(options.seed, 41);
  StrandFinish finish;
  finish.hair_count = kHairsInAll / static_cast<double>(options.strand_count);
  finish.group = group_index(groom, "plait");
  finish.skin_clearance_m = 0.0015;
  // A point for each 9.5 mm shows the weave; 0.16 m stands for the way over the head to the tie.
  finish.points = std::clamp(static_cast<int>((0.16 + options.length_m) / 0.0095), 18, 72);
  for (const Root& root : scatter_roots(options.strand_count, options.seed, is_pulled_back)) {
    Path path = pulled(root, tie, random);
    const double chance = random.unit();
    // The number of the lock is random, so each lock has hair from all over the head.
    append_plaited(plait, static_cast<int>(random.next() % kLocks),
                   plait.length() * (1 - 0.15 * chance * chance * chance), random, path);
    Curl wave = make_curl(options.curl, random);
    // Plaited hair cannot curl far.
    wave.radius_m *= 0.25;
    add_path(groom, curled(path, wave), finish);
  }
  const std::vector<std::uint32_t> wound = add_cord(plait, groom);
  // Knots at the tie, at each half period of the plait and at the cord hold the plait together. A knot ties points
  // within a radius, m, with a stiffness, N/m.
  add_knot(groom, points_at(groom, tie.centre, 0.016), 300);
  for (double s = 0.03; s < plait.tied_at() - 0.01; s += kPeriod / 2)
    add_knot(groom, points_at(groom, plait.place(s).middle, 0.022), 250);
  std::vector<std::uint32_t> tied = points_at(groom, plait.place(plait.tied_at()).middle, 0.012);
  tied.insert(tied.end(), wound.begin(), wound.end());
  add_knot(groom, std::move(tied), 300);
}

}  // namespace hairnet::made
