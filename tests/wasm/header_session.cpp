#include "tests/wasm/header_session.hpp"

#include <array>
#include <vector>

#include "client/hairnet.h"
#include "tests/wasm/results.hpp"
#include "tests/wasm/session.hpp"

namespace hairnet::same_bits {
namespace {

// The texture of nodes may have this many rows, more than a few characters need.
constexpr std::size_t kNodeRowsMax = 2048;
// Where a record has its lattice, in texels 16 to 18, and its 256 coefficients, in texels 21 to 84
// (client/shaders/character.glsl). Counted in floats, of which a texel has four.
constexpr std::size_t kTexelFloats = 4, kLatticeAt = 16 * kTexelFloats, kLatticeFloats = 3 * kTexelFloats,
                      kCoefficientsAt = 21 * kTexelFloats, kCoefficients = 256;
// The offsets of a character's hair lie on a grid of 8 x 8 x 8 points, with four halfs for each point.
constexpr std::size_t kSwingHalfs = 4 * 8 * 8 * 8;

// Adds an own character with this groom file. The caller frees `groom`, which is set here.
void add(std::span<const std::uint8_t> file, hairnet_room* room, hairnet_groom*& groom) {
  std::array<char, 200> error;
  const hairnet_error loaded = hairnet_groom_load(file.data(), file.size(), &groom, error.data(), error.size());
  HAIRNET_ASSERT(loaded == HAIRNET_OK);
  std::uint32_t own = 0;
  const hairnet_error added = hairnet_add_character(room, groom, nullptr, &own, error.data(), error.size());
  HAIRNET_ASSERT(added == HAIRNET_OK);
}

// Does what the step says (StepKind in session.hpp) by the functions of hairnet.h.
void take(const Step& step, hairnet_room* room, hairnet_groom*& groom) {
  switch (step.kind) {
    case StepKind::pass:
      break;
    case StepKind::packet:
      hairnet_on_bytes(room, step.bytes.data(), step.bytes.size(), step.now_ns);
      break;
    case StepKind::add:
      add(step.bytes, room, groom);
      break;
    case StepKind::pose: {
      std::array<double, HAIRNET_POSE_NUMBERS> pose;
      std::memcpy(pose.data(), step.bytes.data(), sizeof pose);
      const hairnet_error pushed = hairnet_push_pose(room, 1, pose.data(), 0);
      HAIRNET_ASSERT(pushed == HAIRNET_OK);
      break;
    }
    case StepKind::lose:
      hairnet_on_closed(room, "the cable", step.now_ns);
      break;
  }
}

// Collects what a GPU gets of everyone who is shown, in all pictures: which bases are summed up, the records, and how
// hair moves.
class Pictures {
 public:
  Pictures() {
    const hairnet_error made = hairnet_picture_make(&picture_);
    HAIRNET_ASSERT(made == HAIRNET_OK);
  }
  ~Pictures() { hairnet_picture_free(picture_); }
  Pictures(const Pictures&) = delete;
  Pictures& operator=(const Pictures&) = delete;

  void draw(const hairnet_scene* scene) {
    std::vector<hairnet_shown> shown(hairnet_shown_count(scene));
    const hairnet_error got = hairnet_get_shown(scene, 0, shown.data(), shown.size());
    HAIRNET_ASSERT(got == HAIRNET_OK);
    std::vector<hairnet_drawn> drawn;
    for (std::size_t i = 0; i < shown.size(); ++i) {
      if (shown[i].has_pose == 0) continue;
      hairnet_drawn& one = drawn.emplace_back();
      std::memcpy(one.pose, shown[i].pose, sizeof one.pose);
      one.id = shown[i].member;
      one.scene = scene;
      one.index = static_cast<std::uint32_t>(i);
      one.record = static_cast<std::uint32_t>(drawn.size() - 1);
      // header_session.mjs must set the same numbers. The negative scale mirrors the character and makes it larger by
      // half; the others are those of a usual hairstyle in a small picture.
      one.scale = -1.5f;
      one.strand_count = 5000;
      one.strand_width_m = 4e-4f;
      for (int axis = 0; axis < 3; ++axis) one.box[axis] = -0.25f, one.box[3 + axis] = 0.25f;
      one.has_light = 1;
      one.head_px = 100;
      one.ball_radius_m = 0.5f;
    }
    hairnet_choose_details(drawn.data(), drawn.size(), 1);
    hairnet_picture_data data;
    const hairnet_error written =
        hairnet_picture_write(picture_, drawn.data(), drawn.size(), HAIRNET_SUM_BY_GPU, kNodeRowsMax, &data);
    HAIRNET_ASSERT(written == HAIRNET_OK);
    for (std::size_t n = 0; n < data.source_count; ++n) {
      const hairnet_source& source = data.sources[n];
      for (const std::size_t number : {std::size_t{source.basis}, source.index, source.first, source.end})
        sources.push_back(static_cast<std::uint32_t>(number));
    }
    // Lattices and coefficients must be equal in every bit; of the rest, with its roundings, only the sum counts.
    constexpr std::size_t kRecordFloats = kTexelFloats * HAIRNET_RECORD_TEXELS;
    const std::span records(data.records, kRecordFloats * data.record_count);
    for (std::size_t at = 0; at < records.size(); at += kRecordFloats) {
      const auto lattice = records.subspan(at + kLatticeAt, kLatticeFloats),
                 coefficients = records.subspan(at + kCoefficientsAt, kCoefficients);
      lattices.insert(lattices.end(), lattice.begin(), lattice.end());
      lattices.insert(lattices.end(), coefficients.begin(), coefficients.end());
    }
    for (const float number : records) sum += number;
    hairnet_motions announced;
    const hairnet_error moved = hairnet_picture_motions(picture_, drawn.data(), drawn.size(), &announced);
    HAIRNET_ASSERT(moved == HAIRNET_OK);
    swing.insert(swing.end(), announced.swing, announced.swing + kSwingHalfs * announced.count);
    for (std::size_t n = 0; n < announced.count; ++n)
      for (const double number : announced.motions[n].before) sum += number;
  }

  // What all pictures have had so far. `sum` adds up all numbers of the records, and of the transforms of the picture
  // before.
  std::vector<std::uint32_t> sources;
  std::vector<float> lattices;
  std::vector<std::uint16_t> swing;
  double sum = 0;

 private:
  hairnet_picture* picture_ = nullptr;
};

}  // namespace

std::string header_results(std::span<const std::uint8_t> bytes) {
  const std::vector<Step> steps = read_steps(bytes);
  hairnet_room* room = nullptr;
  hairnet_groom* groom = nullptr;
  const hairnet_error opened = hairnet_open(nullptr, steps.front().now_ns, &room, nullptr, 0);
  HAIRNET_ASSERT(opened == HAIRNET_OK);
  std::string events;
  Bytes sent;
  std::vector<float> nodes, points;
  Pictures pictures;
  for (const Step& step : steps) {
    hairnet_poll(room, step.now_ns);
    if (hairnet_wants_connection(room, nullptr, nullptr) != 0) {
      hairnet_on_opening(room, step.now_ns);
      hairnet_on_open(room, 0, step.now_ns);
    }
    take(step, room, groom);
    hairnet_advance(room);
    for (hairnet_event event; hairnet_next_event(room, &event) != 0;)
      events += std::to_string(event.kind) + " " + std::to_string(event.member) + " " + event.text + "\n";
    std::size_t size = 0;
    while (const void* packet = hairnet_take_packet(room, step.now_ns, &size, nullptr)) {
      const auto* begin = static_cast<const std::uint8_t*>(packet);
      sent.insert(sent.end(), begin, begin + size);
    }
    const hairnet_scene* scene = hairnet_room_scene(room);
    for (std::size_t i = 0; i < hairnet_shown_count(scene); ++i) {
      hairnet_shown shown;
      if (hairnet_get_shown(scene, i, &shown, 1) != HAIRNET_OK || shown.moves == 0) continue;
      const auto& [x, y, z] = shown.lattice.counts;
      const std::size_t count = std::size_t{x} * y * z;
      nodes.resize(nodes.size() + 3 * count);
      hairnet_shown_nodes(scene, i, nodes.data() + nodes.size() - 3 * count, count);
    }
    pictures.draw(scene);
  }
  points.resize(3 * hairnet_groom_point_count(groom));
  const hairnet_error shown =
      hairnet_shown_points(hairnet_room_scene(room), 0, points.data(), nullptr, points.size() / 3);
  hairnet_groom_free(groom);
  hairnet_room_free(room);
  Results out;
  out.begin_case("hairnet.h", "session");
  out.equal("packets sent", sent);
  out.equal("events", events);
  out.equal("nodes shown", nodes);
  out.equal("error of points", std::array{shown});
  double sum = 0;
  for (const float coordinate : points) sum += coordinate;
  out.near(1e-2, "sum of points", {&sum, 1});
  out.equal("sources of pictures", pictures.sources);
  out.equal("lattices in records", pictures.lattices);
  out.equal("swing", pictures.swing);
  hairnet_lights lights;
  hairnet_studio_lights(std::array{0.3, -0.2, 1.0}.data(), &lights);
  const auto [x, y, z] = lights.towards[1];
  const std::array numbers{pictures.sum, static_cast<double>(x), static_cast<double>(y), static_cast<double>(z)};
  out.near(1e-3, "sum of records and motions, a light", numbers);
  return out.lines();
}

}  // namespace hairnet::same_bits
