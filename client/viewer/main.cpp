#include <cstdio>
#include <string>
#include <utility>

#include "client/files/write_file.hpp"
#include "client/tools/command_line/run_program.hpp"
#include "client/tools/command_line/stop_signal.hpp"
#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/characters/options.hpp"
#include "client/viewer/offline/local_run.hpp"
#include "client/viewer/offline/pictures.hpp"
#include "client/viewer/offline/stream.hpp"
#include "client/viewer/offline/video.hpp"
#include "client/viewer/window/viewer_window.hpp"
#include "core/broken_pipe.hpp"

namespace {

using namespace hairnet;
using namespace hairnet::viewer;

// The times for which moments are stored: for the sheet and the last picture, or for each picture of a video. They
// ascend, since the sheet's times lie within the duration, and the last picture's is its end.
std::vector<double> moment_times_s(const ViewOptions& options) {
  if (options.output == Output::video) return video_times_s(options);
  std::vector<double> times_s;
  if (!options.sheet.empty()) times_s = options.times_s;
  if (!options.out.empty()) times_s.push_back(options.duration_s + options.settle_s);
  return times_s;
}

// The checks come in order of their cost: what cannot be written or drawn is refused before files are loaded, and long
// before a stream of minutes has been received.
Result<void> run(const ViewOptions& options) {
  install_stop_signal_handlers();
  if (const Result<void> possible = check_can_write({options.out, options.sheet}); !possible) return possible;
  if (options.output == Output::window) return run_window(options);
  std::unique_ptr<Pictures> pictures;
  if (options.output == Output::pictures) {
    Result<std::unique_ptr<Pictures>> made = make_pictures();
    if (!made) return Refusal(made.error());
    pictures = std::move(*made);
  }
  if (options.output == Output::video) {
    if (const Result<void> possible = check_video(options); !possible) return possible;
  }
  const Result<std::vector<CharacterSetup>> characters = load_characters(options);
  if (!characters) return Refusal(characters.error());
  // A local video is drawn while it is simulated: no moments are stored, so its length is not limited by memory.
  if (options.output == Output::video && options.source == Source::local)
    return record_local_video(options, *characters);

  const std::vector<double> times_s = moment_times_s(options);
  const bool local = options.source == Source::local;
  const StreamResult streamed =
      local ? run_locally(options, *characters, times_s) : stream(options, *characters, times_s);
  // Statistics are printed also after a failure, which they may explain.
  if (!local && streamed.connected) std::fputs((streamed.statistics.summary() + streamed.members).c_str(), stdout);
  if (!streamed.ended) return streamed.ended;
  // A signal ends a video early but leaves it whole; a sheet without its last columns would mislead.
  if (streamed.stopped && (pictures || (options.output == Output::video && streamed.moments.empty())))
    return Refusal(std::string("stopped before the end: no ") + (pictures ? "picture" : "video") + " is made");
  if (options.output == Output::video) return record_stream_video(options, *characters, streamed);
  return pictures ? pictures->write(options, *characters, streamed) : Result<void>();
}

}  // namespace

int main(int argc, char** argv) {
  // The other end of --trace /dev/stdout or of a pipe may be gone: that is an error of one write, no reason to be
  // killed.
  ignore_broken_pipes();
  return run_program("hairnet-view", [&] {
    const auto parsed = parse_options(argc, argv);
    if (const int* exit_code = std::get_if<int>(&parsed)) return *exit_code;
    const Result<void> done = run(std::get<ViewOptions>(parsed));
    if (!done) std::fprintf(stderr, "hairnet-view: %s\n", done.error().c_str());
    return done ? 0 : 1;
  });
}
