#include "tests/load/attack_grooms.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "core/random.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/packing.hpp"

namespace hairnet::load {
namespace {

// A point takes 12 bytes, so the zigzag has 7 MB.
constexpr int kZigzagPoints = 580'000;
// The body has twice as many triangles.
constexpr std::uint32_t kBodyVertices = 1'000'000;
// Each strand has 20 points.
constexpr int kBigStrands = 90'000;

Vec3f point_within(Random& random, float reach_m) {
  const auto coordinate = [&] { return static_cast<float>(random.symmetric()) * reach_m; };
  const float x = coordinate(), y = coordinate(), z = coordinate();
  return {x, y, z};
}

Groom named_groom() {
  Groom groom;
  groom.name = kAttackGroomName;
  groom.group_names = {"hair"};
  return groom;
}

// Returns the groom's file without compression, so that AttackUpload finds and changes the name in it.
std::vector<std::uint8_t> file_of(const Groom& groom) {
  return wire::unpack(wire::encode_groom(groom), wire::kPackedGroom).value();
}

// Strands of 20 points that hang from a cap of 9 cm.
void add_strands(Groom& groom, int count, Random& random) {
  for (int s = 0; s < count; ++s) {
    const double azimuth = random.between(0, 2 * std::numbers::pi), height = random.between(0.2, 1);
    const double ring = std::sqrt(1 - height * height);
    const Vec3f out = Vec3(ring * std::cos(azimuth), height, ring * std::sin(azimuth)).cast<float>();
    std::vector<Vec3f> strand;
    for (int i = 0; i < 20; ++i) {
      const float along = static_cast<float>(i) / 19;
      strand.push_back((0.09f + 0.04f * along) * out - Vec3f(0, 0.25f * along * along, 0));
    }
    groom.add_strand(strand, {});
  }
}

}  // namespace

std::vector<std::uint8_t> make_zigzag_groom() {
  Groom groom = named_groom();
  Random random(1);
  std::vector<Vec3f> strand;
  for (int i = 0; i < kZigzagPoints; ++i) {
    Vec3f point = point_within(random, 0.1f);
    point.x() = i % 2 ? 0.15f : -0.15f;
    strand.push_back(point);
  }
  groom.add_strand(strand, {});
  return file_of(groom);
}

std::vector<std::uint8_t> make_body_groom() {
  Groom groom = named_groom();
  Random random(1);
  add_strands(groom, 100, random);
  for (std::uint32_t i = 0; i < kBodyVertices; ++i) {
    groom.body.mesh.vertices.push_back(point_within(random, 0.2f));
    groom.body.bone_weights.push_back({1, 0, 0, 0, 0});
  }
  for (std::uint32_t i = 0; i < 2 * kBodyVertices; ++i) {
    const std::uint32_t vertex = i % kBodyVertices, step = 1 + i / kBodyVertices;
    groom.body.mesh.triangles.push_back(
        {vertex, (vertex + step) % kBodyVertices, (vertex + 2 * step + 1) % kBodyVertices});
  }
  return file_of(groom);
}

std::vector<std::uint8_t> make_big_groom() {
  Groom groom = named_groom();
  Random random(1);
  add_strands(groom, kBigStrands, random);
  return file_of(groom);
}

std::vector<std::uint8_t> make_rubbish(std::size_t byte_count) {
  std::vector<std::uint8_t> bytes(byte_count);
  Random random(1);
  std::ranges::generate(bytes, [&] { return static_cast<std::uint8_t>(random.next()); });
  std::ranges::copy(kAttackGroomName, bytes.begin());
  return bytes;
}

EncodedGroom make_late_joiner_groom(std::uint64_t seed) {
  Groom groom = named_groom();
  groom.name = "late_joiner";
  Random random(seed, 0x1e3c0);
  add_strands(groom, 20, random);
  auto bytes = std::make_shared<const std::vector<std::uint8_t>>(wire::encode_groom(groom));
  return {"late_joiner", wire::hash_groom(*bytes), std::move(bytes)};
}

}  // namespace hairnet::load
