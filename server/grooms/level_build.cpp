#include "server/grooms/level_build.hpp"

#include <atomic>
#include <new>

#include "core/assert.hpp"
#include "core/levels/build.hpp"
#include "core/modes/make_modes.hpp"
#include "server/grooms/build_pool.hpp"

namespace hairnet::server {

LevelBuild build_levels_in_process(const LevelBuildDef& def, const wire::GroomHash&, std::span<const std::uint8_t>,
                                   const Groom& groom, const GoesOn& goes_on) {
  HAIRNET_ASSERT(goes_on);
  // Several threads of the build may report progress at once.
  std::atomic<BuildError> error = BuildError::none;
  BuildCallbacks callbacks;
  // The build asks at each piece of its work; any answer but `none` makes it return null.
  callbacks.progress = [&](double, std::string_view) {
    error = goes_on();
    return error == BuildError::none;
  };
  LevelBuild build;
  try {
    BuildPool pool(def.thread_count);
    const ParallelFor parallel_for = [&pool](std::size_t count, const std::function<void(std::size_t)>& body) {
      pool.parallel_for(count, body);
    };
    build.levels = build_levels(groom, callbacks, nullptr, parallel_for);
    if (build.levels) {
      // The modes need the finished levels: their basis comes from motions that these levels simulate.
      auto with_modes = std::make_shared<LevelSet>(*build.levels);
      with_modes->modes = make_modes(groom, build.levels, callbacks, parallel_for, def.training);
      build.levels = with_modes->modes ? std::move(with_modes) : nullptr;
    }
    build.error = error;
  } catch (const std::bad_alloc&) {
    build.error = BuildError::memory;
    build.detail = "the server has no memory left for its build";
  }
  HAIRNET_ASSERT((build.levels == nullptr) == (build.error != BuildError::none));
  return build;
}

}  // namespace hairnet::server
