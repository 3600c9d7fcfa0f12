#include "schema/wire/groom_features.hpp"

#include <limits>

#include "schema/wire/flatbuffer_convert.hpp"
#include "schema/wire/groom_numbers.hpp"

namespace hairnet::wire {
namespace {

using flatbuffers::FlatBufferBuilder;

// An empty vector is left out, so a groom of strands alone pays no bytes for features that it lacks.
template <class T>
auto write(FlatBufferBuilder& to, const std::vector<T>& scalars) {
  return scalars.empty() ? flatbuffers::Offset<flatbuffers::Vector<T>>() : to.CreateVector(scalars);
}

template <class T>
auto write_structs(FlatBufferBuilder& to, const std::vector<T>& structs) {
  return structs.empty() ? flatbuffers::Offset<flatbuffers::Vector<const T*>>() : to.CreateVectorOfStructs(structs);
}

std::uint32_t count_of(const PointRange& range) {
  HAIRNET_ASSERT(range.begin <= range.end);
  return static_cast<std::uint32_t>(range.count());
}

}  // namespace

// These functions are not in the unnamed namespace, where they would hide the other conversions of the same name.
static fb::StrandProperties to_flatbuffer(const StrandProperties& s) {
  return {s.radius_m, s.hair_count, s.root_length_m, s.group, s.rooted};
}
static StrandProperties from_flatbuffer(const fb::StrandProperties& s) {
  return {s.radius_m(), s.hair_count(), s.root_length_m(), s.group(), s.rooted()};
}

static fb::Thread to_flatbuffer(const Thread& t) {
  return {count_of(t.points),
          t.group,
          t.rooted,
          t.root_length_m,
          t.radius_m,
          to_flatbuffer(t.colour),
          t.axial_stiffness_n,
          t.damping_time_s,
          t.pin_stiffness_n_per_m,
          t.linear_density_kg_per_m,
          t.air_drag_ns_per_m2};
}
// `points` says where the points lie: the file has only their count (PointCounter).
static Thread from_flatbuffer(const fb::Thread& t, const PointRange& points) {
  return {points,
          t.group(),
          t.rooted(),
          t.root_length_m(),
          t.radius_m(),
          from_flatbuffer(t.colour()),
          t.axial_stiffness_n(),
          t.damping_time_s(),
          t.pin_stiffness_n_per_m(),
          t.linear_density_kg_per_m(),
          t.air_drag_ns_per_m2()};
}

static fb::Cloth to_flatbuffer(const Cloth& c) {
  return {count_of(c.points),
          static_cast<std::uint32_t>(c.triangles.size()),
          c.group,
          !c.root_distance_m.empty(),
          c.root_length_m,
          to_flatbuffer(c.colour),
          c.opacity,
          c.stretch_stiffness_n_per_m,
          c.shear_stiffness_n_per_m,
          c.damping_time_s,
          c.pin_stiffness_n_per_m,
          c.area_density_kg_per_m2,
          c.air_drag_ns_per_m3};
}
// The triangles and distances of a cloth lie in common vectors of the table; read_cloths() takes them.
static Cloth from_flatbuffer(const fb::Cloth& c, const PointRange& points) {
  return {points,
          c.group(),
          {},
          {},
          c.root_length_m(),
          from_flatbuffer(c.colour()),
          c.opacity(),
          c.stretch_stiffness_n_per_m(),
          c.shear_stiffness_n_per_m(),
          c.damping_time_s(),
          c.pin_stiffness_n_per_m(),
          c.area_density_kg_per_m2(),
          c.air_drag_ns_per_m3()};
}

namespace {

// Takes a vector apart into pieces from its front.
template <class T>
class Pieces {
 public:
  explicit Pieces(std::span<const T> all) : all_(all) {}
  // Takes the next `count` elements; false when there are fewer.
  template <class To>
  bool take(std::size_t count, std::vector<To>& out) {
    static_assert(sizeof(To) % sizeof(T) == 0);
    constexpr std::size_t kEach = sizeof(To) / sizeof(T);
    // The division cannot wrap, as a product of a forged count could.
    if (count > all_.size() / kEach) return false;
    out.resize(count);
    if (count > 0) std::memcpy(static_cast<void*>(out.data()), all_.data(), count * sizeof(To));
    all_ = all_.subspan(count * kEach);
    return true;
  }
  [[nodiscard]] bool all_taken() const { return all_.empty(); }

 private:
  std::span<const T> all_;
};

// A vector of structs that may be absent, as a range to walk over.
template <class Struct>
std::span<const Struct> structs(const flatbuffers::Vector<const Struct*>* all) {
  if (!all || all->size() == 0) return {};
  return {reinterpret_cast<const Struct*>(all->Data()), all->size()};
}

template <class Struct>
bool is_aligned_or_absent(const flatbuffers::Vector<const Struct*>* all) {
  return !all || is_aligned(*all);
}

std::string read_root_blends(const fb::Groom& in, Groom& out) {
  Pieces points(span_of(in.root_blend_points()));
  if (in.root_blend_counts()) {
    for (const std::uint16_t count : *in.root_blend_counts()) {
      if (!points.take(count, out.root_blends.emplace_back().points)) return "fewer root blend points than counted";
    }
  }
  // Surplus numbers mean that the file was made by something else, or is damaged.
  return points.all_taken() ? "" : "more root blend points than counted";
}

// Gives each thread, card and cloth its points, which follow those of the strands. validate() finds points that are
// missing.
class PointCounter {
 public:
  explicit PointCounter(const Groom& groom) : next_(groom.strand_begin.empty() ? 0 : groom.strand_begin.back()) {}
  // Saturates instead of wrapping. A range beyond the last index then ends before it begins or outside the points, and
  // validate() refuses either.
  PointRange take(std::uint32_t count) {
    const std::uint32_t begin = next_;
    next_ = count > ~next_ ? ~std::uint32_t{0} : next_ + count;
    HAIRNET_ASSERT(begin <= next_);
    return {begin, next_};
  }

 private:
  std::uint32_t next_;
};

std::string read_indices(const fb::Groom& in, const flatbuffers::Vector<std::uint32_t>* plain,
                         const flatbuffers::Vector<std::uint8_t>* planes, std::vector<std::uint32_t>& out) {
  if (in.version() >= 3) return decode_indices(span_of(planes), out);
  out.assign(span_of(plain).begin(), span_of(plain).end());
  return {};
}

std::string read_cloths(const fb::Groom& in, PointCounter& points, Groom& out) {
  std::vector<std::uint32_t> indices;
  std::string error = read_indices(in, in.cloth_triangles(), in.cloth_triangle_planes(), indices);
  if (!error.empty()) return "cloths: " + error;
  Pieces<std::uint32_t> triangles(indices);
  Pieces distances(span_of(in.cloth_root_distances()));
  for (const fb::Cloth& c : structs(in.cloths())) {
    Cloth& cloth = out.cloths.emplace_back(from_flatbuffer(c, points.take(c.point_count())));
    // Each cloth takes its part off the front of the common list, so the order of cloths is part of the format.
    if (!triangles.take(c.triangle_count(), cloth.triangles)) return "fewer cloth triangles than counted";
    // Only cloth that is pinned has distances to its roots, one for each point.
    if (c.pinned() && !distances.take(c.point_count(), cloth.root_distance_m))
      return "fewer distances on cloth than counted";
  }
  return triangles.all_taken() && distances.all_taken() ? "" : "more of cloths than counted";
}

std::string read_knots(const fb::Groom& in, Groom& out) {
  std::vector<std::uint32_t> indices;
  std::string error = read_indices(in, in.knot_points(), in.knot_point_planes(), indices);
  if (!error.empty()) return "knots: " + error;
  Pieces<std::uint32_t> points(indices);
  for (const fb::Knot& k : structs(in.knots())) {
    Knot& knot = out.knots.emplace_back();
    if (!points.take(k.point_count(), knot.points)) return "fewer tied points than counted";
    knot.stiffness_n_per_m = k.stiffness_n_per_m();
    knot.damping_time_s = k.damping_time_s();
    knot.mass_kg = k.mass_kg();
  }
  return points.all_taken() ? "" : "more tied points than counted";
}

}  // namespace

FlatFeatures write_features(FlatBufferBuilder& to, const Groom& groom) {
  std::vector<std::uint16_t> blend_counts;
  std::vector<float> blend_points, distances;
  std::vector<fb::Clump> clumps;
  std::vector<fb::Thread> threads;
  std::vector<fb::HairCard> cards;
  std::vector<fb::Cloth> cloths;
  std::vector<fb::Knot> knots;
  std::vector<std::uint32_t> triangles, tied;
  for (const RootBlend& blend : groom.root_blends) {
    HAIRNET_ASSERT(blend.points.size() <= std::numeric_limits<std::uint16_t>::max());
    blend_counts.push_back(static_cast<std::uint16_t>(blend.points.size()));
    for (const auto& point : blend.points) blend_points.insert(blend_points.end(), point.begin(), point.end());
  }
  // Fixed numbers of a feature become structs. Lists of a length of their own go into common vectors, with a count in
  // each struct.
  for (const Clump& c : groom.clumps) clumps.emplace_back(c.strand, c.copy_count, c.radius_m, c.tip_radius_m);
  for (const Thread& t : groom.threads) threads.push_back(to_flatbuffer(t));
  for (const HairCard& s : groom.cards) cards.emplace_back(count_of(s.points), to_flatbuffer(s.properties));
  for (const Cloth& c : groom.cloths) {
    cloths.push_back(to_flatbuffer(c));
    for (const auto& triangle : c.triangles) triangles.insert(triangles.end(), triangle.begin(), triangle.end());
    distances.insert(distances.end(), c.root_distance_m.begin(), c.root_distance_m.end());
  }
  for (const Knot& k : groom.knots) {
    knots.emplace_back(static_cast<std::uint32_t>(k.points.size()), k.stiffness_n_per_m, k.damping_time_s, k.mass_kg);
    tied.insert(tied.end(), k.points.begin(), k.points.end());
  }
  // They are written one after the other: the order decides the bytes, and so the hash of the file.
  FlatFeatures flat;
  flat.root_blend_counts = write(to, blend_counts);
  flat.root_blend_points = write(to, blend_points);
  flat.clumps = write_structs(to, clumps);
  flat.threads = write_structs(to, threads);
  flat.cards = write_structs(to, cards);
  flat.cloths = write_structs(to, cloths);
  flat.cloth_triangle_planes = write(to, encode_indices(triangles));
  flat.cloth_root_distances = write(to, distances);
  flat.knots = write_structs(to, knots);
  flat.knot_point_planes = write(to, encode_indices(tied));
  return flat;
}

void add_features(const FlatFeatures& features, fb::GroomBuilder& table) {
  table.add_root_blend_counts(features.root_blend_counts);
  table.add_root_blend_points(features.root_blend_points);
  table.add_clumps(features.clumps);
  table.add_threads(features.threads);
  table.add_cards(features.cards);
  table.add_cloths(features.cloths);
  table.add_cloth_triangle_planes(features.cloth_triangle_planes);
  table.add_cloth_root_distances(features.cloth_root_distances);
  table.add_knots(features.knots);
  table.add_knot_point_planes(features.knot_point_planes);
}

std::string read_features(const fb::Groom& in, Groom& out) {
  // FlatBuffers reads structs in place, and its verifier does not check their alignment.
  if (!is_aligned_or_absent(in.clumps()) || !is_aligned_or_absent(in.threads()) || !is_aligned_or_absent(in.cards()) ||
      !is_aligned_or_absent(in.cloths()) || !is_aligned_or_absent(in.knots()))
    return "clumps, threads, cards, cloths or knots are not aligned";
  std::string error = read_root_blends(in, out);
  if (!error.empty()) return error;
  for (const fb::Clump& c : structs(in.clumps()))
    out.clumps.push_back({c.strand(), c.copy_count(), c.radius_m(), c.tip_radius_m()});
  // Threads, cards and cloths own points in this order, as point_runs() walks over them.
  PointCounter points(out);
  for (const fb::Thread& t : structs(in.threads()))
    out.threads.push_back(from_flatbuffer(t, points.take(t.point_count())));
  for (const fb::HairCard& s : structs(in.cards()))
    out.cards.push_back({points.take(s.point_count()), from_flatbuffer(s.properties())});
  error = read_cloths(in, points, out);
  return error.empty() ? read_knots(in, out) : error;
}

}  // namespace hairnet::wire
