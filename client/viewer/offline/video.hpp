#pragma once

#include <vector>

#include "client/viewer/characters/load_characters.hpp"
#include "client/viewer/characters/options.hpp"
#include "client/viewer/offline/stream.hpp"
#include "core/result.hpp"

namespace hairnet::viewer {

// The times of a video's pictures, from 0 to the end that `options` sets; at least one, but none in a build
// without a renderer.
std::vector<double> video_times_s(const ViewOptions& options);

// These make clips with all characters in one picture, drawn off-screen into options.out. They refuse where nothing can
// draw, without ffmpeg, and in a build without the renderer. A stop signal ends a video early: the video then contains
// what was simulated or streamed until then.

// Makes a video of characters that are simulated here, picture by picture: the same options give the same pictures.
Result<void> record_local_video(const ViewOptions& options, const std::vector<CharacterSetup>& characters);
// Makes a video of the moments of a stream at video_times_s(options), as many as the stream reached. It draws after the
// stream has ended, since drawing would delay the poses.
Result<void> record_stream_video(const ViewOptions& options, const std::vector<CharacterSetup>& characters,
                                 const StreamResult& streamed);
// Whether a video can be made at all, and would fit into memory; call it before loading and streaming.
Result<void> check_video(const ViewOptions& options);

}  // namespace hairnet::viewer
