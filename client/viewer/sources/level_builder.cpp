#include "client/viewer/sources/level_builder.hpp"

#include <cstdio>

#include "core/levels/build.hpp"

namespace hairnet::viewer {

LevelBuilder::LevelBuilder() : thread_([this] { work(); }) {}

LevelBuilder::~LevelBuilder() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  // There is one worker, so one notice suffices.
  wanted_.notify_one();
  thread_.join();
}

std::shared_ptr<const LevelSet> LevelBuilder::levels_of(const std::shared_ptr<const Groom>& groom) {
  const std::lock_guard lock(mutex_);
  if (const auto found = built_.find(groom.get()); found != built_.end()) return found->second.levels;
  // Only this map still refers to the groom, so no caller can ask for its levels any more. This runs seldom: when a new
  // groom comes.
  std::erase_if(built_, [](const auto& entry) { return entry.second.groom.use_count() == 1; });
  built_.emplace(groom.get(), Built{groom, nullptr});
  queue_.push_back(groom);
  wanted_.notify_one();
  return nullptr;
}

std::string LevelBuilder::status() const {
  const std::lock_guard lock(mutex_);
  return status_;
}

void LevelBuilder::work() {
  std::unique_lock lock(mutex_);
  while (true) {
    wanted_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
    if (stopping_) return;
    const std::shared_ptr<const Groom> groom = std::move(queue_.front());
    queue_.pop_front();
    // Unlock for the build, which takes seconds: levels_of() must not wait for it, since it is called for each picture.
    lock.unlock();
    BuildCallbacks callbacks;
    callbacks.progress = [this, &groom](double fraction, std::string_view) {
      char text[160];
      // A groom's name may be long, and the line goes to a panel.
      std::snprintf(text, sizeof text, "building levels of %.80s: %.0f %%", groom->name.c_str(), 100 * fraction);
      const std::lock_guard guard(mutex_);
      status_ = text;
      // Returning false cancels the build.
      return !stopping_;
    };
    // A groom without points has nothing to simulate: its levels are empty.
    std::shared_ptr<const LevelSet> levels =
        groom->points.empty() ? std::make_shared<const LevelSet>() : build_levels(*groom, callbacks);
    lock.lock();
    status_.clear();
    // The entry may be gone, if its last owner has left during the build.
    if (const auto found = built_.find(groom.get()); found != built_.end()) found->second.levels = std::move(levels);
  }
}

}  // namespace hairnet::viewer
