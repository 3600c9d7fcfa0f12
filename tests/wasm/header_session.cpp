#include "tests/wasm/header_session.hpp"

#include <array>
#include <vector>

#include "client/hairnet.h"
#include "tests/wasm/results.hpp"
#include "tests/wasm/session.hpp"

namespace hairnet::same_bits {
namespace {

void add(std::span<const std::uint8_t> file, hairnet_room* room, hairnet_groom*& groom) {
  std::array<char, 200> why;
  const hairnet_error error = hairnet_groom_load(file.data(), file.size(), &groom, why.data(), why.size());
  HAIRNET_ASSERT(error == HAIRNET_OK);
  std::uint32_t own = 0;
  const hairnet_error added = hairnet_add_character(room, groom, nullptr, &own, why.data(), why.size());
  HAIRNET_ASSERT(added == HAIRNET_OK);
}

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
      if (hairnet_get_shown(scene, i, &shown) != HAIRNET_OK || shown.moves == 0) continue;
      const auto& [x, y, z] = shown.lattice.counts;
      const std::size_t count = std::size_t{x} * y * z;
      nodes.resize(nodes.size() + 3 * count);
      hairnet_shown_nodes(scene, i, nodes.data() + nodes.size() - 3 * count, count);
    }
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
  return out.lines();
}

}  // namespace hairnet::same_bits
