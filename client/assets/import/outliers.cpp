#include "client/assets/import/outliers.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <utility>

namespace hairnet {
namespace {

// At most this many points of a strand are measured, however densely it is sampled. Otherwise a strand of 1000 points
// would outvote many of 16.
constexpr std::size_t kSamplesOfStrand = 16;
// Fewer strands have no usual size.
constexpr std::size_t kMeasuredStrandsMin = 8;
// This share of the strands is within the usual size. The worst 2 % do not enlarge what is usual.
constexpr double kUsualShare = 0.98;
// Beyond kFar times the usual size a strand is suspect, unless several are alike: a ponytail may reach three times as
// far as short hair. Nothing that belongs to a head reaches kFarInAllCases times as far.
constexpr double kFar = 3, kFarInAllCases = 12;
// Strands whose sizes have a smaller ratio are alike.
constexpr double kAlike = 1.25;
// This many strands that are alike make a style.
constexpr std::size_t kAlikeMin = 3;
// A segment that is this many times as long as the strand's median segment is a jump: segments of one strand have
// similar lengths, whatever its shape.
constexpr double kJump = 8;
// A strand that is shorter than this share of the usual length counts as having no length: its points differ only by
// rounding.
constexpr double kShort = 1e-5;

struct MeasuredStrand {
  std::size_t file = 0, number = 0;
  std::vector<Vec3> points;
  // `reach` is the distance from the middle of all hair that a quarter of the strand's samples exceed.
  double length = 0, reach = 0;
  // The file's width of the strand, which is put back with the points.
  std::optional<float> width;
  bool is_dropped = false;
};

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(values.size() - 1));
  std::ranges::nth_element(values, at);
  return *at;
}

double length_of(const std::vector<Vec3>& points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += (points[i] - points[i - 1]).norm();
  return length;
}

// The median is robust: a single jump does not enlarge the measure that must find it.
double median_segment(const std::vector<Vec3>& points) {
  std::vector<double> segments;
  for (std::size_t i = 1; i < points.size(); ++i) segments.push_back((points[i] - points[i - 1]).norm());
  return quantile(std::move(segments), 0.5);
}

std::vector<Vec3> samples_of(const MeasuredStrand& strand) {
  const std::size_t count = std::min(kSamplesOfStrand, strand.points.size());
  std::vector<Vec3> samples;
  for (std::size_t i = 0; i < count; ++i)
    samples.push_back(strand.points[count == 1 ? 0 : i * (strand.points.size() - 1) / (count - 1)]);
  return samples;
}

// The copy in double costs memory, but the cuts need every strand at hand before the first is judged.
std::vector<MeasuredStrand> measured_strands(std::span<const StrandFile> files) {
  std::vector<MeasuredStrand> all;
  for (std::size_t f = 0; f < files.size(); ++f) {
    const ImportedStrands& in = files[f].strands;
    for (std::size_t s = 0; s < in.strand_count(); ++s) {
      MeasuredStrand& strand = all.emplace_back();
      strand.file = f;
      strand.number = s;
      if (!files[f].widths.empty()) strand.width = files[f].widths[s];
      for (std::uint32_t i = in.strand_begin[s]; i < in.strand_begin[s + 1]; ++i)
        strand.points.push_back(in.points[i].cast<double>());
      strand.length = length_of(strand.points);
    }
  }
  return all;
}

// The middle of the hair: the median of each coordinate. A mean would follow a single point at 1e20.
Vec3 middle_of(const std::vector<MeasuredStrand>& strands) {
  std::array<std::vector<double>, 3> coordinates;
  for (const MeasuredStrand& strand : strands) {
    for (const Vec3& x : samples_of(strand)) {
      for (int axis = 0; axis < 3; ++axis) coordinates[static_cast<std::size_t>(axis)].push_back(x[axis]);
    }
  }
  return {quantile(std::move(coordinates[0]), 0.5), quantile(std::move(coordinates[1]), 0.5),
          quantile(std::move(coordinates[2]), 0.5)};
}

double reach_of(const MeasuredStrand& strand, const Vec3& middle) {
  std::vector<double> far;
  for (const Vec3& x : samples_of(strand)) far.push_back((x - middle).norm());
  // Of up to four samples one is a quarter or more: the farthest counts then.
  const double share = far.size() <= 4 ? 1 : 0.75;
  return quantile(std::move(far), share);
}

struct Usual {
  Vec3 middle = Vec3::Zero();
  double reach = 0, length = 0;
};

double usual_length(const std::vector<MeasuredStrand>& strands) {
  std::vector<double> lengths;
  for (const MeasuredStrand& strand : strands) {
    lengths.push_back(strand.length);
  }
  return quantile(std::move(lengths), kUsualShare);
}

Usual usual_of(std::vector<MeasuredStrand>& strands) {
  Usual usual;
  usual.middle = middle_of(strands);
  std::vector<double> reaches;
  for (MeasuredStrand& strand : strands) {
    strand.reach = reach_of(strand, usual.middle);
    reaches.push_back(strand.reach);
  }
  usual.reach = quantile(std::move(reaches), kUsualShare);
  usual.length = usual_length(strands);
  return usual;
}

// Returns the indices of the points that lie far from all hair, if the strand jumps to one of them.
std::vector<std::size_t> stray_points(const MeasuredStrand& strand, const Usual& usual) {
  const double far = kFar * usual.reach, jump = kJump * median_segment(strand.points);
  std::vector<std::size_t> stray;
  bool jumps = false;
  for (std::size_t i = 0; i < strand.points.size(); ++i) {
    if ((strand.points[i] - usual.middle).norm() <= far) continue;
    stray.push_back(i);
    jumps = jumps || (i > 0 && (strand.points[i] - strand.points[i - 1]).norm() > jump) ||
            (i + 1 < strand.points.size() && (strand.points[i + 1] - strand.points[i]).norm() > jump);
  }
  // A strand that lies far away as a whole has no jump, and is left to drop_single_strands. Where most points are
  // stray, it is not certain which part is hair.
  if (!jumps || 2 * stray.size() > strand.points.size()) stray.clear();
  return stray;
}

// A strand may end with a jump through the hair, for example to a last point at the origin, which need not lie far
// away. Returns the index of that end point; none: there is no such jump.
std::optional<std::size_t> jumping_end(const MeasuredStrand& strand, const Usual& usual) {
  const std::size_t count = strand.points.size();
  // Fewer points have no usual segment.
  if (count < 5) return {};
  // The jump must also be large beside the hair itself, so coarse strands with one long segment keep it.
  const double jump = std::max(kJump * median_segment(strand.points), usual.reach / 2);
  const auto segment = [&](std::size_t i) { return (strand.points[i + 1] - strand.points[i]).norm(); };
  if (segment(count - 2) > jump) return count - 1;
  if (segment(0) > jump) return 0;
  return {};
}

void cut_points(MeasuredStrand& strand, std::vector<std::size_t> stray, const Usual& usual,
                std::vector<Outlier>& outliers) {
  Outlier& outlier = outliers.emplace_back();
  outlier = {Outlier::Kind::stray_point, strand.file, strand.number, stray.front(), stray.size(), 0, usual.reach};
  for (const std::size_t i : stray) outlier.size = std::max(outlier.size, (strand.points[i] - usual.middle).norm());
  // Removal goes from the last stray point to the first, so the numbers of the others stay valid.
  for (auto i = stray.rbegin(); i != stray.rend(); ++i)
    strand.points.erase(strand.points.begin() + static_cast<std::ptrdiff_t>(*i));
  strand.length = length_of(strand.points);
  strand.reach = reach_of(strand, usual.middle);
}

// Ends are collected first, because only their number tells an error from a shape.
void cut_stray_points(std::vector<MeasuredStrand>& strands, const Usual& usual, std::vector<Outlier>& outliers) {
  std::vector<std::pair<std::size_t, std::size_t>> ends;
  for (std::size_t s = 0; s < strands.size(); ++s) {
    std::vector<std::size_t> stray = stray_points(strands[s], usual);
    if (!stray.empty()) {
      cut_points(strands[s], std::move(stray), usual, outliers);
    } else if (const auto end = jumping_end(strands[s], usual)) {
      ends.emplace_back(s, *end);
    }
  }
  // Where many strands end so, it is their shape.
  if (static_cast<double>(ends.size()) > (1 - kUsualShare) * static_cast<double>(strands.size())) return;
  for (const auto& [s, end] : ends) cut_points(strands[s], {end}, usual, outliers);
}

void drop_single_strands(std::vector<MeasuredStrand>& strands, const Usual& usual, std::vector<Outlier>& outliers) {
  // Very short hair all over has a usual length below its reach; a strand must then exceed the reach.
  const double usual_length = std::max(usual.length, usual.reach);
  std::vector<MeasuredStrand*> candidates;
  for (MeasuredStrand& strand : strands) {
    if (strand.reach > kFar * usual.reach || strand.length > kFar * usual_length) candidates.push_back(&strand);
  }
  const auto alike = [](double a, double b) { return a <= kAlike * b && b <= kAlike * a; };
  // Candidates are compared with each other only, since usual strands say nothing about them. The inner loop ends at
  // kAlikeMin, because a file may have very many that are alike.
  for (MeasuredStrand* strand : candidates) {
    std::size_t count = 0;
    for (const MeasuredStrand* other : candidates) {
      count += alike(strand->reach, other->reach) && alike(strand->length, other->length);
      if (count == kAlikeMin) break;
    }
    const bool is_absurd =
        strand->reach > kFarInAllCases * usual.reach || strand->length > kFarInAllCases * usual_length;
    if (count >= kAlikeMin && !is_absurd) continue;
    strand->is_dropped = true;
    const bool is_long = strand->length > kFar * usual_length;
    outliers.push_back({is_long ? Outlier::Kind::too_long : Outlier::Kind::far_away, strand->file, strand->number, 0, 0,
                        is_long ? strand->length : strand->reach, is_long ? usual.length : usual.reach});
  }
}

// Only points and widths are put back. Groups were divided before, and what the files say of themselves has been taken
// by then.
void put_back(const std::vector<MeasuredStrand>& strands, std::span<StrandFile> files) {
  for (StrandFile& file : files) {
    file.strands = {};
    file.widths.clear();
  }
  for (const MeasuredStrand& strand : strands) {
    if (strand.is_dropped) continue;
    ImportedStrands& out = files[strand.file].strands;
    for (const Vec3& x : strand.points) out.points.push_back(x.cast<float>());
    out.strand_begin.push_back(static_cast<std::uint32_t>(out.points.size()));
    if (strand.width) files[strand.file].widths.push_back(*strand.width);
  }
}

}  // namespace

std::vector<Outlier> cut_outliers(std::span<StrandFile> files) {
  std::vector<MeasuredStrand> strands = measured_strands(files);
  std::vector<Outlier> outliers;
  // The usual length is the 98 % quantile, so it holds even where most strands have no length.
  const double nothing = kShort * usual_length(strands);
  std::erase_if(strands, [&](const MeasuredStrand& strand) {
    if (strand.length > nothing) return false;
    outliers.push_back({Outlier::Kind::no_length, strand.file, strand.number, 0, 0, 0, 0});
    return true;
  });
  if (strands.size() >= kMeasuredStrandsMin) {
    const Usual usual = usual_of(strands);
    cut_stray_points(strands, usual, outliers);
    // Lengths are measured again, since cutting stray points has shortened strands.
    drop_single_strands(strands, {usual.middle, usual.reach, usual_length(strands)}, outliers);
  }
  // Files without outliers keep their bits: the copy in double is not written back.
  if (outliers.empty()) return outliers;
  put_back(strands, files);
  std::ranges::stable_sort(outliers, {}, [](const Outlier& o) { return std::pair(o.file, o.strand); });
  return outliers;
}

}  // namespace hairnet
