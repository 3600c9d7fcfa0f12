#include "tests/gallery/sheets.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "client/draw/groom_geometry.hpp"
#include "client/files/write_file.hpp"

namespace hairnet::gallery {
namespace {

void caption(render::Image& image, const std::string& text) {
  render::draw_text(image, 6, 6, text, 2);
}

}  // namespace

draw::Camera camera_about(const Vec3& head, const Groom& groom, double bearing_deg, double distance_scale) {
  // The picture shows at least a bald head: from the head's joint up to 12 cm above it, and 10 cm about it.
  float low = 0, high = 0.12f, wide = 0.1f;
  for (const Vec3f& p : groom.points) {
    low = std::min(low, p.y());
    high = std::max(high, p.y());
    wide = std::max(wide, std::hypot(p.x(), p.z()));
  }
  const double centre = 0.5 * static_cast<double>(low + high);
  const double radius = std::max(0.5 * static_cast<double>(high - low), static_cast<double>(wide));
  const double bearing = bearing_deg * std::numbers::pi / 180;
  draw::Camera camera;
  camera.fov_deg = 24;
  camera.target = head + Vec3(0, centre, 0);
  // A ball of this radius fills half of the field of view (12 degrees of 24) and has 20 % of space around it. The
  // camera is a little above the middle of the hair.
  camera.eye = camera.target + distance_scale * 1.2 * radius / std::sin(12 * std::numbers::pi / 180) *
                                   Vec3(std::sin(bearing), 0.08, std::cos(bearing)).normalized();
  return camera;
}

Result<void> write_picture(const std::string& path, const render::Image& image) {
  const Result<std::vector<std::uint8_t>> png = render::encode_png(image);
  if (!png) return Refusal(path + ": " + png.error());
  const Result<void> written = write_file(path, std::as_bytes(std::span(*png)));
  return written ? Result<void>() : Refusal(path + ": " + written.error());
}

Result<render::Image> hairstyle_sheet(render::Renderer& renderer, const Hairstyle& style, std::size_t number,
                                      int size_px) {
  // The first time is at rest, before the motion.
  const auto moments = simulate_motion(style, "made:dance", LevelIndex::high, {-0.5, 1.6, 2.6});
  if (!moments) return Refusal(moments.error());
  const std::size_t groom = renderer.stage().add_groom(*style.groom);
  std::vector<render::Image> tiles;
  for (const Moment& moment : *moments) {
    for (const double bearing : {0.0, 90.0, 180.0}) {
      draw::ShownCharacter character = shown(groom, moment);
      character.hair_colour = hair_colour(number);
      const draw::Camera camera = camera_about(moment.pose.head().position, *style.groom, bearing);
      Result<render::Image> tile = renderer.draw({&character, 1}, camera, {}, size_px, size_px * 5 / 4);
      if (!tile) return tile;
      caption(*tile, style.name + (&moment == &moments->front() ? " still" : " moving"));
      tiles.push_back(std::move(*tile));
    }
  }
  renderer.stage().remove_groom(groom);
  return render::contact_sheet(tiles, 6);
}

Result<render::Image> detail_sheet(render::Renderer& renderer, const Hairstyle& style, int size_px) {
  const auto moments = simulate_motion(style, "made:dance", LevelIndex::high, {2.0});
  if (!moments) return Refusal(moments.error());
  const std::size_t groom = renderer.stage().add_groom(*style.groom);
  std::vector<render::Image> tiles;
  // Each distance is about twice the one before, from a portrait to a head of a few pixels.
  for (const double scale : {0.6, 1.0, 2.0, 4.0, 8.0, 16.0}) {
    draw::ShownCharacter character = shown(groom, moments->front());
    const draw::Camera camera = camera_about(character.pose.head().position, *style.groom, 30, scale);
    Result<render::Image> tile = renderer.draw({&character, 1}, camera, {}, size_px, size_px * 5 / 4);
    if (!tile) return tile;
    const render::StageStatistics& s = renderer.stage().statistics();
    caption(*tile, std::to_string(s.strands) + " strands");
    tiles.push_back(std::move(*tile));
    // The second tile shows the same detail from nearby, so that one sees which strands are left. `head_px` is the
    // height of the head in the first tile; 12 degrees are half of the field of view.
    draw::Camera near = camera_about(character.pose.head().position, *style.groom, 30, 1);
    const double distance = (camera.eye - camera.target).norm();
    const float head_px = draw::kHead_m * 0.5f * static_cast<float>(size_px * 5 / 4) /
                          std::tan(12 * std::numbers::pi_v<float> / 180) / static_cast<float>(distance);
    character.detail = draw::detail_for(head_px, 1, style.groom->strand_count());
    Result<render::Image> close = renderer.draw({&character, 1}, near, {}, size_px, size_px * 5 / 4);
    if (!close) return close;
    caption(*close, "as drawn at " + std::to_string(static_cast<int>(head_px)) + " px");
    tiles.push_back(std::move(*close));
  }
  renderer.stage().remove_groom(groom);
  // The first row has the tiles from each distance, the second row those from nearby.
  std::vector<render::Image> rows;
  for (std::size_t row = 0; row < 2; ++row) {
    for (std::size_t i = row; i < tiles.size(); i += 2) rows.push_back(std::move(tiles[i]));
  }
  return render::contact_sheet(rows, 6);
}

Result<render::Image> wind_sheet(render::Renderer& renderer, const Hairstyle& style, int size_px) {
  Wind wind;
  // A fresh breeze from the side, with gusts. The first time is before it acts on the hair for long.
  wind.mean_m_per_s = Vec3(-5, 0, 2);
  wind.gust_ratio = 0.5;
  wind.turbulence_rms_m_per_s = 1;
  Environment environment;
  environment.wind = WindField(wind);
  const auto moments = simulate_motion(style, "made:still", LevelIndex::high, {-0.9, 0.5, 1.5, 2.5, 3.5}, environment);
  if (!moments) return Refusal(moments.error());
  const std::size_t groom = renderer.stage().add_groom(*style.groom);
  std::vector<render::Image> tiles;
  for (const Moment& moment : *moments) {
    draw::ShownCharacter character = shown(groom, moment);
    const draw::Camera camera = camera_about(moment.pose.head().position, *style.groom, 15);
    Result<render::Image> tile = renderer.draw({&character, 1}, camera, {}, size_px, size_px * 5 / 4);
    if (!tile) return tile;
    tiles.push_back(std::move(*tile));
  }
  renderer.stage().remove_groom(groom);
  return render::contact_sheet(tiles, static_cast<int>(tiles.size()));
}

Result<render::Image> crowd_picture(render::Renderer& renderer, const std::vector<Hairstyle>& styles, std::size_t count,
                                    int width_px, int height_px, render::StageStatistics& statistics) {
  static const std::vector<std::string> kMotions{"made:dance", "made:nod", "made:shake", "made:look_around",
                                                 "made:lean"};
  std::vector<std::size_t> grooms;
  std::vector<Moment> moments;
  for (std::size_t s = 0; s < styles.size(); ++s) {
    grooms.push_back(renderer.stage().add_groom(*styles[s].groom));
    auto taken =
        simulate_motion(styles[s], kMotions[s % kMotions.size()], LevelIndex::medium, {0.6, 1.1, 1.7, 2.2, 2.6});
    if (!taken) return Refusal(taken.error());
    for (Moment& moment : *taken) moments.push_back(std::move(moment));
  }
  std::vector<draw::ShownCharacter> crowd;
  const std::size_t columns = 10;
  for (std::size_t i = 0; i < count; ++i) {
    // The factors mix hairstyles, times and colours, so that neighbours differ.
    const std::size_t style = (i * 7 + i / columns) % styles.size(), moment = i * 3 % 5;
    crowd.push_back(shown(grooms[style], moments[5 * style + moment]));
    crowd.back().hair_colour = hair_colour(i * 5 + i / 7);
    const double row = static_cast<double>(i / columns);
    // Heads stand 62 cm apart in rows of ten, every second row shifted by half of that. Each row is 90 cm behind and 10
    // cm above the one before.
    const Vec3 away((static_cast<double>(i % columns) - 4.75 + 0.5 * std::fmod(row, 2)) * 0.62, 0.10 * row, -0.9 * row);
    for (RigidTransform& bone : crowd.back().pose.bones) {
      bone.position += away;
    }
  }
  Vec3 middle = Vec3::Zero();
  for (const draw::ShownCharacter& one : crowd) middle += one.pose.head().position / static_cast<double>(count);
  draw::Camera camera;
  // The camera looks from above and in front at all rows.
  camera.target = middle - Vec3(0, 0.3, 1.5);
  camera.eye = middle + Vec3(0, 2.1, 7.4);
  camera.fov_deg = 36;
  Result<render::Image> image = renderer.draw(crowd, camera, {}, width_px, height_px);
  statistics = renderer.stage().statistics();
  for (const std::size_t groom : grooms) renderer.stage().remove_groom(groom);
  return image;
}

}  // namespace hairnet::gallery
