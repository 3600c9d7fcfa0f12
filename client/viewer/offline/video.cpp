#include "client/viewer/offline/video.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <utility>

#include "client/files/video_writer.hpp"
#include "client/render/renderer.hpp"
#include "client/tools/command_line/progress_bar.hpp"
#include "client/tools/command_line/stop_signal.hpp"
#include "client/viewer/characters/hair_colour.hpp"
#include "client/viewer/drawing/framing.hpp"
#include "client/viewer/drawing/render_list.hpp"
#include "client/viewer/offline/local_run.hpp"
#include "client/viewer/offline/scripted_touch.hpp"

namespace hairnet::viewer {
namespace {

// The most lattices that a stream stores for a video; they take at most a gigabyte.
constexpr std::size_t kKeptMax = 60'000;

Result<std::unique_ptr<render::Renderer>> make_renderer() {
  return render::Renderer::create();
}

// Draws one picture after the other into a video. The camera frames all characters of the first picture that has any.
// It then moves with their mean place, without turning or zooming.
class VideoRecording {
 public:
  VideoRecording(const ViewOptions& options, render::Renderer& renderer, VideoWriter& video)
      : options_(options), renderer_(renderer), video_(video), characters_(renderer.stage()) {}

  Result<void> add(std::span<const ViewedCharacter> viewed) {
    if (!framed_ && !viewed.empty()) {
      frame_all(viewed, options_.views.front(), options_.width, options_.height, camera_);
      framed_ = true;
    }
    // The camera moves by the time of a picture, not of a clock: so the same options give the same video.
    camera_.follow(middle_of(viewed), 1 / options_.frame_rate_hz);
    const Result<render::Image> image =
        renderer_.draw(characters_.show(viewed), camera_.camera(), render::Look{}, options_.width, options_.height);
    if (!image) return Refusal(image.error());
    return video_.add(image->rgba);
  }

 private:
  const ViewOptions& options_;
  render::Renderer& renderer_;
  VideoWriter& video_;
  RenderList characters_;
  OrbitCamera camera_;
  bool framed_ = false;
};

// Makes `count` pictures; `picture` returns the characters of the n-th one. Ends early when `ended` returns true, with
// a whole file of the pictures until then.
Result<void> draw_video(const ViewOptions& options, std::size_t count,
                        const std::function<std::span<const ViewedCharacter>(std::size_t)>& picture,
                        const std::function<bool()>& ended) {
  Result<std::unique_ptr<render::Renderer>> renderer = make_renderer();
  if (!renderer) return Refusal(renderer.error());
  Result<VideoWriter> video = VideoWriter::create(options.out, options.width, options.height, options.frame_rate_hz);
  if (!video) return Refusal(video.error());
  ProgressBar bar("hairnet-view");
  VideoRecording pictures(options, **renderer, *video);
  for (std::size_t i = 0; i < count && !ended(); ++i) {
    bar.show(static_cast<double>(i) / static_cast<double>(count), "drawing");
    if (Result<void> added = pictures.add(picture(i)); !added) return added;
  }
  return video->finish();
}

// One character as a window would show it. It has its own copy of the moment, whose spans the lattice refers to.
class Shown {
 public:
  Shown(std::uint64_t id, std::shared_ptr<const Groom> groom, const Vec3f& hair_colour,
        const std::optional<wire::Appearance>& appearance, const Moment& moment)
      : moment_(moment) {
    viewed_.id = id;
    viewed_.groom = std::move(groom);
    viewed_.hair_colour = hair_colour;
    viewed_.appearance = appearance;
    viewed_.pose = moment.pose;
  }
  // The lattice is made here, not in the constructor: its spans would refer to the place before a move.
  [[nodiscard]] ViewedCharacter viewed_character() const {
    ViewedCharacter character = viewed_;
    character.lattice = moment_.lattice();
    return character;
  }

 private:
  ViewedCharacter viewed_;
  Moment moment_;
};

}  // namespace

std::vector<double> video_times_s(const ViewOptions& options) {
  const double end_s = options.duration_s + options.settle_s;
  // Rounding must not lose the last picture of a whole number of them.
  const auto count = static_cast<std::size_t>(std::floor(end_s * options.frame_rate_hz + 1e-6));
  std::vector<double> times_s;
  for (std::size_t i = 0; i < std::max<std::size_t>(1, count); ++i)
    times_s.push_back(static_cast<double>(i) / options.frame_rate_hz);
  return times_s;
}

Result<void> check_video(const ViewOptions& options) {
  // Others are not counted: nobody knows yet how many there will be.
  const std::size_t count = video_times_s(options).size() * std::max<std::size_t>(1, options.characters.size());
  if (options.source == Source::server && count > kKeptMax)
    return Refusal("a video of a server's room is kept in memory until it is drawn, and this one is too long");
  // A renderer and a writer are made and thrown away: only that shows whether they can be made.
  const Result<std::unique_ptr<render::Renderer>> renderer = make_renderer();
  if (!renderer) return Refusal(renderer.error());
  const Result<VideoWriter> video =
      VideoWriter::create(options.out, options.width, options.height, options.frame_rate_hz);
  return video ? Result<void>() : Refusal(video.error());
}

Result<void> record_local_video(const ViewOptions& options, const std::vector<CharacterSetup>& characters) {
  // Simulates between pictures: one world, no stored moments.
  LocalWorld world = local_world_of(options, characters);
  if (options.touch) touch_by_script(*options.touch, characters.front(), options.duration_s, world);
  const std::vector<double> times_s = video_times_s(options);
  const auto picture = [&](std::size_t i) {
    world.advance_to(times_s[i]);
    return world.viewed_characters();
  };
  return draw_video(options, times_s.size(), picture, stop_requested);
}

Result<void> record_stream_video(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                                 const StreamResult& streamed) {
  std::vector<Shown> shown;
  std::vector<ViewedCharacter> viewed;
  const auto picture = [&](std::size_t i) -> std::span<const ViewedCharacter> {
    shown.clear();
    viewed.clear();
    for (std::size_t c = 0; c < streamed.moments[i].size(); ++c)
      shown.emplace_back(c, characters[c].groom, characters[c].hair_colour, std::nullopt, streamed.moments[i][c]);
    for (std::size_t o = 0; o < streamed.others.size(); ++o) {
      const SeenCharacter& other = streamed.others[o];
      if (i < other.moments.size() && other.moments[i])
        shown.emplace_back(characters.size() + o, other.groom, default_hair_colour(other.member->number - 1),
                           other.member->appearance, *other.moments[i]);
    }
    // Pointers into `shown` are taken once it has all characters.
    for (const Shown& one : shown) viewed.push_back(one.viewed_character());
    return viewed;
  };
  // The signal that ended the stream does not end the video of what was received: the next one ends the program.
  return draw_video(options, streamed.moments.size(), picture, [&] { return !streamed.stopped && stop_requested(); });
}

}  // namespace hairnet::viewer
