#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hairnet::server {

inline constexpr std::size_t kRungCountMax = 8;

// One character on its ladder: rung 0 is the least, `last` the finest that it may have. Costs never fall with the rung.
struct BudgetItem {
  // Is the caller's number.
  std::uint32_t character = 0;
  std::uint32_t subject = 0;
  std::uint64_t session = 0, key = 0;
  // Weighs its error.
  double weight = 0;
  // Is the cost for each tick, in whole ns, so that sums are exact in any order.
  std::array<std::int64_t, kRungCountMax> cost_ns{};
  // Points to the error of each rung.
  const float* error = nullptr;
  std::uint8_t last = 0, now = 0;
  // Every item gets rungs up to this one before any item gets more.
  std::uint8_t even = 0;
};

// One character's way up by one rung, and what it costs and gains.
struct FillStep {
  double priority = 0;
  std::int64_t cost_ns = 0;
  std::uint64_t key = 0;
  std::uint32_t item = 0;
  // The step leads from the rung below to this one.
  std::uint8_t rung = 0;
};

// A run of items (a client) or of clients (a subject), and the least and the most that it can cost.
struct FillShare {
  // These bound its items.
  std::size_t begin = 0, end = 0;
  std::int64_t min_ns = 0, max_ns = 0;
};

// Buffers that are reused from call to call.
struct FillScratch {
  std::vector<FillShare> clients, subjects;
  std::vector<FillStep> steps;
};

enum class Remainder : std::uint8_t { keep, spend };

// Chooses rungs for at most `budget_ns`. Items are in order of subject, session and key. Subjects share the budget,
// then the clients of a subject, max-min fair. Within a client the even rungs come first, then the steps with the most
// removed error for their time. Remainder::spend gives the time that shares could not use to the items that gain most.
// When not even rung 0 of all items fits, all get rung 0. The rung that an item has now is worth kHysteresis times as
// much. Returns the cost of the result. Asserts that there is a rung for each item.
std::int64_t fill_budget(std::int64_t budget_ns, std::span<const BudgetItem> items, FillScratch& scratch,
                         std::span<std::uint8_t> rungs, Remainder remainder);

inline constexpr double kHysteresis = 1.3;

}  // namespace hairnet::server
