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
  wanted_.notify_one();
  thread_.join();
}

std::shared_ptr<const LevelSet> LevelBuilder::levels_of(const std::shared_ptr<const Groom>& groom) {
  const std::lock_guard lock(mutex_);
  if (const auto found = built_.find(groom.get()); found != built_.end()) return found->second.levels;
  // Only this map still refers to the groom, so no caller can ask for its levels any more.
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
    lock.unlock();
    BuildCallbacks callbacks;
    callbacks.progress = [this, &groom](double fraction, std::string_view) {
      char text[160];
      std::snprintf(text, sizeof text, "building levels of %.80s: %.0f %%", groom->name.c_str(), 100 * fraction);
      const std::lock_guard guard(mutex_);
      status_ = text;
      return !stopping_;
    };
    // A groom without points has nothing to simulate.
    std::shared_ptr<const LevelSet> levels =
        groom->points.empty() ? std::make_shared<const LevelSet>() : build_levels(*groom, callbacks);
    lock.lock();
    status_.clear();
    if (const auto found = built_.find(groom.get()); found != built_.end()) found->second.levels = std::move(levels);
  }
}

}  // namespace hairnet::viewer
