#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "client/assets/import/bvh.hpp"
#include "client/assets/import/hair_import.hpp"
#include "client/assets/load_motion.hpp"
#include "client/assets/made/made.hpp"
#include "client/link/address.hpp"
#include "client/viewer/characters/place.hpp"
#include "core/groom/material.hpp"
#include "core/levels/level.hpp"
#include "core/solver/wind.hpp"
#include "schema/wire/messages.hpp"

namespace hairnet::viewer {

// One character as the command line describes it; nothing is loaded yet.
struct CharacterOptions {
  // A spec of load_groom.hpp.
  std::string groom;
  std::string motion = kDefaultMotion;
  // Where the character stands; none: side by side with the others.
  std::optional<Place> place;
  LevelIndex level = LevelIndex::high;
  // Everyone in the room sees it; empty: none.
  std::string name;
  std::optional<Vec3f> colour;  // linear RGB
  // Replaces the base material at run time; none: the groom's own.
  std::optional<Material> material;
  HairstyleOptions hairstyle;
  BvhImport bvh;
};

enum class View : std::uint8_t { front, side, back, three_quarter };

// Where hair is simulated: by a server, or by the core's World in this process. FILES imply the latter.
enum class Source : std::uint8_t { server, local };
// What the program makes. It draws nothing for `none`.
enum class Output : std::uint8_t { window, pictures, video, none };

// What touches the hair in a picture or a video, see scripted_touch.hpp.
enum class TouchScript : std::uint8_t { stroke, hold, pin, prop };

// All that a run depends on: the same options give the same local pictures. Values are within their ranges.
struct ViewOptions {
  Source source = Source::server;
  Output output = Output::window;
  // These files are shown as they are.
  std::vector<std::string> files;
  // How strand files are imported; the same for all of them.
  HairImport hair;
  link::Address server;
  link::TlsOptions tls;
  link::TransportChoice transport = link::TransportChoice::automatic;
  std::string room, token;
  // Which other characters of the room to show; none: no others.
  std::optional<wire::Observe> observe;
  // How long to try to reconnect, s; zero means not at all, infinity forever.
  double reconnect_s = 0;
  std::vector<CharacterOptions> characters;
  // The motions end after this time, s; infinity means forever. They begin at time 0, when every lattice has arrived.
  double duration_s = 6;
  // Time after the motions, s: heads ease upright within 1 s, then are still.
  double settle_s = 0;
  double pose_rate_hz = 60;
  // The rate of a local world.
  double tick_rate_hz = 30;
  // The rate of a video.
  double frame_rate_hz = 30;
  // Each pose is taken up to this much earlier or later, at random.
  double jitter_ms = 0;
  // The wind in the whole room, for everyone; none: the room keeps its own.
  std::optional<Wind> wind;
  // What touches the first character; none: nothing does.
  std::optional<TouchScript> touch;
  // Files and folders to write; empty: not written.
  std::string out, sheet, trace;
  // The times of the sheet's columns.
  std::vector<double> times_s;
  // The sheet has one row for each character and view.
  std::vector<View> views;
  // The size of a picture, a video or the window.
  int width = 480, height = 540;
};

// The options of the command line, or the exit code when the program must end at once (help, or a usage error, already
// printed in one line).
std::variant<ViewOptions, int> parse_options(int argc, char** argv);

}  // namespace hairnet::viewer
