#include "server/grooms/level_build.hpp"

#include <atomic>
#include <new>

#include "core/assert.hpp"
#include "core/levels/build.hpp"
#include "server/grooms/build_pool.hpp"

namespace hairnet::server {

LevelBuild build_levels_here(const LevelBuildDef& def, const wire::GroomHash&, std::span<const std::uint8_t>,
                             const Groom& groom, const GoesOn& goes_on) {
  HAIRNET_ASSERT(goes_on);
  std::atomic<BuildFault> fault = BuildFault::none;
  BuildCallbacks callbacks;
  callbacks.progress = [&](double, std::string_view) {
    fault = goes_on();
    return fault == BuildFault::none;
  };
  LevelBuild build;
  try {
    BuildPool pool(def.thread_count);
    build.levels = build_levels(
        groom, callbacks, nullptr,
        [&pool](std::size_t count, const std::function<void(std::size_t)>& body) { pool.parallel_for(count, body); });
    build.fault = fault;
  } catch (const std::bad_alloc&) {
    build.fault = BuildFault::memory;
    build.detail = "the server has no memory left for its build";
  }
  HAIRNET_ASSERT((build.levels == nullptr) == (build.fault != BuildFault::none));
  return build;
}

}  // namespace hairnet::server
