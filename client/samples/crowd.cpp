// A crowd of heads in one room, from one program: they look around in rows, and the server gives each the detail that
// its size on this screen is worth. Prints what it costs.
//   crowd [ADDRESS [HEADS]]
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <thread>

#include "client/assets/made/made.hpp"
#include "client/room/connect.hpp"

using namespace hairnet;

int main(int argc, char** argv) {
  link::LinkOptions options;
  options.core.room = "crowd";
  if (argc > 1) options.server = link::parse_address(argv[1]).value_or(link::Address());
  const int heads = argc > 2 ? std::atoi(argv[2]) : 32;
  const auto joined = room::connect(options);
  if (!joined) return std::fprintf(stderr, "%s\n", joined.error().c_str()), 1;
  room::Room& crowd = **joined;
  const auto groom = std::make_shared<const Groom>(*make_hairstyle("wavy", {.strand_count = 1000}));
  const Motion motion = *make_motion("look_around");
  std::vector<room::OwnPose> poses(static_cast<std::size_t>(heads));
  for (room::OwnPose& each : poses) each.own = *crowd.add_character(groom);

  // About five seconds at 60 pictures a second.
  for (int picture = 0; picture < 300 && crowd.state() != room::State::closed; ++picture) {
    for (std::size_t i = 0; i < poses.size(); ++i) {
      // Each head is 0.37 s further in the motion than the one before, so they do not move in step.
      poses[i].pose = motion.sample(std::fmod(picture / 60.0 + 0.37 * static_cast<double>(i), motion.duration_s()));
      for (RigidTransform& bone : poses[i].pose.bones)
        // Rows of eight heads, 0.6 m apart, and 0.8 m from row to row.
        bone.position += Vec3(0.6 * static_cast<double>(i % 8), 0, -0.8 * static_cast<double>(i / 8));
    }
    // One call for all heads makes one message of them.
    crowd.push(poses);
    crowd.advance();
    for (const room::Event& event : crowd.take_events()) std::fprintf(stderr, "%s\n", describe(event).c_str());
    // This is about the share of the screen's height that a head takes, seen from 2 m in front of the first row.
    std::vector<wire::MemberImportance> sizes;
    for (const auto& [number, member] : crowd.members())
      if (member->pose) sizes.push_back({number, static_cast<float>(0.3 / (2 - member->pose->head().position.z()))});
    crowd.report_importance(std::move(sizes));
    std::this_thread::sleep_for(std::chrono::milliseconds(16));
  }
  const link::LinkCounters counters = crowd.counters();
  std::printf("%zu heads, %llu frames of %llu bytes in all\n", crowd.members().size(),
              static_cast<unsigned long long>(counters.frames_received),
              static_cast<unsigned long long>(counters.frame_bytes_received));
}
