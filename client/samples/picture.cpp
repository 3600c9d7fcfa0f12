// Draws hair without a GPU: a picture of a made hairstyle at rest, as points in a grey image that any viewer opens.
//   picture [FILE.pgm]
#include <cstdio>

#include "client/assets/made/made.hpp"
#include "client/draw/hair_points.hpp"

using namespace hairnet;

int main(int argc, char** argv) {
  constexpr int kSide_px = 512;
  // The picture shows this width.
  constexpr float kWidth_m = 0.7f;
  const auto groom = std::make_shared<const Groom>(*make_hairstyle("long_curly"));
  // There is no lattice and no skin: the hair hangs as it was made.
  draw::HairPoints hair(groom, nullptr, nullptr);
  std::vector<Vec3f> points(groom->points.size()), tangents(points.size());
  hair.place(rigid_pose({Quat(Eigen::AngleAxisd(0.4, Vec3::UnitY())), Vec3::Zero()}), {}, points, tangents);

  std::vector<unsigned char> picture(std::size_t{kSide_px} * kSide_px, 24);
  for (std::size_t i = 0; i < points.size(); ++i) {
    const int x = static_cast<int>(kSide_px * (0.5f + points[i].x() / kWidth_m));
    const int y = static_cast<int>(kSide_px * (0.35f - points[i].y() / kWidth_m));
    if (x < 0 || y < 0 || x >= kSide_px || y >= kSide_px) continue;
    unsigned char& pixel = picture[static_cast<std::size_t>(y * kSide_px + x)];
    // Hair shines where it runs across the light, which comes from above.
    const float shine = 1 - std::abs(tangents[i].normalized().y());
    pixel = static_cast<unsigned char>(std::min(255.0f, static_cast<float>(pixel) + 8 + 24 * shine));
  }
  const char* name = argc > 1 ? argv[1] : "hair.pgm";
  std::FILE* file = std::fopen(name, "wb");
  if (file == nullptr) return std::perror(name), 1;
  std::fprintf(file, "P5 %d %d 255\n", kSide_px, kSide_px);
  std::fwrite(picture.data(), 1, picture.size(), file);
  std::fclose(file);
}
