#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "client/view/character_buffers.hpp"
#include "client/view/drawable.hpp"
#include "client/view/egl_context.hpp"
#include "client/view/light_maps.hpp"
#include "client/view/picture_target.hpp"
#include "client/view/program.hpp"
#include "client/view/projection.hpp"

namespace hairnet::view {
namespace {

using Vec4f = Eigen::Vector4f;

constexpr float kOpticalDepthMax = 24;  // of a layer of the key light's map
constexpr std::int64_t kLargePixelsMax = 40'000'000;

// The uniform block of studio.glsl, std140.
struct Studio {
  Mat4f view_projection, light_projection;
  Vec4f eye;
  std::array<Vec4f, 3> light_direction, light_colour;
  Vec4f ambient_above, ambient_below, picture, light_map, layer_depth;
};

Vec4f with(const Vec3f& v, float w) {
  return {v.x(), v.y(), v.z(), w};
}

struct Programs {
  Program background, body, body_depth, fabric, strand, strand_depth, strand_layers, resolve;

  static Result<Programs> build() {
    Result<Program> background = Program::build("screen.vert", "background.frag");
    if (!background) return Refusal(background.error());
    Result<Program> body = Program::build("body.vert", "body.frag");
    if (!body) return Refusal(body.error());
    Result<Program> body_depth = Program::build("body_depth.vert", "depth_only.frag");
    if (!body_depth) return Refusal(body_depth.error());
    Result<Program> fabric = Program::build("fabric.vert", "fabric.frag");
    if (!fabric) return Refusal(fabric.error());
    Result<Program> strand = Program::build("strand.vert", "strand.frag");
    if (!strand) return Refusal(strand.error());
    Result<Program> strand_depth = Program::build("strand_depth.vert", "depth_only.frag");
    if (!strand_depth) return Refusal(strand_depth.error());
    Result<Program> strand_layers = Program::build("strand_depth.vert", "strand_layers.frag");
    if (!strand_layers) return Refusal(strand_layers.error());
    Result<Program> resolve = Program::build("screen.vert", "resolve.frag");
    if (!resolve) return Refusal(resolve.error());
    return Programs{std::move(*background), std::move(*body),         std::move(*body_depth),    std::move(*fabric),
                    std::move(*strand),     std::move(*strand_depth), std::move(*strand_layers), std::move(*resolve)};
  }
};

Eigen::AlignedBox3f box_of(std::span<const Vec3f> points) {
  Eigen::AlignedBox3f box;
  for (const Vec3f& p : points) {
    if (drawable(p)) box.extend(p);
  }
  return box;
}

Eigen::AlignedBox3f box_of(const DrawnCharacter& character) {
  Eigen::AlignedBox3f box = box_of(character.body_vertices).merged(box_of(character.strand_points));
  for (const DrawnSurface& surface : character.surfaces) box = box.merged(box_of(surface.points));
  return box;
}

class GlRenderer final : public Renderer {
 public:
  GlRenderer(EglContext context, const Look& look) : context_(std::move(context)), look_(look) {}
  ~GlRenderer() override { static_cast<void>(context_.make_current()); }  // for what the members own

  std::string start();
  Result<Image> draw(std::span<const DrawnCharacter> characters, const Camera& camera, int width, int height) override;

 private:
  struct Gl {
    Programs programs;
    PictureTarget target;
    LightMaps light_maps;
    CharacterBuffers buffers;
    Buffer studio;
    VertexArray nothing;  // for the one triangle over the screen
  };

  [[nodiscard]] int supersample_for(int width, int height) const;
  [[nodiscard]] Studio studio_for(const Camera& camera, const LightRig& rig,
                                  std::span<const DrawnCharacter> characters) const;
  void upload(const Studio& studio) const;
  void draw_background() const;
  void draw_character(const DrawnCharacter& character, const Camera& camera, const LightRig& rig, Studio& studio);
  void draw_light_maps(const DrawnCharacter& character, const Studio& studio) const;
  void draw_surfaces(const DrawnCharacter& character) const;
  [[nodiscard]] Image resolve() const;
  [[nodiscard]] int copies() const { return 1 + look_.follower_count; }

  EglContext context_;  // first: goes last
  Look look_;
  std::optional<Gl> gl_;
};

std::string GlRenderer::start() {
  Result<Programs> programs = Programs::build();
  if (!programs) return programs.error();
  gl_.emplace(std::move(*programs), PictureTarget{}, LightMaps{}, CharacterBuffers{}, Buffer{}, VertexArray{});
  return glGetError() == GL_NO_ERROR ? "" : "OpenGL ES cannot make what the renderer needs";
}

// The large picture is held to what a texture and a fair amount of memory take.
int GlRenderer::supersample_for(int width, int height) const {
  GLint side_max = 0;
  glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side_max);
  int n = look_.supersample;
  while (n > 1 && (std::max(width, height) * n > side_max ||
                   static_cast<std::int64_t>(width) * height * n * n > kLargePixelsMax)) {
    --n;
  }
  return n;
}

Studio GlRenderer::studio_for(const Camera& camera, const LightRig& rig,
                              std::span<const DrawnCharacter> characters) const {
  const Vec3f forward = (camera.target - camera.eye).normalized();
  float nearest = INFINITY, furthest = 0;
  for (const DrawnCharacter& character : characters) {
    const Eigen::AlignedBox3f box = box_of(character);
    if (box.isEmpty()) continue;
    const float middle = forward.dot(box.center() - camera.eye), half = 0.5f * box.diagonal().norm();
    nearest = std::min(nearest, middle - half);
    furthest = std::max(furthest, middle + half);
  }
  const float far_m = std::max(furthest * 1.01f, 0.1f);
  const float near_m = std::clamp(nearest * 0.99f, std::max(0.01f, far_m * 1e-4f), 0.99f * far_m);

  Studio studio{};
  const auto width = static_cast<float>(gl_->target.large_width());
  const auto height = static_cast<float>(gl_->target.large_height());
  studio.view_projection = perspective(camera, width / height, near_m, far_m);
  studio.light_projection = Mat4f::Identity();
  studio.eye = with(camera.eye, look_.exposure);
  for (std::size_t i = 0; i < 3; ++i) {
    studio.light_direction[i] = with(rig.towards[i], 0);
    studio.light_colour[i] = with(rig.colours[i], 0);
  }
  studio.ambient_above = with(rig.ambient_above, 0);
  studio.ambient_below = with(rig.ambient_below, 0);
  const float px_per_m = 0.5f * height / std::tan(camera.fov_deg * std::numbers::pi_v<float> / 360.0f);
  studio.picture = {width, height, px_per_m, 0};
  return studio;
}

void GlRenderer::upload(const Studio& studio) const {
  glBindBuffer(GL_UNIFORM_BUFFER, gl_->studio.name());
  glBufferData(GL_UNIFORM_BUFFER, sizeof(Studio), &studio, GL_STREAM_DRAW);
  glBindBufferBase(GL_UNIFORM_BUFFER, kStudioBinding, gl_->studio.name());
}

void GlRenderer::draw_background() const {
  gl_->target.begin_large();
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  glClearDepthf(1);
  glClear(GL_DEPTH_BUFFER_BIT);
  glDisable(GL_DEPTH_TEST);
  gl_->programs.background.use();
  gl_->programs.background.set("top", look_.background_top);
  gl_->programs.background.set("bottom", look_.background_bottom);
  glBindVertexArray(gl_->nothing.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
}

void GlRenderer::draw_character(const DrawnCharacter& character, const Camera& camera, const LightRig& rig,
                                Studio& studio) {
  const LightVolume volume(character, static_cast<float>(copies()), rig);
  const BodySurface body = make_surface(character, volume);
  const FabricMesh fabric = make_fabric(character, volume);
  StrandRibbons ribbons = make_ribbons(character, volume);
  sort_far_to_near(ribbons, camera);
  gl_->buffers.fill(body, fabric, ribbons);

  // The maps cover the hair: what the body's far parts cast on each other matters less than sharp hair.
  const Eigen::AlignedBox3f hair = ribbons.box.merged(fabric.box);
  const Eigen::AlignedBox3f box = hair.isEmpty() ? body.box : hair;
  if (box.isEmpty()) return;
  const float radius_m = std::max(0.52f * box.diagonal().norm(), 1e-3f), depth_m = 6 * radius_m;
  studio.light_projection = parallel(rig.towards[0], box.center(), radius_m, depth_m);
  studio.light_map = {depth_m, 2 * radius_m / LightMaps::kSide, 1.0f / LightMaps::kSide, kOpticalDepthMax};
  // Followers are not in the maps: their spread blurs what their strand casts.
  studio.picture[3] = std::max(1.25f / LightMaps::kSide, 0.35f * look_.follower_spread_m / radius_m);
  studio.layer_depth = Vec4f(0.03f, 0.09f, 0.25f, 2.0f) * radius_m;
  upload(studio);
  draw_light_maps(character, studio);
  draw_surfaces(character);
}

void GlRenderer::draw_light_maps(const DrawnCharacter& character, const Studio& studio) const {
  gl_->light_maps.begin_body_depth();
  gl_->programs.body_depth.use();
  gl_->buffers.draw_body();
  gl_->buffers.draw_opaque_fabric();
  gl_->light_maps.begin_first_depth();
  gl_->programs.strand_depth.use();
  gl_->buffers.draw_strand_lines();
  gl_->light_maps.begin_layers();
  gl_->programs.strand_layers.use();
  const float texel_m = studio.light_map[1];
  gl_->programs.strand_layers.set("opacity", character.strand_width_m * static_cast<float>(copies()) / texel_m);
  gl_->buffers.draw_strand_lines();
}

void GlRenderer::draw_surfaces(const DrawnCharacter& character) const {
  gl_->light_maps.bind_textures();
  gl_->target.begin_large();
  glEnable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  glDepthMask(GL_TRUE);
  gl_->programs.body.use();
  gl_->programs.body.set("skin", character.skin_colour);
  gl_->programs.body.set("hair_albedo", character.hair_colour);
  gl_->buffers.draw_body();
  gl_->programs.fabric.use();
  gl_->buffers.draw_fabric();

  glDepthMask(GL_FALSE);
  glEnable(GL_BLEND);
  glBlendFuncSeparate(GL_SRC_ALPHA, GL_ONE_MINUS_SRC_ALPHA, GL_ZERO, GL_ONE);
  gl_->programs.strand.use();
  gl_->programs.strand.set("hair", with(character.hair_colour, character.strand_width_m));
  gl_->programs.strand.set("follower_spread", look_.follower_spread_m);
  gl_->buffers.draw_ribbons(copies());
  glDepthMask(GL_TRUE);
}

Image GlRenderer::resolve() const {
  gl_->target.begin_small();
  glDisable(GL_DEPTH_TEST);
  glDisable(GL_BLEND);
  gl_->programs.resolve.use();
  gl_->programs.resolve.set("supersample", gl_->target.supersample());
  glBindVertexArray(gl_->nothing.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  return gl_->target.read_small();
}

// Characters go one after another, the furthest first, through the same buffers and light maps.
Result<Image> GlRenderer::draw(std::span<const DrawnCharacter> characters, const Camera& camera, int width,
                               int height) {
  if (width < 1 || height < 1 || width > kPictureSideMax || height > kPictureSideMax) {
    return Refusal("picture of " + std::to_string(width) + " x " + std::to_string(height) +
                   " pixels: sides must be 1 … " + std::to_string(kPictureSideMax));
  }
  for (std::size_t i = 0; i < characters.size(); ++i) {
    const std::string fault = validate(characters[i]);
    if (!fault.empty()) return Refusal("character " + std::to_string(i) + ": " + fault);
  }
  if (!context_.make_current()) return Refusal("EGL context cannot be made current");
  if (!gl_->target.resize(width, height, supersample_for(width, height))) {
    return Refusal("OpenGL ES has no room for a picture of " + std::to_string(width) + " x " + std::to_string(height) +
                   " pixels");
  }
  const Camera view = mended(camera);
  const LightRig rig = studio_lights(view);
  Studio studio = studio_for(view, rig, characters);
  upload(studio);
  draw_background();

  std::vector<std::pair<float, std::size_t>> by_distance;
  for (std::size_t i = 0; i < characters.size(); ++i) {
    const Eigen::AlignedBox3f box = box_of(characters[i]);
    if (!box.isEmpty()) by_distance.emplace_back(-(box.center() - view.eye).norm(), i);
  }
  std::sort(by_distance.begin(), by_distance.end());
  for (const auto& [distance, i] : by_distance) draw_character(characters[i], view, rig, studio);
  Image image = resolve();
  if (glGetError() != GL_NO_ERROR) return Refusal("OpenGL ES ran out of memory or failed while drawing");
  return image;
}

std::string fault_of(const Look& look) {
  if (look.follower_count < 0 || look.follower_count > 15) return "follower_count is not in 0 … 15";
  if (!(look.follower_spread_m >= 0.0f && look.follower_spread_m <= 0.1f)) return "follower_spread_m is not in 0 … 0.1";
  if (look.supersample < 1 || look.supersample > 4) return "supersample is not in 1 … 4";
  if (!(look.exposure > 0.0f && look.exposure <= 100.0f)) return "exposure is not in 0 … 100";
  if (!look.background_top.allFinite() || !look.background_bottom.allFinite()) return "background is not finite";
  return "";
}

}  // namespace

Result<std::unique_ptr<Renderer>> Renderer::create(const Look& look) {
  if (const std::string fault = fault_of(look); !fault.empty()) return Refusal("look: " + fault);
  Result<EglContext> context = EglContext::create();
  if (!context) return Refusal(context.error());
  auto renderer = std::make_unique<GlRenderer>(std::move(*context), look);
  if (const std::string fault = renderer->start(); !fault.empty()) return Refusal(fault);
  return renderer;
}

}  // namespace hairnet::view
