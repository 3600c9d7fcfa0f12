#include "core/groom/validate_features.hpp"

#include <algorithm>

#include "core/assert.hpp"
#include "core/groom/error_text.hpp"
#include "core/number_range.hpp"

namespace hairnet {
namespace {

// Each NumberRange has the value's name with its unit, the value, and the least and the most that it may be.
std::string out_of_range(std::initializer_list<NumberRange> ranges) {
  return hairnet::out_of_range({ranges.begin(), ranges.size()});
}

// Whether it is a linear RGB albedo: three numbers in [0, 1].
bool is_colour(const Vec3f& c) {
  return c.allFinite() && c.minCoeff() >= 0 && c.maxCoeff() <= 1;
}

// Checks that the points of threads, cards and cloths follow those of the strands, one after the other, without gaps
// and overlaps.
class Points {
 public:
  explicit Points(const Groom& groom) : next_(groom.strand_begin.back()), count_(groom.points.size()) {
    HAIRNET_ASSERT(next_ <= count_);
  }

  // The next run of points must be `range`, of at least `least` points and a multiple of `unit`.
  std::string take(const PointRange& range, std::size_t least, std::size_t unit) {
    // Ranges without gaps or overlap leave no point without an owner, and none with two.
    if (range.begin != next_ || range.end < range.begin || range.end > count_)
      return "its points do not follow those before it";
    HAIRNET_ASSERT(least > 0);
    next_ = range.end;
    return range.count() < least || range.count() % unit != 0 ? "too few points, or one without its partner" : "";
  }
  [[nodiscard]] bool all_taken() const { return next_ == count_; }

 private:
  std::size_t next_, count_;
};

std::string error_of(const Clump& clump, const Groom& groom, const GroomLimits& limits) {
  if (clump.strand >= groom.strand_count()) return "its strand does not exist";
  if (clump.copy_count > limits.copy_count_max) return over_limit("copies", clump.copy_count, limits.copy_count_max);
  return out_of_range(
      {{"radius (m)", clump.radius_m, 0, 0.1f}, {"radius at the tip (m)", clump.tip_radius_m, 0, 0.1f}});
}

std::string error_of(const Thread& thread, const Groom& groom) {
  if (thread.group >= groom.group_names.size()) return "its group does not exist";
  if (!is_colour(thread.colour)) return "colour is not in [0, 1]";
  return out_of_range({{"root length (m)", thread.root_length_m, 0, 10},
                       {"radius (m)", thread.radius_m, 1e-6f, 0.05f},
                       {"axial stiffness (N)", thread.axial_stiffness_n, 0, 1000},
                       {"damping time (s)", thread.damping_time_s, 0, 1},
                       {"pin stiffness (N/m)", thread.pin_stiffness_n_per_m, 0, 1e4},
                       {"linear density (kg/m)", thread.linear_density_kg_per_m, 1e-6f, 1},
                       {"air drag (N s/m^2)", thread.air_drag_ns_per_m2, 0, 10}});
}

std::string error_of(const Cloth& cloth, const Groom& groom, const GroomLimits& limits) {
  if (cloth.group >= groom.group_names.size()) return "its group does not exist";
  if (!is_colour(cloth.colour)) return "colour is not in [0, 1]";
  if (cloth.triangles.size() > 2 * limits.vertex_count_max)
    return over_limit("triangles", cloth.triangles.size(), 2 * limits.vertex_count_max);
  for (std::size_t t = 0; t < cloth.triangles.size(); ++t) {
    const auto& [a, b, c] = cloth.triangles[t];
    const auto foreign = [&](std::uint32_t v) { return v < cloth.points.begin || v >= cloth.points.end; };
    if (foreign(a) || foreign(b) || foreign(c)) return error_at("triangle", t, "a point is not the cloth's own");
    // A triangle with equal corners has no area and no normal.
    if (a == b || b == c || c == a) return error_at("triangle", t, "a corner comes twice");
  }
  if (!cloth.root_distance_m.empty() && cloth.root_distance_m.size() != cloth.points.count())
    return "distances from the pins are neither none nor one a point";
  for (std::size_t i = 0; i < cloth.root_distance_m.size(); ++i) {
    if (const std::string error = out_of_range({{"distance from the pins (m)", cloth.root_distance_m[i], 0, 100}});
        !error.empty())
      return error_at("point", i, error);
  }
  return out_of_range({{"root length (m)", cloth.root_length_m, 0, 10},
                       {"opacity", cloth.opacity, 0, 1},
                       {"stretch stiffness (N/m)", cloth.stretch_stiffness_n_per_m, 0, 1e5},
                       {"shear stiffness (N/m)", cloth.shear_stiffness_n_per_m, 0, 1e5},
                       {"damping time (s)", cloth.damping_time_s, 0, 1},
                       {"pin stiffness (N/m)", cloth.pin_stiffness_n_per_m, 0, 1e4},
                       {"area density (kg/m^2)", cloth.area_density_kg_per_m2, 1e-4f, 100},
                       {"air drag (N s/m^3)", cloth.air_drag_ns_per_m3, 0, 1000}});
}

std::string error_of(const Knot& knot, const Groom& groom) {
  if (knot.points.size() < 2) return "ties fewer than two points";
  for (const std::uint32_t p : knot.points) {
    if (p >= groom.points.size()) return "a tied point does not exist";
  }
  return out_of_range({{"stiffness (N/m)", knot.stiffness_n_per_m, 0, 1e5},
                       {"damping time (s)", knot.damping_time_s, 0, 1},
                       {"mass (kg)", knot.mass_kg, 0, 1}});
}

std::string validate_root_blends(const Groom& groom) {
  if (!groom.root_blends.empty() && groom.root_blends.size() != groom.group_names.size())
    return "root blends are neither none nor one a group";
  for (std::size_t g = 0; g < groom.root_blends.size(); ++g) {
    if (const std::string error = validate(groom.root_blends[g]); !error.empty()) return error_at("group", g, error);
  }
  return {};
}

std::string validate_clumps(const Groom& groom, const GroomLimits& limits) {
  if (groom.clumps.size() > groom.strand_count())
    return over_limit("clumps", groom.clumps.size(), groom.strand_count());
  std::size_t drawn_points = groom.points.size();
  for (std::size_t c = 0; c < groom.clumps.size(); ++c) {
    const Clump& clump = groom.clumps[c];
    if (const std::string error = error_of(clump, groom, limits); !error.empty()) return error_at("clump", c, error);
    HAIRNET_ASSERT(clump.strand < groom.strand_count());
    // A few bytes of clumps could ask clients to draw very many points, so copies count towards the limit of points.
    drawn_points += clump.copy_count * groom.strand_points(clump.strand).size();
  }
  if (drawn_points > limits.point_count_max)
    return over_limit("points with the clumps'", drawn_points, limits.point_count_max);
  return {};
}

// Checks all that owns points behind those of the strands. A thread needs two points, a card two pairs, and a cloth
// three.
std::string validate_point_owners(const Groom& groom, const GroomLimits& limits) {
  Points points(groom);
  for (std::size_t i = 0; i < groom.threads.size(); ++i) {
    std::string error = points.take(groom.threads[i].points, 2, 1);
    if (error.empty()) error = error_of(groom.threads[i], groom);
    if (!error.empty()) return error_at("thread", i, error);
  }
  for (std::size_t i = 0; i < groom.cards.size(); ++i) {
    std::string error = points.take(groom.cards[i].points, 4, 2);
    if (error.empty()) error = error_of(groom.cards[i].properties, groom);
    if (!error.empty()) return error_at("card", i, error);
  }
  for (std::size_t i = 0; i < groom.cloths.size(); ++i) {
    std::string error = points.take(groom.cloths[i].points, 3, 1);
    if (error.empty()) error = error_of(groom.cloths[i], groom, limits);
    if (!error.empty()) return error_at("cloth", i, error);
  }
  return points.all_taken() ? "" : "strands, threads, cards and cloths do not cover the points";
}

}  // namespace

std::string error_of(const StrandProperties& properties, const Groom& groom) {
  if (properties.group >= groom.group_names.size()) return "its group does not exist";
  return out_of_range({{"radius (m)", properties.radius_m, 1e-7f, 0.01f},
                       {"hair count", properties.hair_count, 1e-3f, 1e6},
                       {"root length (m)", properties.root_length_m, 0, 10}});
}

std::string validate_features(const Groom& groom, const GroomLimits& limits) {
  HAIRNET_ASSERT(groom.strand_begin.size() == groom.strand_count() + 1);
  // Counts come first: the checks below take time in proportion to them.
  for (const auto& [name, count] : {std::pair<std::string_view, std::size_t>{"threads", groom.threads.size()},
                                    {"cards", groom.cards.size()},
                                    {"cloths", groom.cloths.size()},
                                    {"knots", groom.knots.size()}}) {
    if (count > limits.fabric_count_max) return over_limit(name, count, limits.fabric_count_max);
  }
  if (groom.strand_begin.back() > groom.points.size()) return "strand offsets go beyond the points";
  std::string error = validate_root_blends(groom);
  if (error.empty()) error = validate_clumps(groom, limits);
  if (error.empty()) error = validate_point_owners(groom, limits);
  std::size_t tied_points = 0;
  for (std::size_t k = 0; error.empty() && k < groom.knots.size(); ++k) {
    // Knots may name the same points, so their lists are bounded together.
    tied_points += groom.knots[k].points.size();
    error = error_of(groom.knots[k], groom);
    if (!error.empty()) return error_at("knot", k, error);
  }
  if (error.empty() && tied_points > limits.point_count_max)
    return over_limit("tied points", tied_points, limits.point_count_max);
  return error;
}

}  // namespace hairnet
