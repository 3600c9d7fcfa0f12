#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace hairnet::server {

// A ladder has at most this many rungs; those of budget.cpp have up to 7.
inline constexpr std::size_t kRungCountMax = 8;

// One character on its ladder of levels and strides: rung 0 is the coarsest, `last` the finest that it may have. Costs
// never fall with the rung.
struct BudgetItem {
  // The caller's number of the character, which fill_budget() does not read.
  std::uint32_t character = 0;
  // The character's subject and session, by which the time is shared, and its key, which breaks ties.
  std::uint32_t subject = 0;
  std::uint64_t session = 0, key = 0;
  // A character with a greater weight gets time first: the error that a step removes counts times this.
  double weight = 0;
  // The cost of each rung for one tick, in whole ns, so that sums are exact in any order.
  std::array<std::int64_t, kRungCountMax> cost_ns{};
  // An array with the error of each rung up to `last`, which must exist during fill_budget().
  const float* error = nullptr;
  // The finest rung that the character may have, and the one that it has.
  std::uint8_t last = 0, now = 0;
  // Within a client, every item gets the rungs up to this one before any item gets a higher one.
  std::uint8_t even = 0;
};

// The step of one character from a rung to the next, with its cost. Steps with a greater priority come first.
struct FillStep {
  double priority = 0;
  std::int64_t cost_ns = 0;
  std::uint64_t key = 0;
  // The index of the item.
  std::uint32_t item = 0;
  // The step leads from the rung below to this one.
  std::uint8_t rung = 0;
};

// One client, or one subject, as a run of an array: a client is a run of items, a subject a run of
// FillScratch::clients.
struct FillShare {
  // The run is [begin, end).
  std::size_t begin = 0, end = 0;
  // The cost with all its items on rung 0, and with all on their last rung.
  std::int64_t min_ns = 0, max_ns = 0;
};

// Buffers that are reused from call to call.
struct FillScratch {
  std::vector<FillShare> clients, subjects;
  std::vector<FillStep> steps;
};

// What fill_budget() does with the time that is left when all shares are filled: whole rungs seldom use a share up.
enum class Remainder : std::uint8_t { keep, spend };

// Chooses a rung for each item, so that all together cost at most `budget_ns`, and writes it into `rungs`. Items must
// be in order of subject, session and key. The budget is shared max-min fair between subjects, and each share between
// the clients of the subject. Within a client the even rungs come first, then the steps that remove the most error for
// their time. Remainder::spend gives the time that shares could not use to the items that gain most. When not even rung
// 0 of all items fits, all get rung 0. Steps up to the rung that an item has now count kHysteresis times. Returns the
// cost of the result. Asserts that `rungs` has one entry for each item.
std::int64_t fill_budget(std::int64_t budget_ns, std::span<const BudgetItem> items, FillScratch& scratch,
                         std::span<std::uint8_t> rungs, Remainder remainder);

// Weighs the steps up to the present rung of an item, so that noise of a few per cent in the costs changes no level.
inline constexpr double kHysteresis = 1.3;

}  // namespace hairnet::server
