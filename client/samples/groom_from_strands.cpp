// Makes a hairstyle of this program's own strands, a fringe of short straight hair, and writes its file, which a room
// or hairnet-view takes.
//   groom_from_strands [FILE.groom]
#include <cmath>
#include <cstdio>

#include "client/assets/made/made.hpp"
#include "schema/wire/groom_file.hpp"

using namespace hairnet;

int main(int argc, char** argv) {
  Groom groom;
  groom.name = "fringe";
  groom.group_names = {"fringe"};
  groom.body = make_bust();
  constexpr int kStrands = 400, kPoints = 12;
  constexpr float kLength_m = 0.12f;
  for (int s = 0; s < kStrands; ++s) {
    // Roots on an arc over the forehead; each strand goes out a little, and then down.
    const float angle = 1.6f * (static_cast<float>(s) / (kStrands - 1) - 0.5f);
    const Vec3f out(std::sin(angle), 0.3f, std::cos(angle));
    const Vec3f root = Vec3f(0, 0.08f, 0) + 0.09f * out;
    std::vector<Vec3f> strand;
    for (int p = 0; p < kPoints; ++p) {
      const float along = static_cast<float>(p) / (kPoints - 1);
      strand.push_back(root + kLength_m * along * (0.25f * out - along * Vec3f::UnitY()));
    }
    // Each strand stands for 25 hairs, which give it their mass, stiffness and drag.
    groom.add_strand(strand, {.hair_count = 25});
  }
  if (const std::string error = validate(groom); !error.empty()) return std::fprintf(stderr, "%s\n", error.c_str()), 1;
  const std::vector<std::uint8_t> bytes = wire::encode_groom(groom);
  const char* name = argc > 1 ? argv[1] : "fringe.groom";
  std::FILE* file = std::fopen(name, "wb");
  if (file == nullptr) return std::perror(name), 1;
  std::fwrite(bytes.data(), 1, bytes.size(), file);
  std::fclose(file);
  std::printf("%s: %zu strands, %zu bytes\n", name, groom.strand_count(), bytes.size());
}
