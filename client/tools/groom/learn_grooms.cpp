#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <filesystem>
#include <future>
#include <optional>
#include <thread>
#include <utility>

#include "client/files/read_file.hpp"
#include "client/files/write_file.hpp"
#include "client/tools/command_line/progress_bar.hpp"
#include "client/tools/groom/commands.hpp"
#include "client/tools/groom/read_groom.hpp"
#include "core/learnt/learnt_hair.hpp"
#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "schema/wire/groom_file.hpp"
#include "schema/wire/level_file.hpp"

namespace hairnet::groom {
namespace {

namespace fs = std::filesystem;

using Clock = std::chrono::steady_clock;

// The progress bar gives building the levels its part up to the first share, and finding the modes up to the second;
// the rest is learning. Learning takes nearly all of the time.
constexpr double kLevelsDone = 0.02, kModesDone = 0.04;

// A groom to learn, and where its results go.
struct Subject {
  std::string path;
  wire::GroomHash hash{};
  Groom groom;
  // The files to write; empty: not wanted.
  std::string level_file, copy;
};

// Runs a loop on all processors; the body may run another, since threads are made for each loop and none waits for a
// pool.
void on_all_processors(std::size_t count, const std::function<void(std::size_t)>& body) {
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    // Each thread takes the next index, so that a slow one delays nobody.
    for (std::size_t i = next++; i < count; i = next++) body(i);
  };
  std::vector<std::future<void>> others;
  // The calling thread works, too.
  const std::size_t thread_count = std::min<std::size_t>(count, std::thread::hardware_concurrency());
  while (others.size() + 1 < thread_count) others.push_back(std::async(std::launch::async, work));
  work();
  for (std::future<void>& other : others) other.get();
}

// Checks a folder by a file in it, before minutes of learning.
Result<void> check_folder(const std::string& folder) {
  if (folder.empty()) return {};
  std::error_code ignored;
  if (fs::exists(folder, ignored) && !fs::is_directory(folder, ignored))
    return Refusal(folder + ": is no folder; give a folder to write to");
  return check_can_write({(fs::path(folder) / ".hairnet-groom").string()});
}

// Returns where the copy of a groom's file goes; empty: no copy is wanted. The copy must not replace another copy of
// the same name, or the original, whose hash clients know.
Result<std::string> copy_of(const std::string& path, const LearnOptions& options) {
  if (options.embed.empty()) return std::string();
  const fs::path name = fs::path(path).filename(), copy = fs::path(options.embed) / name;
  const auto has_name = [&](const std::string& other) { return fs::path(other).filename() == name; };
  if (std::ranges::count_if(options.grooms, has_name) > 1)
    return Refusal(path + ": another file has this name, and both go into " + options.embed);
  std::error_code ignored;
  if (fs::equivalent(path, copy, ignored))
    return Refusal(path + ": lies in " + options.embed + " already; give another folder for its copy");
  return copy.string();
}

Result<Subject> read_subject(const std::string& path, const LearnOptions& options) {
  Result<GroomFile> file = read_groom(path);
  if (!file) return Refusal(file.error());
  const Result<std::string> copy = copy_of(path, options);
  if (!copy) return Refusal(copy.error());
  const fs::path folder = options.levels;
  return Subject{path, file->hash, std::move(file->groom),
                 folder.empty() ? "" : (folder / wire::level_file_name(file->hash)).string(), *copy};
}

// Reads the levels that the folder has of this groom. Null where it has none that a server would use: they are of
// another version, damaged, or without modes.
std::shared_ptr<LevelSet> read_levels(const Subject& subject) {
  if (subject.level_file.empty()) return nullptr;
  const Result<std::vector<std::byte>> bytes = read_file(subject.level_file, wire::kLevelFileBytesMax);
  if (!bytes) return nullptr;
  wire::DecodedLevels decoded = wire::decode_levels(as_octets(*bytes), subject.hash);
  return decoded.levels && decoded.levels->modes ? std::move(decoded.levels) : nullptr;
}

std::string errors_of(const LearntHair& hair) {
  const auto percent = [](float share) { return 100 * static_cast<double>(share); };
  char text[200];
  std::snprintf(text, sizeof(text),
                "on validation motions it errs by %.0f %% of the motion, the low level by %.0f %%; in wind by %.0f and "
                "%.0f %%%s",
                percent(hair.error), percent(hair.low_error), percent(hair.wind.error), percent(hair.wind.low_error),
                hair.wind.weights.empty() ? ", so it is not used there" : "");
  return text;
}

// Learns the hair of one groom and writes its levels. One thread calls it.
class Learner {
 public:
  Learner(const LearnOptions& options, const Subject& subject)
      : options_(options), subject_(subject), title_(fs::path(subject.path).filename().string()) {}

  // Whether the hair is learnt now. False: it was refused, which is printed. An error stops the program.
  Result<bool> learn() {
    const Clock::time_point begun = Clock::now();
    std::shared_ptr<LevelSet> levels = read_levels(subject_);
    // The cache has the result, so only the copy may be missing.
    if (levels && levels->learnt && !options_.again) {
      std::printf("%s: its hair is already learnt: %s; --again repeats it\n", subject_.path.c_str(),
                  errors_of(*levels->learnt).c_str());
      return embed(*levels->learnt).map([] { return true; });
    }
    // Levels in the folder are used as they are; only their maps are not part of the file.
    const bool has_file = levels != nullptr;
    Result<std::shared_ptr<const LearntHair>> hair = nullptr;
    {
      ProgressBar bar(title_);
      bar_ = &bar;
      if (has_file) {
        make_level_maps(subject_.groom, *levels, on_all_processors);
      } else {
        levels = build();
      }
      // No levels means that the build was stopped: `hair` stays null, which counts as stopped below.
      if (levels) {
        hair = learn_hair(subject_.groom, levels, *levels->modes, part(kModesDone, 1), on_all_processors,
                          options_.learning);
      }
    }
    // A null without an error means that it was stopped.
    if (hair && !*hair) return Refusal(subject_.path + ": stopped; nothing was written for it");
    // Levels of refused hair are written where there were none: the server is spared building them.
    if (hair || !has_file) {
      if (hair) levels->learnt = *hair;
      if (const Result<void> written = write(*levels); !written) return Refusal(written.error());
    }
    if (!hair) {
      std::printf("%s: refused: %s\n", subject_.path.c_str(), hair.error().c_str());
      return false;
    }
    if (const Result<void> embedded = embed(*levels->learnt); !embedded) return Refusal(embedded.error());
    std::printf("%s: learnt in %.0f s: %s\n", subject_.path.c_str(),
                std::chrono::duration<double>(Clock::now() - begun).count(), errors_of(*levels->learnt).c_str());
    return true;
  }

 private:
  // Callbacks for a part of the bar, from `begin` to `end`. `name` is shown instead of the stages, whose names say
  // little.
  [[nodiscard]] BuildCallbacks part(double begin, double end, std::string_view name = {}) const {
    BuildCallbacks callbacks;
    callbacks.progress = [this, begin, end, name](double fraction, std::string_view stage) {
      bar_->show(begin + fraction * (end - begin), name.empty() ? stage : name);
      // False stops the work at its next question.
      return !options_.is_stopped || !options_.is_stopped();
    };
    return callbacks;
  }

  // Builds levels and modes. Null when stopped.
  [[nodiscard]] std::shared_ptr<LevelSet> build() const {
    constexpr std::string_view kBuilding = "building the levels";
    const auto built = build_levels(subject_.groom, part(0, kLevelsDone, kBuilding), nullptr, on_all_processors);
    if (!built) return nullptr;
    auto modes = make_modes(subject_.groom, built, part(kLevelsDone, kModesDone, kBuilding), on_all_processors,
                            options_.training);
    if (!modes) return nullptr;
    // A copy, since the built set is const, and shares its levels.
    auto levels = std::make_shared<LevelSet>(*built);
    levels->modes = std::move(modes);
    return levels;
  }

  // The file appears whole or not at all, so that a server never reads half of it.
  [[nodiscard]] Result<void> write(const LevelSet& levels) const {
    if (subject_.level_file.empty()) return {};
    return write(subject_.level_file, wire::encode_levels(subject_.hash, levels));
  }
  [[nodiscard]] Result<void> embed(const LearntHair& hair) const {
    if (subject_.copy.empty()) return {};
    return write(subject_.copy, wire::encode_groom(subject_.groom, &hair));
  }
  static Result<void> write(const std::string& path, const std::vector<std::uint8_t>& bytes) {
    const Result<void> written = write_file(path, std::as_bytes(std::span(bytes)));
    return written ? written : Refusal(path + ": " + written.error());
  }

  const LearnOptions& options_;
  const Subject& subject_;
  std::string title_;
  ProgressBar* bar_ = nullptr;
};

}  // namespace

Result<void> learn_grooms(const LearnOptions& options) {
  for (const std::string& folder : {options.levels, options.embed})
    if (const Result<void> possible = check_folder(folder); !possible) return possible;
  std::vector<Subject> subjects;
  for (const std::string& path : options.grooms) {
    Result<Subject> subject = read_subject(path, options);
    if (!subject) return Refusal(subject.error());
    subjects.push_back(std::move(*subject));
  }
  // Refused hair does not stop the others: the error comes at the end.
  std::size_t refused = 0;
  for (const Subject& subject : subjects) {
    const Result<bool> is_learnt = Learner(options, subject).learn();
    if (!is_learnt) return Refusal(is_learnt.error());
    if (!*is_learnt) ++refused;
    // Each result shows at once, also in a log.
    std::fflush(stdout);
  }
  if (refused == 0) return {};
  return Refusal(std::to_string(refused) + " of " + std::to_string(subjects.size()) + " grooms have no learnt hair");
}

}  // namespace hairnet::groom
