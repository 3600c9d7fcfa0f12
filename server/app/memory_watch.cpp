#include "server/app/memory_watch.hpp"

#include <spdlog/spdlog.h>

#include <algorithm>
#include <utility>

#include "core/assert.hpp"

namespace hairnet::server {

MemoryWatch::MemoryWatch(ProcessMemory memory, ProgramGauges& gauges, ProgramCounters& counters)
    : memory_(std::move(memory)), gauges_(&gauges), counters_(&counters) {
  HAIRNET_ASSERT(memory_.bytes_max == 0 || memory_.resident_bytes);
  HAIRNET_ASSERT(!memory_.give_back || (memory_.resident_bytes && memory_.allocated_bytes));
  gauges_->memory_max_bytes.set(static_cast<double>(memory_.bytes_max));
}

void MemoryWatch::poll(std::int64_t now_ns) {
  bool is_full = is_full_;
  if (memory_.resident_bytes) {
    const std::size_t resident = memory_.resident_bytes();
    const double share =
        memory_.bytes_max == 0 ? 0 : static_cast<double>(resident) / static_cast<double>(memory_.bytes_max);
    // Memory is full from the bound on, and stays full until it is below kRefillShare of the bound. With one threshold
    // the answer could change at each poll, while clients come and are refused in turn.
    is_full = share >= (is_full ? kRefillShare : 1);
    if (memory_.give_back && now_ns >= give_back_next_ns_) give_back(resident, now_ns);
  }
  if (memory_.reserve && memory_.reserve->is_spent()) {
    // A spent reserve means that the system gave no more, whatever the bound says.
    if (!use_is_counted_) counters_->memory_reserve_used.add();
    use_is_counted_ = !memory_.reserve->refill();
    is_full = use_is_counted_ || is_full;
  }
  if (is_full != is_full_) {
    if (is_full)
      spdlog::warn("event=memory_full");
    else
      spdlog::info("event=memory_free");
  }
  is_full_ = is_full;
  gauges_->memory_full.set(is_full ? 1 : 0);
}

void MemoryWatch::give_back(std::size_t resident_bytes, std::int64_t now_ns) {
  const auto unused = [this](std::size_t resident) {
    return static_cast<std::ptrdiff_t>(resident) - static_cast<std::ptrdiff_t>(memory_.allocated_bytes());
  };
  give_back_next_ns_ = now_ns + kGiveBackInterval_ns;
  const std::ptrdiff_t before = unused(resident_bytes);
  // Some unused memory always stays, between blocks in use.
  if (gave_back_ && before < unused_least_ + static_cast<std::ptrdiff_t>(kGiveBack_bytes)) {
    unused_least_ = std::min(unused_least_, before);
    return;
  }
  memory_.give_back();
  gave_back_ = true;
  unused_least_ = unused(memory_.resident_bytes());
}

}  // namespace hairnet::server
