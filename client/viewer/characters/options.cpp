#include "client/viewer/characters/options.hpp"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <string_view>

#include "client/assets/import/head_files.hpp"
#include "client/files/video_writer.hpp"
#include "client/tools/command_line/hair_flags.hpp"
#include "client/tools/command_line/in_range.hpp"
#include "client/tools/command_line/parse.hpp"
#include "client/tools/command_line/wind_flags.hpp"
#include "client/viewer/characters/character_spec.hpp"
#include "core/file_name.hpp"

namespace hairnet::viewer {
namespace {

constexpr std::string_view kFooter = R"(A character is given as key=value, separated by commas:
  groom=FILE or made:STYLE   motion=FILE.bvh or made:NAME (made:look_around)   level=high|medium|low|ether|learnt|rigid
  material=soft|normal|stiff|gelled|wet (a change while it runs)   at=X:Z:HEADING (metres, degrees)
  name=TEXT (everyone in the room sees it, and the colour)
  colour=brown|blonde|black|red|dark_blonde|dark_brown|auburn|grey|#rrggbb   strands=N (made grooms)
  rest=auto|zero|first up=+y face=+z unit=1 (BVH: the pose that is upright, its axes, metres a unit; found, unless given)
Motions begin at time 0: heads rest upright until every lattice has arrived.
A window opens unless --out, --sheet, --trace or --no-draw is given; H in it shows the keys.
Hair that is simulated here can be touched in it: a left drag on hair holds it, and lets go, or pins it when shift is
pressed; with ctrl a ball strokes it; P ends all pins. Hair in a server's room cannot be touched.
Examples:
  hairnet-view --local                                             a testbed: choose hair and motion in the window
  hairnet-view straight.hair        or: head.obj hair.data walk.bvh       what is in files, its unit and axes guessed
  hairnet-view --connect host:7420 --room hall --character groom=made:bob,motion=made:nod,name=Ann     a live room
  hairnet-view --local --out hair.png                              a head of curls, as a picture
  hairnet-view --local --character groom=made:long_curly,motion=made:dance --out dance.mp4
  hairnet-view --local --character groom=made:long_straight,motion=made:shake --touch hold --out hold.mp4
  hairnet-view --local --character groom=made:long_curly,motion=made:look --touch prop --views back --out chair.mp4
  hairnet-view --character groom=made:long_curly,motion=made:dance --out frame.png
  hairnet-view --connect host:7420 --character groom=a.groom,motion=walk.bvh,level=low --sheet s.png --times 0.5,1.2,2
  hairnet-view --character groom=made:bob,motion=made:nod --duration 3 --trace received
  hairnet-view --connect wss://host/ws --ca chain.pem --room hall --observe all --times 1,2 --duration 3 --sheet all.png
  hairnet-view --no-draw --room lobby --character groom=made:bob,motion=made:dance,at=0.6:0:20 --duration forever \
    --reconnect forever                                            keeps a room alive until it is interrupted
)";

constexpr std::array<const char*, 4> kViewNames{"front", "side", "back", "three_quarter"};
constexpr std::array<const char*, 4> kTouchNames{"stroke", "hold", "pin", "prop"};
// The character that is shown without a window when nobody is named.
constexpr const char* kDefaultCharacter = "groom=made:long_curly,motion=made:walk,colour=auburn";
// The longest duration is a day: a longer one is mostly a typing error, and 'forever' exists.
constexpr double kDuration_s_max = 24 * 3600;

// Values as typed that need parsing before they go into the options. They are parsed together after CLI11 has read all
// flags, since many defaults depend on other flags.
struct Texts {
  std::string connect = "127.0.0.1:7420", transport = "auto", observe, times, views = "three_quarter", size, duration,
              reconnect, touch;
  std::vector<std::string> characters;
  bool no_draw = false, local = false;
  Wind wind;
  CLI::App* wind_flags = nullptr;
  // These flags only apply to a server, and are refused without one.
  std::vector<const CLI::Option*> of_server;
};

std::vector<std::string> split(const std::string& text, char separator) {
  std::vector<std::string> parts;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(separator, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

// CLI11 prints the flag's name before the line, and exits with 2.
[[noreturn]] void refuse(const std::string& flag, const std::string& error) {
  throw CLI::ValidationError(flag, error);
}

double whole_number(const std::string& flag, const std::string& text, double least, double most) {
  const Result<double> number = parse_finite_number(text);
  if (!number || *number != std::floor(*number) || *number < least || *number > most)
    refuse(flag, "'" + text + "' is not a whole number in range");
  return *number;
}

void take_server(ViewOptions& o, const std::string& text) {
  const Result<link::Address> address = link::parse_address(text);
  if (!address) refuse("--connect", address.error());
  o.server = *address;
}

void take_transport(ViewOptions& o, const std::string& text) {
  const Result<link::TransportChoice> choice = link::parse_transport_choice(text);
  if (!choice) refuse("--transport", choice.error());
  o.transport = *choice;
}

// Parses all, nobody, nearest:N or radius:M. The default is all in a window and nobody otherwise.
void take_observe(ViewOptions& o, std::string text) {
  if (text.empty()) text = o.source == Source::server && o.output == Output::window ? "all" : "nobody";
  if (text == "nobody") return;
  const std::vector<std::string> parts = split(text, ':');
  wire::Observe observe;
  if (text == "all") {
    observe.mode = wire::ObserveMode::all;
  } else if (parts.size() == 2 && parts[0] == "nearest") {
    observe.mode = wire::ObserveMode::nearest;
    observe.count = static_cast<std::uint32_t>(whole_number("--observe", parts[1], 1, 1e6));
  } else if (parts.size() == 2 && parts[0] == "radius") {
    const Result<double> radius_m = parse_finite_number(parts[1]);
    if (!radius_m) refuse("--observe", radius_m.error());
    observe.mode = wire::ObserveMode::radius;
    observe.radius_m = static_cast<float>(*radius_m);
  } else {
    refuse("--observe", "'" + text + "' is not all, nobody, nearest:N or radius:METRES");
  }
  // The limits are the protocol's, so a server does not refuse what passes here.
  if (const std::string error = wire::validate(observe); !error.empty()) refuse("--observe", error);
  o.observe = observe;
}

void take_room(const ViewOptions& o) {
  if (!wire::is_room_name(o.room)) refuse("--room", wire::kRoomNameRule);
  if (o.token.size() > wire::kTokenBytesMax) refuse("--token", "it is too long");
}

// Parses seconds, from `min_s` to a day, or the word 'forever' as infinity. NaN fails the negated comparison.
double seconds(const std::string& flag, const std::string& text, double min_s) {
  if (text == "forever") return std::numeric_limits<double>::infinity();
  const Result<double> number = parse_finite_number(text);
  if (!number || !(*number >= min_s && *number <= kDuration_s_max))
    refuse(flag, "'" + text + "' is not 'forever', nor seconds in " + (min_s > 0 ? "0.1" : "0") + " ... 86400");
  return *number;
}

// A picture under another ending would be a PNG that no program takes for one. Devices may have any name.
void check_picture_name(const std::string& flag, const std::string& path, bool is_right) {
  if (is_right || path.empty() || extension_of(path) == ".png" || path.starts_with("/dev/")) return;
  refuse(flag, "'" + path + "' has another ending than .png" +
                   (flag == "--out" ? ", or .mp4, .gif or .webm for a video" : "") + ": give it one of these");
}

// The output decides other defaults, so it comes first.
void take_output(ViewOptions& o, const Texts& texts) {
  const bool pictures = !o.out.empty() || !o.sheet.empty();
  o.source = texts.local || !o.files.empty() ? Source::local : Source::server;
  if (pictures && texts.no_draw) refuse("--no-draw", "excludes --out and --sheet");
  check_picture_name("--out", o.out, is_video(o.out));
  check_picture_name("--sheet", o.sheet, false);
  if (is_video(o.out)) {
    if (!o.sheet.empty()) refuse("--sheet", "is made without a video: give them one after the other");
    if (!o.trace.empty() && o.source == Source::local)
      refuse("--trace", "is written without a video when it is simulated here: give them one after the other");
    o.output = Output::video;
  } else {
    // A trace alone opens no window.
    o.output = pictures ? Output::pictures : texts.no_draw || !o.trace.empty() ? Output::none : Output::window;
  }
  if (o.source == Source::server) return;
  for (const CLI::Option* flag : texts.of_server) {
    if (flag->count() > 0) refuse(flag->get_name(), "needs a server, and --local and FILES have none");
  }
}

void take_durations(ViewOptions& o, const Texts& texts) {
  const bool lasts = o.output == Output::window;
  o.duration_s = seconds("--duration", texts.duration.empty() ? (lasts ? "forever" : "6") : texts.duration, 0.1);
  o.reconnect_s = seconds("--reconnect", texts.reconnect.empty() ? (lasts ? "forever" : "0") : texts.reconnect, 0);
  if (std::isfinite(o.duration_s)) return;
  if (o.output == Output::pictures || o.output == Output::video)
    refuse("--duration", "pictures and videos need an end: 'forever' is not possible");
  if (!o.trace.empty()) refuse("--duration", "a trace needs an end: 'forever' would fill the disk");
  if (o.output == Output::none && o.source == Source::local)
    refuse("--duration", "'forever' without a window or a trace does nothing in a local simulation");
}

void take_size(ViewOptions& o, std::string text) {
  if (text.empty()) text = o.output == Output::window ? "1280x800" : o.output == Output::video ? "960x720" : "480x540";
  const std::vector<std::string> parts = split(text, 'x');
  if (parts.size() != 2) refuse("--size", "'" + text + "' is not WIDTHxHEIGHT");
  // The largest size is that of pictures (render::kPictureSideMax) and of videos (VideoWriter).
  o.width = static_cast<int>(whole_number("--size", parts[0], 16, 8192));
  o.height = static_cast<int>(whole_number("--size", parts[1], 16, 8192));
}

void take_times(ViewOptions& o, const std::string& text) {
  if (text.empty()) return;
  if (o.sheet.empty()) refuse("--times", "needs --sheet");
  for (const std::string& part : split(text, ',')) {
    const Result<double> time = parse_finite_number(part);
    if (!time) refuse("--times", time.error());
    if (*time < 0 || *time > o.duration_s + o.settle_s) refuse("--times", part + " is not within the duration");
    o.times_s.push_back(*time);
  }
  // The stream reaches the times in their order, whichever was typed first.
  std::sort(o.times_s.begin(), o.times_s.end());
}

void take_views(ViewOptions& o, const std::string& text) {
  for (const std::string& part : split(text, ',')) {
    const auto name = std::find(kViewNames.begin(), kViewNames.end(), part);
    if (name == kViewNames.end()) refuse("--views", "'" + part + "' is not one of front, side, back, three_quarter");
    o.views.push_back(static_cast<View>(name - kViewNames.begin()));
  }
}

void take_touch(ViewOptions& o, const std::string& text) {
  if (text.empty()) return;
  const auto name = std::find(kTouchNames.begin(), kTouchNames.end(), text);
  if (name == kTouchNames.end()) refuse("--touch", "'" + text + "' is not one of stroke, hold, pin, prop");
  if (o.source == Source::server)
    refuse("--touch", "is for hair that is simulated here, not in a server's room: give --local or FILES");
  if (o.output == Output::window)
    refuse("--touch", "is for pictures, videos and traces: in a window, take hold of the hair with the mouse");
  o.touch = static_cast<TouchScript>(name - kTouchNames.begin());
}

void take_characters(ViewOptions& o, const Texts& texts) {
  for (const std::string& spec : texts.characters) {
    const Result<CharacterOptions> character = parse_character(spec);
    if (!character) refuse("--character", character.error());
    o.characters.push_back(*character);
  }
  if (!o.characters.empty() || !o.files.empty()) return;
  if (o.source == Source::local) {
    if (o.output != Output::window) o.characters.push_back(*parse_character(kDefaultCharacter));
    return;
  }
  // Without a character, a room or a server there is nothing to show: a mere default server is not what was meant.
  const bool asks_for_room = std::any_of(texts.of_server.begin(), texts.of_server.end(),
                                         [](const CLI::Option* flag) { return flag->count() > 0; });
  if (!o.observe || !asks_for_room)
    refuse("--character", "at least one is required, or --observe, --connect, --local or a file");
}

// The order matters: output and durations decide defaults and limits of what follows.
void take_texts(ViewOptions& o, const Texts& texts) {
  take_output(o, texts);
  take_durations(o, texts);
  take_server(o, texts.connect);
  take_transport(o, texts.transport);
  take_room(o);
  take_observe(o, texts.observe);
  take_size(o, texts.size);
  take_times(o, texts.times);
  take_views(o, texts.views);
  take_touch(o, texts.touch);
  take_characters(o, texts);
  // No flag of the wind means that the room keeps its own wind, which still air does not.
  if (texts.wind_flags->count_all() > 0) {
    if (const std::string error = validate(texts.wind); !error.empty()) refuse("--wind", error);
    o.wind = texts.wind;
  }
  // This check needs the output, the sheet and the times.
  if (!o.sheet.empty() && o.times_s.empty()) refuse("--sheet", "needs --times");
}

void add_server_flags(CLI::App& app, ViewOptions& o, Texts& texts) {
  CLI::Option_group& group = *app.add_option_group("Server");
  texts.of_server = {
      group.add_option("--connect", texts.connect,
                       "server, HOST:PORT or tcp://, tls://, ws:// or wss:// and that (127.0.0.1:7420)"),
      group.add_option("--transport", texts.transport,
                       "auto (WebTransport where server and network have it, else as the address says), webtransport "
                       "or address (auto)"),
      group.add_option("--ca", o.tls.ca_file, "PEM file of certificates to trust (the system's)")
          ->check(CLI::ExistingFile),
      group.add_flag("--insecure", o.tls.insecure, "trust any certificate"),
      group.add_option("--room", o.room, "room to join (the lobby)"),
      group.add_option("--token", o.token, "token that grants access to the room, see hairnet-token"),
      group.add_option(
          "--observe", texts.observe,
          "others of the room to show too: all, nearest:N, radius:METRES or nobody (nobody; in a window, all)"),
      group.add_option("--reconnect", texts.reconnect,
                       "seconds to keep trying to reconnect, or 'forever' (0; in a window, forever)"),
      group.add_option("--pose-rate", o.pose_rate_hz, "poses a second (60)")->check(in_range(1.0, 1000.0)),
      group.add_option("--jitter", o.jitter_ms, "milliseconds by which poses are early or late, at random (0)")
          ->check(in_range(0.0, 1000.0))};
}

void add_flags(CLI::App& app, ViewOptions& o, Texts& texts) {
  app.add_option("FILES", o.files,
                 "to be shown: strands (" + strand_extensions() + "), .groom, a body (" + std::string(kBodyFiles) +
                     "), .bvh of motion");
  app.add_flag("--local", texts.local, "simulate here, without a server");
  app.add_option("--tick-rate", o.tick_rate_hz, "ticks a second of that (30)")->check(in_range(10.0, 240.0));
  // One at a time: a list after one flag would swallow FILES.
  app.add_option("--character", texts.characters, "a character (below); once for each")
      ->expected(1)
      ->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  app.add_option("--duration", texts.duration,
                 "seconds of the motions, which loop, or 'forever' (6; in a window, forever)");
  app.add_option("--settle", o.settle_s, "seconds added, the heads easing upright, then still")
      ->check(in_range(0.0, kDuration_s_max));
  app.add_option("--out", o.out, "PNG: every character at the end; or a video, .mp4, .gif or .webm");
  app.add_option("--sheet", o.sheet, "PNG: a row for every character and view, a column for each of --times");
  app.add_option("--times", texts.times, "seconds, separated by commas");
  app.add_option("--views", texts.views, "front, side, back, three_quarter, separated by commas (three_quarter)");
  app.add_option(
      "--touch", texts.touch,
      "who touches the first character: a hand that strokes its hair (stroke), pulls a lock aside (hold), or "
      "pins it behind the shoulder (pin); or a chair's back (prop). It is not drawn");
  app.add_option("--size", texts.size, "of a picture, WIDTHxHEIGHT (480x540; video 960x720; window 1280x800)");
  app.add_option("--frame-rate", o.frame_rate_hz, "pictures a second of a video (30)")->check(in_range(1.0, 240.0));
  app.add_option("--trace", o.trace, "folder for every frame that is received, or simulated");
  app.add_flag("--no-draw", texts.no_draw, "stream and measure only");
  add_hair_flags(app, "--hair-", o.hair);
  add_server_flags(app, o, texts);
  texts.wind_flags = add_wind_flags(app, texts.wind);
}

}  // namespace

std::variant<ViewOptions, int> parse_options(int argc, char** argv) {
  ViewOptions options;
  Texts texts;
  CLI::App app(
      "Shows living hair, of a hairnet server's room or simulated here: in a window, as pictures or as a video.",
      "hairnet-view");
  app.footer(std::string(kFooter));
  add_flags(app, options, texts);
  if (const auto exit_status = parse_command_line(app, argc, argv, [&] { take_texts(options, texts); }))
    return *exit_status;
  return options;
}

}  // namespace hairnet::viewer
