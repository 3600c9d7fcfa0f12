#include "client/assets/made/ponytail.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/assets/made/bust_shape.hpp"
#include "client/assets/made/easing.hpp"
#include "client/assets/made/ribbon.hpp"
#include "client/assets/made/tied.hpp"

namespace hairnet::made {
namespace {

// The band is a ring of 12.5 mm radius behind the crown. Its axis points up and back, so that the tail falls in an
// arch.
const Tie kBand{Vec3(0, 0.098, -0.118), Vec3(0, 0.42, -0.91).normalized(), 0.0125};
const Vec3f kBandColour(0.30f, 0.02f, 0.05f);

// One strand's path: out of the band, in an arch and down. The tail spreads first, and tapers then.
Path tail(double length_m, Random& random) {
  const double angle = 2 * std::numbers::pi * random.unit();
  const double ring = std::sqrt(random.unit());
  const Vec3 radial = std::sin(angle) * Vec3::UnitX() + std::cos(angle) * kBand.down();
  const double thin = random.unit();
  // The square of the chance leaves most hair nearly at full length; the shortest strands lack 0.32 of it.
  const double length = length_m * (1 - 0.32 * thin * thin);
  const Vec3 stray = 0.035 * Vec3(random.symmetric(), random.symmetric(), random.symmetric());
  Growth growth;
  // Strands begin a little inside the band, where the knot ties them.
  growth.start = kBand.on_ring(angle, kBand.radius_m * ring) - 0.004 * kBand.axis;
  growth.direction = kBand.axis + 0.45 * ring * radial;
  growth.length_m = length;
  growth.bend_m = 0.042;
  growth.spares_face = false;
  // The tail is up to 38 mm thick to each side.
  const double spread = 0.038 * ring;
  growth.preferred_direction = [=](const GrowthPoint& at) {
    // The tail spreads within the first 10 cm and narrows towards its end.
    const double gathered = smootherstep(0, 0.10, at.s) * (1 - 0.75 * smootherstep(0.4 * length_m, length_m, at.s));
    // Gathers sideways only: the fall determines the forward and backward position.
    const double in = 6 * (spread * radial.x() * gathered - at.p.x());
    return Vec3(Vec3(in, -1, 0) + stray + 0.8 * kBand.axis * std::exp(-at.s / 0.018));
  };
  // A strand lies 4 to 39 mm off the skin, by its place in the ring.
  const double lift = 0.004 + 0.035 * (0.5 + 0.5 * ring * std::cos(angle));
  growth.clearance = [lift](const Vec3&, double s) { return lift * smootherstep(0.0, 0.1, s); };
  return grow(growth);
}

// The band, a ring of cloth on the hair where it is tied. Returns its points. Every second column stands out a little,
// which shows as gathers in the cloth.
std::vector<std::uint32_t> add_band(Groom& groom) {
  // The band has 24 columns round the hair and 4 rows, and is 16 mm wide.
  constexpr int kRound = 24, kRows = 4;
  constexpr double kWidth = 0.016;
  const auto at = [](int column, int row) {
    const double angle = 2 * std::numbers::pi * column / kRound, along = kWidth * (row / (kRows - 1.0) - 0.5);
    const double gathered = 0.0006 * (column % 2);
    return Vec3(kBand.on_ring(angle, kBand.radius_m + 0.003 - 12 * along * along + gathered) + along * kBand.axis);
  };
  Cloth cloth;
  cloth.group = group_index(groom, "band");
  cloth.colour = kBandColour;
  cloth.stretch_stiffness_n_per_m = 100;
  cloth.shear_stiffness_n_per_m = 30;
  cloth.area_density_kg_per_m2 = 0.3f;
  std::vector<std::uint32_t> points;
  const std::uint32_t first = add_cloth_grid(groom, {kRound, kRows, true, at}, 0, cloth);
  for (std::uint32_t i = 0; i < kRound * kRows; ++i) points.push_back(first + i);
  return points;
}

// The points in the band: the ends of the hair that is pulled into it and the beginnings of the tail. Rooted strands
// end in the band; the others begin there.
std::vector<std::uint32_t> held_points(const Groom& groom) {
  std::vector<std::uint32_t> points;
  for (std::size_t s = 0; s < groom.strand_count(); ++s)
    points.push_back(groom.strands[s].rooted ? groom.strand_begin[s + 1] - 1 : groom.strand_begin[s]);
  return points;
}

}  // namespace

void dress_ponytail(const StyleOptions& options, Groom& groom) {
  // Two fifths of the strands are the tail, which begins in the band; the others are pulled back into it.
  const std::size_t tail_count = options.strand_count * 2 / 5;
  const std::size_t pulled_count = options.strand_count - tail_count;
  Random random(options.seed, 31);
  StrandFinish finish;
  finish.hair_count = kHairsInAll / static_cast<double>(options.strand_count);
  finish.points = 18;
  finish.group = group_index(groom, "pulled");
  finish.skin_clearance_m = 0.0015;
  for (const Root& root : scatter_roots(pulled_count, options.seed, is_pulled_back)) {
    add_path(groom, pulled(root, kBand, random), finish);
  }

  finish.rooted = false;
  finish.group = group_index(groom, "tail");
  finish.skin_clearance_m = 0.003;
  finish.points = curl_points(options.curl, options.length_m, 20);
  for (std::size_t i = 0; i < tail_count; ++i) {
    // Strands of one curl share a stream of random numbers; there are 24 curls in a tail.
    const Path path = tail(options.length_m, random);
    // One lock in all, so its curls are nearly in phase.
    Random shared(options.seed, 1000 + random.next() % 24);
    Curl curl = make_curl(options.curl, shared);
    curl.phase += 0.7 * random.symmetric();
    add_path(groom, curled(path, curl), finish);
  }

  std::vector<std::uint32_t> tied = held_points(groom);
  const std::vector<std::uint32_t> band = add_band(groom);
  tied.insert(tied.end(), band.begin(), band.end());
  add_knot(groom, std::move(tied), 300);
  // On the side of the head, where the tail does not hide it.
  const Vec3 seat = kBand.centre - (kBand.radius_m + 0.008) * kBand.down() - 0.008 * kBand.axis;
  std::vector<std::uint32_t> bow = add_bow(groom, seat, (-kBand.down() - 0.35 * kBand.axis).normalized(), kBandColour);
  // The bow is tied to the upper side of the band: columns 8 to 16 of 24 in the first row, since column 0 is below.
  bow.insert(bow.end(), band.begin() + 8, band.begin() + 17);
  add_knot(groom, std::move(bow), 300);
}

}  // namespace hairnet::made
