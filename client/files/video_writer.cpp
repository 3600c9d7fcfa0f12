#include "client/files/video_writer.hpp"

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdio>
#include <cstring>
#include <optional>
#include <utility>
#include <vector>

extern char** environ;  // NOLINT: POSIX names it so

#include "core/file_name.hpp"

namespace hairnet {
namespace {

using Words = std::vector<std::string>;

// The ffmpeg options of each kind. All except gif crop to an even width and height, which yuv420p needs. A lower crf
// loses less: at 17, losses of x264 are hardly visible.
struct Kind {
  std::string_view ending;
  // The name of the container for ffmpeg, and further options, separated by blanks.
  std::string_view format, words;
};
constexpr std::array<Kind, 3> kKinds{
    {{".mp4", "mp4",
      "-vf crop=trunc(iw/2)*2:trunc(ih/2)*2 -c:v libx264 -preset medium -crf 17 -pix_fmt yuv420p -movflags +faststart"},
     {".webm", "webm",
      "-vf crop=trunc(iw/2)*2:trunc(ih/2)*2 -c:v libvpx-vp9 -b:v 0 -crf 30 -row-mt 1 -pix_fmt yuv420p"},
     {".gif", "gif", "-filter_complex [0:v]split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse"}}};

const Kind* kind_of(std::string_view path) {
  const std::string extension = extension_of(path);
  for (const Kind& kind : kKinds) {
    if (extension == kind.ending) return &kind;
  }
  return nullptr;
}

void append(std::string_view text, Words& words) {
  while (!text.empty()) {
    const std::size_t end = std::min(text.find(' '), text.size());
    words.emplace_back(text.substr(0, end));
    text.remove_prefix(std::min(end + 1, text.size()));
  }
}

Words command_line(const Kind& kind, const std::string& part, int width, int height, double rate_hz) {
  char picture[96];
  std::snprintf(picture, sizeof picture, "-s %dx%d -r %.6g", width, height, rate_hz);
  Words words{"ffmpeg"};
  // ffmpeg's complaints are read only after its end, so they must fit the buffer of the pipe: errors alone do.
  append("-hide_banner -loglevel error -nostdin -y -f rawvideo -pix_fmt rgba", words);
  append(picture, words);
  append("-i - -an", words);
  append(kind.words, words);
  // The same pictures give the same file: no date and no version of the encoder are in it.
  append("-fflags +bitexact -flags:v +bitexact -f", words);
  words.emplace_back(kind.format);
  words.push_back(part);
  return words;
}

struct Pipe {
  int read = -1, write = -1;
};

std::optional<Pipe> make_pipe() {
  std::array<int, 2> ends{};
  // Without O_CLOEXEC ffmpeg would get the writing end as well, and never see the end of its own input.
  if (pipe2(ends.data(), O_CLOEXEC) != 0) return {};
  return Pipe{ends[0], ends[1]};
}

void close_end(int& fd) {
  if (fd >= 0) close(std::exchange(fd, -1));
}

std::string first_line(const std::string& text) {
  return text.substr(0, text.find('\n'));
}

}  // namespace

bool is_video(std::string_view path) {
  return kind_of(path) != nullptr;
}

Result<VideoWriter> VideoWriter::create(const std::string& path, int width, int height, double rate_hz) {
  const Kind* kind = kind_of(path);
  if (kind == nullptr) return Refusal(path + ": a video ends in .mp4, .gif or .webm");
  if (width < 16 || width > 8192 || height < 16 || height > 8192) return Refusal("a video is 16 to 8192 pixels a side");
  if (!(rate_hz >= 1 && rate_hz <= 240)) return Refusal("a video has 1 to 240 pictures a second");
  Result<OutputFile> file = OutputFile::create(path);
  if (!file) return Refusal(path + ": " + file.error());

  VideoWriter writer(std::move(*file));
  writer.path_ = path;
  writer.picture_bytes_ = std::size_t{4} * static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  const std::optional<Pipe> pictures = make_pipe();
  if (!pictures) return Refusal("no pipe for a video: " + std::string(std::strerror(errno)));
  writer.pictures_fd_ = pictures->write;
  int pictures_read = pictures->read;
  const std::optional<Pipe> complaints = make_pipe();
  if (!complaints) {
    close_end(pictures_read);
    return Refusal("no pipe for a video: " + std::string(std::strerror(errno)));
  }
  writer.complaints_fd_ = complaints->read;
  // The complaints are read once ffmpeg has ended, which must never wait.
  fcntl(writer.complaints_fd_, F_SETFL, O_NONBLOCK);
  // These ends are the child's. This program closes its copies after the start, or the pipes would never end.
  int complaints_write = complaints->write;

  Words words = command_line(*kind, writer.file_.temporary(), width, height, rate_hz);
  std::vector<char*> arguments;
  for (std::string& word : words) arguments.push_back(word.data());
  arguments.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, pictures_read, STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, complaints_write, STDERR_FILENO);
  // ffmpeg writes to the file's name, so its standard output has nothing to say.
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, "/dev/null", O_WRONLY, 0);
  // The child has its own process group, so Ctrl+C reaches only this program, which then ends the video.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  posix_spawnattr_setpgroup(&attributes, 0);
  // posix_spawn does not copy this process, which may have much memory and several threads.
  const int error = posix_spawnp(&writer.process_, "ffmpeg", &actions, &attributes, arguments.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  close_end(pictures_read);
  close_end(complaints_write);
  if (error != 0) {
    // The destructor must not end a process that never was.
    writer.process_ = -1;
    return Refusal(error == ENOENT
                       ? "videos need the program ffmpeg, which is not here (Debian: apt-get install ffmpeg)"
                       : "ffmpeg does not start: " + std::string(std::strerror(error)));
  }
  return writer;
}

VideoWriter::VideoWriter(VideoWriter&& other) noexcept
    : file_(std::move(other.file_)),
      path_(std::move(other.path_)),
      picture_bytes_(other.picture_bytes_),
      process_(std::exchange(other.process_, -1)),
      pictures_fd_(std::exchange(other.pictures_fd_, -1)),
      complaints_fd_(std::exchange(other.complaints_fd_, -1)) {}

VideoWriter::~VideoWriter() {
  if (process_ > 0) {
    // The video is abandoned: ffmpeg need not finish it.
    kill(process_, SIGTERM);
    (void)end_process();
  }
  close_end(pictures_fd_);
  close_end(complaints_fd_);
}

Result<void> VideoWriter::add(std::span<const std::uint8_t> rgba) {
  if (process_ <= 0) return Refusal(path_ + ": the video is finished");
  if (rgba.size() != picture_bytes_) return Refusal(path_ + ": a picture of another size");
  while (!rgba.empty()) {
    const ssize_t written = write(pictures_fd_, rgba.data(), rgba.size());
    if (written > 0) {
      rgba = rgba.subspan(static_cast<std::size_t>(written));
    } else if (written < 0 && errno != EINTR) {
      // The program ignores SIGPIPE (core/broken_pipe.hpp), so an ffmpeg that has ended shows as an error of write().
      const std::string complaint = end_process();
      return Refusal(path_ + ": ffmpeg gave up" + (complaint.empty() ? "" : ": " + complaint));
    }
  }
  return {};
}

Result<void> VideoWriter::finish() {
  if (process_ <= 0) return Refusal(path_ + ": the video is finished");
  // The file gets its name only after ffmpeg has ended well.
  if (const std::string complaint = end_process(); !complaint.empty()) return Refusal(path_ + ": " + complaint);
  if (const Result<void> written = file_.finish(); !written) return Refusal(path_ + ": " + written.error());
  return {};
}

std::string VideoWriter::end_process() {
  // The end of the pictures is what tells ffmpeg to finish the video.
  close_end(pictures_fd_);
  int status = 0;
  // A signal may interrupt the wait; without waiting for it the child would stay as a zombie.
  while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  // One read takes what fits here; of a longer complaint only the first line is shown anyway.
  std::string said(4096, '\0');
  const ssize_t count = read(complaints_fd_, said.data(), said.size());
  said.resize(count > 0 ? static_cast<std::size_t>(count) : 0);
  close_end(complaints_fd_);
  if (WIFEXITED(status) && WEXITSTATUS(status) == 0) return {};
  return said.empty() ? "ffmpeg failed" : first_line(said);
}

}  // namespace hairnet
