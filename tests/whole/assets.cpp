#include "tests/whole/assets.hpp"

#include <sodium.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "core/groom/groom.hpp"
#include "core/random.hpp"
#include "schema/wire/groom_file.hpp"
#include "tests/support/build_grooms.hpp"

namespace hairnet::whole {
namespace {

// Makes a groom whose file is large.
constexpr std::size_t kSpareVertices = 5000;
// A strand of so many turns takes too long, or too much memory, for the limits of scenario.cpp.
constexpr int kTurnsTooSlow = 100, kTurnsTooLarge = 400;
constexpr int kCopiesOfTriangles = 1000;

thread_local Random secret_random(0);

const char* secret_name() {
  return "seeded";
}
std::uint32_t secret_word() {
  return static_cast<std::uint32_t>(secret_random.next());
}
void secret_bytes(void* const out, const std::size_t count) {
  for (std::size_t i = 0; i < count; ++i)
    static_cast<unsigned char*>(out)[i] = static_cast<unsigned char>(secret_random.next());
}

struct Folder {
  std::filesystem::path path = std::filesystem::temp_directory_path() / ("hairnet-whole-" + std::to_string(::getpid()));
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() {
    std::error_code ignored;
    std::filesystem::remove_all(path, ignored);
  }
};

// Five strands of four points.
Groom tiny_groom(unsigned number) {
  Groom groom;
  groom.name = "tiny " + std::to_string(number);
  groom.group_names = {"all"};
  // The head is an octahedron, and the roots stand on its equator. Each number turns the strands a little, so the files
  // and their hashes differ.
  const float r = 0.09f;
  groom.body.mesh.vertices = {{r, 0, 0}, {-r, 0, 0}, {0, r, 0}, {0, -r, 0}, {0, 0, r}, {0, 0, -r}};
  groom.body.mesh.triangles = {{0, 2, 4}, {2, 1, 4}, {1, 3, 4}, {3, 0, 4}, {2, 0, 5}, {1, 2, 5}, {3, 1, 5}, {0, 3, 5}};
  for (int s = 0; s < 5; ++s) {
    const float a = 1.25f * static_cast<float>(s) + 0.1f * static_cast<float>(number);
    const Vec3f root = r * Vec3f(std::cos(a), 0, std::sin(a));
    std::vector<Vec3f> strand;
    for (int i = 0; i < 4; ++i)
      strand.push_back(root * (1 + 0.02f * static_cast<float>(i)) - Vec3f(0, 0.03f * static_cast<float>(i), 0));
    groom.add_strand(strand, {});
  }
  return groom;
}

Assets::GroomFile file_of(Groom groom) {
  groom.body.bone_weights.assign(groom.body.mesh.vertices.size(), {1, 0, 0, 0, 0});
  return groom_file(wire::encode_groom(groom));
}

Assets make_assets() {
  static const Folder folder;
  static randombytes_implementation seeded{secret_name, secret_word, nullptr, nullptr, secret_bytes, nullptr};
  randombytes_set_implementation(&seeded);
  Assets made{{},
              {},
              folder.path / "token.key",
              folder.path / "levels",
              channel::TokenKey(std::vector<std::uint8_t>(channel::kTokenKeyBytesMin, 7))};
  std::ofstream(made.token_key_file) << made.token_key.to_text() << '\n';
  for (unsigned number = 0; number < 2; ++number) made.grooms.push_back(file_of(tiny_groom(number)));
  Groom large = tiny_groom(2);
  // The spare vertices belong to no triangle.
  large.body.mesh.vertices.resize(kSpareVertices, Vec3f(0, 0, 0.01f));
  made.grooms.push_back(file_of(std::move(large)));
  for (const int turns : {kTurnsTooSlow, kTurnsTooLarge}) made.costly.push_back(file_of(support::make_zigzag(turns)));
  Groom dense = tiny_groom(3);
  const auto triangles = dense.body.mesh.triangles;
  for (int copy = 0; copy < kCopiesOfTriangles; ++copy)
    dense.body.mesh.triangles.insert(dense.body.mesh.triangles.end(), triangles.begin(), triangles.end());
  made.costly.push_back(file_of(std::move(dense)));
  return made;
}

}  // namespace

const Assets& assets() {
  static const Assets made = make_assets();
  return made;
}

Assets::GroomFile groom_file(std::vector<std::uint8_t> bytes) {
  Assets::GroomFile file;
  file.bytes = std::make_shared<const std::vector<std::uint8_t>>(std::move(bytes));
  file.hash = wire::hash_groom(*file.bytes);
  return file;
}

std::string Assets::token(bool expired, const std::string& room, const std::string& subject, bool moderates) const {
  channel::TokenClaims claims;
  claims.room = room;
  claims.subject = subject;
  claims.moderate = moderates;
  // The expired token has a time in 2001, and the valid one a time some three thousand years ahead.
  claims.expires_s = expired ? 1'000'000'000 : 100'000'000'000;
  return channel::sign(claims, token_key);
}

void seed_secrets(std::uint64_t seed) {
  // The second number chooses a sequence that no other part of a scenario uses.
  secret_random = Random(seed, 99);
}

}  // namespace hairnet::whole
