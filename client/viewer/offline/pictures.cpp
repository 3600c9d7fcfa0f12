#include "client/viewer/offline/pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <utility>

#include "client/assets/upright.hpp"
#include "client/files/write_file.hpp"
#include "client/render/renderer.hpp"
#include "client/tools/command_line/progress_bar.hpp"
#include "client/viewer/characters/hair_colour.hpp"
#include "client/viewer/drawing/framing.hpp"
#include "client/viewer/drawing/render_list.hpp"

namespace hairnet::viewer {
namespace {

// The same as the window's (OrbitCamera::kFov_deg), so that both show hair alike.
constexpr float kFieldOfView_deg = 26;
// The camera stands this much farther away than the framed sphere needs, as in the window (kFrameMargin in
// orbit_camera.cpp).
constexpr double kMargin = 1.12;
// Head and neck, from below to above, head space, m: they are framed even for short hair.
constexpr std::array<float, 2> kHeadSpan_y{-0.20f, 0.22f};

// The sphere to frame: a groom at rest, with the head, at least 14 cm to each side, and strands as far as they hang.
// Head space, m.
struct Framing {
  explicit Framing(const Groom& groom) {
    float low = kHeadSpan_y[0], high = kHeadSpan_y[1], wide = 0.14f;
    for (const Vec3f& p : groom.points) {
      low = std::min(low, p.y());
      high = std::max(high, p.y());
      wide = std::max(wide, std::hypot(p.x(), p.z()));
    }
    centre_y = static_cast<double>(low + high) / 2;
    radius = static_cast<double>(std::max((high - low) / 2, wide));
  }
  double centre_y, radius;
};

// The camera is fixed to the world, at the heading with which the clip begins, and follows the head's place. So the
// head's turns and the hair's swing are visible, which a camera that turned with the head would hide.
draw::Camera camera_of(const Pose& beginning, const Framing& framing, const Pose& pose, View view) {
  const Quat heading = upright(beginning).head().rotation;
  const Vec3 direction = (heading * direction_of(view)).normalized();
  draw::Camera camera;
  camera.fov_deg = kFieldOfView_deg;
  camera.target = pose.head().position + Vec3(0, framing.centre_y, 0);
  const double half_angle = kFieldOfView_deg / 2 * std::numbers::pi / 180;
  // The sphere touches the view's edge at the sine of the half angle.
  camera.eye = camera.target + direction * (kMargin * framing.radius / std::sin(half_angle));
  return camera;
}

// The subject of a picture: an own character, or another one of the room. Each gets pictures of its own.
struct Sitter {
  const Groom* groom = nullptr;
  Vec3f hair_colour = Vec3f::Zero();
  // The colours of hair and skin, in place of hair_colour; none: hair_colour and the default skin.
  std::optional<wire::Appearance> appearance;
  // The pose at which the clip begins, or, for others, when they were first seen.
  Pose beginning;
  // One entry for each time; null: the subject was not seen then.
  std::vector<const Moment*> moments;
};

std::vector<Sitter> sitters_of(const std::vector<CharacterSetup>& characters, const StreamResult& streamed) {
  std::vector<Sitter> sitters;
  for (std::size_t c = 0; c < characters.size(); ++c) {
    Sitter& one = sitters.emplace_back(
        // Own characters have a moment at each time: a stream that ended early makes no pictures.
        Sitter{characters[c].groom.get(), characters[c].hair_colour, {}, characters[c].motion.poses.front(), {}});
    for (const std::vector<Moment>& moment : streamed.moments) one.moments.push_back(&moment[c]);
  }
  for (const SeenCharacter& other : streamed.others) {
    Sitter& one = sitters.emplace_back(
        Sitter{other.groom.get(), default_hair_colour(other.member->number - 1), other.member->appearance, {}, {}});
    for (const std::optional<Moment>& moment : other.moments) one.moments.push_back(moment ? &*moment : nullptr);
    // Only characters with at least one moment are in the stream's result.
    const auto first = std::find_if(one.moments.begin(), one.moments.end(), [](const Moment* m) { return m; });
    one.beginning = (*first)->pose;
  }
  return sitters;
}

Result<void> write_png(const std::string& path, const render::Image& image) {
  const Result<std::vector<std::uint8_t>> png = render::encode_png(image);
  if (!png) return Refusal(path + ": " + png.error());
  const Result<void> written = write_file(path, std::as_bytes(std::span(*png)));
  if (!written) return Refusal(path + ": " + written.error());
  return {};
}

class RenderedPictures : public Pictures {
 public:
  explicit RenderedPictures(std::unique_ptr<render::Renderer> renderer) : renderer_(std::move(renderer)) {}

  Result<void> write(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                     const StreamResult& streamed) override {
    ProgressBar bar("hairnet-view");
    const std::vector<Sitter> sitters = sitters_of(characters, streamed);
    if (sitters.empty()) return Refusal("no character was seen");
    // Rows are characters and views, columns are times: so a row shows one subject over time.
    if (!options.sheet.empty()) {
      if (const Result<void> done = write_sheet(options, sitters, bar); !done) return done;
    }
    return options.out.empty() ? Result<void>() : write_last(options, sitters, bar);
  }

 private:
  Result<void> write_sheet(const ViewOptions& options, const std::vector<Sitter>& sitters, ProgressBar& bar) {
    std::vector<render::Image> tiles;
    const std::size_t count = sitters.size() * options.views.size() * options.times_s.size();
    for (const Sitter& sitter : sitters) {
      for (const View view : options.views) {
        for (std::size_t t = 0; t < options.times_s.size(); ++t) {
          bar.show(static_cast<double>(tiles.size()) / static_cast<double>(count), "drawing");
          Result<render::Image> tile = draw(options, sitter, sitter.moments[t], view);
          if (!tile) return Refusal(tile.error());
          char caption[32];
          std::snprintf(caption, sizeof caption, "%.2f s", options.times_s[t]);
          render::draw_text(*tile, 8, 8, caption);
          tiles.push_back(std::move(*tile));
        }
      }
    }
    return write_png(options.sheet, render::contact_sheet(tiles, static_cast<int>(options.times_s.size())));
  }

  Result<void> write_last(const ViewOptions& options, const std::vector<Sitter>& sitters, ProgressBar& bar) {
    std::vector<render::Image> tiles;
    // Here columns are characters, so that people stand side by side.
    for (const View view : options.views) {
      for (const Sitter& sitter : sitters) {
        const std::size_t count = options.views.size() * sitters.size();
        bar.show(static_cast<double>(tiles.size()) / static_cast<double>(count), "drawing");
        Result<render::Image> tile = draw(options, sitter, sitter.moments.back(), view);
        if (!tile) return Refusal(tile.error());
        tiles.push_back(std::move(*tile));
      }
    }
    return write_png(options.out, render::contact_sheet(tiles, static_cast<int>(sitters.size())));
  }

  // Draws one subject at one moment, and the empty studio if there is none: the sheet keeps its columns.
  Result<render::Image> draw(const ViewOptions& options, const Sitter& sitter, const Moment* moment, View view) {
    const Groom& groom = *sitter.groom;
    if (!moment) {
      return renderer_->draw({}, camera_of(sitter.beginning, Framing(groom), sitter.beginning, view), {}, options.width,
                             options.height);
    }
    // Grooms stay uploaded, since most subjects have several tiles.
    const auto [place, is_new] = grooms_.try_emplace(&groom);
    OnStage& on_stage = place->second;
    if (is_new) on_stage.number = renderer_->stage().add_groom(groom);
    if (moment->skin && !on_stage.skin) {
      on_stage.skin = moment->skin;
      renderer_->stage().set_skin(on_stage.number, SkinPush(*moment->skin, groom.materials.base.thickness_m));
    }
    draw::ShownCharacter shown;
    shown.groom = on_stage.number;
    shown.pose = moment->pose;
    shown.lattice = moment->lattice();
    shown.hair_colour = sitter.hair_colour;
    if (sitter.appearance) apply_appearance(*sitter.appearance, shown);
    return renderer_->draw(std::span(&shown, 1), camera_of(sitter.beginning, Framing(groom), moment->pose, view), {},
                           options.width, options.height);
  }

  std::unique_ptr<render::Renderer> renderer_;
  struct OnStage {
    std::size_t number = 0;
    // The skin that the stage has for the groom; null: none yet.
    std::shared_ptr<const Skin> skin;
  };
  std::map<const Groom*, OnStage> grooms_;
};

}  // namespace

Result<std::unique_ptr<Pictures>> make_pictures() {
  Result<std::unique_ptr<render::Renderer>> renderer = render::Renderer::create();
  if (!renderer) return Refusal(renderer.error());
  return std::make_unique<RenderedPictures>(std::move(*renderer));
}

}  // namespace hairnet::viewer
