#include "client/render/stage.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "client/draw/character_records.hpp"
#include "client/draw/light_rig.hpp"
#include "client/render/groom_buffers.hpp"
#include "client/render/hair_density_pass.hpp"
#include "client/render/lattice_pass.hpp"
#include "client/render/projection.hpp"
#include "client/render/shader_program.hpp"
#include "client/render/strand_deform_pass.hpp"
#include "client/render/vector_texture.hpp"

namespace hairnet::render {
namespace {

// Characters farther from the camera are left out: nothing of a head is seen there, and a damaged position would spoil
// the depth range of the picture.
constexpr double kCoordinateMax_m = 1e4;
// The near plane is never closer to the camera: the precision of depths far away falls with it.
constexpr float kNearMin_m = 0.01f;
// The size of the texture with the hairs of a card. Its smaller levels (mipmaps) keep far cards smooth.
constexpr int kCardTextureWidth = 1024, kCardTextureHeight = 512;

struct Programs {
  Program background, body, fabric, card, strand;
  LatticePass lattices;
  StrandDeformPass placement;
  HairDensityPass density;

  static Result<Programs> build() {
    auto programs = build_programs({{"screen.vert", "background.frag"},
                                    {"body.vert", "body.frag"},
                                    {"fabric.vert", "fabric.frag"},
                                    {"card.vert", "card.frag"},
                                    {"strand.vert", "strand.frag"}});
    if (!programs) return Refusal(programs.error());
    auto& [background, body, fabric, card, strand] = *programs;
    Result<LatticePass> lattices = LatticePass::build();
    if (!lattices) return Refusal(lattices.error());
    Result<StrandDeformPass> placement = StrandDeformPass::build();
    if (!placement) return Refusal(placement.error());
    Result<HairDensityPass> density = HairDensityPass::build();
    if (!density) return Refusal(density.error());
    return Programs{std::move(background), std::move(body),      std::move(fabric),     std::move(card),
                    std::move(strand),     std::move(*lattices), std::move(*placement), std::move(*density)};
  }
};

// Draws the texture of cards once: it is the same for all grooms, and no file must be shipped.
Result<void> make_card_texture(const Texture& texture) {
  const Result<Program> program = Program::build("screen.vert", "card_texture.frag");
  if (!program) return Refusal(program.error());
  GLint before = 0;
  glGetIntegerv(GL_FRAMEBUFFER_BINDING, &before);
  glActiveTexture(GL_TEXTURE0 + kCardTextureUnit);
  glBindTexture(GL_TEXTURE_2D, texture.name());
  glTexStorage2D(GL_TEXTURE_2D, 8, GL_RGBA8, kCardTextureWidth, kCardTextureHeight);
  const Framebuffer target;
  const VertexArray nothing;
  glBindFramebuffer(GL_FRAMEBUFFER, target.name());
  glFramebufferTexture2D(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_TEXTURE_2D, texture.name(), 0);
  glViewport(0, 0, kCardTextureWidth, kCardTextureHeight);
  for (const GLenum test : {GL_DEPTH_TEST, GL_BLEND, GL_CULL_FACE, GL_SCISSOR_TEST}) glDisable(test);
  program->use();
  glBindVertexArray(nothing.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(before));
  glGenerateMipmap(GL_TEXTURE_2D);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  glTexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  return {};
}

// One character of a picture, as it will be drawn.
struct Appearance {
  const draw::ShownCharacter* character;
  // The index of the character in the list that draw() got.
  std::size_t number;
  draw::DrawDetail detail;
  // The index of the list of strands to draw (GroomBuffers::list_for).
  std::size_t list;
  // The head's height on the screen, pixels.
  float head_px;
};

// The number of strands that are drawn of this character.
std::size_t strands_of(const GroomBuffers& groom, const Appearance& one) {
  return draw::drawn_strands(one.detail, groom.strand_count());
}

class GlStage final : public Stage {
 public:
  explicit GlStage(Programs programs) : programs_(std::move(programs)) {}

  Result<void> start() {
    GLint side_max = 0;
    glGetIntegerv(GL_MAX_TEXTURE_SIZE, &side_max);
    rows_max_ = static_cast<std::size_t>(side_max);
    if (Result<void> made = make_card_texture(card_texture_); !made) return made;
    // Errors until here are of missing memory or features: the stage is then not usable.
    return glGetError() == GL_NO_ERROR ? Result<void>() : Refusal("OpenGL ES cannot make what the stage needs");
  }

  std::size_t add_groom(const Groom& groom) override {
    // Slots of removed grooms are used again, so numbers of others stay as they are.
    std::size_t free = 0;
    while (free < grooms_.size() && grooms_[free]) ++free;
    if (free == grooms_.size()) grooms_.emplace_back();
    grooms_[free].emplace(draw::make_groom_geometry(groom));
    return free;
  }

  void remove_groom(std::size_t groom) override {
    if (groom < grooms_.size()) grooms_[groom].reset();
  }

  void set_skin(std::size_t groom, const SkinPush& skin) override {
    if (groom < grooms_.size() && grooms_[groom]) grooms_[groom]->skin().fill(skin);
  }

  void draw(std::span<const draw::ShownCharacter> characters, const draw::Camera& wanted, const Look& look, int width,
            int height, bool target_is_srgb, const Sampling& sampling) override;

  [[nodiscard]] const StageStatistics& statistics() const override { return statistics_; }
  [[nodiscard]] draw::DepthRange depth_range() const override { return depth_range_; }
  [[nodiscard]] std::span<const draw::MovingCharacter> drawn_characters() const override { return drawn_characters_; }

 private:
  // What draw() knows of its picture.
  struct View {
    draw::Camera camera;
    Eigen::Matrix3d rotation;
    // Pixels of a metre at a distance of 1 m.
    float px_per_m;
    float aspect;
    draw::DepthRange range;
    Mat4f projection;
    draw::LightRig rig;
    // Samples for each pixel of the target.
    float samples;
    Sampling sampling;
  };
  [[nodiscard]] std::vector<std::vector<Appearance>> appearances(std::span<const draw::ShownCharacter> characters,
                                                                 View& view, const Look& look) const;
  void fit_points(std::vector<std::vector<Appearance>>& by_groom) const;
  void add_records(std::span<const draw::ShownCharacter> characters, std::vector<std::vector<Appearance>>& by_groom,
                   const Vec3& origin);
  void set_scene(const Program& program, const View& view, const Look& look, int width, int height, bool srgb) const;
  [[nodiscard]] std::optional<draw::DensityGrid> density_of(const GroomBuffers& groom, const Appearance& one,
                                                            std::size_t number) const;
  void add_densities(const std::vector<std::vector<Appearance>>& by_groom, const View& view);
  void place_strands(const std::vector<std::vector<Appearance>>& by_groom);
  void draw_groom(const GroomBuffers& groom, const std::vector<Appearance>& shown, std::size_t first);
  void draw_strands(const GroomBuffers& groom, const std::vector<Appearance>& shown, std::size_t first);
  void count(std::size_t indices, std::size_t instances);

  Programs programs_;
  Texture card_texture_;
  VectorTexture records_texture_{kRecordsUnit, draw::CharacterRecords::kRecordTexels};
  // OpenGL needs a vertex array even for the triangle over the screen, which has no vertex data.
  VertexArray nothing_;
  // The largest number of rows that a texture may have on this GPU.
  std::size_t rows_max_ = 0;
  // The rows that the points of all characters of the picture take.
  std::size_t point_rows_ = 0;
  // The number of density grids in the picture.
  std::size_t densities_ = 0;
  draw::CharacterRecords records_;
  // The grooms by their numbers; none: the number is free.
  std::vector<std::optional<GroomBuffers>> grooms_;
  std::vector<draw::MovingCharacter> drawn_characters_;
  StageStatistics statistics_;
  draw::DepthRange depth_range_;
};

// Chooses who is in the picture, at which detail. Groups the characters by groom, and sorts each group by its list of
// strands: characters with one list are adjacent, and can be one draw call. Within a list those with most strands come
// first. Leaves out what is outside the view.
std::vector<std::vector<Appearance>> GlStage::appearances(std::span<const draw::ShownCharacter> characters, View& view,
                                                          const Look& look) const {
  std::vector<std::vector<Appearance>> by_groom(grooms_.size());
  // The range of depths of all that is drawn, m.
  double nearest = 1e9, furthest = 0;
  const double spread = std::tan(view.camera.fov_deg * std::numbers::pi / 360.0);
  // A ball is at least partly in the view while its middle is no further from each side's plane than its radius. These
  // factors turn the distance from such a plane into a distance across the view.
  const double side_y = std::hypot(1.0, spread), side_x = std::hypot(1.0, spread * static_cast<double>(view.aspect));
  for (std::size_t number = 0; number < characters.size(); ++number) {
    const draw::ShownCharacter& character = characters[number];
    if (character.groom >= grooms_.size() || !grooms_[character.groom] || !is_valid(character.pose)) continue;
    const GroomBuffers& groom = *grooms_[character.groom];
    const Vec3 at = view.rotation * (character.pose.head().position - view.camera.eye);
    if (!(at.cwiseAbs().maxCoeff() <= kCoordinateMax_m)) continue;
    const float scale = std::abs(character.scale);
    const double radius = static_cast<double>(scale * draw::ball_radius_m(groom.radius_m())), depth = -at.z();
    // A ball that reaches behind the eye may still be seen.
    if (depth < -radius || std::abs(at.y()) > depth * spread + radius * side_y ||
        std::abs(at.x()) > depth * spread * static_cast<double>(view.aspect) + radius * side_x)
      continue;
    nearest = std::min(nearest, depth - radius);
    furthest = std::max(furthest, depth + radius);
    // A camera inside a head would get an endless detail, so the depth counts as 5 cm at least.
    const float head_px = scale * draw::kHead_m * view.px_per_m / static_cast<float>(std::max(depth, 0.05));
    const draw::DrawDetail detail =
        character.detail.value_or(draw::detail_for(head_px, look.quality, groom.strand_count()));
    by_groom[character.groom].push_back({&character, number, detail, groom.list_for(detail.tolerance_m), head_px});
  }
  for (auto& shown : by_groom) {
    std::ranges::stable_sort(shown, [](const Appearance& a, const Appearance& b) {
      return std::tuple(a.list, -a.detail.strand_share) < std::tuple(b.list, -b.detail.strand_share);
    });
  }
  const float far_m = std::max(static_cast<float>(furthest) * 1.01f, 0.1f);
  // The ratio of both planes bounds how coarse depths become: 10 000 leaves a 24-bit buffer fine enough.
  const float near_m =
      std::clamp(static_cast<float>(nearest) * 0.99f, std::max(kNearMin_m, far_m * 1e-4f), 0.99f * far_m);
  view.range = {near_m, far_m};
  view.projection =
      shifted(perspective(view.camera, view.aspect, near_m, far_m), view.sampling.shift_x, view.sampling.shift_y);
  return by_groom;
}

// Sets what all shaders of a picture share. Scene space has the world's axes and the camera as its origin, so a head 10
// km from the world's origin is drawn as finely as one there.
void GlStage::set_scene(const Program& program, const View& view, const Look& look, int width, int height,
                        bool srgb) const {
  Mat4f axes = Mat4f::Identity();
  axes.topLeftCorner<3, 3>() = view.rotation.cast<float>();
  program.use();
  program.set("viewMatrix", axes);
  program.set("projectionMatrix", view.projection);
  program.set("cameraPosition", Vec3f(Vec3f::Zero()));
  program.set("viewport_px", static_cast<float>(width), static_cast<float>(height));
  program.set("light_direction", std::span<const Vec3f>(view.rig.towards));
  program.set("light_colour", std::span<const Vec3f>(view.rig.colours));
  program.set("ambient_above", view.rig.ambient_above);
  program.set("ambient_below", view.rig.ambient_below);
  program.set("exposure", look.exposure);
  program.set("encode_srgb", srgb ? 0.0f : 1.0f);
  program.set("samples", view.samples);
  program.set("dither_seed", view.sampling.dither_seed);
  program.set("copies", 1);
}

void GlStage::count(std::size_t indices, std::size_t instances) {
  ++statistics_.draw_calls;
  statistics_.vertices += indices * instances;
}

// The textures of strand points are limited in size. When all wanted strands do not fit, every character is drawn with
// fewer strands.
void GlStage::fit_points(std::vector<std::vector<Appearance>>& by_groom) const {
  const std::size_t most = std::min(rows_max_, StrandDeformPass::kRowsMax);
  std::size_t rows = 0, characters = 0;
  for (std::size_t g = 0; g < by_groom.size(); ++g) {
    characters += by_groom[g].size();
    for (const Appearance& one : by_groom[g]) rows += grooms_[g]->point_rows(strands_of(*grooms_[g], one));
  }
  if (rows <= most) return;
  // Each character may waste part of a row of points, so one row each is set aside.
  const float scale =
      std::max(static_cast<float>(most) - static_cast<float>(characters), 0.0f) / static_cast<float>(rows);
  for (auto& shown : by_groom) {
    for (Appearance& one : shown) one.detail.strand_share = scale * std::min(one.detail.strand_share, 1.0f);
  }
}

// Makes the records, in the order in which characters are drawn. Removes the characters from `by_groom` that do not fit
// into the rows of the textures.
void GlStage::add_records(std::span<const draw::ShownCharacter> characters,
                          std::vector<std::vector<Appearance>>& by_groom, const Vec3& origin) {
  // All characters are passed, not only those in view, so that a head that leaves the view for a moment keeps its
  // nodes.
  records_.begin(characters, programs_.lattices.sum_by(), rows_max_);
  drawn_characters_.clear();
  statistics_ = {};
  point_rows_ = densities_ = 0;
  for (std::size_t g = 0; g < by_groom.size(); ++g) {
    const GroomBuffers* groom = grooms_[g] ? &*grooms_[g] : nullptr;
    for (std::size_t i = 0; i < by_groom[g].size(); ++i) {
      const Appearance& one = by_groom[g][i];
      const std::size_t rows = groom->point_rows(strands_of(*groom, one));
      if (!records_.has_room(one.number) || point_rows_ + rows > rows_max_) {
        // The characters behind this one in the list would not fit either, or only by chance: all are left out.
        statistics_.left_out += by_groom[g].size() - i;
        by_groom[g].resize(i);
        break;
      }
      const std::optional<draw::DensityGrid> density = density_of(*groom, one, densities_);
      records_.add(one.number, origin, one.detail, groom->strand_width_m(), {point_rows_, rows},
                   density ? &*density : nullptr);
      if (density) ++densities_;
      drawn_characters_.push_back({one.character->id, one.character->pose.head(), one.character->lattice,
                                   draw::ball_radius_m(groom->radius_m()), one.head_px, one.character->scale});
      point_rows_ += rows;
    }
  }
}

std::optional<draw::DensityGrid> GlStage::density_of(const GroomBuffers& groom, const Appearance& one,
                                                     std::size_t number) const {
  if (!programs_.density.is_supported()) return std::nullopt;
  return draw::density_of({groom.strand_box(), groom.root_box(), groom.strand_width_m(), groom.strand_count()},
                          one.detail, one.character->lattice, number);
}

// Follows the light through the placed strands. Runs after place_strands, whose points it counts, and before the
// drawing, because it changes the bound framebuffer.
void GlStage::add_densities(const std::vector<std::vector<Appearance>>& by_groom, const View& view) {
  if (densities_ == 0) return;
  GLint before = 0;
  glGetIntegerv(GL_FRAMEBUFFER_BINDING, &before);
  programs_.density.begin(densities_);
  std::size_t first = 0;
  for (std::size_t g = 0; g < by_groom.size(); ++g) {
    // One call for all characters of a groom draws as many points as the character with most has; the shader drops
    // those beyond each one's rows.
    std::size_t points = 0;
    for (const Appearance& one : by_groom[g])
      points = std::max(points, grooms_[g]->point_count(
                                    std::min(strands_of(*grooms_[g], one), draw::DensityGrid::kDensityStrandsMax)));
    if (points > 0) programs_.density.add(*grooms_[g], points, first, by_groom[g].size());
    first += by_groom[g].size();
  }
  programs_.density.light().use();
  programs_.density.light().set("light_direction", std::span<const Vec3f>(view.rig.towards));
  programs_.density.finish(first);
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(before));
}

// Runs FFD for all strands. Runs before the drawing, because it changes the bound framebuffer.
void GlStage::place_strands(const std::vector<std::vector<Appearance>>& by_groom) {
  if (point_rows_ == 0) return;
  GLint before = 0;
  glGetIntegerv(GL_FRAMEBUFFER_BINDING, &before);
  programs_.placement.reserve(point_rows_, std::min(rows_max_, StrandDeformPass::kRowsMax));
  std::size_t first = 0;
  for (std::size_t g = 0; g < by_groom.size(); ++g) {
    if (!by_groom[g].empty()) programs_.placement.place(*grooms_[g], first, by_groom[g].size());
    first += by_groom[g].size();
  }
  glBindFramebuffer(GL_FRAMEBUFFER, static_cast<GLuint>(before));
  programs_.placement.bind();
}

void GlStage::draw_strands(const GroomBuffers& groom, const std::vector<Appearance>& shown, std::size_t first) {
  groom.bind_points();
  programs_.strand.use();
  programs_.strand.set("strand_count", static_cast<float>(groom.strand_count()));
  for (std::size_t begin = 0; begin < shown.size();) {
    std::size_t end = begin, strands = 0;
    float follow_hairs = 0;
    // Characters with the same list of strands are one draw call, with the largest number of strands and follow hairs
    // among them; the shader drops what is too much for each.
    while (end < shown.size() && shown[end].list == shown[begin].list) {
      strands = std::max(strands, strands_of(groom, shown[end]));
      follow_hairs = std::max(follow_hairs, shown[end].detail.follow_hair_count);
      ++end;
    }
    if (strands > 0) {
      const int copies = 1 + static_cast<int>(std::ceil(std::clamp(follow_hairs, 0.0f, draw::kFollowHairsMax)));
      const std::size_t instances = (end - begin) * static_cast<std::size_t>(copies);
      programs_.strand.set("first_record", static_cast<int>(first + begin));
      programs_.strand.set("copies", copies);
      groom.draw_strands(shown[begin].list, strands, static_cast<GLsizei>(instances));
      count(groom.index_count(shown[begin].list, strands), instances);
      statistics_.strands += strands * instances;
    }
    begin = end;
  }
}

// Draws the characters of one groom. Their records begin at `first`, in the order of `shown`. The body comes first: it
// is opaque, and hides most hair behind it before that is shaded.
void GlStage::draw_groom(const GroomBuffers& groom, const std::vector<Appearance>& shown, std::size_t first) {
  const auto all = static_cast<GLsizei>(shown.size());
  const auto draw_all = [&](const Program& program, const DrawnMesh& mesh) {
    if (mesh.empty()) return;
    program.use();
    program.set("first_record", static_cast<int>(first));
    mesh.draw(all);
    count(mesh.index_count(), shown.size());
  };
  // A body has no partial coverage.
  glDisable(GL_SAMPLE_ALPHA_TO_COVERAGE);
  draw_all(programs_.body, groom.body());
  glEnable(GL_SAMPLE_ALPHA_TO_COVERAGE);
  programs_.fabric.use();
  groom.skin().use(programs_.fabric);
  draw_all(programs_.fabric, groom.fabric());
  programs_.card.use();
  groom.skin().use(programs_.card);
  draw_all(programs_.card, groom.cards());
  if (groom.strand_count() > 0) draw_strands(groom, shown, first);
}

void GlStage::draw(std::span<const draw::ShownCharacter> characters, const draw::Camera& wanted, const Look& look,
                   int width, int height, bool target_is_srgb, const Sampling& sampling) {
  if (width < 1 || height < 1) return;
  View view{};
  view.camera = sanitized(wanted);
  view.sampling = sampling;
  view.rig = draw::studio_lights(view.camera);
  GLint samples = 0;
  glGetIntegerv(GL_SAMPLES, &samples);
  view.samples = static_cast<float>(std::max(samples, 1));
  view.rotation = view_rotation(view.camera);
  view.aspect = static_cast<float>(width) / static_cast<float>(height);
  view.px_per_m =
      0.5f * static_cast<float>(height) / std::tan(view.camera.fov_deg * std::numbers::pi_v<float> / 360.0f);
  std::vector<std::vector<Appearance>> by_groom = appearances(characters, view, look);
  depth_range_ = view.range;

  // The order is: which strands, then records, then passes that need records, then the picture.
  fit_points(by_groom);
  add_records(characters, by_groom, view.camera.eye);
  records_texture_.fill(records_.records());
  for (const auto& groom : grooms_) statistics_.groom_bytes += groom ? groom->bytes() : 0;
  if (!characters.empty()) {
    statistics_.character_bytes =
        draw::CharacterRecords::kRecordTexels * sizeof(Eigen::Vector4f) +
        records_.node_rows() * draw::kLatticeRow * sizeof(Eigen::Vector4f) / characters.size();
  }

  // The caller may have left any state; passes below need all of this off.
  for (const GLenum test : {GL_BLEND, GL_CULL_FACE, GL_SCISSOR_TEST, GL_DEPTH_TEST, GL_SAMPLE_ALPHA_TO_COVERAGE})
    glDisable(test);
  glColorMask(GL_TRUE, GL_TRUE, GL_TRUE, GL_TRUE);
  // Each pass reads what those before it have bound: records, then nodes, then placed points.
  records_texture_.bind();
  programs_.lattices.run(records_);
  statistics_.groom_bytes += programs_.lattices.basis_bytes();
  place_strands(by_groom);
  add_densities(by_groom, view);
  statistics_.point_bytes = programs_.placement.bytes();
  glViewport(0, 0, width, height);
  glDepthMask(GL_TRUE);
  glClearDepthf(1);
  glClear(GL_DEPTH_BUFFER_BIT);
  // Scene uniforms are set once for each program, not for each draw call.
  for (const Program* program :
       {&programs_.background, &programs_.body, &programs_.fabric, &programs_.card, &programs_.strand})
    set_scene(*program, view, look, width, height, target_is_srgb);
  programs_.background.use();
  programs_.background.set("top", look.background_top);
  programs_.background.set("bottom", look.background_bottom);
  // The background covers every pixel, so colours need no clearing.
  glBindVertexArray(nothing_.name());
  glDrawArrays(GL_TRIANGLES, 0, 3);

  glEnable(GL_DEPTH_TEST);
  glDepthFunc(GL_LESS);
  glActiveTexture(GL_TEXTURE0 + kCardTextureUnit);
  glBindTexture(GL_TEXTURE_2D, card_texture_.name());
  std::size_t first = 0;
  for (std::size_t g = 0; g < by_groom.size(); ++g) {
    if (!by_groom[g].empty()) draw_groom(*grooms_[g], by_groom[g], first);
    first += by_groom[g].size();
  }
  // Other code that draws into the window expects the usual state of OpenGL.
  glDisable(GL_SAMPLE_ALPHA_TO_COVERAGE);
  glBindVertexArray(0);
  glActiveTexture(GL_TEXTURE0);
}

}  // namespace

Result<std::unique_ptr<Stage>> Stage::create() {
  Result<Programs> programs = Programs::build();
  if (!programs) return Refusal(programs.error());
  auto stage = std::make_unique<GlStage>(std::move(*programs));
  if (const Result<void> started = stage->start(); !started) return Refusal(started.error());
  return stage;
}

}  // namespace hairnet::render
