#include "tests/wasm/drawing_cases.hpp"

#include <array>
#include <cstdio>
#include <span>

#include "client/draw/character_records.hpp"
#include "client/draw/density_grid.hpp"
#include "client/draw/draw_detail.hpp"
#include "client/draw/light_rig.hpp"

namespace hairnet::same_bits {
namespace {

void put(std::string& to, double number) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), " %.9g", number);
  to += text.data();
}
void put_all(std::string& to, std::span<const float> numbers) {
  for (const float number : numbers) put(to, static_cast<double>(number));
}
void put(std::string& to, const Vec3f& v) {
  put_all(to, {v.data(), 3});
}

void put_details(std::string& to) {
  for (const float px : {0.05f, 8.0f, 74.0f, 95.0f, 131.0f, 250.0f, 349.0f, 700.0f, 3000.0f}) {
    for (const float quality : {0.25f, 1.0f, 2.0f}) {
      for (const std::size_t strands : {std::size_t{0}, std::size_t{250}, std::size_t{12'000}}) {
        const draw::DrawDetail d = draw::detail_for(px, quality, strands);
        to += "detail";
        put_all(to, std::array{px, quality, static_cast<float>(strands), d.strand_share, d.follow_hair_count,
                               d.tolerance_m, d.quadratic, draw::width_scale(d)});
        to += '\n';
      }
    }
  }
}

void put_grid(std::string& to, const Eigen::AlignedBox3f& box, float width_m) {
  const draw::DensityGrid grid = draw::density_grid(box, 3, width_m);
  to += "grid";
  put(to, box.min());
  put(to, box.max());
  put(to, width_m);
  put(to, grid.origin);
  put(to, grid.cell);
  put(to, grid.weight);
  to += '\n';
}

void put_lights(std::string& to, const Vec3& eye, const Vec3& target) {
  const draw::LightRig rig = draw::studio_lights({eye, target, {0, 1, 0}, 30});
  to += "lights";
  put(to, eye.cast<float>());
  put(to, target.cast<float>());
  for (const Vec3f& towards : rig.towards) put(to, towards);
  for (const Vec3f& colour : rig.colours) put(to, colour);
  put(to, rig.ambient_above);
  put(to, rig.ambient_below);
  to += '\n';
}

// A character at rest, in its own numbers, and its record.
void put_record(std::string& to) {
  draw::ShownCharacter character;
  const Quat turn(Eigen::AngleAxisd(0.7, Vec3(0.2, 1, 0.1).normalized()));
  for (std::size_t bone = 0; bone < kBoneCount; ++bone)
    character.pose.bones[bone] = {turn, {0.1 * static_cast<double>(bone), 1.5, -0.25}};
  character.hair_tip_colour = Vec3f(0.5f, 0.25f, 0.125f);
  character.body_shown = false;
  const draw::DrawDetail detail{.strand_share = 0.5f, .follow_hair_count = 1.5f, .quadratic = 0.75f};
  const draw::DensityGrid density = draw::density_grid({Vec3f(-0.2f, -0.3f, -0.1f), Vec3f(0.1f, 0.2f, 0.3f)}, 3, 1e-3f);
  draw::CharacterRecords records;
  records.begin({&character, 1});
  records.add(0, Vec3::Zero(), detail, 4e-4f, {7, 11}, &density);
  to += "record";
  for (const RigidTransform& bone : character.pose.bones) {
    for (const double q : bone.rotation.coeffs()) put(to, q);
    for (const double x : bone.position) put(to, x);
  }
  put(to, character.hair_colour);
  put(to, *character.hair_tip_colour);
  put(to, character.skin_colour);
  put_all(to, std::array{character.roughness, detail.strand_share, detail.follow_hair_count, detail.quadratic});
  for (const Eigen::Vector4f& texel : records.records()) put_all(to, {texel.data(), 4});
  to += '\n';
}

}  // namespace

std::string drawing_cases() {
  std::string lines;
  put_details(lines);
  put_grid(lines, {Vec3f(-0.2f, -0.3f, -0.1f), Vec3f(0.1f, 0.2f, 0.3f)}, 1e-3f);
  put_grid(lines, {Vec3f(-0.5f, 0, 0), Vec3f(0.5f, 1e-4f, 0.01f)}, 0.02f);
  for (const Vec3& from : {Vec3(0, 0, 2), Vec3(1, 0.5, 0.3), Vec3(-0.2, -3, 0.4), Vec3(0.3, 0.1, -2)})
    put_lights(lines, Vec3(0.5, 1.5, -1) + from, {0.5, 1.5, -1});
  put_record(lines);
  return lines;
}

}  // namespace hairnet::same_bits
