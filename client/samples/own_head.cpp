// A head that nods in the lobby of a server. Prints where the tip of its first strand is, 60 times a second.
//   own_head [ADDRESS]
#include <chrono>
#include <cstdio>
#include <optional>
#include <thread>

#include "client/assets/made/made.hpp"
#include "client/draw/hair_points.hpp"
#include "client/room/connect.hpp"

using namespace hairnet;

int main(int argc, char** argv) {
  link::LinkOptions options;
  if (argc > 1) options.server = link::parse_address(argv[1]).value_or(link::Address());
  const auto joined = room::connect(options);
  if (!joined) return std::fprintf(stderr, "%s\n", joined.error().c_str()), 1;
  room::Room& lobby = **joined;
  const auto groom = std::make_shared<const Groom>(*make_hairstyle("bob"));
  const std::uint32_t me = *lobby.add_character(groom, {.tag = "Nora"});
  const Motion motion = *make_motion("nod");

  // It is made again when the lattice or the skin arrives.
  std::optional<draw::HairPoints> hair;
  std::vector<Vec3f> points(groom->points.size());
  // About five seconds at 60 pictures a second.
  for (int picture = 0; picture < 300 && lobby.state() != room::State::closed; ++picture) {
    // The pose goes out first, so that advance() already shows it.
    lobby.push(me, motion.sample(picture / 60.0));
    lobby.advance();
    for (const room::Event& event : lobby.take_events()) std::fprintf(stderr, "%s\n", describe(event).c_str());
    if (const auto head = lobby.member_of(me)) {
      const link::Playout::Sample& sample = head->sample;
      const auto geometry = sample.geometry();
      if (!hair || hair->geometry() != geometry.get() || hair->has_skin() != (head->skin != nullptr))
        hair.emplace(groom, geometry, head->skin);
      hair->place(*head->pose, sample.lattice(), points, {});
      // Strand 0 has the points from strand_begin[0] up to strand_begin[1].
      const Vec3f& tip = points[groom->strand_begin[1] - 1];
      std::printf("%.3f %.3f %.3f\n", tip.x(), tip.y(), tip.z());
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(16));
  }
}
