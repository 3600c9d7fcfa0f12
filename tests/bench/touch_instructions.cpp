#include "tests/bench/touch_instructions.hpp"

#include <array>
#include <charconv>
#include <cstdint>
#include <cstdio>
#include <memory>
#include <string>
#include <string_view>

#include "client/files/read_file.hpp"
#include "core/result.hpp"
#include "tests/bench/touch_room.hpp"

namespace hairnet::bench {
namespace {

struct TouchCase {
  HandsAt hands;
  const char* name;
};
// The first one is what the others are compared with.
constexpr std::array<TouchCase, 4> kTouchCases{{{HandsAt::nowhere, "without hands"},
                                                {HandsAt::room, "20 people's hands"},
                                                {HandsAt::gone, "hands have gone"},
                                                {HandsAt::elsewhere, "a hand in another room"}}};
static_assert(TouchRoom::kPeople == 20, "a name says how many people there are");

// The instructions in dump `number`, from 1 on. Valgrind has finished each when the function ends after which it dumps.
Result<std::uint64_t> instructions_in(const std::string& dumps, std::size_t number) {
  constexpr std::string_view kTotals = "\ntotals: ";
  const std::string path = dumps + "." + std::to_string(number);
  const auto file = read_file(path);
  if (!file) return Refusal(path + ": " + file.error());
  const std::string_view text = as_text(*file);
  const std::size_t at = text.find(kTotals);
  std::uint64_t count = 0;
  if (at == std::string_view::npos) return Refusal(path + ": it has no totals");
  const auto end = std::from_chars(text.data() + at + kTotals.size(), text.data() + text.size(), count);
  if (end.ec != std::errc() || count == 0) return Refusal(path + ": its totals count nothing");
  return count;
}

int fail_touch(const char* name, const std::string& reason) {
  std::fprintf(stderr, "hairnet-bench: %s: %s\n", name, reason.c_str());
  return 1;
}

}  // namespace

// Outside the unnamed namespace and never inlined, so that it has a name to toggle at. A loop ends it, because a call
// at its end would become a jump, after which valgrind sees no return.
[[gnu::noinline]] void perform_steps(TouchRoom& room, std::size_t tick_count) {
  for (std::size_t tick = 0; tick < tick_count; ++tick) room.step();
}

int count_touch_instructions(const Subject& subject, const Options& o) {
  constexpr auto kLow = static_cast<std::size_t>(LevelIndex::low);
  auto levels = std::make_shared<LevelSet>();
  levels->levels[kLow] = *build_level(subject.groom, kLevelSpecs[kLow]);
  const auto tick_count = static_cast<std::size_t>(o.callgrind_steps);
  std::printf("touch: %zu characters of level low, %zu ticks\n", TouchRoom::kPeople, tick_count);
  int status = 0;
  std::string untouched_hash;
  double untouched_count = 0;
  for (std::size_t i = 0; i < kTouchCases.size(); ++i) {
    const auto& [hands, name] = kTouchCases[i];
    TouchRoom room(levels, subject.motions.front(), hands, tick_count);
    perform_steps(room, tick_count);
    if (const std::string fault = room.fault(); !fault.empty()) status = fail_touch(name, fault);
    if (i == 0) untouched_hash = room.hash();
    if ((room.hash() == untouched_hash) != (hands != HandsAt::room))
      status = fail_touch(name, hands == HandsAt::room ? "hands move no hair" : "hands that are not there move hair");
    std::printf("%-23s %4.1f touched  %s", name, room.touched_mean(), room.hash().c_str());
    if (!o.dumps.empty()) {
      const auto count = instructions_in(o.dumps, i + 1);
      if (!count) {
        std::printf("\n");
        return fail_touch(name, count.error());
      }
      if (i == 0) untouched_count = static_cast<double>(*count);
      std::printf("  %9.0f instructions a tick, %.6f times",
                  static_cast<double>(*count) / static_cast<double>(tick_count),
                  static_cast<double>(*count) / untouched_count);
    }
    std::printf("\n");
  }
  return status;
}

}  // namespace hairnet::bench
