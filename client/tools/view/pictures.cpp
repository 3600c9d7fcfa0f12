#include "client/tools/view/pictures.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <map>
#include <numbers>
#include <optional>
#include <utility>

#include "client/link/switch_blend.hpp"
#include "client/tools/clip/upright.hpp"
#include "client/tools/files/write_file.hpp"
#include "client/tools/progress/progress_bar.hpp"
#include "client/tools/view/hair_colour.hpp"
#include "client/view/renderer.hpp"
#include "core/ffd/cluster_strands.hpp"
#include "core/ffd/deform.hpp"

namespace hairnet::viewer {
namespace {

constexpr float kFieldOfView_deg = 26;
constexpr float kMargin = 1.12f;  // of the framed sphere
// What is framed at least: head and neck, head space.
constexpr std::array<float, 2> kHeadSpan_y{-0.20f, 0.22f};

// Where a view looks from, before the character's heading turns it.
Vec3f direction_of(View view) {
  switch (view) {
    case View::front:
      return {0, 0.05f, 1};
    case View::side:
      return {1, 0.05f, 0};
    case View::back:
      return {0, 0.05f, -1};
    case View::three_quarter:
      return {0.64f, 0.12f, 0.77f};
  }
  return Vec3f::UnitZ();
}

// Centre and radius, head space, of what is to be seen of a groom at rest: the head and, as far as they hang, strands.
struct Framing {
  explicit Framing(const Groom& groom) {
    float low = kHeadSpan_y[0], high = kHeadSpan_y[1], wide = 0.14f;
    for (const Vec3f& p : groom.points) {
      low = std::min(low, p.y());
      high = std::max(high, p.y());
      wide = std::max(wide, std::hypot(p.x(), p.z()));
    }
    centre_y = (low + high) / 2;
    radius = std::max((high - low) / 2, wide);
  }
  float centre_y, radius;
};

// The camera keeps to the world, turned once to the heading that the clip begins with, and follows the head's place, so
// that the head's turns and the hair's swing are seen.
view::Camera camera_of(const Pose& beginning, const Framing& framing, const Pose& pose, View view) {
  const Quat heading = upright(beginning).head().rotation;
  const Vec3f direction = (heading * direction_of(view).cast<double>()).normalized().cast<float>();
  view::Camera camera;
  camera.fov_deg = kFieldOfView_deg;
  camera.target = pose.head().position.cast<float>() + Vec3f(0, framing.centre_y, 0);
  const float half_angle = kFieldOfView_deg / 2 * std::numbers::pi_v<float> / 180;
  camera.eye = camera.target + direction * (kMargin * framing.radius / std::sin(half_angle));
  return camera;
}

// Fewer strands are drawn wider, so that a head looks covered at any density.
float strand_width_m(std::size_t drawn_strand_count) {
  constexpr float kWidth_m = 4e-4f, kCount = 10'000;
  return kWidth_m *
         std::clamp(std::sqrt(kCount / static_cast<float>(std::max<std::size_t>(1, drawn_strand_count))), 0.6f, 4.0f);
}

// `points` are the groom's, deformed.
std::vector<view::DrawnSurface> surfaces_of(const Groom& groom, std::span<const Vec3f> points) {
  using Kind = view::DrawnSurface::Kind;
  std::vector<view::DrawnSurface> surfaces;
  const auto own = [&](const PointRange& range) { return points.subspan(range.begin, range.count()); };
  for (const Thread& t : groom.threads)
    surfaces.push_back({.kind = Kind::thread, .points = own(t.points), .colour = t.colour, .radius_m = t.radius_m});
  for (const Strip& s : groom.strips) surfaces.push_back({.kind = Kind::strip, .points = own(s.points)});
  for (const Cloth& c : groom.cloths)
    surfaces.push_back({.kind = Kind::cloth,
                        .points = own(c.points),
                        .triangles = c.triangles,
                        .first_index = c.points.begin,
                        .colour = c.colour,
                        .opacity = c.opacity});
  return surfaces;
}

// Whom to draw: one of the cast, or another of the room.
struct Subject {
  const Groom* groom = nullptr;
  Vec3f hair_colour = Vec3f::Zero();
  Pose beginning;                      // where the clip begins, or where it was seen first
  std::vector<const Moment*> moments;  // [time]; null: not seen
};

std::vector<Subject> subjects_of(const std::vector<Actor>& cast, const StreamResult& streamed) {
  std::vector<Subject> subjects;
  for (std::size_t c = 0; c < cast.size(); ++c) {
    Subject& one =
        subjects.emplace_back(Subject{cast[c].groom.get(), cast[c].hair_colour, cast[c].motion.poses.front(), {}});
    for (const std::vector<Moment>& moment : streamed.moments) one.moments.push_back(&moment[c]);
  }
  for (const SeenCharacter& other : streamed.others) {
    Subject& one = subjects.emplace_back(Subject{other.groom.get(), default_hair_colour(subjects.size()), {}, {}});
    for (const std::optional<Moment>& moment : other.moments) one.moments.push_back(moment ? &*moment : nullptr);
    const auto first = std::find_if(one.moments.begin(), one.moments.end(), [](const Moment* m) { return m; });
    one.beginning = (*first)->pose;
  }
  return subjects;
}

Result<void> write_png(const std::string& path, const view::Image& image) {
  const Result<std::vector<std::uint8_t>> png = view::encode_png(image);
  if (!png) return Refusal(path + ": " + png.error());
  const Result<void> written = write_file(path, std::as_bytes(std::span(*png)));
  if (!written) return Refusal(path + ": " + written.error());
  return {};
}

class RenderedPictures : public Pictures {
 public:
  explicit RenderedPictures(std::unique_ptr<view::Renderer> renderer) : renderer_(std::move(renderer)) {}

  Result<void> write(const ViewOptions& options, const std::vector<Actor>& cast,
                     const StreamResult& streamed) override {
    ProgressBar bar("hairnet-view");
    const std::vector<Subject> subjects = subjects_of(cast, streamed);
    if (subjects.empty()) return Refusal("nobody was seen");
    if (!options.sheet.empty()) {
      if (const Result<void> done = write_sheet(options, subjects, bar); !done) return done;
    }
    return options.out.empty() ? Result<void>() : write_last(options, subjects, bar);
  }

 private:
  Result<void> write_sheet(const ViewOptions& options, const std::vector<Subject>& subjects, ProgressBar& bar) {
    std::vector<view::Image> tiles;
    const std::size_t count = subjects.size() * options.views.size() * options.times_s.size();
    for (const Subject& subject : subjects) {
      for (const View view : options.views) {
        for (std::size_t t = 0; t < options.times_s.size(); ++t) {
          bar.show(static_cast<double>(tiles.size()) / static_cast<double>(count), "drawing");
          Result<view::Image> tile = draw(options, subject, subject.moments[t], view);
          if (!tile) return Refusal(tile.error());
          char caption[32];
          std::snprintf(caption, sizeof caption, "%.2f s", options.times_s[t]);
          view::draw_text(*tile, 8, 8, caption);
          tiles.push_back(std::move(*tile));
        }
      }
    }
    return write_png(options.sheet, view::contact_sheet(tiles, static_cast<int>(options.times_s.size())));
  }

  Result<void> write_last(const ViewOptions& options, const std::vector<Subject>& subjects, ProgressBar& bar) {
    std::vector<view::Image> tiles;
    for (const View view : options.views) {
      for (const Subject& subject : subjects) {
        const std::size_t count = options.views.size() * subjects.size();
        bar.show(static_cast<double>(tiles.size()) / static_cast<double>(count), "drawing");
        Result<view::Image> tile = draw(options, subject, subject.moments.back(), view);
        if (!tile) return Refusal(tile.error());
        tiles.push_back(std::move(*tile));
      }
    }
    return write_png(options.out, view::contact_sheet(tiles, static_cast<int>(subjects.size())));
  }

  // The empty studio where there is no moment.
  Result<view::Image> draw(const ViewOptions& options, const Subject& subject, const Moment* moment, View view) {
    const Groom& groom = *subject.groom;
    if (!moment) {
      return renderer_->draw({}, camera_of(subject.beginning, Framing(groom), subject.beginning, view), options.width,
                             options.height);
    }
    deform(groom, *moment);
    skin(groom.body, moment->pose, body_vertices_);
    view::DrawnCharacter drawn;
    drawn.body_vertices = body_vertices_;
    drawn.triangles = &groom.body.mesh.triangles;
    drawn.strand_points = strand_points_;
    drawn.strand_begin = clusters_->strand_begin();
    drawn.strand_width_m = strand_width_m(drawn.strand_begin.size() - 1);
    const std::vector<view::DrawnSurface> surfaces = surfaces_of(groom, points_);
    drawn.surfaces = surfaces;
    drawn.hair_colour = subject.hair_colour;
    return renderer_->draw(std::span(&drawn, 1), camera_of(subject.beginning, Framing(groom), moment->pose, view),
                           options.width, options.height);
  }

  // The moment's points in world space: the groom's, and those of the strands that are drawn.
  void deform(const Groom& groom, const Moment& moment) {
    link::SwitchBlend blend;
    const auto apply = [&](const Shape& shape) {
      deform(groom, shape);
      blend.apply(shape.level, shape.time_ns, false, points_);
    };
    for (const Shape& shape : moment.trail) apply(shape);
    apply(moment.shape);
    clusters_.emplace(groom);
    strand_points_.resize(clusters_->point_count());
    clusters_->follow(points_, strand_points_);
    for (auto* points : {&points_, &strand_points_}) {
      for (Vec3f& p : *points) p = moment.pose.head().point(p.cast<double>()).cast<float>();
    }
  }

  // The groom's points in head space.
  void deform(const Groom& groom, const Shape& shape) {
    points_ = groom.points;
    if (shape.displacement.empty()) return;
    const LevelGeometry& geometry = *shape.geometry;
    const auto [deformer, is_new] = deformers_.try_emplace({&groom, shape.geometry}, nullptr);
    if (is_new) deformer->second = std::make_unique<Deformer>(groom, geometry.lattice, FfdKind::quadratic);
    grid_.resize(geometry.lattice.node_count());
    expand_displacements(geometry, shape.displacement, grid_);
    deformer->second->deform(grid_, points_);
  }

  std::unique_ptr<view::Renderer> renderer_;
  std::map<std::pair<const Groom*, std::shared_ptr<const LevelGeometry>>, std::unique_ptr<Deformer>> deformers_;
  std::optional<ClusterStrands> clusters_;  // of the groom drawn last
  std::vector<Vec3f> points_, strand_points_, body_vertices_, grid_;
};

}  // namespace

Result<std::unique_ptr<Pictures>> make_pictures() {
  Result<std::unique_ptr<view::Renderer>> renderer = view::Renderer::create();
  if (!renderer) return Refusal(renderer.error());
  return std::make_unique<RenderedPictures>(std::move(*renderer));
}

}  // namespace hairnet::viewer
