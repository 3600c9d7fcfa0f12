#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include "core/assert.hpp"
#include "schema/wire/basis_file.hpp"
#include "schema/wire/packing.hpp"
#include "tests/support/mutation.hpp"
#include "tests/tools/hex.hpp"
#include "tests/tools/web_messages.hpp"
#include "tests/tools/web_modes.hpp"

namespace hairnet {
namespace {

using Bytes = std::vector<std::uint8_t>;
using Json = nlohmann::ordered_json;

constexpr int kMutations = 1500;

wire::HairBasis small_basis(std::size_t mode_count) {
  WebRandom random(21);
  wire::HairBasis out = make_basis(random, {3, 2, 3}, mode_count);
  for (const auto& [bone, dims] :
       {std::pair(Bone::head, std::array{3, 4, 5}), std::pair(Bone::left_shoulder, std::array{2, 2, 3})}) {
    SkinDistanceField& field = out.skin.emplace_back();
    field = {bone, random.vector(0.2f), 0.0125f, dims, {}};
    for (int node = 0; node < dims[0] * dims[1] * dims[2]; ++node) field.distance.push_back(random.real(0.06f));
  }
  return out;
}

Json samples_of(const Basis& basis) {
  WebRandom random(22);
  Json samples = Json::array();
  for (std::size_t count = 0; count <= basis.mode_count(); ++count) {
    std::vector<float> coefficients;
    for (std::size_t k = 0; k < count; ++k) coefficients.push_back(k == 2 ? 0 : random.real(2 * basis.deviation_m[k]));
    std::vector<Vec3f> displacements(basis.node_count);
    displacements_of(basis, coefficients, displacements);
    samples.push_back({{"coefficients", coefficients}, {"displacements", flat(displacements)}});
  }
  return samples;
}

// Of 32-bit words: of integers, and of the bits of floats.
class Checksum {
 public:
  void add(const auto& numbers) {
    for (const auto number : numbers) add_word(static_cast<std::uint32_t>(number));
  }
  void add_floats(const auto& numbers) {
    for (const float number : numbers) add_word(std::bit_cast<std::uint32_t>(number));
  }
  [[nodiscard]] std::uint32_t value() const { return value_; }

 private:
  void add_word(std::uint32_t word) { value_ = (value_ ^ word) * 16'777'619u; }
  std::uint32_t value_ = 0;
};

// Of all that a file holds, or null.
Json checksum_of(const Bytes& file) {
  const auto got = wire::decode_basis(file);
  if (!got) return nullptr;
  const LevelGeometry& geometry = got->geometry;
  Checksum sum;
  sum.add_floats(geometry.lattice.origin);
  sum.add_floats(geometry.lattice.spacing);
  sum.add(geometry.lattice.dims);
  for (const auto* list :
       {&geometry.active_nodes, &geometry.trimmed_nodes, &geometry.trimmed_begin, &geometry.trimmed_from})
    sum.add(*list);
  sum.add_floats(geometry.trimmed_weights);
  sum.add_floats(got->basis.deviation_m);
  sum.add_floats(got->basis.unit);
  sum.add(got->basis.modes);
  for (const SkinDistanceField& field : got->skin) {
    sum.add(std::array{field.bone});
    sum.add_floats(field.origin);
    sum.add_floats(std::array{field.cell_m});
    sum.add(field.dims);
    for (const float distance_m : field.distance) sum.add(std::array{skin_byte(distance_m)});
  }
  return sum.value();
}

Json spoilt_case(const std::string& name, const Bytes& file) {
  return {{"name", name}, {"file", hex(file)}, {"checksum", checksum_of(file)}};
}

// The table of a basis file, of which vectors can be changed.
class Table {
 public:
  explicit Table(const wire::HairBasis& basis)
      : bytes_(wire::unpack(wire::encode_basis(basis.geometry, basis.basis, basis.skin), wire::kPackedBasis).value()) {}
  [[nodiscard]] const Bytes& bytes() const { return bytes_; }
  [[nodiscard]] Bytes file() const { return wire::pack(bytes_, wire::kPackedBasis); }

  // Overwrites the first number of a vector, or any other.
  template <class T>
  Table& set(const std::vector<T>& vector, std::size_t index, T value) {
    std::memcpy(bytes_.data() + place_of(vector.data(), vector.size() * sizeof(T)) + index * sizeof(T), &value,
                sizeof(T));
    return *this;
  }
  // Says that a vector has another length: that it goes on in what lies behind it.
  template <class T>
  Table& set_size(const std::vector<T>& vector, std::size_t size) {
    return set_size_at(place_of(vector.data(), vector.size() * sizeof(T)), size);
  }
  // The same of the modes, which are the only vector of so many bytes.
  Table& set_modes_size(const Basis& basis, std::size_t size) {
    const auto count = static_cast<std::uint32_t>(2 * basis.modes.size());
    return set_size_at(place_of(&count, sizeof count) + sizeof count, size);
  }
  Table& set_lattice(const Vec3f& before, const Vec3f& after) {
    std::memcpy(bytes_.data() + place_of(before.data(), sizeof before), after.data(), sizeof after);
    return *this;
  }

 private:
  [[nodiscard]] std::size_t place_of(const void* what, std::size_t size) const {
    const auto* begin = static_cast<const std::uint8_t*>(what);
    const auto found = std::search(bytes_.begin(), bytes_.end(), begin, begin + size);
    HAIRNET_ASSERT(found != bytes_.end());
    return static_cast<std::size_t>(found - bytes_.begin());
  }
  Table& set_size_at(std::size_t at, std::size_t size) {
    const auto count = static_cast<std::uint32_t>(size);
    std::memcpy(bytes_.data() + at - sizeof count, &count, sizeof count);
    return *this;
  }

  Bytes bytes_;
};

void add_numbers(const wire::HairBasis& good, Json& all) {
  constexpr float kInfinity = std::numeric_limits<float>::infinity(), kNaN = std::numeric_limits<float>::quiet_NaN();
  const auto add = [&](const std::string& name, auto spoil) {
    Table table(good);
    spoil(table);
    all.push_back(spoilt_case(name, table.file()));
  };
  const auto& [geometry, basis, skin] = good;
  const std::size_t last = basis.mode_count() - 1;
  for (const float value : {0.0f, -0.0f, -0.01f, kInfinity, -kInfinity, kNaN, 1e-40f, 0.5f}) {
    const std::string is = " is " + std::to_string(value);
    add("the last deviation" + is, [&](Table& table) { table.set(basis.deviation_m, last, value); });
    add("the first deviation" + is, [&](Table& table) { table.set(basis.deviation_m, 0, value); });
    add("a unit" + is, [&](Table& table) { table.set(basis.unit, last, value); });
    add("a spacing" + is, [&](Table& table) {
      table.set_lattice(geometry.lattice.spacing, {value, geometry.lattice.spacing.y(), geometry.lattice.spacing.z()});
    });
  }
  add("equal deviations", [&](Table& table) { table.set(basis.deviation_m, 1, basis.deviation_m[0]); });
  for (const float value : {16.0f, 16.001f, -16.0f, -17.0f, kNaN})
    add("a weight is " + std::to_string(value), [&](Table& table) { table.set(geometry.trimmed_weights, 0, value); });
  for (const float value : {100.0f, -100.0f, 100.01f, kNaN, -kInfinity})
    add("an origin is " + std::to_string(value), [&](Table& table) {
      table.set_lattice(geometry.lattice.origin, {geometry.lattice.origin.x(), geometry.lattice.origin.y(), value});
    });
  add("an active node twice", [&](Table& table) { table.set(geometry.active_nodes, 1, geometry.active_nodes[0]); });
  add("an active node outside", [&](Table& table) { table.set(geometry.active_nodes, 0, 1'000'000u); });
  add("a trimmed node follows none", [&](Table& table) { table.set(geometry.trimmed_from, 0, 1'000'000u); });
  add("offsets descend", [&](Table& table) { table.set(geometry.trimmed_begin, 1, 1'000'000u); });
}

void add_counts(const wire::HairBasis& good, Json& all) {
  const auto& [geometry, basis, skin] = good;
  const std::size_t count = basis.mode_count(), bytes_a_mode = 2 * 3 * basis.node_count;
  const auto add = [&](const std::string& name, std::size_t deviations, std::size_t units, std::size_t plane_bytes) {
    Table table(good);
    // The modes first: their number is found by value.
    table.set_modes_size(basis, plane_bytes).set_size(basis.deviation_m, deviations).set_size(basis.unit, units);
    all.push_back(spoilt_case(name + " of " + std::to_string(count), table.file()));
  };
  add("no modes", 0, 0, 0);
  add("a mode fewer", count - 1, count - 1, (count - 1) * bytes_a_mode);
  add("a unit fewer", count, count - 1, count * bytes_a_mode);
  add("a deviation fewer", count - 1, count, count * bytes_a_mode);
  add("a byte of modes fewer", count, count, count * bytes_a_mode - 1);
  add("a node of modes fewer", count, count, count * bytes_a_mode - 6);
  add("all but a mode", 1, 1, bytes_a_mode);
  add("a mode more", count + 1, count + 1, (count + 1) * bytes_a_mode);
  const auto add_nodes = [&](const std::string& name, const std::vector<std::uint32_t>& nodes) {
    all.push_back(spoilt_case(name, Table(good).set_size(nodes, nodes.size() - 1).file()));
  };
  add_nodes("an active node fewer", geometry.active_nodes);
  add_nodes("a trimmed node fewer", geometry.trimmed_nodes);
  add_nodes("an offset fewer", geometry.trimmed_begin);
  add_nodes("a follower fewer", geometry.trimmed_from);
}

void add_bytes(const Table& good, Json& all) {
  const Bytes file = good.file();
  for (std::size_t size = 0; size < file.size(); size += file.size() / 16)
    all.push_back(spoilt_case("cut off after " + std::to_string(size),
                              Bytes(file.begin(), file.begin() + static_cast<std::ptrdiff_t>(size))));
  all.push_back(spoilt_case("the table, not packed", good.bytes()));
  all.push_back(spoilt_case("packed as a groom", wire::pack(good.bytes(), wire::kPackedGroom)));
  all.push_back(spoilt_case("packed twice", wire::pack(file, wire::kPackedBasis)));
  std::mt19937 random(23);
  for (int n = 0; n < kMutations; ++n)
    all.push_back(spoilt_case("mutation " + std::to_string(n),
                              wire::pack(wire::mutated(random, good.bytes()), wire::kPackedBasis)));
}

}  // namespace

wire::HairBasis make_basis(WebRandom& random, const std::array<int, 3>& dims, std::size_t mode_count) {
  wire::HairBasis out{random.geometry(dims), {}, {}};
  out.basis.node_count = out.geometry.active_nodes.size();
  for (std::size_t mode = 0; mode < mode_count; ++mode) {
    out.basis.deviation_m.push_back(0.1f / static_cast<float>(1 + mode));
    out.basis.unit.push_back(1e-4f * static_cast<float>(1 + mode));
    for (std::size_t i = 0; i < 3 * out.basis.node_count; ++i)
      out.basis.modes.push_back(static_cast<std::int16_t>(random.real(32767)));
  }
  return out;
}

Json basis_cases() {
  const wire::HairBasis good = small_basis(5);
  Json spoilt = Json::array();
  add_numbers(good, spoilt);
  add_counts(good, spoilt);
  add_counts(small_basis(kModeCountMax), spoilt);
  add_bytes(Table(good), spoilt);
  const Bytes file = Table(good).file();
  return {{"file", hex(file)},
          {"checksum", checksum_of(file)},
          {"geometry", to_json(good.geometry)},
          {"nodeCount", good.basis.node_count},
          {"deviationM", good.basis.deviation_m},
          {"unit", good.basis.unit},
          {"modes", good.basis.modes},
          {"samples", samples_of(good.basis)},
          {"spoilt", spoilt}};
}

}  // namespace hairnet
