#pragma once

#include <atomic>
#include <condition_variable>
#include <deque>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "core/groom/groom.hpp"
#include "core/levels/level.hpp"

namespace hairnet::viewer {

// Builds levels of grooms on a thread of its own, one groom after the other, so that a window goes on drawing. Keeps
// them while another owner has the groom. Call it from one thread; it locks for moments only.
class LevelBuilder {
 public:
  LevelBuilder();
  // Cancels the current build and waits for its end.
  ~LevelBuilder();

  // Returns null and begins to build on the first call, and null until the levels are built; then always the same
  // levels. Call it again for each picture: there is no notice.
  std::shared_ptr<const LevelSet> levels_of(const std::shared_ptr<const Groom>& groom);
  // The current build and its progress in one line; empty without a build.
  [[nodiscard]] std::string status() const;

 private:
  struct Built {
    std::shared_ptr<const Groom> groom;
    // Null: not built yet.
    std::shared_ptr<const LevelSet> levels;
  };
  void work();

  // Guards the members below, except for stopping_.
  mutable std::mutex mutex_;
  std::condition_variable wanted_;
  // The grooms that were asked for, with their levels once these are built.
  std::map<const Groom*, Built> built_;
  std::deque<std::shared_ptr<const Groom>> queue_;
  std::string status_;
  std::atomic<bool> stopping_{false};
  // It is last, because it uses all members above: they exist when it starts, and it is joined before they go.
  std::thread thread_;
};

}  // namespace hairnet::viewer
